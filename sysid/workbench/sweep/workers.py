"""Who does the jobs of a sweep: processes of this machine. One thread each, and none of them is trusted to live.

A worker is a process of its own behind an executor of its own, so that one that is killed takes nothing but its job
with it: the job is done again by its successor. A driver that is killed takes its workers along, for they watch it.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import connection
from typing import Any

from sysid.errors import SysidError
from sysid.workbench.runner.steps import NotKnownError
from sysid.workbench.sweep.trial import Bench, Job, run_job

MAX_DEATHS = 8
"""Workers that one job may outlive: a job that kills every worker it meets must end the sweep, not circle for ever."""

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""One thread a worker: two with default threads were measured ten times slower than two with one each."""

TICK_S = 1.0
"""How long a wait for results lasts at most, so that a clock on the screen goes on."""


class WorkersLostError(SysidError):
    """A job has cost too many workers their lives."""


class AbstractWorkers(ABC):
    """Takes jobs and gives back results, in any order."""

    @property
    @abstractmethod
    def free(self) -> int:
        """How many more jobs can be taken now."""

    @abstractmethod
    def submit(self, job: Job, before: Mapping[str, Any] | None) -> None:
        """Take a job.

        Args:
            job: The job.
            before: The result of the job that it needs.
        """

    @abstractmethod
    def finished(self) -> list[tuple[Job, dict[str, Any]]]:
        """Results that have come in; waits a moment for the first, and may come back without any.

        Raises:
            WorkersLostError: If a job keeps killing its workers.
        """

    @abstractmethod
    def give_up(self) -> None:
        """End what they are at, whoever can: other jobs are taken again."""

    @abstractmethod
    def close(self) -> None:
        """Let go of the workers."""


