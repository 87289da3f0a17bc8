"""Many runs of a reference: in processes beside each other, each with its own time limit, kept by their content.

A run that fails, hangs, ends its process or gives what is no record is an :class:`Outcome` with a reason. What has been
run is never run again, in whatever study, as long as reference, inputs, parameters and sample time are the same; that
holds for runs that gave no record too, until they are asked for anew.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import shutil
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.ingest import TraceCache, content_key, default_cache_folder
from sysid.references.config import ReferenceConfig
from sysid.references.kept_runs import KeptRuns, Note
from sysid.references.kinds import FORMAT
from sysid.references.processes import ReferenceProcess
from sysid.traces import Channel, Trace

TOO_LONG = "it was not done after"
BEGINNING = 0.1
"""Share of an experiment that is run to see how long one takes, where the whole takes long."""
FROM_OUTSIDE = ("by signal SIGTERM", "by signal SIGINT", "by signal SIGHUP")
"""How a run ends that a batch system, a container or a person has ended: that says nothing of the experiment."""
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """One experiment.

    Args:
        name: Of the record that comes of it.
        inputs: Held from sample to sample, shape ``(n_samples, n_inputs)``.
        parameters: Those that vary, by name.
        told: How it was drawn, for people.
    """

    name: str
    inputs: NDArray[np.float64] = field(repr=False)
    parameters: Mapping[str, float] = field(default_factory=dict)
    told: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcome:
    """What came of an experiment.

    Args:
        case: The experiment.
        trace: Inputs, parameters and outputs; ``None`` where there is no record.
        before: The outputs before its first sample, by name.
        reason: Why there is none.
        cpu_s: Processor time of the run.
        wall_s: Its time by the clock.
        stored: Whether an earlier run's record was taken.
        cold: Whether its process had run none before, so that its time is that of loading and compiling, too.
    """

    case: Case
    trace: Trace | None
    before: Mapping[str, float] = field(default_factory=dict)
    reason: str | None = None
    cpu_s: float = float("nan")
    wall_s: float = float("nan")
    stored: bool = False
    cold: bool = False


@dataclass(kw_only=True, eq=False)
class ReferenceRuns:
    """Runs of one reference.

    Args:
        config: What it is, with whole paths.
        workers: Processes.
        folder: Where records are kept; the cache of data sets by default.
        fresh: Whether everything is run again, whatever is kept.
    """

    config: ReferenceConfig
    workers: int = 2
    folder: Path = field(default_factory=default_cache_folder)
    fresh: bool = False
    _idle: list[ReferenceProcess] = field(default_factory=list, repr=False)
    _at_work: set[ReferenceProcess] = field(default_factory=set, repr=False)
    _stopped: threading.Event = field(default_factory=threading.Event, repr=False)
    _digest: str = field(default="", repr=False)

    def __enter__(self) -> ReferenceRuns:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End all processes."""
        while self._idle:
            self._idle.pop().end()

    @property
    def digest(self) -> str:
        """SHA-256 of what runs; it is loaded for that, in a process of its own.

        Raises:
            ConfigError: If it cannot be loaded.
        """
        if not self._digest:
            self._idle.append(self._start())
        return self._digest

    def _start(self) -> ReferenceProcess:
        process = ReferenceProcess(self.config)
        hello = process.hello
        if hello is None:
            how = process.end()
            raise ConfigError(
                "the reference ended its process while it was loaded", where=self.config.kind,
                expected="a reference that can be loaded", got=how, remedy="run it in its own tool first",
            )  # fmt: skip
        if "digest" not in hello:
            process.end()
            raise ConfigError(hello.pop("what"), **hello)
        self._digest = self._digest or str(hello["digest"])
        return process

    def key(self, case: Case) -> str:
        """The digest of all that a run depends on.

        Args:
            case: The experiment.

        Returns:
            64 hexadecimal digits.
        """
        config = self.config
        renamed = {name: variable for name, variable in config.variables.items() if name != variable}
        return content_key(
            {
                "reference": [FORMAT, config.kind, self.digest],
                "inputs": [[k, p.unit] for k, p in config.inputs.items()],
                "outputs": [[k, p.unit] for k, p in config.outputs.items()],
                "units": [[k, p.unit] for k, p in config.parameters.items()],
                "values": hashlib.sha256(np.ascontiguousarray(case.inputs).tobytes()).hexdigest(),
                "samples": len(case.inputs),
                "parameters": sorted({**config.constants, **case.parameters}.items()),
                "sample_time": config.sample_time,
                "settling": config.settling,
                "format": config.format if config.kind == "program" else "",
                # Said only where it matters, so that what was kept before it could be said is found.
                **({"variables": sorted(renamed.items())} if renamed else {}),
                **({"exit_codes": sorted(config.exit_codes)} if config.exit_codes != (0,) else {}),
            }
        )

    def kept(self, cases: Sequence[Case]) -> int:
        """How many of some experiments have been run.

        Args:
            cases: The experiments.

        Returns:
            Their number.
        """
        return sum(self._told(self.key(case)) is not None for case in cases)

    def seconds_each(self) -> tuple[float | None, str]:
        """How long one run takes, and where that is known from; first runs of a process if nothing else is."""
        cache = TraceCache(folder=self.folder)
        for cold in (False, True):
            if (measured := cache.mean_time(self._timed_as(cold=cold))) is not None:
                return measured, "the mean of the runs so far"
        return (None, "nothing has been run yet") if self.config.cost is None else (self.config.cost, "as declared")

    def _timed_as(self, *, cold: bool) -> str:
        return f"reference-{self.digest[:16]}-{self.config.sample_time!r}{'-cold' if cold else ''}"

    def _note_times(self, made: Sequence[Outcome]) -> None:
        """Those that gave no record too: a reference that hangs in one of ten takes as long as that."""
        for cold in (False, True):
            if seconds := [one.wall_s for one in made if one.cold is cold]:
                TraceCache(folder=self.folder).note_time(self._timed_as(cold=cold), float(np.mean(seconds)))

    def run(
        self, cases: Sequence[Case], progress: Progress | None = None, *, until: float = inf, fewest: int = 0
    ) -> list[Outcome]:
        """Run experiments, or find them where they have been run.

        Args:
            cases: The experiments.
            progress: Told of each that is done: its name, how many are, and of how many.
            until: The time of ``time.monotonic`` after which none is begun any more.
            fewest: How many of the first are run whatever the time.

        Returns:
            What came of each, in their order, but for those that were not begun.

        Raises:
            ConfigError: If the reference cannot be loaded.
        """
        found: dict[int, Outcome] = {}
        _ = self.digest
        with ThreadPoolExecutor(max(1, self.workers)) as threads:
            waiting = {threads.submit(self._one, case, inf if k < fewest else until): k for k, case in enumerate(cases)}
            try:
                for done in as_completed(waiting):
                    if (one := done.result()) is None:
                        continue
                    found[waiting[done]] = one
                    if progress is not None:
                        progress(one.case.name, len(found), len(cases))
            except BaseException:
                # Leaving the pool waits for what runs, be that an hour: it is ended, and none of it is kept.
                self._stopped.set()
                for begun in waiting:
                    begun.cancel()
                for process in list(self._at_work):
                    process.kill()
                raise
        self._note_times([one for one in found.values() if not one.stored])
        return [found[k] for k in sorted(found)]

    def again(self, case: Case) -> Outcome:
        """Run an experiment whatever is kept, in a process that has run others where there is one; nothing is kept.

        Args:
            case: The experiment.

        Returns:
            What came of it.
        """
        return self._made(case)

    def seconds_warm(self, first: Outcome, *, most: float) -> float:
        """How long a run takes whose process has loaded and compiled what it needs: one more tells.

        Args:
            first: What came of the first run.
            most: Seconds that the same once more may take; of what takes longer, the beginning is run.

        Returns:
            Seconds, those of the first where that was as fast; kept for :meth:`seconds_each`.
        """
        if first.trace is None:
            return first.wall_s
        if first.stored:
            return self.seconds_each()[0] or first.wall_s
        n = len(first.case.inputs)
        few = n if first.wall_s < most else max(2, round(BEGINNING * n))
        again = self.again(replace(first.case, inputs=first.case.inputs[:few]))
        seconds = first.wall_s if again.trace is None else min(first.wall_s, again.wall_s * n / few)
        self._note_times([replace(first, wall_s=seconds, cold=False)])
        return seconds

    def _one(self, case: Case, until: float) -> Outcome | None:
        if self._stopped.is_set() or time.monotonic() > until:
            return None
        key = self.key(case)
        kept = None if self.fresh else self._kept(case, key)
        if kept is not None:
            return kept
        outcome = self._made(case)
        if self._stopped.is_set():
            return None
        if not any(how in (outcome.reason or "") for how in FROM_OUTSIDE):
            note = Note(
                reason=outcome.reason, before=outcome.before, cpu_s=outcome.cpu_s, wall_s=outcome.wall_s
            )  # fmt: skip
            self._store.keep(key, note, outcome.trace)
        return outcome

    def _made(self, case: Case) -> Outcome:
        process = self._worker()
        self._at_work.add(process)
        if self._stopped.is_set():  # while it was started
            process.kill()
        try:
            return self._answered(process, case)
        finally:
            self._at_work.discard(process)

    def _answered(self, process: ReferenceProcess, case: Case) -> Outcome:
        began, cold, process.ran = time.perf_counter(), not process.ran, True
        with _exchange() as (given, made):
            np.save(given, case.inputs, allow_pickle=False)
            parameters = {**self.config.constants, **case.parameters}
            process.send(json.dumps({"inputs": str(given), "outputs": str(made), "parameters": parameters}))
            try:
                answer = process.receive(self.config.time_limit)
            except TimeoutError:
                process.end()
                answer, cold = {"reason": self._too_long}, False
            else:
                if answer is None:
                    answer, cold = {"reason": f"it ended its process {process.end()}"}, False
                else:
                    self._idle.append(process)
            wall = time.perf_counter() - began
            values = np.load(made, allow_pickle=False) if answer["reason"] is None else None
        trace = None if values is None else self._trace(case, values[1:])
        before = {} if values is None else dict(zip(self.config.outputs, values[0].tolist(), strict=True))
        return Outcome(
            case=case, trace=trace, before=before, reason=answer["reason"], cpu_s=answer.get("cpu_s", float("nan")),
            wall_s=wall, cold=cold,
        )  # fmt: skip

    def _worker(self) -> ReferenceProcess:
        """One that is idle, or a new one; between looking and taking another thread may have taken the last."""
        try:
            return self._idle.pop()
        except IndexError:
            return self._start()

    def _trace(self, case: Case, outputs: NDArray[np.float64]) -> Trace:
        config, constant = self.config, np.ones((len(outputs), 1))
        columns = [case.inputs, *(constant * case.parameters[name] for name in config.parameters), outputs]
        return Trace(
            name=case.name,
            sample_time=config.sample_time,
            channels=channels_of(config),
            values=np.hstack(columns),
            provenance=(case.told,) if case.told else (),
        )

    @property
    def _too_long(self) -> str:
        return f"{TOO_LONG} {self.config.time_limit:g} s, its time limit"

    @property
    def _store(self) -> KeptRuns:
        return KeptRuns(self.folder)

    def _told(self, key: str) -> Note | None:
        """What is noted of a run; nothing of one that had another time limit, and was not done in it."""
        note = self._store.note(key)
        outdated = note is not None and (note.reason or "").startswith(TOO_LONG) and note.reason != self._too_long
        return None if outdated else note

    def _kept(self, case: Case, key: str) -> Outcome | None:
        note = self._told(key)
        if note is None:
            return None
        kept = None if note.reason else self._store.trace(key)
        if kept is None and not note.reason:
            return None
        # The same experiment may have had another name in another study.
        trace = None if kept is None else self._trace(case, kept.columns(tuple(self.config.outputs)))
        return Outcome(
            case=case, trace=trace, before=note.before, reason=note.reason, cpu_s=note.cpu_s, wall_s=note.wall_s,
            stored=True,
        )  # fmt: skip


def channels_of(config: ReferenceConfig) -> tuple[Channel, ...]:
    """The channels of the records of a reference.

    Args:
        config: What it is.

    Returns:
        Inputs, parameters, outputs.
    """
    ports = {**config.inputs, **config.parameters, **config.outputs}
    return tuple(Channel(name=name, unit=port.unit, reference=port.reference) for name, port in ports.items())


@contextlib.contextmanager
def _exchange() -> Iterator[tuple[Path, Path]]:
    place = Path(tempfile.mkdtemp(prefix="sysid-exchange-"))
    try:
        yield place / "inputs.npy", place / "outputs.npy"
    finally:
        shutil.rmtree(place, ignore_errors=True)
