"""Free parameters of what is fixed: which a whole has, where each acts, and their values in a trained whole."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from collections.abc import Mapping as Dict
from dataclasses import replace

import numpy as np

from sysid.composite.fixed.member import FixedMember, Standing
from sysid.errors import ConfigError
from sysid.estimation.parameters.named import check_alike
from sysid.models import Cascade, GreyBoxModel
from sysid.models.grey_box.declared import Parameter


def declared(fixed: Sequence[FixedMember], more: Iterable[Parameter] = ()) -> dict[str, Parameter]:
    """The parameters of some fixed submodels by name, known ones too.

    Args:
        fixed: The submodels.
        more: Further ones.

    Returns:
        Each once.

    Raises:
        ConfigError: If one of a name has other terms than another.
    """
    found: dict[str, Parameter] = {}
    for one in (*more, *(one for member in fixed for one in member.named)):
        check_alike(one, found.setdefault(one.name, one))
    return found


def check_names(parameters: Collection[str], standing: Sequence[Standing]) -> None:
    """Refuse parameters that are called as channels are.

    Args:
        parameters: Their names.
        standing: All members and fixed submodels.

    Raises:
        ConfigError: If one is.
    """
    channels = {one.channel(name, there) for one in standing for there in one.instances
                for name in (*one.mapping.inputs, one.output)}  # fmt: skip
    if both := sorted(channels & set(parameters)):
        raise ConfigError(
            f"{both[0]} is a parameter and a channel",
            where=f"parameters, {both[0]}",
            expected="a name that no member reads or writes",
            got=both[0],
            remedy="give the parameter another name",
        )


def trained_equations(fixed: Sequence[FixedMember], named: Collection[str] | None) -> list[FixedMember]:
    """The fixed submodels whose parameters a round trains.

    Args:
        fixed: The submodels.
        named: Outputs of members and submodels that it trains; ``None`` for all.

    Returns:
        Those that are named, and those that share a parameter with one of them.
    """
    free = [one for one in fixed if one.free]
    if named is None:
        return free
    moved = {parameter.name for one in free if one.output in named for parameter in one.free}
    while more := {p.name for one in free for p in one.free if moved & {q.name for q in one.free}} - moved:
        moved |= more
    return [one for one in free if moved & {parameter.name for parameter in one.free}]


def values_in(whole: Cascade) -> dict[str, float]:
    """The values of what was estimated in the equations of a whole.

    Args:
        whole: The whole, of a composite.

    Returns:
        By name, each in its unit.
    """
    return {
        one.name: model.parameters[one.name]
        for model in whole.models
        if isinstance(model, GreyBoxModel)
        for one in model.grey.free
    }


def with_values(whole: Cascade, values: Dict[str, float]) -> Cascade:
    """A whole with other values of its parameters, wherever they act.

    Args:
        whole: The whole, of a composite.
        values: By name, in their units; a parameter that is not among them keeps its own.

    Returns:
        The whole.
    """
    for model in whole.models:
        if isinstance(model, GreyBoxModel) and {one.name for one in model.grey.free} & set(values):
            own = model.parameters | dict(values)
            theta = np.array([own[one.name] for one in model.grey.free])
            whole = whole.with_member(replace(model, theta=theta))
    return whole