class InThisProcess(AbstractWorkers):
    """Does each job where it stands: for tests and for those who look for a fault.

    Args:
        bench: What all jobs share.
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._done: list[tuple[Job, dict[str, Any]]] = []

    @property
    def free(self) -> int:
        """One job at a time."""
        return 1 - len(self._done)

    def submit(self, job: Job, before: Mapping[str, Any] | None) -> None:
        """Do it now."""
        self._done.append((job, run_job(self._bench, job, before)))

    def finished(self) -> list[tuple[Job, dict[str, Any]]]:
        """What was done since."""
        done, self._done = self._done, []
        return done

    def give_up(self) -> None:
        """Nothing is under way."""

    def close(self) -> None:
        """Nothing to let go of."""


class NoWorkers(AbstractWorkers):
    """Does nothing: for who looks at what is stored."""

    @property
    def free(self) -> int:
        """As if it could."""
        return 1

    def submit(self, job: Job, before: Mapping[str, Any] | None) -> None:  # noqa: ARG002 - as all workers
        """Refuse a job, which is not stored then.

        Raises:
            NotKnownError: Always.
        """
        raise NotKnownError(f"trial {job.number}")

    def finished(self) -> list[tuple[Job, dict[str, Any]]]:
        """Nothing."""
        return []

    def give_up(self) -> None:
        """Nothing is under way."""

    def close(self) -> None:
        """Nothing to let go of."""


@dataclass(eq=False)
class _Worker:
    """A process behind its executor, and what it is at."""

    executor: ProcessPoolExecutor
    job: Job | None = None
    before: Mapping[str, Any] | None = None
    future: Future[dict[str, Any]] | None = None


class LocalWorkers(AbstractWorkers):
    """Processes of this machine.

    Args:
        bench: What all jobs share; each worker gets it once.
        n: How many.
    """

    def __init__(self, bench: Bench, n: int) -> None:
        self._bench = bench
        self._deaths: dict[str, int] = {}
        self._workers = [_Worker(executor=self._hire()) for _ in range(n)]

    @property
    def free(self) -> int:
        """Workers without a job."""
        return sum(worker.future is None for worker in self._workers)

    @property
    def processes(self) -> list[int]:
        """Process numbers of the workers that have begun."""
        return [pid for worker in self._workers for pid in (getattr(worker.executor, "_processes", None) or {})]

    def submit(self, job: Job, before: Mapping[str, Any] | None) -> None:
        """Give it to a worker without a job."""
        worker = next(worker for worker in self._workers if worker.future is None)
        self._begin(worker, job, before)

    def finished(self) -> list[tuple[Job, dict[str, Any]]]:
        """What has come in; a killed worker's job is begun again."""
        busy = {worker.future: worker for worker in self._workers if worker.future is not None}
        done, _ = wait(busy, timeout=TICK_S, return_when=FIRST_COMPLETED)
        results = []
        for future in done:
            worker = busy[future]
            job = worker.job
            if job is None:
                continue
            try:
                results.append((job, future.result()))
                worker.job = worker.before = worker.future = None
            except BrokenProcessPool:
                self._count_death(job)
                worker.executor.shutdown(wait=False)
                worker.executor = self._hire()
                self._begin(worker, job, worker.before)
        return results

    def give_up(self) -> None:
        """End what the workers are at; others take their places."""
        for worker in self._workers:
            if worker.job is not None:
                _end(worker)
                worker.executor = self._hire()
                worker.job = worker.before = worker.future = None

    def close(self) -> None:
        """End the workers, whatever they are at."""
        for worker in self._workers:
            _end(worker)

    def _hire(self) -> ProcessPoolExecutor:
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(1, mp_context=context, initializer=_settle_in, initargs=(self._bench,))

    def _begin(self, worker: _Worker, job: Job, before: Mapping[str, Any] | None) -> None:
        worker.job, worker.before = job, before
        with _one_thread(), _no_script():
            worker.future = worker.executor.submit(_work, job, before)

    def _count_death(self, job: Job) -> None:
        deaths = self._deaths[job.key] = self._deaths.get(job.key, 0) + 1
        if deaths > MAX_DEATHS:
            raise WorkersLostError(
                f"{deaths} workers in a row were killed at the same trial",
                where=f"trial {job.number}, {job.structure}",
                expected="a worker that lives until its trial is done",
                remedy="see whether the machine runs out of memory, or take this point out of the ranges",
            )


def _end(worker: _Worker) -> None:
    processes = list((getattr(worker.executor, "_processes", None) or {}).values())
    worker.executor.shutdown(wait=False, cancel_futures=True)
    if worker.future is not None and not worker.future.done():
        for process in processes:
            process.terminate()


_BENCH: list[Bench] = []
"""What this worker's jobs share; set once, when the process begins."""


def _settle_in(bench: Bench) -> None:
    _BENCH[:] = [bench]
    # Ctrl-C reaches every process of a terminal; what becomes of a sweep is the driver's business.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_leave_with, args=(parent.sentinel,), daemon=True).start()


def _leave_with(sentinel: int) -> None:
    """End this process when the driver's ends, however that ends: it would wait for jobs for ever."""
    connection.wait([sentinel])
    os._exit(1)


def _work(job: Job, before: Mapping[str, Any] | None) -> dict[str, Any]:
    return run_job(_BENCH[0], job, before)


@contextmanager
def _no_script() -> Iterator[None]:
    """A process that begins now does not run the user's script again: all that it does is in this package.

    ``spawn`` imports the main module of its parent, by its spec or its file, so that a script without
    ``if __name__ == "__main__":`` would begin anew in each worker, and find its own folder busy.
    """
    main = sys.modules["__main__"]
    kept = {name: value for name in ("__spec__", "__file__") if (value := getattr(main, name, None)) is not None}
    for name in kept:
        setattr(main, name, None)
    try:
        yield
    finally:
        for name, value in kept.items():
            setattr(main, name, value)


@contextmanager
def _one_thread() -> Iterator[None]:
    """The environment of a process that begins now: its libraries read it when they are loaded."""
    kept = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in kept.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
