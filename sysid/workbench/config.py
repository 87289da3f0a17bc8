"""The pipeline's YAML: what is fitted to which data, how, and what comes out; every field checked by name."""

from __future__ import annotations

import dataclasses
import difflib
import inspect
import typing
from collections.abc import Mapping as Dict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    PlainValidator,
    WithJsonSchema,
    create_model,
    field_validator,
    model_validator,
)

from sysid.content import content_folders
from sysid.errors import ConfigError
from sysid.estimation import Training
from sysid.export.exporters import EXPORTERS
from sysid.models import ARX, NARX, AbstractStructure, Mapping, Start, StartKind, structure_from_dict
from sysid.workbench.naming import slug
from sysid.yaml_files import FieldError, check, parse_yaml, read_yaml

_STRICT = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

STRUCTURES: dict[str, type[AbstractStructure]] = {ARX.kind: ARX, NARX.kind: NARX}
"""Structures that a pipeline can fit; their fields are those of the classes."""


def _as_field_error(error: ConfigError) -> FieldError:
    """A ConfigError from a deeper room, told where the YAML went wrong by pydantic."""
    return FieldError(error.what, expected=error.expected, got=error.got, remedy=error.remedy or "correct the value")


def _structure(value: object) -> AbstractStructure:
    """A structure from its fields, with the fields of its kind named where one is wrong."""
    if isinstance(value, AbstractStructure):
        return value
    kinds = ", ".join(STRUCTURES)
    if not isinstance(value, Dict) or "kind" not in value:
        raise FieldError(
            "not a structure",
            expected=f"fields with a kind: one of {kinds}",
            got=repr(value),
            remedy="write for example {kind: NARX, input_delays: 4, output_delays: 4, neurons: 20}",
        )
    kind = value["kind"]
    if kind not in STRUCTURES:
        near = difflib.get_close_matches(str(kind), STRUCTURES, n=1)
        remedy = f"did you mean {near[0]}?" if near else "choose one of these kinds"
        raise FieldError("unknown kind of structure", expected=f"one of {kinds}", got=repr(kind), remedy=remedy)
    parameters = inspect.signature(STRUCTURES[kind]).parameters
    for name in value:
        if name != "kind" and name not in parameters:
            near = difflib.get_close_matches(str(name), parameters, n=1)
            raise FieldError(
                f"unknown field {name!r} of the structure {kind}",
                expected=f"one of {', '.join(parameters)}",
                got=str(name),
                remedy=f"did you mean {near[0]}?" if near else "remove it",
            )
    missing = [p.name for p in parameters.values() if p.default is p.empty and p.name not in value]
    if missing:
        raise FieldError(
            f"the structure {kind} lacks {', '.join(missing)}",
            expected=", ".join(parameters),
            got=", ".join(str(name) for name in value),
            remedy=f"add {missing[0]}: ...",
        )
    try:
        return structure_from_dict(value)
    except ConfigError as error:
        raise _as_field_error(error) from error
    except (TypeError, ValueError) as error:
        raise FieldError(
            f"a field of the structure {kind} has the wrong type",
            expected="numbers or lists of numbers",
            got=repr(dict(value)),
            remedy=f"correct it ({error})",
        ) from error


def _structure_schema() -> dict[str, Any]:
    """JSON schema of all structures, for editors that complete the YAML."""
    choices = []
    for kind, structure in STRUCTURES.items():
        parameters = inspect.signature(structure).parameters
        choices.append(
            {
                "type": "object",
                "title": kind,
                "properties": {"kind": {"const": kind}} | {name: {} for name in parameters},
                "required": ["kind", *(p.name for p in parameters.values() if p.default is p.empty)],
                "additionalProperties": False,
            }
        )
    return {"oneOf": choices}


