"""results.json: what a run found, read and written with its contract.

The contract is documented in ``reports/README.md``. A reader skips keys that it does not know, and refuses a
``schema_version`` newer than its own.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping as Dict
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, WithJsonSchema

from sysid.atomic import replacing
from sysid.errors import ConfigError
from sysid.estimation import Loop, Status
from sysid.traces import Role

SCHEMA_VERSION: Final = 1
RESULTS_FILE: Final = "results.json"


def _nan_for_null(value: object) -> object:
    return math.nan if value is None else value


# JSON has no word for infinity and NaN: a figure that is not finite is written as null, and read as NaN.
Number = Annotated[
    float,
    BeforeValidator(_nan_for_null),
    WithJsonSchema({"type": ["number", "null"]}),
]


class _Record(BaseModel):
    """Frozen; keys from a later release are kept, so that a copy loses nothing."""

    model_config = ConfigDict(frozen=True, extra="allow", protected_namespaces=())


class FiguresRecord(_Record):
    """Figures of merit of one output against one target."""

    mse: Number = Field(description="Mean squared error, in the unit squared.")
    nrmse_fit: Number = Field(description="Percent, 100 (1 - |y - y_hat| / |y - mean(y)|).")
    max_abs_error: Number = Field(description="Largest absolute error, in the unit.")
    r: Number = Field(default=math.nan, description="Correlation coefficient of target and output.")
    unit: str = Field(description="Unit of the output.")


class PublishedRecord(_Record):
    """A published figure set beside ours; written by the report, not by the run."""

    value: Number
    unit: str
    source: str = Field(description="Where it is printed, such as 'Table 5.1'.")
    label: str = Field(description="Which model it belongs to.")
    ratio: Number = Field(description="Our figure divided by the published one.")


class CoverageRecord(_Record):
    """How often an interval of the output holds what was measured."""

    level: Number = Field(description="How often it should, 0 to 1.")
    share: Number = Field(description="How often it does, 0 to 1.")
    share_before_spread: Number = Field(description="How often the interval from the estimation records alone does.")
    mean_half_width: Number = Field(description="In the output's unit.")


class StateRecord(FiguresRecord):
    """Figures of merit while a state lasts."""

    share: Number = Field(description="Of the samples that count, 0 to 1.")


class CaseRecord(_Record):
    """One fit on one case."""

    role: Role
    free_run: FiguresRecord = Field(description="The model fed with its own past output: the figure that counts.")
    one_step: FiguresRecord = Field(description="One step ahead from measured output: open loop.")
    run_time_s: Number = Field(description="Seconds that the free run took: median of repeats, warm.")
    n_samples: int = Field(ge=1)
    begins_at: int = Field(default=0, description="Sample of the case at which the free run begins and is scored.")
    simulated_s: Number = Field(description="Length of the case in seconds.")
    coverage: dict[str, CoverageRecord] | None = Field(
        default=None, description="Of the output's interval, free_run and one_step, where the fit has a posterior."
    )
    by_state: dict[str, StateRecord] | None = Field(
        default=None, description="Free run by the name of a state, where an annotator says in which each sample is."
    )
    published: dict[str, PublishedRecord] | None = Field(
        default=None, description="By kind of figure: free_run, one_step (mse) or run_time."
    )


class RunTimeRecord(_Record):
    """How long an exported file takes for 20,000 samples, beside its model's own compiled free run."""

    cars: int = Field(description="Runs side by side in one call.")
    seconds: Number
    ratio: Number = Field(description="To the model's own free run, for each car.")


class ExportRecord(_Record):
    """One exported file and how it compares with its model."""

    format: str
    file: str = Field(description="Path, relative to the run folder.")
    largest_difference: Number = Field(description="Over all cases, in the output's unit.")
    tolerance: Number = Field(description="What was allowed, in the same unit.")
    unit: str = ""
    run_times: list[RunTimeRecord] = Field(default=[], description="Empty where none were measured.")


class LearningCurve(_Record):
    """Loss over the iterations."""

    iteration: list[Number] = []
    mse: list[Number] = Field(default=[], description="Over the estimation records, in the output's unit squared.")


