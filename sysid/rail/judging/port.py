"""From fitted models to a brake: which way they plug into a train follows from the channels that they speak of."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, field

from sysid.airbrake.consist import Consist
from sysid.airbrake.variant import USUAL, Variant
from sysid.errors import ConfigError
from sysid.models import AbstractModel, Cascade, Interpolation, Mapping
from sysid.rail.dynamics.brake import AbstractBrake
from sysid.rail.dynamics.cascade_brake import CascadeBrake, LineBrake
from sysid.rail.dynamics.known_brake import KnownBrake
from sysid.rail.dynamics.surrogate import (
    COMMAND,
    CYLINDER,
    PIPE,
    SPEED,
    TAIL_VENT,
    Stage,
    SurrogateBrake,
    ValveSurrogateBrake,
)
from sysid.rail.judging.judge import MakeBrake


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """One fitted model of a brake, or a whole cascade.

    Args:
        model: The model.
        node: Of the valve that it was fitted at; ``None`` for one that stands at every car.
        everywhere: Whether a whole from the handle on stands at every car though it was made for one: its pressures are
            those of one place, and a train of many has others everywhere else.
        ranges: Least and greatest value that each of its inputs has in the traces that it was fitted on, where that is
            known: a brake that is driven beyond those of the handle or the pipe is refused.
        beyond: Whether it is run there all the same.
    """

    model: AbstractModel | Cascade | Interpolation
    node: int | None = None
    everywhere: bool = False
    ranges: Dict[str, tuple[float, float]] = field(default_factory=dict)
    beyond: bool = False


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
    singles = (part.model.single for part in nearest(parts, consist) if not isinstance(part.model, Interpolation))
    return Stage(models=tuple(model for model in singles if model is not None))


def nearest(parts: Sequence[Part], consist: Consist) -> list[Part]:
    """Which part stands at each car: the one that was fitted nearest to it.

    Args:
        parts: At least one; several need a node each.
        consist: The train.

    Returns:
        The one part, or one per valve.

    Raises:
        ConfigError: If it is not said which car is whose.
    """
    if len(parts) == 1:
        return list(parts)
    nodes = [part.node for part in parts if part.node is not None]
    if len(set(nodes)) < len(parts):
        raise ConfigError(
            "several models give one channel, and it is not said which car is whose",
            where="parts",
            expected="a node of its own for each",
            got=[part.node for part in parts],
            remedy="write options: {node: 3} beside each of them",
        )
    return [min(parts, key=lambda part: abs((part.node or 0) - node)) for node in consist.valve_nodes]


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
        groups.setdefault(_mapping(part).output, []).append(part)
    for output, group in groups.items():
        if len({str(_mapping(part)) for part in group}) > 1:
            raise ConfigError(
                f"two mappings give {output}",
                where="parts",
                expected="one mapping for each output",
                got=", ".join(str(_mapping(part)) for part in group),
            )
    done: list[list[Part]] = []
    given: set[str] = set()
    while groups:
        free = [out for out, group in groups.items() if not (set(_mapping(group[0]).inputs) & set(groups)) - given]
        if not free:
            raise ConfigError(
                "the models wait for each other",
                where="parts",
                expected="an order in which each has its inputs",
                got=", ".join(str(_mapping(group[0])) for group in groups.values()),
                remedy="plug a loop in as one model of its own",
            )
        for output in free:
            done.append(groups.pop(output))
            given.add(output)
    return done


def brake_of(parts: Sequence[Part], consist: Consist, variant: Variant = USUAL) -> MakeBrake:
    """How to make a brake of fitted models.

    Models that begin at the handle (``STP``) are a brake of their own at every car. A cascade that does was made for
    one place: it stands at a train of one valve, or with others of other nodes, or where it is said that it is meant
    everywhere. A line gives every car its own pressures. Models that begin at the pipe stand on the reference's pipe,
    each with the pressures of its car; so do the members of a cascade that begins there, if it holds none of them by
    limits.

    Args:
        parts: The models.
        consist: The train.
        variant: The reading of the reference that models from the pipe on stand on.

    Returns:
        Makes fresh brakes.

    Raises:
        ConfigError: If the models do not add up to a brake.
    """
    make, ranges = _brake_of(parts, consist, variant), _fitted(parts)
    return (lambda: KnownBrake(make(), ranges)) if ranges else make


def _fitted(parts: Sequence[Part]) -> dict[str, tuple[float, float]]:
    """Where all parts were fitted that read a channel."""
    known: dict[str, list[tuple[float, float]]] = {}
    for part in parts:
        for name, found in part.ranges.items() if not part.beyond else ():
            known.setdefault(name, []).append(found)
    return {name: (max(low for low, _ in all_), min(high for _, high in all_)) for name, all_ in known.items()}


def _brake_of(parts: Sequence[Part], consist: Consist, variant: Variant) -> MakeBrake:
    """A brake that answers to anything."""
    lines = [part.model for part in parts if isinstance(part.model, Interpolation)]
    if lines:
        return _of_line(lines, len(parts), consist)
    wholes = [part.model for part in parts if isinstance(part.model, Cascade)]
    if wholes and all(COMMAND in whole.inputs for whole in wholes):
        return _of_cascades(parts, consist)
    parts = [member for part in parts for member in _members(part)]
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
        return ValveSurrogateBrake(stages=stages, consist=consist, variant=variant)

    make()  # What does not fit is told before anything is run.
    return make


def _mapping(part: Part) -> Mapping:
    model = None if isinstance(part.model, Interpolation) else part.model.single
    if model is None:
        raise ConfigError(
            "a cascade has no single mapping",
            where="parts",
            expected="models, or cascades alone",
            got=f"{', '.join(part.model.inputs)} -> {', '.join(part.model.outputs)} among other parts",
        )
    return model.mapping


def _of_cascades(parts: Sequence[Part], consist: Consist) -> MakeBrake:
    """Cascades that begin at the handle, each at the cars nearest to its own."""
    if len(parts) == 1 and consist.pairs > 1 and not parts[0].everywhere:
        raise ConfigError(
            "a whole that was made for one place is asked for every car of a train",
            where="parts",
            expected=f"a line, or a whole for each of several places, on {consist.pairs} brake valves",
            got=f"one whole, {', '.join(parts[0].model.inputs)} -> {CYLINDER}",
            remedy="give the line of an assembly with interpolation (line: reports/whole-train), several wholes with a "
            "node each, or options: {everywhere: true} if the front cylinder is meant at every car",
        )
    chosen = [part.model for part in nearest(parts, consist)]
    cascades = [model for model in chosen if isinstance(model, Cascade)]
    if len(cascades) < len(chosen):
        raise ConfigError(
            "a cascade from the handle stands beside single models",
            where="parts",
            expected="cascades alone, each with its node",
            got=", ".join(type(part.model).__name__ for part in parts),
        )

    def make() -> AbstractBrake:
        return CascadeBrake(cascades=cascades, consist=consist)

    make()  # What does not fit is told before anything is run.
    return make


def _of_line(lines: Sequence[Interpolation], count: int, consist: Consist) -> MakeBrake:
    """A line from the handle on: every valve at its own position."""
    if len(lines) != count or count != 1:
        raise ConfigError(
            "a line stands beside other models",
            where="parts",
            expected="one line, which gives every car's pressures",
            got=f"{len(lines)} of {count} parts",
        )

    def make() -> AbstractBrake:
        return LineBrake(line=lines[0], consist=consist)

    make()  # What does not fit is told before anything is run.
    return make


def _members(part: Part) -> list[Part]:
    """The part itself, or the members of a cascade that stands on the reference's pipe."""
    if not isinstance(part.model, Cascade):
        return [part]
    members = [model for model in part.model.models if len(model.mapping.outputs) == 1]
    if part.model.limits or len(members) < len(part.model.models):
        raise ConfigError(
            "a cascade from the pipe on cannot hold outputs by limits, nor have models of several outputs",
            where="parts",
            expected="models of one output each, without limits",
            got=part.model.label,
            remedy="judge the cascade from the handle on, or its models as parts",
        )
    return [Part(model=model, node=part.node) for model in members]
