"""One fit in results.json: its figures on every case, how it was trained and checked, and what was exported of it."""

from __future__ import annotations

import math
from typing import Any

from pydantic import Field

from sysid.estimation import Loop, Status
from sysid.reporting.records import Number, Record
from sysid.traces import Role


class FiguresRecord(Record):
    """Figures of merit of one output against one target."""

    mse: Number = Field(description="Mean squared error, in the unit squared.")
    nrmse_fit: Number = Field(description="Percent, 100 (1 - |y - y_hat| / |y - mean(y)|).")
    max_abs_error: Number = Field(description="Largest absolute error, in the unit.")
    r: Number = Field(default=math.nan, description="Correlation coefficient of target and output.")
    unit: str = Field(description="Unit of the output.")


class PublishedRecord(Record):
    """A published figure set beside ours; written by the report, not by the run."""

    value: Number = Field(description="The published figure.")
    unit: str = Field(description="Of the figure.")
    source: str = Field(description="Where it is printed, such as 'Table 5.1'.")
    label: str = Field(description="Which model it belongs to.")
    ratio: Number = Field(description="Our figure divided by the published one.")


class CoverageRecord(Record):
    """How often an interval of the output holds what was measured."""

    level: Number = Field(description="How often it should, 0 to 1.")
    share: Number = Field(description="How often it does, 0 to 1.")
    share_before_spread: Number = Field(description="How often the interval from the estimation records alone does.")
    mean_half_width: Number = Field(description="In the output's unit.")


class StateRecord(FiguresRecord):
    """Figures of merit while a state lasts."""

    share: Number = Field(description="Of the samples that count, 0 to 1.")


class CaseRecord(Record):
    """One fit on one case."""

    role: Role
    free_run: FiguresRecord = Field(description="The model fed with its own past output: the figure that counts.")
    one_step: FiguresRecord = Field(description="One step ahead from measured output: open loop.")
    run_time_s: Number = Field(description="Seconds that the free run took: median of repeats, warm.")
    n_samples: int = Field(ge=1, description="Samples that were scored.")
    predicts: bool = Field(default=True, description="Whether the model has a prediction from measured output.")
    begins_at: int = Field(default=0, description="Sample of the case at which the free run begins and is scored.")
    simulated_s: Number = Field(description="Length of the case in seconds.")
    coverage: dict[str, CoverageRecord] | None = Field(
        default=None, description="Of the output's interval, free_run and one_step, where the fit has a posterior."
    )
    by_state: dict[str, StateRecord] | None = Field(
        default=None, description="Free run by the name of a state, where an annotator says in which each sample is."
    )
    constants: dict[str, float] | None = Field(
        default=None, description="Parameters that differ by case, as the run had them; null where none does."
    )
    published: dict[str, PublishedRecord] | None = Field(
        default=None, description="By kind of figure: free_run, one_step (mse) or run_time."
    )


class RunTimeRecord(Record):
    """How long an exported file takes for 20,000 samples, beside its model's own compiled free run."""

    cars: int = Field(description="Runs side by side in one call.")
    seconds: Number = Field(description="Of one call.")
    ratio: Number = Field(description="To the model's own free run, for each car.")


class ExportRecord(Record):
    """One exported file and how it compares with its model."""

    format: str = Field(description="Name of the exporter, such as onnx.")
    file: str = Field(description="Path, relative to the run folder.")
    largest_difference: Number = Field(description="Over all cases, in the output's unit.")
    tolerance: Number = Field(description="What was allowed, in the same unit.")
    unit: str = Field(default="", description="Of the difference.")
    run_times: list[RunTimeRecord] = Field(default=[], description="Empty where none were measured.")


class LearningCurve(Record):
    """Loss over the iterations."""

    iteration: list[Number] = Field(default=[], description="Number of the iteration.")
    mse: list[Number] = Field(default=[], description="Over the estimation records, in the output's unit squared.")


class EvidenceRecord(Record):
    """What Bayesian regularisation found."""

    log_evidence: Number = Field(
        description="Of the marginal likelihood; where errors persist, of an independent one, times the samples."
    )
    correlation_time: Number = Field(default=math.nan, description="Samples after which a residual is news.")
    alphas: dict[str, Number] = Field(default={}, description="Precision of the prior, per group of weights.")
    effective_parameters: dict[str, Number] = Field(default={}, description="Per group of weights.")
    parameters: dict[str, Number] = Field(default={}, description="Per group of weights.")


