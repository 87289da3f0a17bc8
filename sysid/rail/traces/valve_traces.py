"""Generator of traces of single valves anywhere in a train: the reference physics, a node for each case."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sysid.airbrake import generate as airbrake
from sysid.errors import ConfigError
from sysid.traces import Channel, Trace


def generate(
    *,
    case: str,
    recipe: Mapping[str, Any],
    options: Mapping[str, Any],
    channels: tuple[Channel, ...],
    sample_time: float,
) -> Trace:
    """Simulate one case of a data set whose cases are valves of one train.

    A model that is to stand at every car has to have seen the front, the middle and the end of a train: the pipe falls
    as a step here and as a slow curve there.

    Args:
        case: Its name.
        recipe: As :func:`sysid.airbrake.generate.generate` takes it, with the valve's ``node`` beside it.
        options: As there, without ``node``.
        channels: Channels wanted, in their units.
        sample_time: Seconds between samples.

    Returns:
        The trace.

    Raises:
        ConfigError: If recipe or options cannot be used, or the train has no valve at the node.

    Example:
        >>> from sysid.units import Reference
        >>> cylinder = Channel(name="BC", unit="psi", reference=Reference.GAUGE)
        >>> recipe = {"command": [[0, 90], [2, 64.2], [12, 64.2]], "node": 5}
        >>> trace = generate(
        ...     case="rear", recipe=recipe, options={"pairs": 2}, channels=(cylinder,), sample_time=0.1
        ... )
        >>> bool(trace["BC"][-1] > 10.0)
        True
    """
    if "node" not in recipe or "node" in options:
        raise ConfigError(
            "the valve is not named",
            where=f"the recipe of case {case}",
            expected="node in every recipe, and in no options",
            got=f"recipe: {', '.join(recipe)}; options: {', '.join(options)}",
            remedy="write node: 3 for the first valve, and every second number up to the train's last vehicle",
        )
    rest = {name: value for name, value in recipe.items() if name != "node"}
    return airbrake.generate(
        case=case,
        recipe=rest,
        options={**options, "node": recipe["node"]},
        channels=channels,
        sample_time=sample_time,
    )
