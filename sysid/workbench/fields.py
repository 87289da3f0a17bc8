"""Fields of the pipeline's YAML that are objects of other rooms: read from the words that people write."""

from __future__ import annotations

import dataclasses
import inspect
import typing
from collections.abc import Mapping as Dict
from typing import TYPE_CHECKING, Annotated, Any, cast

from pydantic import BaseModel, Field, PlainSerializer, PlainValidator, WithJsonSchema, create_model

from sysid.errors import ConfigError, did_you_mean, shortened
from sysid.estimation import (
    JointTraining,
    PolynomialTraining,
    StateSpaceTraining,
    Training,
    TransferFunctionTraining,
)
from sysid.estimation.estimator import Estimator
from sysid.estimation.estimators import ESTIMATORS, estimator_of
from sysid.export.exporters import ELSEWHERE, EXPORTERS
from sysid.field_checks import FieldError
from sysid.models import AbstractStructure, Mapping, Start, structure_from_dict
from sysid.models.orders.lags import LagSpec, parse_lags
from sysid.workbench.old_words import JOINT_TRAINING, STRICT, TRAINING, TRAINING_VALUES, Words, with_new_words

STRUCTURES: dict[str, type[AbstractStructure]] = {kind: row.structure for kind, row in ESTIMATORS.items()}
"""Structures that a pipeline can fit; their fields are those of the classes."""

_KINDS = {structure.__name__: kind for kind, structure in STRUCTURES.items()}
_ALSO = {"TF": "TransferFunction"}
"""Words of reports and of ``sysid orders`` that are no names of classes."""

_ELSEWHERE = {
    **dict.fromkeys(("tfest", "idtf"), ("TransferFunction",)),
    **dict.fromkeys(("procest", "idproc", "fopdt", "sopdt", "p1d", "process"), ("ProcessModel",)),
    **dict.fromkeys(("ssest", "n4sid", "idss", "statespace"), ("LinearStateSpace",)),
    **dict.fromkeys(("nlarx", "idnlarx", "narxnet", "nnarx"), ("NARX",)),
    **dict.fromkeys(("nlhw", "idnlhw", "hammerstein", "wiener", "hw"), ("HammersteinWiener",)),
    **dict.fromkeys(("greyest", "nlgreyest", "idgrey", "idnlgrey", "graybox", "equations"), ("GreyBox",)),
    **dict.fromkeys(("idneuralstatespace", "nlssest"), ("NeuralStateSpace",)),
    **dict.fromkeys(("frols", "polynomial"), ("PolynomialNARX",)),
    **dict.fromkeys(("ar", "fir", "idpoly", "impulseest"), ("ARX",)),
    **dict.fromkeys(("var", "varx"), ("VectorARX",)),
}
"""What the same is called in other tools."""

_EXAMPLES = {
    **dict.fromkeys(("poles", "nb", "nf"), "[2]"), **dict.fromkeys(("zeros", "nk"), "[1]"), "na": "2", "nc": "1",
    "nd": "1", "states": "2", "neurons": "10", "input_delays": "2", "output_delays": "2", "first": "1", "second": "1",
    "type": "P1D", "equations": '"y[k+1] = a*y + b*u"',
}  # fmt: skip
"""What a field may look like, for one input."""


def with_short_kind(value: object) -> object:
    """The fields of a structure, its kind as results have it where the YAML has the name of the class.

    Args:
        value: The fields; anything else is given back as it is.

    Returns:
        The fields.

    Example:
        >>> with_short_kind({"kind": "NeuralStateSpace", "states": 2})
        {'kind': 'NSS', 'states': 2}
    """
    if isinstance(value, Dict) and isinstance(value.get("kind"), str):
        return {**value, "kind": _KINDS.get(value["kind"], _ALSO.get(value["kind"], value["kind"]))}
    return value


def as_field_error(error: ConfigError, name: str | None = None) -> FieldError:
    """A ConfigError of a deeper room, so that pydantic adds where in the YAML it happened.

    Args:
        error: The error.
        name: Of the fit that it is about, where the place does not say so.

    Returns:
        The error that pydantic places.
    """
    where = "" if name is None else f"{name}: "
    return FieldError(
        f"{where}{error.what}", expected=error.expected, got=error.got, remedy=error.remedy or "correct the value"
    )


