"""Experiments on a reference as steps: the runs, which keep themselves, then the data set, written and loaded."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sysid.atomic import write_bytes
from sysid.errors import ConfigError
from sysid.ingest import load_dataset, write_csv
from sysid.references.config import ReferenceConfig
from sysid.references.design import designed
from sysid.references.runs import Case, Outcome, Progress, ReferenceRuns, channels_of
from sysid.references.told import unlike
from sysid.traces import Channel, Trace, TraceSet
from sysid.units import is_pressure
from sysid.workbench.experiments.config import ExperimentConfig
from sysid.workbench.runner.events import Warned
from sysid.workbench.runner.naming import cases_of
from sysid.workbench.runner.program import Closing, Program
from sysid.workbench.runner.run import Run
from sysid.workbench.runner.steps import Estimate, NotKnownError, Outlined, Step, Work
from sysid.workbench.runner.store import write_json
from sysid.workbench.written import Written
from sysid.yaml_files import yaml_text

if TYPE_CHECKING:
    from sysid.workbench.kinds import RunRequest

DATASET, RECORD, TRACES = "dataset.yaml", "experiment.json", "traces"
UNLIKE = "unlike.txt"
"""Beside them, where the reference does not repeat itself: how."""
TITLE = "Running the reference"
LOADING = Outlined(name="data", title="Loading the traces")
SHOWN = 5
"""Reasons that are listed at the end."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Experimented:
    """What came of experiments.

    Args:
        traces: The records, with their roles.
        outcomes: What came of each, by role.
        before: The outputs before the first sample, by name: the middle over all records.
        spread: How far that differs between records, by name.
    """

    traces: TraceSet
    outcomes: Mapping[str, Sequence[Outcome]]
    before: Mapping[str, float]
    spread: Mapping[str, float]

    @property
    def failed(self) -> list[Outcome]:
        """The experiments without a record."""
        return [one for some in self.outcomes.values() for one in some if one.trace is None]


def program(request: RunRequest) -> Program[Experimented]:
    """What ``sysid run`` does of a pipeline of kind ``experiment``.

    Args:
        request: What was asked.

    Returns:
        The program.

    Raises:
        UserError: If the pipeline cannot be used.
    """
    return program_of(Written.read(ExperimentConfig, request.path))


