"""What the members, levels and limits of a cascade must be."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from typing import Any

from sysid.errors import ChannelError, ConfigError
from sysid.models.cascades.cascade_run import Level
from sysid.models.cascades.wiring import Member, Wiring
from sysid.models.channels.ends import Ends
from sysid.models.channels.rest_levels import leaders
from sysid.models.contract.column_recursion import ColumnRecursion
from sysid.models.lagged.cascade_program import Limit


def own_limits(models: Sequence[Member]) -> dict[str, Limit]:
    """Limits that members have of themselves, by channel."""
    return {name: limit for model in models for name, limit in model.limits.items()}


def check_circles(models: Sequence[Member], wiring: Wiring) -> None:
    """Members in a circle must run sample by sample, which a model with a state of its own does not."""
    alone = [model for model in models if ColumnRecursion.of(model) is None]
    if alone and any(wiring.feeds_back(Ends.of(model)) for model in models):
        raise ConfigError(
            "the models cannot be wired",
            expected="models that read lagged samples (ARX, NARX) where some read each other in a circle",
            got=", ".join(f"{model.mapping} {model.label}" for model in alone),
            remedy="fit it as ARX or NARX, or open the circle",
        )


def check_levels_and_limits(rest: Dict[str, Level], limits: Dict[str, Limit], wiring: Wiring) -> None:
    """Levels at rest are of channels that there are, and limits of outputs that are computed after what they read."""
    check_names("rest", rest, wiring.channels)
    check_names("limits", limits, wiring.outputs)
    for name, level in rest.items():
        if isinstance(level, str):
            check_names(f"rest of {name}", [level], wiring.channels if name in wiring.outputs else wiring.inputs)
        leaders(name, rest, wiring.outputs)  # which end
    for i, name in enumerate(wiring.outputs):
        read = limits.get(name, Limit()).channels
        check_names(f"limits of {name}", read, (*wiring.inputs, *wiring.outputs[:i]))


def check_names(where: str, names: Any, known: Sequence[str]) -> None:
    """Refuse names that are not among those that are known."""
    strangers = [name for name in names if name not in known]
    if strangers:
        raise ChannelError(strangers, known, where=f"{where} of the cascade" if where in {"rest", "limits"} else where)