class EvidenceRecord(_Record):
    """What Bayesian regularisation found."""

    log_evidence: Number
    correlation_time: Number = Field(default=math.nan, description="Samples after which a residual is news.")
    alphas: dict[str, Number] = Field(default={}, description="Precision of the prior, per group of weights.")
    effective_parameters: dict[str, Number] = Field(default={}, description="Per group of weights.")
    parameters: dict[str, Number] = Field(default={}, description="Per group of weights.")


class AttemptRecord(_Record):
    """One start as it stood when it was looked at."""

    start: int = Field(description="Which start, from 1 on.")
    seed: int | None = None
    iterations: int
    elapsed_s: Number
    estimation_mse: Number = Field(description="On the estimation records, in the output's unit squared.")
    selection_mse: Number = Field(description="Geometric mean over the selection traces.")
    log_evidence: Number
    effective_parameters: Number
    stable: bool | None = Field(default=None, description="What the check of its free run said, where it was asked.")
    chosen: bool = False
    members: list[int] = Field(default=[], description="Of a committee, the starts that it unites, once for each vote.")
    without: list[str] = Field(default=[], description="Inputs that it does without.")


class StabilityRecord(_Record):
    """What a check of the free run over random sequences found."""

    stable: bool
    text: str = Field(description="The finding as a sentence.")
    source: str = Field(description="Where the sequences come from.")
    seed: int
    sequences: int
    unbounded: int = Field(description="How many left the bounds.")
    judged: int = Field(description="How many had a plateau to settle on.")
    unsettled: int = Field(description="How many of those settled elsewhere.")
    tolerance: Number = Field(
        description="How far from its plateau a run may settle, as a share of the output's range."
    )
    largest_plateau_error: Number = Field(description="As a share of the output's range.")
    worst: str = Field(description="Name of the worst sequence.")


class FitRecord(_Record):
    """One fit: what it is, how it ended, and how good it is on every case."""

    name: str
    slug: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._+-]*$", description="Its folder under fits/.")
    mapping: str = Field(description="Written as in 'BP+AR -> BC'.")
    structure: dict[str, Any]
    label: str = Field(description="Structure in a few characters, such as 'NARX 4/4/20'.")
    loop: Loop
    seed: int | None = None
    initial: str | None = Field(default=None, description="Name of the fit that this one was started from.")
    train_time_s: Number
    status: str = Field(description="Name of the status, such as CONVERGED.")
    notes: list[str] = []
    evidence: EvidenceRecord | None = None
    attempts: list[AttemptRecord] = Field(default=[], description="Every start at every look.")
    stability: StabilityRecord | None = Field(default=None, description="Of the free run over random sequences.")
    n_parameters: int | None = None
    selection_mse: Number = Field(default=math.nan, description="Free-run mse on the traces that chose between fits.")
    cases: dict[str, CaseRecord]
    exports: list[ExportRecord] = []
    learning_curve: LearningCurve | None = None

    @property
    def status_sentence(self) -> str:
        """How the fit ended, as a sentence."""
        return Status[self.status].value if self.status in Status.__members__ else self.status

    @property
    def unit(self) -> str:
        """The output's unit."""
        return next((case.free_run.unit for case in self.cases.values()), "")


class DataCaseRecord(_Record):
    """One trace of the data set."""

    role: Role
    samples: int
    duration_s: Number
    provenance: list[str] = []


class DataRecord(_Record):
    """The data set."""

    name: str
    digest: str
    sample_time: Number = Field(description="Seconds.")
    cases: dict[str, DataCaseRecord]


class SelectionRecord(_Record):
    """The traces that chose between fits."""

    name: str = Field(description="Name of their data set.")
    cases: dict[str, Any] = Field(description="By name of the trace.")


class BestRecord(_Record):
    """Which fit was chosen."""

    name: str
    chosen_by: str = Field(description="One sentence: by which figure, on which traces.")
    cases_chose: bool = Field(
        default=False, description="Whether the cases that are scored took part, as in a published sweep that did so."
    )


