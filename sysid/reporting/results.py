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

from sysid.errors import ConfigError
from sysid.reporting.advice.record import AdviceRecord
from sysid.reporting.fit_records import FitRecord
from sysid.reporting.frequency import HERTZ, FrequencyUnit
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

KINDS = ("fits", "sweep")
"""Of the runs whose results these are."""


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
    frequency: FrequencyUnit = Field(default=HERTZ, description="Unit of the frequencies that the page draws.")
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
        ConfigError: If there is no results.json, it is of a run of another kind, it is damaged, or it was written by a
            newer release.
    """
    path = Path(folder) / RESULTS_FILE
    document = read_document(path)
    if (kind := document.get("kind", "fits")) not in KINDS:
        raise ConfigError(
            "the run fitted no records", where=path, expected=f"a run of kind {' or '.join(KINDS)}", got=f"kind {kind}",
            remedy="name another run, or the bundle that this one exported",
        )  # fmt: skip
    return parse_results(document, where=path)


def write_results(folder: Path, results: Results) -> Path:
    """Write results.json, strict JSON, under a temporary name that is then renamed.

    Args:
        folder: The folder it goes into; made if missing.
        results: The results.

    Returns:
        The file.
    """
    return write_record(Path(folder) / RESULTS_FILE, results)
