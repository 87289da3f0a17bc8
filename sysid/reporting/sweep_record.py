"""sweep.json: what a sweep tried and found, read and written with its contract; beside ``results.json``."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from pydantic import Field

from sysid.estimation.linear.order_search import Criterion, weighed
from sysid.estimation.results.tolerance import outside
from sysid.reporting.records import Number, Record, parse_record, read_document, write_record
from sysid.units import squared

SCHEMA_VERSION: Final = 1
SWEEP_FILE: Final = "sweep.json"

TRACES: Final = {"selection": "the selection traces", "estimation": "the estimation traces", "cases": "all cases"}
"""What chooses, in words, by ``choose_on``."""


class TrialCase(Record):
    """One trial on one case."""

    role: str = Field(description="What the case is used for.")
    free_run_mse: Number = Field(description="In the output's unit squared.")
    one_step_mse: Number = Field(description="In the output's unit squared.")
    run_time_s: Number = Field(description="Seconds of the free run: least of the repeats.")
    n_samples: int = Field(default=0, description="Measured values that errors count on.")


class Trial(Record):
    """One point that was tried."""

    number: int = Field(ge=1, description="Its place in the grid.")
    key: str = Field(description="Digest of everything it depends on.")
    label: str = Field(description="Short form of the structure.")
    structure: dict[str, Any] = Field(description="All fields of the structure.")
    values: dict[str, Any] = Field(default={}, description="Its value in each range.")
    status: str = Field(description="Name of the fit's status, or FAILED.")
    usable: bool = Field(description="Whether it may be chosen.")
    reason: str = Field(default="", description="Why it failed.")
    dropped_at: int | None = Field(default=None, description="Rung after which it was dropped, from 1 on.")
    iterations: int = Field(default=0, description="Of all of its training.")
    iteration_s: Number = Field(
        default=math.nan, description="Seconds of one iteration of a network's training; null of what has none."
    )
    seconds: Number = Field(default=math.nan, description="Wall time of all of its training.")
    cpu_s: Number = Field(default=math.nan, description="Processor time of all of its training and scoring.")
    parameters: int = Field(default=0, description="Fitted parameters.")
    operations: int = Field(default=0, description="Multiplications of one step.")
    log_evidence: Number = Field(default=math.nan, description="Null where none was computed.")
    pole_radius: Number = Field(default=math.nan, description="Largest pole's magnitude; null if it is not linear.")
    selection_free_run_mse: Number = Field(
        default=math.nan, description="Mean over the selection traces, unit squared."
    )
    selection_one_step_mse: Number = Field(default=math.nan, description="The same one step ahead.")
    selection_rms_shares: list[Number] = Field(
        default=[], description="Of each selection trace the free run's rms error, as a share of the output's range."
    )
    selection_errors: list[Number] = Field(
        default=[], description="Mean squared errors of the free run by part of what chooses, over the outputs' sizes."
    )
    cases: dict[str, TrialCase] = Field(default={})

    def within(self, tolerance: float) -> float:
        """Share of the traces that choose over which every output's free run stays within a tolerance.

        Args:
            tolerance: Share of an output's range that the root mean square of its error may come to.

        Returns:
            The share; 0 without such traces.
        """
        count = len(self.selection_rms_shares)
        return 1.0 - outside(self.selection_rms_shares, tolerance) / count if count else 0.0

    @property
    def in_full(self) -> bool:
        """Whether it was trained to the end and may be chosen."""
        return self.usable and self.dropped_at is None

    def mean(self, figure: str, on: str = "cases") -> float:
        """Mean over cases, or over the selection traces, of one of the figures of a case.

        Args:
            figure: ``free_run_mse``, ``one_step_mse`` or ``run_time_s``.
            on: ``cases``, ``estimation`` or ``selection``.

        Returns:
            The mean; NaN without such cases.
        """
        if on == "selection" and figure != "run_time_s":
            return float(getattr(self, f"selection_{figure}"))
        cases = [case for case in self.cases.values() if on != "estimation" or case.role == "estimation"]
        return sum(float(getattr(case, figure)) for case in cases) / len(cases) if cases else math.nan

    def criterion(self, one: Criterion) -> float:
        """An information criterion, from the one-step error over the estimation traces as ``sysid orders`` has it.

        Args:
            one: Which.

        Returns:
            It; of a model without noise from its free run, which is the same there. NaN where nothing was counted.
        """
        cases = [case for case in self.cases.values() if case.role == "estimation"]
        n = sum(case.n_samples for case in cases)
        if not n:
            return math.nan
        errors = [c.free_run_mse if math.isnan(c.one_step_mse) else c.one_step_mse for c in cases]
        mse = sum(case.n_samples * error for case, error in zip(cases, errors, strict=True)) / n
        return float(weighed(np.array([mse]), np.array([self.parameters]), n, one)[0])


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure of merit of a trial; less is better.

    Args:
        words: What it is, for axes and tables.
        unit: Its unit; ``{unit}`` stands for the output's, ``{squared}`` for its square.
        of: Its value for a trial, on some traces.
        measured: Whether it changes with the load of the machine.
    """

    words: str
    unit: str
    of: Callable[[Trial, str], float]
    measured: bool = False