def _start(value: object) -> Start:
    """How a free run starts: a word, or ``{measured: n}``."""
    if isinstance(value, Start):
        return value
    try:
        if isinstance(value, str) and value != StartKind.MEASURED.value:
            return Start(kind=StartKind(value))
        if isinstance(value, Dict) and set(value) == {StartKind.MEASURED.value} and type(value["measured"]) is int:
            return Start(kind=StartKind.MEASURED, n_measured=value["measured"])
    except ConfigError as error:
        raise _as_field_error(error) from error
    except ValueError:
        pass
    raise FieldError(
        "not a way to start a free run",
        expected="rest, first-sample, or {measured: 50} for 50 measured samples",
        got=repr(value),
        remedy="choose one of the three",
    )


def _start_text(start: Start) -> str | dict[str, int]:
    return {"measured": start.n_measured} if start.kind is StartKind.MEASURED else start.kind.value


def _mapping(value: object) -> Mapping:
    """A mapping from its text."""
    if isinstance(value, Mapping):
        return value
    try:
        return Mapping.parse(str(value))
    except ConfigError as error:
        raise _as_field_error(error) from error


StructureField = Annotated[
    AbstractStructure,
    PlainValidator(_structure),
    PlainSerializer(lambda structure: structure.to_dict()),
    WithJsonSchema(_structure_schema()),
]
StartField = Annotated[
    Start,
    PlainValidator(_start),
    PlainSerializer(_start_text),
    WithJsonSchema(
        {
            "anyOf": [
                {"enum": ["rest", "first-sample"]},
                {"type": "object", "properties": {"measured": {"type": "integer", "minimum": 1}}},
            ]
        }
    ),
]
MappingField = Annotated[
    Mapping, PlainValidator(_mapping), PlainSerializer(str), WithJsonSchema({"type": "string", "pattern": "->"})
]


def _format(value: object) -> str:
    """The name of an exporter."""
    if isinstance(value, str) and value in EXPORTERS:
        return value
    near = difflib.get_close_matches(str(value), EXPORTERS, n=1)
    raise FieldError(
        "unknown export format",
        expected=f"one of {', '.join(EXPORTERS)}",
        got=repr(value),
        remedy=f"did you mean {near[0]}?" if near else "choose one of these formats",
    )


FormatField = Annotated[str, PlainValidator(_format), WithJsonSchema({"enum": list(EXPORTERS)})]


def _fields_of(dataclass: type) -> dict[str, Any]:
    """A dataclass's fields as pydantic wants them, so that the YAML has exactly the options the code has."""
    hints = typing.get_type_hints(dataclass)
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(dataclass):
        if field.default_factory is not dataclasses.MISSING:
            fields[field.name] = (hints[field.name], Field(default_factory=field.default_factory))
        else:
            fields[field.name] = (hints[field.name], ... if field.default is dataclasses.MISSING else field.default)
    return fields


if TYPE_CHECKING:

    class TrainingConfig(BaseModel):
        """Options of a network's training, field by field those of :class:`sysid.estimation.Training`."""

else:
    # The fields are read off the dataclass: an option added to the training appears in the YAML by itself.
    TrainingConfig = create_model("TrainingConfig", __config__=_STRICT, **_fields_of(Training))


class FitConfig(BaseModel):
    """One fit.

    Args:
        name: Name in tables, different for each fit.
        structure: What is fitted, with its ``kind``.
        training: How a network is trained; an ARX model has nothing to choose.
        initial: Name of an earlier fit to start from.
    """

    model_config = _STRICT

    name: str = Field(min_length=1)
    structure: StructureField
    training: TrainingConfig | None = None
    initial: str | None = None

    @property
    def slug(self) -> str:
        """Name of the fit's folder."""
        return slug(self.name)

    @model_validator(mode="after")
    def _check(self) -> FitConfig:
        if isinstance(self.structure, ARX) and (self.training is not None or self.initial is not None):
            raise FieldError(
                f"the fit {self.name!r} has a training or an initial fit, but is ARX",
                expected="neither: least squares is computed directly",
                remedy="remove training and initial",
            )
        try:
            self.training_options(seed=0)
        except ConfigError as error:
            raise _as_field_error(error) from error
        return self

    def training_options(self, seed: int) -> Training:
        """The options of the training, with the pipeline's seed where the fit names none.

        Args:
            seed: The pipeline's seed.

        Returns:
            The options.
        """
        given: dict[str, Any] = {"seed": seed}
        if self.training is not None:
            given |= {name: getattr(self.training, name) for name in self.training.model_fields_set}
        return Training(**given)


