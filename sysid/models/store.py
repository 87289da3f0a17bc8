"""Models from data: the one table that says which kind of structure belongs to which class."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from typing import Any

from sysid.errors import ConfigError, shortened
from sysid.models.blocks.built_model import BUILT, BuiltModel
from sysid.models.cascades.cascade import Cascade
from sysid.models.contract.base import AbstractModel
from sysid.models.grey_box.grey_box import GreyBox, VectorGreyBox
from sysid.models.grey_box.grey_box_model import GreyBoxModel, VectorGreyBoxModel
from sysid.models.lagged.cascade_program import Limit
from sysid.models.linear.arx import ARX, ARXModel
from sysid.models.linear.linear_state_space import (
    LinearStateSpace,
    LinearStateSpaceModel,
    VectorStateSpace,
    VectorStateSpaceModel,
)
from sysid.models.linear.polynomial import PolynomialModel
from sysid.models.linear.polynomial_orders import POLYNOMIALS
from sysid.models.linear.transfer_function import TransferFunction, TransferFunctionModel
from sysid.models.linear.vector_arx import VectorARXModel
from sysid.models.linear.vector_arx_orders import VectorARX
from sysid.models.networks.narx import NARXModel, VectorNARXModel
from sysid.models.networks.narx_structures import NARX, VectorNARX
from sysid.models.networks.neural_state_space import (
    NeuralStateSpace,
    NeuralStateSpaceModel,
    VectorNeuralStateSpace,
    VectorNeuralStateSpaceModel,
)
from sysid.models.orders.structure import AbstractStructure
from sysid.models.process.fitted_process import FittedProcess
from sysid.models.process.structure import ProcessModel

_PAIRS: tuple[tuple[type[AbstractStructure], type[AbstractModel]], ...] = (
    (ARX, ARXModel),
    (NARX, NARXModel),
    (NeuralStateSpace, NeuralStateSpaceModel),
    (VectorNeuralStateSpace, VectorNeuralStateSpaceModel),
    (TransferFunction, TransferFunctionModel),
    (ProcessModel, FittedProcess),
    (GreyBox, GreyBoxModel),
    (VectorGreyBox, VectorGreyBoxModel),
    (LinearStateSpace, LinearStateSpaceModel),
    (VectorStateSpace, VectorStateSpaceModel),
    *((structure, PolynomialModel) for structure in POLYNOMIALS.values()),
    (VectorARX, VectorARXModel),
    (VectorNARX, VectorNARXModel),
    *((structure, BuiltModel) for structure in BUILT),
)

_KINDS = {structure.kind: (structure, model) for structure, model in _PAIRS}
"""By kind the structure and its models."""


def _check_kind(kind: object) -> str:
    if not isinstance(kind, str) or kind not in _KINDS:
        raise ConfigError(
            "unknown kind of model",
            expected=f"one of {', '.join(_KINDS)}",
            got=shortened(kind),
            remedy="correct the kind, or use the version of the workbench that wrote it",
        )
    return kind


def model_from_dict(fields: Dict[str, Any]) -> AbstractModel:
    """Build the model that some model's ``to_dict`` wrote.

    Args:
        fields: What it wrote.

    Returns:
        The model.

    Raises:
        ConfigError: If the kind is unknown or a field is missing.
    """
    kind = _check_kind(fields.get("structure", {}).get("kind"))
    try:
        return _KINDS[kind][1].from_dict(fields, structure_from_dict(fields["structure"]))
    except KeyError as error:
        raise ConfigError(
            f"the stored {kind} model lacks the field {error}", remedy="store the model again; this file is incomplete"
        ) from error


def structure_from_dict(fields: Dict[str, Any]) -> AbstractStructure:
    """Build a structure from its fields.

    Args:
        fields: ``kind`` and the structure's own fields.

    Returns:
        The structure.

    Raises:
        ConfigError: If the kind is unknown, or the fields are not the structure's.
    """
    kind = _check_kind(fields.get("kind"))
    try:
        return _KINDS[kind][0](**{key: value for key, value in fields.items() if key != "kind"})
    except TypeError as error:
        raise ConfigError(
            f"not the fields of the structure {kind}",
            expected=", ".join(_KINDS[kind][0].__dataclass_fields__),  # type: ignore[attr-defined]  # all are dataclasses
            got=", ".join(fields),
            remedy="correct the field's name",
        ) from error


def cascade_from_dict(fields: Dict[str, Any]) -> Cascade:
    """Build the cascade that :meth:`Cascade.to_dict` wrote.

    Args:
        fields: What it wrote.

    Returns:
        The cascade.

    Raises:
        ConfigError: If it is no cascade, or a member's kind is unknown, or a field is missing.
    """
    kind = fields.get("structure", {}).get("kind")
    if kind != Cascade.kind or "members" not in fields:
        raise ConfigError(
            "not a stored cascade",
            expected=f"the kind {Cascade.kind} and its members",
            got=f"kind {kind!r} with the fields {', '.join(fields)}",
            remedy="store the cascade again, or use model_from_dict for a single model",
        )
    return Cascade(
        models=tuple(model_from_dict(member) for member in fields["members"]),
        rest=fields.get("rest", {}),
        limits={name: Limit(**limit) for name, limit in fields.get("limits", {}).items()},
    )
