"""From fitted models to a brake: which way they plug into a train follows from the channels that they speak of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sysid.airbrake.consist import Consist
from sysid.errors import ConfigError
from sysid.models import AbstractModel
from sysid.rail.brake import AbstractBrake
from sysid.rail.judge import MakeBrake
from sysid.rail.surrogate import COMMAND, CYLINDER, PIPE, SPEED, TAIL_VENT, Stage, SurrogateBrake, ValveSurrogateBrake


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """One fitted model of a brake.

    Args:
        model: The model.
        node: Of the valve that it was fitted at; ``None`` for one that stands at every car.
    """

    model: AbstractModel
    node: int | None = None


def placed(parts: Sequence[Part], consist: Consist) -> Stage:
    """Models of one mapping, each at the cars that are nearest to its own.

    Args:
        parts: At least one; several need a node each.
        consist: The train.

    Returns:
        One model for all, or one per car.

    Raises:
        ConfigError: If several models of one mapping do not say where they stand, or differ in their structure.
    """
    if len(parts) == 1:
        return Stage(models=(parts[0].model,))
    nodes = [part.node for part in parts if part.node is not None]
    if len(set(nodes)) < len(parts):
        raise ConfigError(
            f"several models give {parts[0].model.mapping.output}, and it is not said which car is whose",
            where=str(parts[0].model.mapping),
            expected="a node of its own for each",
            got=[part.node for part in parts],
            remedy="write options: {node: 3} beside each of them",
        )
    nearest = [min(parts, key=lambda part: abs((part.node or 0) - node)) for node in consist.valve_nodes]
    return Stage(models=tuple(part.model for part in nearest))


def ordered(parts: Sequence[Part]) -> list[list[Part]]:
    """Models by what they give, in an order in which each has its inputs.

    Args:
        parts: In any order.

    Returns:
        Groups of one mapping.

    Raises:
        ConfigError: If models wait for each other, or two mappings give one channel.
    """
    groups: dict[str, list[Part]] = {}
    for part in parts:
        groups.setdefault(part.model.mapping.output, []).append(part)
    for output, group in groups.items():
        if len({str(part.model.mapping) for part in group}) > 1:
            raise ConfigError(
                f"two mappings give {output}",
                where="parts",
                expected="one mapping for each output",
                got=", ".join(str(part.model.mapping) for part in group),
            )
    done: list[list[Part]] = []
    given: set[str] = set()
    while groups:
        free = [out for out, group in groups.items() if not (set(group[0].model.mapping.inputs) & set(groups)) - given]
        if not free:
            raise ConfigError(
                "the models wait for each other",
                where="parts",
                expected="an order in which each has its inputs",
                got=", ".join(str(group[0].model.mapping) for group in groups.values()),
                remedy="plug a loop in as one model of its own",
            )
        for output in free:
            done.append(groups.pop(output))
            given.add(output)
    return done


def brake_of(parts: Sequence[Part], consist: Consist) -> MakeBrake:
    """How to make a brake of fitted models.

    Models that begin at the handle (``STP``) are a brake of their own at every car. Models that begin at the pipe stand
    on the reference's pipe, each with the pressures of its car.

    Args:
        parts: The models.
        consist: The train.

    Returns:
        Makes fresh brakes.

    Raises:
        ConfigError: If the models do not add up to a brake.
    """
    stages = [placed(group, consist) for group in ordered(parts)]
    outputs = [stage.models[0].mapping.output for stage in stages]
    if CYLINDER in outputs:
        # What does not lead to the cylinder comes before it.
        stages.append(stages.pop(outputs.index(CYLINDER)))
    inputs = {name for stage in stages for name in stage.models[0].mapping.inputs}
    alone = bool(inputs & {COMMAND, TAIL_VENT, SPEED}) or PIPE in outputs

    def make() -> AbstractBrake:
        if alone:
            return SurrogateBrake(stages=stages, consist=consist)
        return ValveSurrogateBrake(stages=stages, consist=consist)

    make()  # What does not fit is told before anything is run.
    return make