class ExportConfig(BaseModel):
    """What leaves the workbench.

    Args:
        fit: Name of a fit, or ``best``: least free-run error on the selection traces.
        formats: File formats.
        tolerance: Largest difference allowed between a file and its model, in the output's unit.
    """

    model_config = _STRICT

    fit: str = "best"
    formats: tuple[FormatField, ...] = ("onnx", "torchscript")
    tolerance: float = Field(default=1e-9, gt=0.0)


class ReportConfig(BaseModel):
    """What the report shows beside our own figures.

    Args:
        published: Name of a table of published figures.
    """

    model_config = _STRICT

    published: str | None = None


def _as_list(value: object) -> object:
    return [value] if isinstance(value, str) else value


class PipelineConfig(BaseModel):
    """A pipeline.

    Args:
        name: Name of the run folder; letters, digits, dots, dashes and underscores.
        description: What it is for.
        data: Name of a data set, or path of its ``dataset.yaml``.
        selection: Data set with traces that choose between fits; validation cases never do.
        mapping: Inputs and output, such as ``BP+AR -> BC``.
        start: How each free run begins.
        rest: Value at rest of the output, by channel name, in its unit.
        seed: Seed of everything random.
        fits: What is fitted, in order.
        export: What leaves the workbench; ``null`` for nothing.
        report: What the report shows.
    """

    model_config = _STRICT

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")
    description: str = ""
    data: str
    selection: str | None = None
    mapping: MappingField
    start: StartField = Start()
    rest: dict[str, float] = Field(default_factory=dict)
    seed: int = Field(default=0, ge=0)
    fits: Annotated[tuple[FitConfig, ...], BeforeValidator(_as_list)] = Field(min_length=1)
    export: ExportConfig | None = ExportConfig()
    report: ReportConfig = ReportConfig()

    @field_validator("fits")
    @classmethod
    def _check_fits(cls, fits: tuple[FitConfig, ...]) -> tuple[FitConfig, ...]:
        earlier: dict[str, FitConfig] = {}
        slugs: set[str] = set()
        for fit in fits:
            if fit.slug in slugs or fit.name == "best":
                raise FieldError(
                    f"the name {fit.name!r} cannot be told from another",
                    expected="a different name for each fit, in letters and digits too, and not the word best",
                    got=", ".join(other.name for other in fits),
                    remedy="rename one of them",
                )
            if fit.initial is not None and fit.initial not in earlier:
                near = difflib.get_close_matches(fit.initial, earlier, n=1)
                raise FieldError(
                    f"the fit {fit.name!r} starts from {fit.initial!r}, which is not an earlier fit",
                    expected=f"one of {', '.join(earlier)}" if earlier else "no initial fit for the first one",
                    got=fit.initial,
                    remedy=f"did you mean {near[0]}?" if near else "name a fit that stands above it",
                )
            if fit.initial is not None and earlier[fit.initial].structure != fit.structure:
                raise FieldError(
                    f"the fit {fit.name!r} has another structure than {fit.initial!r}, which it starts from",
                    expected=earlier[fit.initial].structure.label,
                    got=fit.structure.label,
                    remedy="use one structure for both, or remove initial",
                )
            earlier[fit.name] = fit
            slugs.add(fit.slug)
        return fits

    @model_validator(mode="after")
    def _check_names(self) -> PipelineConfig:
        names = [fit.name for fit in self.fits]
        if self.export is not None and self.export.fit not in ["best", *names]:
            near = difflib.get_close_matches(self.export.fit, names, n=1)
            raise FieldError(
                f"export names the fit {self.export.fit!r}, which there is not",
                expected=f"best, or one of {', '.join(names)}",
                got=self.export.fit,
                remedy=f"did you mean {near[0]}?" if near else "correct the name",
            )
        strangers = sorted(set(self.rest) - {self.mapping.output})
        if strangers:
            raise FieldError(
                f"rest names {', '.join(strangers)}, which is not the output",
                expected=self.mapping.output,
                got=", ".join(strangers),
                remedy=f"write rest: {{{self.mapping.output}: 0}}; inputs rest at their first sample",
            )
        return self

    @model_validator(mode="after")
    def _check_inputs(self) -> PipelineConfig:
        n_inputs = len(self.mapping.inputs)
        for fit in self.fits:
            if isinstance(fit.structure, ARX) and len(fit.structure.nb) != n_inputs:
                raise FieldError(
                    f"the orders of the fit {fit.name!r} do not match the inputs",
                    expected=f"{n_inputs} values of nb and of nk for {self.mapping}",
                    got=f"{len(fit.structure.nb)} values",
                    remedy="give one nb and one nk for each input",
                )
            if isinstance(fit.structure, NARX):
                try:
                    fit.structure.lags(n_inputs)
                except ConfigError as error:
                    raise _as_field_error(error) from error
        return self

    @property
    def rest_output(self) -> float | None:
        """The output's declared value at rest, ``None`` where none is declared."""
        return self.rest.get(self.mapping.output)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Pipeline:
    """A pipeline and where it was read from.

    Args:
        config: The checked fields.
        text: The YAML as written.
        path: Its file.
    """

    config: PipelineConfig
    text: str
    path: Path