FIGURES: Final[dict[str, Figure]] = {
    "free_run_mse": Figure(words="free-run mse", unit="{squared}", of=lambda trial, on: trial.mean("free_run_mse", on)),
    "one_step_mse": Figure(words="one-step mse", unit="{squared}", of=lambda trial, on: trial.mean("one_step_mse", on)),
    "run_time": Figure(words="mean run time", unit="s", of=lambda trial, _: trial.mean("run_time_s"), measured=True),
    "operations": Figure(words="multiplications a step", unit="", of=lambda trial, _: float(trial.operations)),
    "parameters": Figure(words="parameters", unit="", of=lambda trial, _: float(trial.parameters)),
    "evidence": Figure(words="minus log evidence", unit="", of=lambda trial, _: -trial.log_evidence),
    "AICc": Figure(words="AICc", unit="", of=lambda trial, _: trial.criterion(Criterion.AICC)),
    "BIC": Figure(words="BIC", unit="", of=lambda trial, _: trial.criterion(Criterion.BIC)),
    # "Best of both", error times run time: in free run, and one step ahead as in Lopes 2021, section 4.5.
    "BB": Figure(
        words="BB: free-run mse × run time",
        unit="{squared} s",
        of=lambda trial, on: trial.mean("free_run_mse", on) * trial.mean("run_time_s"),
        measured=True,
    ),
    "BB_one_step": Figure(
        words="BB: one-step mse × run time",
        unit="{squared} s",
        of=lambda trial, on: trial.mean("one_step_mse", on) * trial.mean("run_time_s"),
        measured=True,
    ),
}
"""The figures that a sweep can minimise, choose by, and show."""


class SweepSummary(Record):
    """What a sweep came to, in results.json; every trial is in sweep.json."""

    file: str = Field(default=SWEEP_FILE, description="Where the trials are, relative to the run folder.")
    points: int = Field(description="Points of the ranges, whether all were tried or not.")
    trials: int = Field(description="Points that were tried.")
    in_full: int = Field(description="Trials that were trained to the end and may be chosen.")
    dropped: int = Field(description="Trials that were dropped before their end.")
    unusable: dict[str, int] = Field(default={}, description="Trials that may not be chosen, by status.")
    choose_by: str = Field(description="Figure that chose the winner; less is better.")
    choose_on: str = Field(description="Traces that chose: selection, estimation or cases.")
    winner: int | None = Field(description="Number of the trial that was chosen.")
    label: str = Field(default="", description="Short form of the winner's structure.")
    least: Number = Field(default=math.nan, description="The winner's figure.")
    unit: str = Field(default="", description="Of that figure.")
    front: list[int] = Field(default=[], description="Numbers of the trials that no other beats in every objective.")
    wall_s: Number = Field(description="Seconds from the first trial to the last, of all sessions together.")
    workers: int = Field(description="Processes that worked on it.")


