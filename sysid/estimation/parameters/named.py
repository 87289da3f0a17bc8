"""Parameters with a name as they are trained: once where all share one, once for each case where they differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sysid.errors import ConfigError
from sysid.models.grey_box.declared import Parameter
from sysid.models.grey_box.grey_box import GreyBox

FLAT_ALPHA = 1e-10
"""Precision of what nothing is known of, in scaled numbers: a hundred thousand times its scale is ordinary."""


def precision_of(parameter: Parameter) -> float:
    """What is known of a parameter before the data, in scaled numbers."""
    return FLAT_ALPHA if parameter.prior is None else (parameter.scale / parameter.prior) ** 2


def check_alike(one: Parameter, other: Parameter) -> None:
    """Refuse a parameter that has other terms than one of its name.

    Args:
        one: The parameter.
        other: The one that was declared before.

    Raises:
        ConfigError: If they differ.
    """
    if one != other:
        raise ConfigError(
            f"the parameter {one.name} is declared in two ways",
            where=f"parameters, {one.name}",
            expected=f"{other.to_dict()} everywhere: one parameter has one name in the whole",
            got=str(one.to_dict()),
            remedy="declare it alike where it is the same, or give the other another name",
        )


@dataclass(frozen=True, kw_only=True)
class Named:
    """One value that is trained.

    Args:
        parameter: What is known of it.
        place: Where it stands in what is trained.
        case: The case whose value it is, or the output whose equation has one of its own; empty where all share one.
    """

    parameter: Parameter
    place: int
    case: str = ""

    @property
    def name(self) -> str:
        """What people call it: ``mass``, or ``mass of run1``."""
        return f"{self.parameter.name} of {self.case}" if self.case else self.parameter.name

    @property
    def label(self) -> str:
        """The same with its unit."""
        return f"{self.name} [{self.parameter.unit}]" if self.parameter.unit else self.name


def named_of(grey: GreyBox, cases: Sequence[str], n_weights: int) -> tuple[Named, ...]:
    """The parameters of a grey box as they are trained.

    Args:
        grey: The grey box.
        cases: Names of the cases; none where nothing differs by case.
        n_weights: Weights of its networks, which stand behind the parameters of the first case.

    Returns:
        Those of the first case among those that are shared, in the order of the structure; then those of the second
        case, of the third, and so on.
    """
    first = cases[0] if cases else ""
    found = [
        Named(parameter=one, place=i, case=first if one.per else "") for i, one in enumerate(grey.free)
    ]  # fmt: skip
    at = len(grey.free) + n_weights
    for case in cases[1:]:
        for one in grey.by_case:
            found.append(Named(parameter=one, place=at, case=case))
            at += 1
    return tuple(found)
