"""The same jobs on a Dask cluster, by its address. Only the driver writes; workers compute and answer."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from sysid.errors import ConfigError
from sysid.workbench.sweep.trial import Bench, Job, run_job
from sysid.workbench.sweep.workers import MAX_DEATHS, TICK_S, AbstractWorkers, WorkersLostError

POLL_S = 0.01
"""Between two looks at what is done: little beside a job's seconds."""

CONNECT_S = 30
"""How long a scheduler may take to answer."""


class DaskWorkers(AbstractWorkers):
    """Workers of a Dask scheduler.

    Args:
        bench: What all jobs share; sent to the cluster once, and again if a worker's death took it along.
        address: Of the scheduler, such as ``tcp://10.0.0.1:8786``.

    Raises:
        ConfigError: If Dask is not installed, or nobody answers at the address.
    """

    def __init__(self, bench: Bench, address: str) -> None:
        try:
            from distributed import Client
        except ImportError as error:
            raise ConfigError(
                "a cluster needs Dask, which is not installed",
                where="cluster",
                expected="the package distributed",
                got="no such package",
                remedy='pip install "sysid-workbench[dask]", here and on every worker',
            ) from error
        try:
            self._client = Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, TimeoutError) as error:
            raise ConfigError(
                "no Dask scheduler answers",
                where=f"cluster: {address}",
                expected="the address that dask scheduler prints when it starts",
                got=error,
                remedy="start it with: dask scheduler, and workers with: dask worker ADDRESS --nthreads 1",
            ) from error
        self._bench = bench
        self._sent: Any = None
        self._jobs: dict[Any, tuple[Job, Mapping[str, Any] | None]] = {}
        self._deaths: dict[str, int] = {}

    @property
    def free(self) -> int:
        """One job a worker, and one to follow it without a pause."""
        workers = max(1, len(self._client.scheduler_info(n_workers=-1)["workers"]))
        return max(0, 2 * workers - len(self._jobs))

    def submit(self, job: Job, before: Mapping[str, Any] | None) -> None:
        """Send it to the scheduler."""
        if self._sent is None:
            self._sent = self._client.scatter(self._bench, broadcast=True, hash=False)
        future = self._client.submit(run_job, self._sent, job, before, pure=False, retries=MAX_DEATHS)
        self._jobs[future] = (job, before)

    def finished(self) -> list[tuple[Job, dict[str, Any]]]:
        """What has come in; a job whose worker died is sent again, with what it needs."""
        from concurrent.futures import CancelledError

        from distributed import KilledWorker

        deadline = time.monotonic() + TICK_S
        while not (done := [future for future in self._jobs if future.done()]) and time.monotonic() < deadline:
            time.sleep(POLL_S)
        results = []
        for future in done:
            job, before = self._jobs.pop(future)
            try:
                if future.status in {"lost", "cancelled"}:
                    raise CancelledError(future.key)
                results.append((job, dict(future.result())))
            except (KilledWorker, CancelledError) as error:
                self._count_death(job, error)
                self._sent = None
                self.submit(job, before)
        return results

    def give_up(self) -> None:
        """Take back what is not done."""
        for future in self._jobs:
            future.cancel()
        self._jobs.clear()

    def close(self) -> None:
        """Take back what is not done, and leave the cluster as it is."""
        self.give_up()
        self._client.close()

    def _count_death(self, job: Job, error: Exception) -> None:
        deaths = self._deaths[job.key] = self._deaths.get(job.key, 0) + 1
        if deaths > MAX_DEATHS:
            raise WorkersLostError(
                "the cluster loses every worker that takes this trial",
                where=f"trial {job.number}, {job.structure}",
                got=error,
                remedy="see the workers' logs; memory is the usual cause",
            ) from error