class AmplitudeRecord(_Record):
    """The best linear model and the best network at one amplitude."""

    amplitude: str = Field(description="minimum, intermediate or full: how far the output of its cases moves.")
    cases: list[str]
    linear: str = Field(description="Name of the linear fit with the highest mean fit over these cases.")
    linear_fit: Number = Field(description="That free-run fit in percent.")
    network: str = Field(description="Name of the network with the highest mean fit over these cases.")
    network_fit: Number = Field(description="That free-run fit in percent.")


class LinearityRecord(_Record):
    """Whether a linear model is enough, amplitude by amplitude."""

    answer: str = Field(description="LINEAR, NETWORK, NEITHER or UNKNOWN.")
    text: str = Field(description="The answer as a sentence.")
    rows: list[AmplitudeRecord] = []


class Results(_Record):
    """All of results.json."""

    schema_version: int = SCHEMA_VERSION
    pipeline: str
    description: str = ""
    command: str = Field(description="The command that makes the run again.")
    created: str = Field(description="Date and time, ISO 8601.")
    environment: dict[str, Any]
    seed: int | None
    start: dict[str, Any] | None = Field(default=None, description="How each free run begins.")
    data: DataRecord
    selection: SelectionRecord | None = None
    fits: list[FitRecord] = Field(min_length=1)
    best: BestRecord | None = None
    linearity: LinearityRecord | None = Field(default=None, description="Whether a linear model is enough.")
    published: str | None = Field(default=None, description="Reference table to set beside ours.")

    @property
    def best_fit(self) -> FitRecord | None:
        """The fit that was chosen."""
        return None if self.best is None else next(fit for fit in self.fits if fit.name == self.best.name)

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
    version = document.get("schema_version", SCHEMA_VERSION)
    if isinstance(version, int) and version > SCHEMA_VERSION:
        raise ConfigError(
            "the results were written by a newer release",
            where=where,
            expected=f"schema_version up to {SCHEMA_VERSION}",
            got=version,
            remedy="upgrade the workbench, or make the report with the release that made the run",
        )
    try:
        results = Results.model_validate(document)
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"]) or "the whole file"
        raise _damaged(where, f"{field}: {first['msg']}", f"{first['input']!r:.80}") from error
    names = [fit.name for fit in results.fits]
    if len(set(names)) < len(names) or len({fit.slug for fit in results.fits}) < len(names):
        raise _damaged(where, "a name and a slug of its own for every fit", ", ".join(names))
    if results.best is not None and results.best.name not in names:
        raise _damaged(where, f"best.name: one of {', '.join(names)}", results.best.name)
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
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError) as error:
        raise ConfigError(
            "the folder holds no results",
            where=folder,
            expected=f"a run folder with {RESULTS_FILE}",
            got="no such file",
            remedy="name the folder of a finished run, such as runs/<pipeline>, or run the pipeline first",
        ) from error
    except (OSError, ValueError, RecursionError) as error:
        raise _damaged(path, "JSON in UTF-8", error) from error
    if not isinstance(document, dict):
        raise _damaged(path, "a JSON object at the top level", type(document).__name__)
    return parse_results(document, where=path)


def write_results(folder: Path, results: Results) -> Path:
    """Write results.json, strict JSON, under a temporary name that is then renamed.

    Args:
        folder: The folder it goes into; made if missing.
        results: The results.

    Returns:
        The file.
    """
    path = Path(folder) / RESULTS_FILE
    with replacing(path) as draft:
        draft.write_text(results.model_dump_json(indent=1) + "\n", encoding="utf-8")
    return path


def results_json_schema() -> dict[str, Any]:
    """The JSON schema of results.json.

    Returns:
        The schema, draft 2020-12.

    Example:
        >>> sorted(results_json_schema()["required"])
        ['command', 'created', 'data', 'environment', 'fits', 'pipeline', 'seed']
    """
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Results.model_json_schema()}


def _damaged(where: object, expected: object, got: object) -> ConfigError:
    return ConfigError(
        "the results are damaged",
        where=where,
        expected=expected,
        got=got,
        remedy="run the pipeline again; it resumes from what is finished",
    )
