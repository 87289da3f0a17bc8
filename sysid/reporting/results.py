"""results.json of a run of fits, a sweep's among them: what it found, read and written with its contract.

The contract is documented in ``docs/results.md``. A reader skips keys that it does not know, and refuses a
``schema_version`` newer than its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from pathlib import Path
from typing import Any

from pydantic import Field

from sysid.estimation import Loop, Status
from sysid.reporting.advice_record import AdviceRecord
from sysid.reporting.records import (
    RESULTS_FILE,
    DataSetRecord,
    Number,
    Record,
    RunResults,
    damaged,
    parse_record,
    read_document,
    write_record,
)
from sysid.reporting.sweep_record import SweepSummary
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

    log_evidence: Number = Field(description="Logarithm of the marginal likelihood.")
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
    stable: bool | None = Field(default=None, description="What the check of its free run said, where it was asked.")
    chosen: bool = Field(default=False, description="Whether it is the result.")
    members: list[int] = Field(default=[], description="Of an ensemble, the starts that it unites, once for each pick.")
    without: list[str] = Field(default=[], description="Inputs that it does without.")
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
        default=0, description="On how many of the first hundred it hangs on where it began; 0 where that is few."
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


class DataCaseRecord(Record):
    """One trace of the data set."""

    role: Role
    samples: int = Field(description="How many it has.")
    duration_s: Number = Field(description="Length in seconds.")
    provenance: list[str] = Field(default=[], description="Sentences on where it comes from.")


class DataRecord(DataSetRecord):
    """The data set of fits."""

    sample_time: Number = Field(description="Seconds.")
    source: str = Field(default="", description="Sentences on where it comes from, and what of it was guessed.")
    cases: dict[str, DataCaseRecord]


class SelectionRecord(Record):
    """The traces that chose between fits."""

    name: str = Field(description="Name of their data set.")
    cases: dict[str, Any] = Field(description="By name of the trace.")


class BestRecord(Record):
    """Which fit was chosen."""

    name: str = Field(description="Name of the fit.")
    chosen_by: str = Field(description="One sentence: by which figure, on which traces.")
    cases_chose: bool = Field(
        default=False, description="Whether the cases that are scored took part, as in a published sweep that did so."
    )


class AmplitudeRecord(Record):
    """The chosen linear model and the chosen network at one amplitude."""

    amplitude: str = Field(description="minimum, intermediate or full: how far the output of its cases moves.")
    cases: list[str] = Field(description="Names of its cases.")
    linear: str = Field(description="Name of the linear fit that what chooses puts first.")
    linear_fit: Number = Field(description="Its mean free-run fit over these cases in percent.")
    network: str = Field(description="Name of the network that what chooses puts first.")
    network_fit: Number = Field(description="Its mean free-run fit over these cases in percent.")
    output: str = Field(default="", description="Which output it is about, where there are several.")
    better_linear: str = Field(default="", description="Another linear fit that is better here, where there is one.")
    better_linear_fit: Number = Field(default=math.nan, description="Its free-run fit in percent.")
    better_network: str = Field(default="", description="Another network that is better here, where there is one.")
    better_network_fit: Number = Field(default=math.nan, description="Its free-run fit in percent.")


class OrderRow(Record):
    """One structure of an order search."""

    label: str = Field(description="Structure in a few characters.")
    n_parameters: int = Field(description="Fitted parameters.")
    one_step_mse: Number = Field(description="On the estimation traces, in the output's unit squared.")
    aicc: Number = Field(description="AICc; smaller is better.")
    bic: Number = Field(description="BIC; smaller is better.")
    free_run_fit: Number = Field(description="Mean fit of the free run in percent; null where it diverges.")
    pole_radius: Number = Field(default=math.nan, description="Largest pole's magnitude: stable below 1.")


class OrderCurveRecord(Record):
    """Loss against size."""

    candidates: int = Field(description="Structures that were tried.")
    sizes: list[int] = Field(description="Numbers of parameters, rising.")
    lowest: list[Number] = Field(description="Least mean squared one-step error of each size.")
    highest: list[Number] = Field(description="The greatest.")
    choices: list[tuple[str, str, int, Number]] = Field(
        description="Criterion, the structure that it chooses, its parameters and its error."
    )


class OrdersRecord(Record):
    """What a search over the orders of ARX models, and of other structures, found for one output."""

    mapping: str = Field(description="Written as in 'BP+AR -> BC'.")
    unit: str = Field(description="The output's unit.")
    best: dict[str, Any] = Field(description="All fields of the best structure.")
    label: str = Field(description="The same in a few characters.")
    chosen_by: str = Field(description="By what it is the best.")
    notes: list[str] = Field(default=[], description="Such as that it stands at the end of what was tried.")
    correlations: list[float] = Field(default=[], description="Canonical correlations of past and future, descending.")
    curve: OrderCurveRecord
    rows: list[OrderRow] = Field(description="The first structures, best first.")


class SystemCaseRecord(Record):
    """A fit of several outputs on one case."""

    role: Role
    mean_fit: Number = Field(description="Mean over the outputs of the free run's fit in percent.")
    run_time_s: Number = Field(description="Seconds that the free run of all models took.")


class SystemRecord(Record):
    """A fit of several outputs as a whole."""

    name: str = Field(description="Its name in the pipeline.")
    mapping: str = Field(description="Written as in 'u -> y1+y2'.")
    label: str = Field(description="Structure in a few characters.")
    fits: dict[str, str] = Field(description="By output the name of the fit object that has its figures.")
    models: int = Field(description="How many models: one, or one an output.")
    n_parameters: int = Field(description="Fitted parameters of all models.")
    train_time_s: Number = Field(description="Wall seconds of the fits of all models.")
    cases: dict[str, SystemCaseRecord]


class LinearityRecord(Record):
    """Whether a linear model is enough, amplitude by amplitude."""

    answer: str = Field(description="LINEAR, NETWORK, NEITHER or UNKNOWN.")
    text: str = Field(description="The answer as a sentence.")
    rows: list[AmplitudeRecord] = Field(default=[])


class Results(RunResults):
    """All of results.json of a run of fits, or of a sweep."""

    data: DataRecord
    selection: SelectionRecord | None = Field(default=None, description="The traces that chose between fits.")
    fits: list[FitRecord] = Field(min_length=1, description="One object a fit and output.")
    systems: list[SystemRecord] = Field(default=[], description="Fits of several outputs as wholes.")
    orders: list[OrdersRecord] = Field(default=[], description="What a search of the orders found, by output.")
    best: BestRecord | None = Field(default=None, description="Which fit was chosen.")
    linearity: LinearityRecord | None = Field(default=None, description="Whether a linear model is enough.")
    advice: list[AdviceRecord] = Field(default=[], description="What is in the traces, output by output.")
    published: str | None = Field(default=None, description="Reference table to set beside ours.")
    drawn: int = Field(default=12, ge=1, description="Cases of each fit that are drawn at most.")
    sweep: SweepSummary | None = Field(default=None, description="How the fits were found, where a sweep found them.")

    @property
    def best_fit(self) -> FitRecord | None:
        """The fit that was chosen."""
        return None if self.best is None else next(fit for fit in self.fits if fit.name == self.best.name)

    @property
    def best_fits(self) -> list[FitRecord]:
        """The fit that was chosen, output by output."""
        best = self.best_fit
        if best is None or best.system is None:
            return [] if best is None else [best]
        return [fit for fit in self.fits if fit.system == best.system]

    @property
    def best_name(self) -> str:
        """Name of the fit that was chosen, as the pipeline has it."""
        best = self.best_fit
        return "" if best is None else best.system or best.name

    def chosen(self, fit: FitRecord) -> bool:
        """Whether a fit is what was chosen, or one output of that."""
        return any(fit is one for one in self.best_fits)

    def mappings(self) -> dict[str, list[FitRecord]]:
        """The fits by mapping, both in the order of the file."""
        groups: dict[str, list[FitRecord]] = {}
        for fit in self.fits:
            groups.setdefault(fit.mapping, []).append(fit)
        return groups


def parse_results(document: Dict[str, Any], *, where: object) -> Results:
    """Check the plain data of a results.json.

    Args:
        document: Plain data.
        where: Named in errors: the file the data came from.

    Returns:
        The results.

    Raises:
        ConfigError: If they were written by a newer release, or a field is missing or wrong.
    """
    results = parse_record(Results, {"schema_version": 1} | dict(document), where=where)
    names = [fit.name for fit in results.fits]
    if len(set(names)) < len(names) or len({fit.slug for fit in results.fits}) < len(names):
        raise damaged(where, "a name and a slug of its own for every fit", ", ".join(names))
    if results.best is not None and results.best.name not in names:
        raise damaged(where, f"best.name: one of {', '.join(names)}", results.best.name)
    return results


def read_results(folder: Path) -> Results:
    """Read the results of a run.

    Args:
        folder: The run's folder.

    Returns:
        The results.

    Raises:
        ConfigError: If there is no results.json, it is damaged, or it was written by a newer release.
    """
    path = Path(folder) / RESULTS_FILE
    return parse_results(read_document(path), where=path)


def write_results(folder: Path, results: Results) -> Path:
    """Write results.json, strict JSON, under a temporary name that is then renamed.

    Args:
        folder: The folder it goes into; made if missing.
        results: The results.

    Returns:
        The file.
    """
    return write_record(Path(folder) / RESULTS_FILE, results)