def find_pipeline(name_or_path: str, *, workspace: Path | None = None) -> Path:
    """The file of a pipeline.

    Args:
        name_or_path: A built-in or workspace pipeline's name, or a YAML file.
        workspace: The user's workspace; ``None`` is the current folder.

    Returns:
        The file.

    Raises:
        ConfigError: If there is none.
    """
    given = Path(name_or_path)
    if given.suffix in {".yaml", ".yml"} or len(given.parts) > 1:
        if given.is_file():
            return given
        raise ConfigError(
            "there is no such pipeline file", expected="a YAML file", got=name_or_path, remedy="check the path"
        )
    known: dict[str, Path] = {}
    for folder in content_folders("pipelines", workspace=workspace):
        for file in sorted(folder.glob("*.yaml")):
            known.setdefault(file.stem, file)
    if name_or_path in known:
        return known[name_or_path]
    near = difflib.get_close_matches(name_or_path, known, n=1)
    raise ConfigError(
        f"there is no pipeline named {name_or_path}",
        expected=f"one of {', '.join(sorted(known))}, or the path of a YAML file" if known else "the path of a YAML",
        got=name_or_path,
        remedy=f"did you mean {near[0]}?" if near else "make a workspace with one: sysid init DIR",
    )


def read_pipeline(path: Path) -> Pipeline:
    """Read and check a pipeline.

    Args:
        path: Its YAML file.

    Returns:
        The pipeline.

    Raises:
        ConfigError: Naming the file, the field and what is wrong with it.
    """
    config = check(PipelineConfig, read_yaml(path), where=path)
    return Pipeline(config=config, text=path.read_text(encoding="utf-8-sig"), path=path.resolve())


def parse_pipeline(text: str, *, where: object = "text") -> PipelineConfig:
    """Check a pipeline that is not in a file.

    Args:
        text: The YAML.
        where: Named in errors.

    Returns:
        The checked fields.

    Raises:
        ConfigError: Naming the field and what is wrong with it.

    Example:
        >>> text = '''
        ... name: first
        ... data: tank
        ... mapping: pump -> level
        ... fits: [{name: ARX, structure: {kind: ARX, na: 1, nb: [1], nk: [1]}}]
        ... '''
        >>> parse_pipeline(text).fits[0].structure.label
        'ARX [1; 1; 1]'
    """
    return check(PipelineConfig, parse_yaml(text, where=where), where=where)


def json_schema() -> dict[str, Any]:
    """The YAML's JSON schema, for editors that complete and check while one types."""
    return PipelineConfig.model_json_schema()