def _structure(value: object) -> AbstractStructure:
    """A structure from its fields, with the fields of its kind named where one is wrong."""
    if isinstance(value, AbstractStructure):
        return value
    kinds = ", ".join(_KINDS)
    value = with_short_kind(value)
    if not isinstance(value, Dict) or "kind" not in value:
        raise FieldError(
            "not a structure",
            expected=f"fields with a kind: one of {kinds}",
            got=shortened(value),
            remedy="write for example {kind: NARX, input_delays: 4, output_delays: 4, neurons: 20}",
        )
    kind = value["kind"]
    if not isinstance(kind, str) or kind not in STRUCTURES:
        remedy = did_you_mean(kind, (*_KINDS, *_ALSO), "choose one of these kinds", also=_ELSEWHERE)
        raise FieldError("unknown kind of structure", expected=f"one of {kinds}", got=shortened(kind), remedy=remedy)
    parameters = inspect.signature(STRUCTURES[kind]).parameters
    for name in value:
        if name != "kind" and name not in parameters:
            what = f"unknown field {name!r} of the structure {kind}"
            raise as_field_error(ConfigError.unknown(what, name, parameters, "remove it"))
    missing = [p.name for p in parameters.values() if p.default is p.empty and p.name not in value]
    if missing:
        raise FieldError(
            f"the structure {kind} lacks {', '.join(missing)}",
            expected=", ".join(parameters),
            got=", ".join(str(name) for name in value),
            remedy="add "
            + ", ".join(f"{name}: {_EXAMPLES.get(name, '...')}" for name in missing)
            + (
                "; one number is for all inputs, a list has one for each"
                if {"poles", "zeros", "nb", "nk", "nf"} & set(missing)
                else ""
            ),
        )
    try:
        return structure_from_dict(value)
    except ConfigError as error:
        raise as_field_error(error) from error
    except (TypeError, ValueError, ArithmeticError) as error:
        raise FieldError(
            f"a field of the structure {kind} has the wrong type",
            expected="numbers or lists of numbers",
            got=shortened(dict(value)),
            remedy=f"correct it ({error})",
        ) from error


def _structure_schema() -> dict[str, Any]:
    """JSON schema of all structures, for editors that complete the YAML."""
    choices = []
    for kind, structure in STRUCTURES.items():
        parameters = inspect.signature(structure).parameters
        names = list(dict.fromkeys([structure.__name__, kind, *(also for also, one in _ALSO.items() if one == kind)]))
        choices.append(
            {
                "type": "object",
                "title": structure.__name__,
                "properties": {"kind": {"enum": names}} | {name: {} for name in parameters},
                "required": ["kind", *(p.name for p in parameters.values() if p.default is p.empty)],
                "additionalProperties": False,
            }
        )
    return {"oneOf": choices}


def _start(value: object) -> Start:
    """How a free run starts: a word, or ``{measured: n}``."""
    try:
        return Start.of(value)
    except ConfigError as error:
        raise as_field_error(error) from error


def _start_text(start: Start) -> str | dict[str, int]:
    return {start.kind.value: start.n_measured} if start.n_measured else start.kind.value


def _mapping(value: object) -> Mapping:
    """A mapping from its text, or from its lists."""
    try:
        return Mapping.of(value)
    except ConfigError as error:
        raise as_field_error(error) from error


def _single_mapping(value: object) -> Mapping:
    """A mapping of one output."""
    mapping = _mapping(value)
    try:
        mapping.check_single()
    except ConfigError as error:
        raise as_field_error(error) from error
    return mapping


def _past_lags(value: object) -> tuple[int, ...]:
    """Lags from 1 on, in the forms that people write."""
    try:
        return parse_lags(typing.cast("LagSpec", value), first=1, where="lags")
    except ConfigError as error:
        raise as_field_error(error) from error


LagsField = Annotated[
    tuple[int, ...],
    PlainValidator(_past_lags),
    PlainSerializer(list),
    WithJsonSchema(
        {"anyOf": [{"type": "integer"}, {"type": "string"}, {"type": "array", "items": {"type": "integer"}}]}
    ),
]
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
                {"enum": ["estimated", "rest", "first-sample"]},
                {"type": "object", "properties": {"measured": {"type": "integer", "minimum": 1}}},
                {"type": "object", "properties": {"estimated": {"type": "integer", "minimum": 1}}},
            ]
        }
    ),
]
_NAME = {"type": "string", "minLength": 1}
_NAMES = {"anyOf": [_NAME, {"type": "array", "items": _NAME}]}


