"""What stands in a composite model in one instance or several, and what of it is declared and not fitted."""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field
from typing import Any

from sysid.composite.fixed.expressions import moving
from sysid.equations.functions import OWN
from sysid.equations.syntax import Call, Delayed, nodes_of
from sysid.equations.system import written_name
from sysid.errors import ConfigError
from sysid.models import GreyBox, Mapping
from sysid.models.grey_box.declared import Parameter, parameters_from
from sysid.models.grey_box.grey_box import Table, lowered
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True)
class Standing:
    """What stands in one instance or in several.

    Args:
        mapping: Inputs and output, such as ``BP+AR -> BC``; in the first instance as they are.
        instances: Suffixes of the channel names, one for each instance: ``("", "10")`` makes one over ``BP -> AR`` and
            one over ``BP10 -> AR10``.
        shared: Inputs that have the same name in every instance.
    """

    mapping: Mapping
    instances: tuple[str, ...] = ("",)
    shared: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "instances", tuple(self.instances))
        object.__setattr__(self, "shared", tuple(self.shared))
        if not self.instances:
            raise ConfigError(
                f"{self.mapping} stands nowhere",
                where="instances",
                expected="a suffix for each instance; an empty one for the first",
                got="none",
                remedy='leave instances out: one instance, ("",)',
            )

    @property
    def output(self) -> str:
        """What it writes in its first instance, by which it is called."""
        return self.mapping.output

    def channel(self, name: str, instance: str) -> str:
        """Name of one of its channels in one of its instances.

        Args:
            name: The channel in the first instance.
            instance: The instance's suffix.

        Returns:
            The channel there.
        """
        return name if name in self.shared else f"{name}{instance}"

    @property
    def outputs(self) -> list[str]:
        """What it writes, instance after instance."""
        return [self.channel(self.output, instance) for instance in self.instances]


def parameters_of(given: Dict[str, Any] | tuple[Parameter, ...]) -> tuple[Parameter, ...]:
    """Parameters of what is fixed, from what people write.

    Args:
        given: By name a start, or ``{start:, low:, high:, prior:, fixed:, unit:}``.

    Returns:
        Them.

    Raises:
        ConfigError: If they cannot be; or if one is to have a value per case, which a whole knows nothing of.
    """
    found = parameters_from(given)
    for one in found:
        if one.per:
            raise ConfigError(
                f"{one.name} is to have a value per {one.per}",
                where=f"parameters, {one.name}",
                expected="one value: every trace of a whole is run with the same",
                got=f"per: {one.per}",
                remedy="leave per out, or make it a channel of the traces",
            )
    return found