class SweepRecord(Record):
    """All of sweep.json."""

    schema_version: int = Field(default=SCHEMA_VERSION, description="Of this file.")
    name: str = Field(description="Name of the sweep.")
    mapping: str = Field(description="Written as in 'BP+AR -> BC'.")
    unit: str = Field(description="Unit of the output.")
    method: str = Field(description="How the points were chosen: grid, random, tpe or nsga-ii.")
    loop: str = Field(default="", description="open or closed: what was trained for.")
    points: int = Field(description="Points of the grid, whether all were tried or not.")
    ranges: dict[str, list[Any]] = Field(default={}, description="By field, every value that it can take.")
    objectives: list[str] = Field(description="Figures that are minimised.")
    choose_by: str = Field(description="Figure that chooses the winner.")
    choose_on: str = Field(description="Traces that choose: selection, estimation or cases.")
    chosen_by: str = Field(description="One sentence: by which figure, on which traces.")
    reproduces: str | None = Field(default=None, description="What it repeats, where it does.")
    published: str | None = Field(default=None, description="Reference table to set beside it.")
    warm_start: str = Field(default="none", description="Where networks begin: none, linear, or from smaller ones.")
    rungs: list[dict[str, Any]] = Field(
        default=[], description="Rungs of successive halving, at which trials were dropped."
    )
    workers: int = Field(description="Processes that worked on it.")
    wall_s: Number = Field(description="Seconds from the first trial to the last, of all sessions together.")
    winner: int | None = Field(default=None, description="Number of the trial that was chosen.")
    beside: list[Trial] = Field(default=[], description="Chosen by hand, trained like the trials.")
    trials: list[Trial]

    def figure(self, trial: Trial, name: str) -> float:
        """A figure of merit of a trial, on the traces that choose."""
        return FIGURES[name].of(trial, self.choose_on)

    def choice(self, trial: Trial) -> float:
        """The figure that chooses; infinite where it is not a number."""
        value = self.figure(trial, self.choose_by)
        return value if math.isfinite(value) else math.inf

    @property
    def winning(self) -> Trial | None:
        """The trial that was chosen."""
        return next((trial for trial in self.trials if trial.number == self.winner), None)

    @property
    def tried_in_full(self) -> list[Trial]:
        """Trials that may be chosen, in the order of the grid."""
        return [trial for trial in self.trials if trial.in_full]

    def words(self, name: str) -> str:
        """A figure with its unit, for an axis."""
        figure = FIGURES[name]
        unit = figure.unit.format(unit=self.unit, squared=squared(self.unit))
        return f"{figure.words} [{unit}]" if unit else figure.words

    @property
    def summary(self) -> SweepSummary:
        """What it came to."""
        winner = self.winning
        unusable = Counter(trial.status for trial in self.trials if not trial.usable and trial.dropped_at is None)
        return SweepSummary(
            points=self.points,
            trials=len(self.trials),
            in_full=len(self.tried_in_full),
            dropped=sum(trial.dropped_at is not None for trial in self.trials),
            unusable=dict(sorted(unusable.items())),
            choose_by=self.choose_by,
            choose_on=self.choose_on,
            winner=self.winner,
            label="" if winner is None else winner.label,
            least=math.nan if winner is None else self.figure(winner, self.choose_by),
            unit=FIGURES[self.choose_by].unit.format(unit=self.unit, squared=squared(self.unit)),
            front=[trial.number for trial in self.front()],
            wall_s=self.wall_s,
            workers=self.workers,
        )

    def front(self, names: list[str] | None = None) -> list[Trial]:
        """The trials that no other beats in every one of some figures.

        Args:
            names: The figures; the objectives by default.

        Returns:
            The Pareto front, best first in the first figure.
        """
        chosen = names or self.objectives
        scored = [(tuple(self.figure(trial, name) for name in chosen), trial) for trial in self.tried_in_full]
        scored = [pair for pair in scored if all(math.isfinite(value) for value in pair[0])]
        kept = [
            pair
            for pair in scored
            if not any(
                other != pair[0] and all(b <= a for a, b in zip(pair[0], other, strict=True)) for other, _ in scored
            )
        ]
        return [trial for _, trial in sorted(kept, key=lambda pair: (pair[0], pair[1].number))]


def has_sweep(folder: Path) -> bool:
    """Whether a run folder holds a sweep."""
    return (folder / SWEEP_FILE).is_file()


def read_sweep(folder: Path) -> SweepRecord:
    """Read what a sweep found.

    Args:
        folder: The run's folder.

    Returns:
        The record.

    Raises:
        ConfigError: If there is none, it is damaged, or it was written by a newer release.
    """
    path, again = Path(folder) / SWEEP_FILE, "run the sweep again; it takes its finished trials from the folder"
    document = read_document(path, remedy=again)
    return parse_record(SweepRecord, document, where=path, newest=SCHEMA_VERSION, what="the trials", remedy=again)


def write_sweep(folder: Path, record: SweepRecord) -> Path:
    """Write sweep.json under a temporary name that is then renamed.

    Args:
        folder: The run's folder.
        record: What the sweep found.

    Returns:
        The file.
    """
    return write_record(Path(folder) / SWEEP_FILE, record)
