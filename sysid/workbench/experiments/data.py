"""Experiments in the place of a data set: whatever names data may name the pipeline that a slow model is asked by."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sysid.errors import ConfigError
from sysid.ingest.datasets.dataset import Unmade
from sysid.references.candidates import Candidates
from sysid.references.runs import Case, Progress, ReferenceRuns
from sysid.traces import Role, Trace, TraceSet
from sysid.workbench.experiments.config import ExperimentConfig
from sysid.workbench.experiments.run import SHOWN, Experiments, records
from sysid.workbench.written import Written


@dataclass(frozen=True, kw_only=True, eq=False)
class ExperimentData:
    """The records of a pipeline of kind ``experiment``; what has been run is found by its content.

    Args:
        work: What it runs.
    """

    work: Experiments

    @classmethod
    def at(cls, path: Path) -> ExperimentData:
        """Those of a pipeline.

        Args:
            path: Its YAML. **What that names is run.**

        Returns:
            They; nothing has been run yet.

        Raises:
            ConfigError: If it is no such pipeline.
        """
        read = Written.read(ExperimentConfig, path)
        return cls(work=Experiments(config=read.config, reference=read.config.reference.at(read.path.parent)))

    def load(self, progress: Progress | None = None) -> TraceSet:
        """Run what has yet to be run.

        Args:
            progress: Told of each experiment that is done.

        Returns:
            The records with their roles; its source says what gave none, and why.

        Raises:
            ConfigError: If the reference cannot be loaded, or there is no record to fit.
        """
        outcomes = self.work.made(progress)
        there = records(self.work.config, outcomes)
        failed = [f"{o.case.name} ({o.reason})" for some in outcomes.values() for o in some if o.trace is None]
        shown = ", ".join(failed[:SHOWN]) + (f" and {len(failed) - SHOWN} more" if len(failed) > SHOWN else "")
        told = f"Experiments on a reference ({self.work.reference.kind}), run as {self.work.config.name} asks."
        return TraceSet(
            name=self.work.config.name,
            traces=tuple(trace for trace, _ in there),
            roles={trace.name: Role(role) for trace, role in there},
            source=told + (f" No record came of {shown}." if failed else ""),
        )

    def unmade(self) -> Unmade | None:
        """What has yet to be run of the design; ``None`` if nothing."""
        return self._unmade([case for some in self.work.cases().values() for case in some])

    def unmade_new(self, number: int, count: int, *, duration: float | None = None) -> Unmade | None:
        """What of some new experiments has yet to be run; ``None`` if nothing. As :meth:`new`."""
        return self._unmade(self._candidates(count, duration).cases(number))

    def new(
        self, number: int, count: int, *, duration: float | None = None, progress: Progress | None = None
    ) -> list[Trace]:
        """New random experiments, drawn as the design draws its own.

        Args:
            number: Of the round that they are for, from 1 on; 0 for those that are held out of all. No two rounds have
                one in common.
            count: How many.
            duration: Seconds of each, in place of the design's.
            progress: Told of each that is done.

        Returns:
            The records of those that gave one.

        Raises:
            ConfigError: If none did.
        """
        with ReferenceRuns(config=self.work.reference, workers=self.work.config.workers) as runs:
            done = runs.run(self._candidates(count, duration).cases(number), progress)
        found = [one.trace for one in done if one.trace is not None]
        if not found:
            raise ConfigError(
                "no new experiment gave a record", where=self.work.config.name,
                expected="one record at least", got="; ".join(sorted({str(one.reason) for one in done})[:SHOWN]),
                remedy="run the reference in its own tool with these inputs first, or raise time_limit",
            )  # fmt: skip
        return found

    def _candidates(self, count: int, duration: float | None) -> Candidates:
        design = self.work.config.experiment
        if duration is not None:
            # The times at a level stay what they are in experiments of the design's length.
            holds = design.holds(self.work.reference.sample_time)
            hold = tuple(one * self.work.reference.sample_time for one in holds)
            design = design.model_copy(update={"duration": duration, "hold": design.hold or hold})
        return Candidates(reference=self.work.reference, design=design, count=count)

    def _unmade(self, cases: list[Case]) -> Unmade | None:
        left, each, _ = self.work.lacking(cases)
        seconds = None if each is None else each * left / self.work.config.workers
        return (
            Unmade(cases=left, generator=f"the reference of {self.work.config.name}", seconds=seconds) if left else None
        )
