"""What every pipeline that finds a model says, whether its fits are given, swept or searched for."""

from __future__ import annotations

from typing import Any, Self

from pydantic import BaseModel, Field, FiniteFloat, model_validator

from sysid.field_checks import FieldError, FolderName
from sysid.models import Start, StartKind
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.workbench.fields import FormatField, MappingField, StartField
from sysid.workbench.old_words import STRICT
from sysid.workbench.stability import StabilityConfig


class FilesConfig(BaseModel):
    """The files that a model leaves the workbench as.

    Args:
        formats: File formats; by default ONNX and C, as far as they can be written here.
        tolerance: Largest difference allowed between a file and its model, in the output's unit; by default 1e-9 of the
            largest value that each output has over the cases.
        run_times: Whether every file is timed beside the model's own free run; some seconds a format.
    """

    model_config = STRICT

    formats: tuple[FormatField, ...] | None = None
    tolerance: float | None = Field(default=None, gt=0.0)
    run_times: bool = False


class ExportConfig(FilesConfig):
    """What leaves the workbench.

    Args:
        fit: Name of a fit, or ``best``: least free-run error on the selection traces.
        formats: File formats; by default ONNX and C, as far as they can be written here.
        tolerance: Largest difference allowed between a file and its model, in the output's unit; by default 1e-9 of the
            largest value that each output has over the cases.
        run_times: Whether every file is timed beside the model's own free run; some seconds a format.
        case: Of parameters that differ by case, the case whose values the files have; by default they are inputs.
        unstable: Whether a fit whose free run is unstable (status ``UNSTABLE``) may leave. Without, ``best`` is the
            best of the others, and nothing is exported where there is none.
        input_levels: What inputs stood at before a run from rest, by channel, in their units; by default their first
            sample.
    """

    fit: str = "best"
    case: str | None = None
    unstable: bool = True
    input_levels: dict[str, FiniteFloat] = Field(default_factory=dict)


class ReportConfig(BaseModel):
    """What the report shows beside our own figures.

    Args:
        published: Name of a table of published figures.
        drawn: Cases of each fit that are drawn at most, the worst of those that were not fitted first; 12 by default,
            and fewer where a search has little time.
        frequency: Unit of the frequencies that are drawn: ``Hz``, or ``rad/s``.
    """

    model_config = STRICT

    published: str | None = None
    drawn: int | None = Field(default=None, ge=1)
    frequency: FrequencyUnit = HERTZ


class SharedConfig(BaseModel):
    """What is looked for, in which data, and what comes of it.

    Args:
        kind: Which kind of pipeline it is.
        name: Name of the run folder; letters, digits, dots, dashes and underscores.
        description: What it is for.
        data: Name of a data set, or path of its ``dataset.yaml``; of a search a file with traces, too.
        selection: Data set with traces that choose; validation and test cases do not.
        mapping: Inputs and outputs, such as ``BP+AR -> BC`` or ``STP -> BP+AR``.
        start: How each free run begins.
        rest: Value at rest of the output, by channel name, in its unit.
        seed: Seed of everything random.
        stability: How a network's free run is checked: over which sequences it has to stay bounded and to settle.
        export: What leaves the workbench; ``null`` for nothing.
        report: What the report shows.
    """

    model_config = STRICT

    kind: str
    name: FolderName
    description: str = ""
    data: str
    selection: str | None = None
    mapping: MappingField
    start: StartField = Start(kind=StartKind.ESTIMATED)
    rest: dict[str, FiniteFloat] = Field(default_factory=dict)
    seed: int = Field(default=0, ge=0)
    stability: StabilityConfig = StabilityConfig()
    export: ExportConfig | None = ExportConfig()
    report: ReportConfig = ReportConfig()

    @model_validator(mode="after")
    def _check_rest(self) -> Self:
        outputs = self.mapping.outputs
        strangers = sorted(set(self.rest) - set(outputs))
        if strangers:
            raise FieldError(
                f"rest names {', '.join(strangers)}, which is not {'the' if len(outputs) == 1 else 'an'} output",
                expected=", ".join(outputs),
                got=", ".join(strangers),
                remedy=f"write rest: {{{outputs[0]}: 0}}; inputs rest at their first sample, or input_levels",
            )
        return self

    @model_validator(mode="after")
    def _check_input_levels(self) -> Self:
        strangers = sorted(set(self.export.input_levels if self.export else ()) - set(self.mapping.inputs))
        if strangers:
            raise FieldError(
                f"input_levels of the export names {', '.join(strangers)}, which is no input",
                expected=", ".join(self.mapping.inputs), got=", ".join(strangers),
                remedy="name inputs; what outputs stand at is said under rest",
            )  # fmt: skip
        return self

    @property
    def shared(self) -> dict[str, Any]:
        """The fields that pipelines of all these kinds have, but for the kind."""
        return {name: getattr(self, name) for name in SharedConfig.model_fields if name != "kind"}