def _mapping_schema(*words: str) -> WithJsonSchema:
    return WithJsonSchema(
        {
            "anyOf": [
                {"type": "string", "pattern": "->"},
                *(
                    {
                        "type": "object",
                        "properties": {"inputs": _NAMES, word: _NAME if word == "output" else _NAMES},
                        "required": ["inputs", word],
                        "additionalProperties": False,
                    }
                    for word in words
                ),
            ]
        }
    )


MappingField = Annotated[Mapping, PlainValidator(_mapping), PlainSerializer(str), _mapping_schema("output", "outputs")]
SingleMappingField = Annotated[
    Mapping, PlainValidator(_single_mapping), PlainSerializer(str), _mapping_schema("output")
]


def _format(value: object) -> str:
    """The name of an exporter."""
    if isinstance(value, str) and value in EXPORTERS:
        return value
    raise FieldError(
        "unknown export format",
        expected=f"one of {', '.join(EXPORTERS)}",
        got=shortened(value),
        remedy=did_you_mean(value, EXPORTERS, "choose one of these formats", also=ELSEWHERE),
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

    class TransferFunctionConfig(BaseModel):
        """Those of :class:`sysid.estimation.TransferFunctionTraining`."""

    class StateSpaceConfig(BaseModel):
        """Those of :class:`sysid.estimation.StateSpaceTraining`."""

    class PolynomialConfig(BaseModel):
        """Those of :class:`sysid.estimation.PolynomialTraining`."""

    class JointConfig(BaseModel):
        """Options of a cascade's training, field by field those of :class:`sysid.estimation.JointTraining`."""

else:

    class _TrainingWords(Words):
        OLD, OLD_VALUES = TRAINING, TRAINING_VALUES

    class _JointWords(Words):
        OLD = JOINT_TRAINING

    # The fields are read off the dataclass: an option added to the training appears in the YAML by itself.
    TrainingConfig = create_model("TrainingConfig", __base__=_TrainingWords, **_fields_of(Training))
    TransferFunctionConfig = create_model(
        "TransferFunctionConfig", __config__=STRICT, **_fields_of(TransferFunctionTraining)
    )
    StateSpaceConfig = create_model("StateSpaceConfig", __config__=STRICT, **_fields_of(StateSpaceTraining))
    PolynomialConfig = create_model("PolynomialConfig", __config__=STRICT, **_fields_of(PolynomialTraining))
    JointConfig = create_model("JointConfig", __base__=_JointWords, **_fields_of(JointTraining))

OptionsConfig = TrainingConfig | TransferFunctionConfig | StateSpaceConfig | PolynomialConfig
"""Options that some structure takes, as the YAML has them."""

_OPTIONS: dict[type, type[BaseModel]] = {
    Training: TrainingConfig,
    TransferFunctionTraining: TransferFunctionConfig,
    StateSpaceTraining: StateSpaceConfig,
    PolynomialTraining: PolynomialConfig,
}


def options_config(structure: AbstractStructure, value: object) -> Any:
    """The options of a structure's training, checked by name, type and whether they apply to it.

    Args:
        structure: What is to be fitted.
        value: Options by name, or such options that are read already; ``None`` for none.

    Returns:
        The options; ``None`` for none.

    Raises:
        FieldError: If the structure takes none, has no such option, or one does not apply to it.
    """
    if value is None:
        return None
    if isinstance(value, BaseModel):
        value = given_options(value)
    if not isinstance(value, Dict):
        raise FieldError(
            "not options of a training", expected="options by name", got=shortened(value), remedy="write {name: value}"
        )
    row = estimator_of(structure)
    if row.training is None:
        raise as_field_error(row.takes_none(value))
    config = options_of(row)
    named: Dict[str, Any] = with_new_words(value, getattr(config, "OLD", {}))
    for name in named:
        if name not in config.model_fields:
            otherwise = f"remove it: {row.name} has no such option"
            raise as_field_error(ConfigError.unknown(f"unknown field {name!r}", name, config.model_fields, otherwise))
    checked = config.model_validate(named)
    try:
        row.options(given_options(checked), seed=0)
    except ConfigError as error:
        raise as_field_error(error) from error
    return checked


def options_of(row: Estimator) -> type[BaseModel]:
    """The options of an estimator as the YAML has them.

    Args:
        row: Its row, of one that takes options.

    Returns:
        The pydantic model.
    """
    return _OPTIONS[cast("type", row.training)]


def given_options(config: BaseModel | None) -> dict[str, Any] | None:
    """The options that the YAML names, without the defaults.

    Args:
        config: The options as read.

    Returns:
        Options by name; ``None`` for none.
    """
    return None if config is None else {name: getattr(config, name) for name in config.model_fields_set}
