"""Wiring: which model reads what from whom, and in which order they run. Cascades and exporters share this notion."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from itertools import pairwise

from sysid.errors import ConfigError
from sysid.models.channels.ends import Ends
from sysid.models.contract.base import AbstractModel

Member = AbstractModel
"""What can be wired: a model of one output, or of several."""


@dataclass(frozen=True, kw_only=True)
class Wiring:
    """Models wired by the names of their channels.

    Models may read each other in a circle as long as the circle passes through the past somewhere: within a sample each
    one must find what it reads at that sample computed.

    Args:
        inputs: Channels that no model writes: what goes into the whole, in the order in which they are first read.
        outputs: Channels that the models write, in the order in which they are computed.
        order: Positions of the models in the order in which they run. Models that were given in an order that can run
            keep it.
        units: Unit of every channel.

    Example:
        >>> from sysid.models import ARX, ARXModel, Mapping
        >>> def model(text: str) -> ARXModel:
        ...     mapping = Mapping.parse(text)
        ...     n = len(mapping.inputs)
        ...     return ARXModel(orders=ARX(na=1, nb=(1,) * n, nk=(0,) * n), coefficients=[0.5] * (n + 1), intercept=0.0,
        ...         mapping=mapping, sample_time=0.1, input_units=("psi",) * n, output_unit="psi", rest_output=0.0)
        >>> wiring = Wiring.of([model("BP+AR -> BC"), model("BP -> AR"), model("STP -> BP")])
        >>> wiring.inputs, wiring.outputs, wiring.order
        (('STP',), ('BP', 'AR', 'BC'), (2, 1, 0))
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    order: tuple[int, ...]
    units: dict[str, str]

    @classmethod
    def of(cls, models: Sequence[Member], limits: Dict[str, Collection[str]] | None = None) -> Wiring:
        """Wire models.

        Args:
            models: In any order.
            limits: Channels that limit an output at the same sample, by output: they are computed before it.

        Returns:
            The wiring.

        Raises:
            ConfigError: If there is no model, a channel is computed twice, the models read each other in a circle
                within one sample, or sample times or units differ.
        """
        ends = [Ends.of(model) for model in models]
        units, faults = _units(ends)
        computed = [name for end in ends for name in end.outputs]
        faults += [f"{name} is computed twice" for name in sorted(set(computed)) if computed.count(name) > 1]
        faults += [] if models else ["there is no model"]
        if len({model.sample_time for model in models}) > 1:
            faults.append("the sample times differ")
        order = () if faults else _order(ends, limits or {}, faults)
        if faults:
            raise ConfigError(
                "the models cannot be wired",
                expected="models that do not read each other in a circle within one sample, each channel computed by "
                "one of them, with one sample time, and one unit for each channel",
                got="; ".join(dict.fromkeys(faults)),
                remedy="give one model for each channel; in a circle let one model read from lag 1 on (input_delays), "
                "or fit the channels as the outputs of one model (VectorNARX)",
            )
        return cls(
            inputs=tuple(dict.fromkeys(n for i in order for n in ends[i].inputs if n not in computed)),
            outputs=tuple(name for i in order for name in ends[i].outputs),
            order=order,
            units=units,
        )

    @property
    def channels(self) -> tuple[str, ...]:
        """Inputs, then outputs."""
        return (*self.inputs, *self.outputs)

    def feeds_back(self, ends: Ends) -> bool:
        """Whether a model reads what is computed after it, and so from the samples before.

        Args:
            ends: Its ends.

        Returns:
            True if it does.
        """
        before = self.outputs.index(ends.outputs[0])
        return any(name in self.outputs[before:] and name not in ends.outputs for name in ends.inputs)


def _units(ends: Sequence[Ends]) -> tuple[dict[str, str], list[str]]:
    units: dict[str, str] = {}
    faults = []
    for end in ends:
        for name, unit in zip((*end.inputs, *end.outputs), (*end.input_units, *end.output_units), strict=True):
            if units.setdefault(name, unit) != unit:
                faults.append(f"{name} is in {units[name]} and in {unit}")
    return units, faults


def _order(ends: Sequence[Ends], limits: Dict[str, Collection[str]], faults: list[str]) -> tuple[int, ...]:
    """First the first model, in the order given, whose inputs and limits of now are known; then again, to the last."""
    owner = {name: i for i, end in enumerate(ends) for name in end.outputs}
    # Outputs of one model come in their own order, and one may limit the next.
    held_by = [{one for name in end.outputs for one in limits.get(name, ())} - {*end.outputs} for end in ends]
    reads = [{owner[name] for name in end.direct | held_by[i] if name in owner} for i, end in enumerate(ends)]
    order: list[int] = []
    while len(order) < len(ends):
        ready = [i for i in range(len(ends)) if i not in order and reads[i] <= set(order)]
        if not ready:
            faults.append(_circle(ends, reads, order))
            return ()
        order.append(ready[0])
    return tuple(order)


def _circle(ends: Sequence[Ends], reads: Sequence[set[int]], order: Sequence[int]) -> str:
    """Name one circle: among models that wait, following what each waits for must come back."""
    walk = [next(i for i in range(len(ends)) if i not in order)]
    while walk.count(walk[-1]) == 1:
        walk.append(min(reads[walk[-1]] - set(order)))
    circle = walk[walk.index(walk[-1]) :][::-1]
    parts = [f"{'+'.join(ends[b].outputs)} needs {'+'.join(ends[a].outputs)}" for a, b in pairwise(circle)]
    return f"a circle: {', '.join(parts)}"