def program_of(pipeline: Written[ExperimentConfig]) -> Program[Experimented]:
    """Experiments as a program.

    Args:
        pipeline: What to do; paths in it are relative to the folder of its file.

    Returns:
        The program.
    """
    config = pipeline.config
    work = Experiments(config=config, reference=config.reference.at(pipeline.path.parent))
    return Program(
        name=config.name,
        keep=pipeline.keep,
        steps=work.run,
        outline=lambda: [Outlined(name="runs", title=TITLE, how_long=work.estimate), LOADING],
        closing=closing,
        tracked=False,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Experiments:
    """What a pipeline runs.

    Args:
        config: The pipeline.
        reference: With whole paths.
    """

    config: ExperimentConfig
    reference: ReferenceConfig

    def cases(self) -> dict[str, list[Case]]:
        """The experiments of the design, by role."""
        return designed(self.reference, self.config.experiment)

    def run(self, run: Run) -> Experimented:
        """Run them and load what came of them, as steps."""
        outcomes = run.do(self._running(run)).value
        return run.do(self._loading(run, outcomes)).value

    def lacking(self, cases: Sequence[Case]) -> tuple[int, float | None, str]:
        """How many of some experiments have yet to be run, seconds that one takes, and where that is known from."""
        with ReferenceRuns(config=self.reference, workers=self.config.workers) as runs:
            return len(cases) - runs.kept(cases), *runs.seconds_each()

    def estimate(self) -> Estimate:
        """Wall time of what has yet to be run."""
        cases = [case for some in self.cases().values() for case in some]
        left, each, basis = self.lacking(cases)
        said = f"{left} of {len(cases)} runs to make"
        if each is None:
            limit = self.reference.time_limit
            return Estimate(seconds=None, basis=f"{said}, none measured: give cost; at most {limit:g} s each")
        return Estimate(seconds=each * left / self.config.workers, basis=f"{said}, {each:.3g} s each, {basis}")

    def _running(self, run: Run) -> Step[dict[str, list[Outcome]]]:
        return Step(
            name="runs",
            title=TITLE,
            make=lambda work: self._ran(run, work),
            how_long=self.estimate,
            was_found=lambda found: all(one.stored for some in found.values() for one in some),
            peek=self._peeked,
            outcome=_said,
        )

    def _peeked(self) -> dict[str, list[Outcome]]:
        cases = self.cases()
        flat = [case for some in cases.values() for case in some]
        with ReferenceRuns(config=self.reference, workers=1) as runs:
            if runs.kept(flat) < len(flat):
                raise NotKnownError
            return _by_role(cases, runs.run(flat))

    def _ran(self, run: Run, work: Work) -> dict[str, list[Outcome]]:
        kept = run.store.path / UNLIKE
        if run.fresh:
            kept.unlink(missing_ok=True)

        def warn(text: str) -> None:
            run.tell(Warned(text=text))
            write_bytes(kept, f"{text}\n".encode())  # who goes on later runs nothing again that would tell

        return self.made(
            lambda name, n, count: work.say(f"{name} ({n} of {count})", n / count), fresh=run.fresh, warn=warn
        )

    def made(
        self, progress: Progress | None, *, fresh: bool = False, warn: Callable[[str], object] | None = None
    ) -> dict[str, list[Outcome]]:
        """What comes of the experiments.

        Args:
            progress: Told of each that is done.
            fresh: Whether they are run again, whatever is kept.
            warn: Told where the reference does not repeat itself; one is run twice to see.

        Returns:
            By role.
        """
        cases = self.cases()
        flat = [case for some in cases.values() for case in some]
        with ReferenceRuns(config=self.reference, workers=self.config.workers, fresh=fresh) as runs:
            done = runs.run(flat, progress)
            if warn is not None and (said := unlike(runs, done)) is not None:
                warn(said)
            return _by_role(cases, done)

    def _loading(self, run: Run, outcomes: Mapping[str, Sequence[Outcome]]) -> Step[Experimented]:
        """Write the data set and load its traces, which shows that it can be used."""

        def make(_: Work) -> Experimented:
            file = write_dataset(self.config, self.reference, outcomes, run.store.path, run.command)
            traces, (before, spread) = load_dataset(file), _before(self.reference, outcomes)
            found = Experimented(traces=traces, outcomes=outcomes, before=before, spread=spread)
            for one in found.failed[:SHOWN]:
                run.tell(Warned(text=f"{one.case.name} gave no record: {one.reason}"))
            return found

        return Step(
            name=LOADING.name, title=LOADING.title, make=make,
            outcome=lambda found: cases_of(found.traces),
        )  # fmt: skip


def write_dataset(
    config: ExperimentConfig,
    reference: ReferenceConfig,
    outcomes: Mapping[str, Sequence[Outcome]],
    folder: Path,
    command: str,
) -> Path:
    """Write what came of experiments as a data set.

    Args:
        config: The pipeline.
        reference: With whole paths.
        outcomes: By role.
        folder: Where.
        command: That makes it again.

    Returns:
        Its ``dataset.yaml``.

    Raises:
        ConfigError: If there is no record to fit.
    """
    there = records(config, outcomes)
    for trace, _ in there:
        write_csv(trace, folder / TRACES / f"{trace.name}.csv")
    cases = {trace.name: {"role": role, "file": f"{TRACES}/{trace.name}.csv"} for trace, role in there}
    fields = {
        "name": config.name,
        "description": config.description or f"Designed experiments on a reference ({reference.kind})",
        "sample_time": reference.sample_time,
        "channels": [_channel(one) for one in channels_of(reference)],
        "source": {"files": {}, "repairs": {"constant": "accept"}},
        "cases": cases,
        "provenance": f"Made by {command}; each input is held from sample to sample, outputs are at its end.",
    }
    write_json(folder / RECORD, _record(outcomes))
    write_bytes(folder / DATASET, f"# Made by: {command}\n\n{yaml_text(fields)}".encode())
    return folder / DATASET


def records(config: ExperimentConfig, outcomes: Mapping[str, Sequence[Outcome]]) -> list[tuple[Trace, str]]:
    """The records that came of experiments.

    Args:
        config: The pipeline.
        outcomes: By role.

    Returns:
        Each with its role.

    Raises:
        ConfigError: If there is no record to fit.
    """
    there = [(one.trace, role) for role, some in outcomes.items() for one in some if one.trace is not None]
    if not any(role == "estimation" for _, role in there):
        reasons = sorted({str(one.reason) for some in outcomes.values() for one in some if one.reason})
        raise ConfigError(
            "no run of the reference gave a record to fit", where=config.name,
            expected="one record at least", got="; ".join(reasons[:SHOWN]),
            remedy="run the reference in its own tool with these inputs first, or raise time_limit",
        )  # fmt: skip
    return there


def _channel(channel: Channel) -> dict[str, str]:
    """A pressure has to say what it is measured from, be it nothing."""
    told = {"reference": channel.reference.value} if is_pressure(channel.unit) else {}
    return {"name": channel.name, "unit": channel.unit, **told}


def _by_role(cases: Mapping[str, Sequence[Case]], done: Sequence[Outcome]) -> dict[str, list[Outcome]]:
    left = list(done)
    return {role: [left.pop(0) for _ in some] for role, some in cases.items()}


def _before(
    reference: ReferenceConfig, outcomes: Mapping[str, Sequence[Outcome]]
) -> tuple[dict[str, float], dict[str, float]]:
    known = [one.before for one in outcomes["estimation"] if one.trace is not None]
    values = {name: np.array([one[name] for one in known]) for name in reference.outputs}
    return {k: float(np.median(v)) for k, v in values.items()}, {k: float(np.ptp(v)) for k, v in values.items()}


def _record(outcomes: Mapping[str, Sequence[Outcome]]) -> dict[str, Any]:
    def plain(value: float) -> float | None:
        return value if np.isfinite(value) else None

    return {
        one.case.name: {
            "role": role, "drawn": one.case.told, "reason": one.reason, "cpu_s": plain(one.cpu_s),
            "wall_s": plain(one.wall_s), "before": dict(one.before),
        }
        for role, some in outcomes.items()
        for one in some
    }  # fmt: skip


def _said(outcomes: Mapping[str, Sequence[Outcome]]) -> str:
    every = [one for some in outcomes.values() for one in some]
    failed, stored = sum(one.trace is None for one in every), sum(one.stored for one in every)
    return f"{len(every)} runs, {stored} of them stored" + (f", {failed} without a record" if failed else "")


def closing(found: Experimented, folder: Path) -> Closing:
    """What is said at the end: the traces, what gave none and why, and how they are used.

    Args:
        found: What came of the experiments.
        folder: The run folder.

    Returns:
        The lines.
    """
    file = folder.resolve() / DATASET
    roles = ", ".join(f"{sum(o.trace is not None for o in some)} {role}" for role, some in found.outcomes.items())
    failed = [f"no record of {one.case.name}: {one.reason}" for one in found.failed]
    more = [f"and {len(failed) - SHOWN} more, in {RECORD}"] if len(failed) > SHOWN else []
    return Closing(
        lines=[
            f"{len(found.traces)} traces: {roles}",
            *failed[:SHOWN],
            *more,
            f"Data set: {file}",
            f"Find a model of it with: sysid auto {file}",
        ]
    )