@dataclass(frozen=True, kw_only=True)
class FixedMember(Standing):
    """A submodel that is declared and not fitted: an expression of its inputs, held between two bounds.

    A weighted sum has its weights in ``gains``, and runs as one; any other expression is an ``equation``.

    Args:
        equation: The expression, in the language of equations, which reads all inputs and remembers nothing else:
            ``"max(a, b[k-1])*c"``. Its output's own past is an input under another name.
        tables: By name the points of functions that it calls.
        parameters: What of it is estimated in rounds of training end to end: by name a start, or ``{start:, low:,
            high:, prior:, fixed:, unit:}``.
        gains: The weight of each input, in the output's unit per the input's, or its weights by lag (``{0: 2, 1: -1}``
            looks one sample ahead); under the output's own name the weight of its last value: 1 sums up, more is a
            relay with hysteresis.
        constant: What is added, in the output's unit.
        low: Least value; none by default.
        high: Greatest value; none by default.
        rest: Value at rest.
        unit: Of the output; a pure number by default.
        bounds: The channel that it is a limit of, whose unit it has then; none by default.

    Raises:
        ConfigError: If the gains, or what the equation reads, are not those of the inputs; if the equation cannot be
            read, or remembers; or if the bounds do not hold the rest.
    """

    gains: Dict[str, float | Dict[int, float]] = field(default_factory=dict)
    equation: str = ""
    tables: tuple[Table, ...] | Dict[str, Any] = ()
    parameters: tuple[Parameter, ...] | Dict[str, Any] = ()
    constant: float = 0.0
    low: float = -math.inf
    high: float = math.inf
    rest: float
    unit: str = "1"
    bounds: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "parameters", parameters_of(self.parameters))
        object.__setattr__(self, "tables", self.grey_box.tables if self.equation else tuple(self.tables))
        if self.equation:
            self._check_equation()
        else:
            self._check_gains()
        if not self.low <= self.rest <= self.high or self.low == self.high:
            raise ConfigError(
                f"the bounds of {self.output} do not hold its rest",
                where="low, high",
                expected="low at most rest, rest at most high, low below high",
                got=f"low {self.low:g}, rest {self.rest:g}, high {self.high:g}",
                remedy="correct the bounds",
            )

    def unit_in(self, like: Trace) -> str:
        """Its unit beside some channels.

        Args:
            like: A trace that has the channel that it limits.

        Returns:
            The unit.

        Raises:
            ChannelError: If the trace lacks that channel.
        """
        return like.channel(self.bounds).unit if self.bounds else self.unit

    @property
    def points(self) -> dict[str, tuple[tuple[float, float], ...]]:
        """By table its points."""
        return dict(self.tables)

    @property
    def grey_box(self) -> GreyBox:
        """The equation as a structure."""
        equations = f"{written_name(self.output)} = {self.equation}"
        return GreyBox(equations=equations, tables=self.tables, parameters=self.parameters)

    @property
    def named(self) -> tuple[Parameter, ...]:
        """The parameters."""
        return self.parameters  # type: ignore[return-value]  # brought into this form when it was made

    @property
    def free(self) -> tuple[Parameter, ...]:
        """What is estimated."""
        return tuple(one for one in self.named if not one.fixed)

    def _check_equation(self) -> None:
        system = self.grey_box.system
        lowered(self.grey_box, self.mapping.inputs, (self.output,), None)
        parts = [node for one in system.equations for node in nodes_of(one.right)]
        lost = any(isinstance(node, Delayed) and (node.seconds or node.name == self.output) for node in parts)
        remembers = any(isinstance(node, Call) and node.function in OWN for node in parts)
        for one in self.free:
            if not any(one.name in moving(equation.right) for equation in system.equations):
                raise ConfigError(
                    f"nothing moves with {one.name}, which only decides",
                    where=f"parameters, {one.name}",
                    expected="a parameter that the output moves with: an exact switch has no derivative",
                    got=self.equation,
                    remedy="let it act through a slope, as in relay(x, on=..., off=..., slope=20) or clamp(20*(x - "
                    "...), 0, 1)",
                )
        if lost or remembers or self.gains or self.constant or set(system.others) != set(self.mapping.inputs):
            raise ConfigError(
                f"the equation of {self.mapping} is none of these inputs",
                where="equation",
                expected=f"an expression of {', '.join(self.mapping.inputs)}, now or whole samples ago, that remembers "
                "nothing, and neither gains nor a constant beside it",
                got=self.equation,
                remedy="correct the mapping, or write it under equations: what is remembered is made a channel there",
            )

    def _check_gains(self) -> None:
        if set(self.gains) - {self.output} != set(self.mapping.inputs) or self.tables or self.parameters:
            raise ConfigError(
                f"the gains of {self.mapping} are not those of its inputs",
                where="gains",
                expected=f"one for each of {', '.join(self.mapping.inputs)}, with or without {self.output}",
                got=", ".join(self.gains) or "none",
                remedy="correct the gains or the mapping, or write an equation, which alone has tables and parameters",
            )
        own = self.gains.get(self.output, 0.0)
        if isinstance(own, Dict):
            raise ConfigError(
                f"{self.output} has weights by lag for its own past",
                where="gains",
                expected="one number, the weight of its last value",
                got=", ".join(f"{lag}: {weight:g}" for lag, weight in own.items()),
                remedy="write the weight of its last value",
            )
        for name in self.mapping.inputs:
            given = self.gains[name]
            if isinstance(given, Dict) and (not given or min(given) < 0):
                raise ConfigError(
                    f"the weights of {name} in {self.mapping} have no such lags",
                    where="gains",
                    expected="a weight for at least one lag, from 0 on",
                    got=", ".join(str(lag) for lag in given) or "none",
                    remedy="write a number for the newest sample alone, or lags from 0 on",
                )

    @property
    def weights(self) -> tuple[Dict[int, float], ...]:
        """For each input its weights by lag."""
        given = (self.gains[name] for name in self.mapping.inputs)
        return tuple(one if isinstance(one, Dict) else {0: one} for one in given)

    @property
    def memory(self) -> float:
        """The weight of its own last value."""
        own = self.gains.get(self.output, 0.0)
        return 0.0 if isinstance(own, Dict) else own