class AttemptRecord(Record):
    """One start as it stood when it was looked at."""

    start: int = Field(description="Which start, from 1 on.")
    seed: int | None = Field(default=None, description="Of the start; null for one that was given.")
    iterations: int = Field(description="Done by then.")
    elapsed_s: Number = Field(description="Seconds that it had taken.")
    estimation_mse: Number = Field(
        description="On the estimation records, in the output's unit squared; relative for several outputs."
    )
    selection_mse: Number = Field(description="Geometric mean over the selection traces.")
    log_evidence: Number = Field(description="Null where none was computed.")
    effective_parameters: Number = Field(description="Parameters that the data determine.")
    away: Number = Field(
        default=math.nan,
        description="Distance from the middle of all starts on the inputs backwards, over half of the output's range.",
    )
    stable: bool | None = Field(default=None, description="What the check of its free run said, where it was asked.")
    chosen: bool = Field(default=False, description="Whether it is the result.")
    members: list[int] = Field(default=[], description="Of an ensemble, the starts that it unites, once for each pick.")
    without: list[str] = Field(default=[], description="Inputs that it does without.")
    cautious: bool = Field(
        default=False,
        description="Whether it counts errors that persist as fewer samples.",
    )
    status: str = Field(default="", description="Name of the status that it had then; empty where not recorded.")


class StabilityRecord(Record):
    """What a check of the free run over random sequences found."""

    stable: bool = Field(description="Whether it is.")
    text: str = Field(description="The finding as a sentence.")
    source: str = Field(description="Where the sequences come from.")
    seed: int = Field(description="Of the sequences.")
    sequences: int = Field(description="How many were run.")
    asked: int | None = Field(
        default=None, description="How many were to be run, where the time ended before; null where all were."
    )
    unbounded: int = Field(description="How many left the bounds.")
    beyond: int = Field(
        default=0, description="How many took a linear model of the records out of the bounds too; not judged."
    )
    judged: int = Field(description="How many had a plateau to settle on.")
    unsettled: int = Field(description="How many of those settled elsewhere.")
    apart: int = Field(
        default=0, description="On how many of a hundred it hangs on where it began; 0 where that is few."
    )
    tolerance: Number = Field(
        description="How far from its plateau a run may settle, as a share of the output's range."
    )
    largest_plateau_error: Number = Field(description="As a share of the output's range.")
    worst: str = Field(description="Name of the worst sequence.")


class FitRecord(Record):
    """One fit: what it is, how it ended, and how good it is on every case."""

    name: str = Field(description="Its name in tables.")
    slug: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._+-]*$", description="Its folder under fits/.")
    mapping: str = Field(description="Written as in 'BP+AR -> BC'.")
    system: str | None = Field(
        default=None, description="Name of the fit of several outputs that it is one output of; null for one output."
    )
    model_slug: str = Field(default="", description="Folder under fits/ of its model; empty where it is its own.")
    structure: dict[str, Any] = Field(description="All fields of the structure.")
    label: str = Field(description="Structure in a few characters, such as 'NARX 4/4/20'.")
    loop: Loop
    seed: int | None = Field(default=None, description="Of its random start.")
    initial: str | None = Field(default=None, description="Name of the fit that this one was started from.")
    train_time_s: Number = Field(description="Wall seconds of the fit.")
    status: str = Field(description="Name of the status, such as CONVERGED.")
    notes: list[str] = Field(default=[], description="Sentences on choices that were made.")
    warnings: list[str] = Field(
        default=[], description="Those of them that say what was declared and is not so, as of a record's beginning."
    )
    evidence: EvidenceRecord | None = None
    attempts: list[AttemptRecord] = Field(default=[], description="Every start at every checkpoint.")
    stability: StabilityRecord | None = Field(default=None, description="Of the free run over random sequences.")
    n_parameters: int | None = Field(default=None, description="Fitted parameters; null where not counted.")
    selection_mse: Number = Field(default=math.nan, description="Free-run mse on the traces that chose between fits.")
    cases: dict[str, CaseRecord]
    exports: list[ExportRecord] = Field(default=[])
    learning_curve: LearningCurve | None = None

    @property
    def status_sentence(self) -> str:
        """How the fit ended, as a sentence."""
        return Status[self.status].value if self.status in Status.__members__ else self.status

    @property
    def predicts(self) -> bool:
        """Whether the model has a prediction from measured output."""
        return any(case.predicts for case in self.cases.values())

    @property
    def unit(self) -> str:
        """The output's unit."""
        return next((case.free_run.unit for case in self.cases.values()), "")
