"""From equations to programs: names become places, functions operations, and what remembers gets states of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from sysid.equations.functions import FUNCTIONS, LIMITS, OWN, operator
from sysid.equations.graph import (
    CONTINUOUS_STATE,
    DISCRETE_STATE,
    FIXED,
    FREE,
    INPUT,
    NORM,
    SHARE,
    STEP,
    WEIGHT,
)
from sysid.equations.implicit import MOST_STATES_IMPLICIT, implicit_slopes
from sysid.equations.lowered import ROSENBROCK, Lowered, Net, Terms
from sysid.equations.named_values import Names
from sysid.equations.nets import asked, check_weights, layer
from sysid.equations.slopes import slopes_of
from sysid.equations.syntax import Call, Delayed, Name, Node, Number, Operation, equation_error
from sysid.equations.system import System
from sysid.errors import ConfigError
from sysid.kernels import register_machine as machine


def lower(system: System, terms: Terms) -> Lowered:
    """Make programs of equations.

    Args:
        system: The equations.
        terms: What they are lowered for.

    Returns:
        The programs.

    Raises:
        ConfigError: With line and column, of what cannot be lowered.
    """
    work = _Lowering(system=system, terms=terms)
    right = {one.name: one.right for one in system.equations}
    for name in system.order:  # in this order none of them is gone into twice
        work.named(name, 0)
    rates = [work.value(right[name]) for name in system.continuous]
    for name in system.discrete:
        work.updates[work.state(name)] = work.value(right[name])
    outputs = [work.named(name, 0) for name in terms.outputs]
    work.finish_delays()
    ahead = any(terms.moving) and len(rates) > 0
    return work.programs(rates, work.slopes(work.between(rates) if ahead else rates), outputs, ahead=ahead)


@dataclass(kw_only=True)
class _Lowering(Names):
    nets: list[Net] = field(default_factory=list)
    norms: list[float] = field(default_factory=list)
    steep: dict[str, tuple[tuple[float, float], ...]] = field(default_factory=dict)
    """Tables that are slopes of others."""

    # Expressions

    def value(self, node: Node) -> int:
        """The value of an expression."""
        if isinstance(node, Number):
            return self.constant(node.value)
        if isinstance(node, Name):
            return self.named(node.name, node.at)
        if isinstance(node, Delayed):
            return self.delayed(node)
        if isinstance(node, Call):
            return self._call(node)
        assert isinstance(node, Operation)  # noqa: S101 - there is no other node
        return self._operation(node)

    def _operation(self, node: Operation) -> int:
        if len(node.operands) == 1:
            inside = self.value(node.operands[0])
            if node.operator == "not":
                return self.apply(machine.SUB, self.constant(1.0), inside)
            return self.apply(machine.NEG, inside)
        # A sum of a thousand terms leans to the left: it is walked down, not gone into.
        spine: list[Operation] = []
        left: Node = node
        while isinstance(left, Operation) and len(left.operands) > 1:
            spine.append(left)
            left = left.operands[0]
        found = self.value(left)
        for one in reversed(spine):
            found = operator(self, one.operator, found, self.value(one.operands[1]))
        return found

    def _call(self, node: Call) -> int:
        name = node.function
        if name in OWN:
            return {"relay": self._relay, "latch": self._latch, "hold": self._hold, "net": self._net,
                    "delay": self._delay}[name](node)  # fmt: skip
        arguments = [self.value(one) for one in node.parts]
        if name in self.terms.tables:
            return self.apply(machine.TABLE, arguments[0], own=list(self.terms.tables).index(name))
        function = FUNCTIONS[name]
        assert function.lower is not None  # noqa: S101 - those without are OWN
        if function.arguments == LIMITS:
            self._check_limits(node, *map(self.value_of, arguments[1:]))
        return function.lower(self, *arguments)

    def _check_limits(self, node: Call, low: float | None, high: float | None) -> None:
        if low is not None and high is not None and low > high:
            raise equation_error(
                f"the lower limit of {node.function} is above its upper one",
                self.system.text,
                node.at,
                expected=f"{node.function}({', '.join(LIMITS)})",
                remedy=f"exchange them: {high:g}, {low:g}",
            )

    def _taken(self, node: Call) -> list[Node]:
        """Arguments and options of a function with states, in order."""
        names = OWN[node.function].arguments
        options = dict(node.options)
        found = list(node.arguments) + [options[name] for name in names[len(node.arguments) :] if name in options]
        if len(found) != len(names) or len(node.parts) != len(names):
            raise equation_error(
                f"{node.function} takes {', '.join(names)}",
                self.system.text,
                node.at,
                expected=OWN[node.function].says,
                remedy="give it those",
            )
        return found

    def _number(self, node: Node, what: str) -> float:
        found = self.value_of(self.value(node))
        if found is None:
            raise equation_error(
                f"{what} is a number", self.system.text, node.at, expected="a number", remedy="write it as a number"
            )
        return found

    # What remembers

    def _remember(self, function: str, arguments: tuple[int, ...], rule: Callable[[int], int]) -> int:
        """The value of a function of its arguments and of what it was a sample ago; the same call once."""
        key = (function, *arguments)
        if key not in self.remembering:
            number = sum(1 for name in self.hidden if name.startswith(f"{function} ")) + 1
            before = self.memory(f"{function} {number}")
            self.remembering[key] = self.updates[before] = rule(before)
        return self.remembering[key]

    def _relay(self, node: Call) -> int:
        x, on, off = (self.value(one) for one in self._taken(node))
        upper, lower_ = self.value_of(on), self.value_of(off)
        if upper is not None and lower_ is not None and lower_ > upper:
            raise equation_error(
                "the relay goes off above where it goes on",
                self.system.text,
                node.at,
                expected=OWN["relay"].says,
                remedy="exchange on and off; for the opposite write 1 - relay(...)",
            )
        set_ = self.switch(machine.GREATER, self.apply(machine.SUB, x, on))
        kept = self.switch(machine.NOT_LESS, self.apply(machine.SUB, x, off))
        return self._remember("relay", (x, on, off), lambda before: self._set_or_kept(set_, kept, before))

    def _latch(self, node: Call) -> int:
        set_, reset = (self.value(one) for one in self._taken(node))
        kept = self.apply(machine.SUB, self.constant(1.0), reset)
        return self._remember("latch", (set_, reset), lambda before: self._set_or_kept(set_, kept, before))

    def _set_or_kept(self, set_: int, kept: int, before: int) -> int:
        still = self.apply(machine.MUL, kept, before)
        return self.apply(machine.SELECT, set_, self.constant(1.0), still)

    def _hold(self, node: Call) -> int:
        x, when = (self.value(one) for one in self._taken(node))
        return self._remember("hold", (x, when), lambda before: self.apply(machine.SELECT, when, x, before))

    def _delay(self, node: Call) -> int:
        inside, seconds = self._taken(node)
        lag = self.samples(node, self._number(seconds, "a delay"))
        value = self.value(inside)
        if lag == 0.0:
            return value
        key = ("delay", value)
        found = self.kept(key, f"delay {value}", lag, node.at, lambda: value)
        self.updates[self.chains[key][0]] = value
        return found

    # Networks

    def _net(self, node: Call) -> int:
        neurons, scale = asked(node, self.system.text, self._number)
        arguments = [self.value(one) for one in node.arguments]
        net = Net(
            arguments=len(arguments),
            neurons=neurons,
            first=self.nets[-1].stop if self.nets else 0,
            norm=len(self.norms),
            probe=len(self.probed),
            scaled=scale is not None,
        )
        check_weights(net)
        for value in arguments:
            self.probe(value)
        self.nets.append(net)
        self.norms += [0.0, 1.0] * len(arguments) + [1.0 if scale is None else scale]
        return layer(self.graph, net, arguments)

    # Programs

    def between(self, rates: list[int]) -> list[int]:
        """Rates on the way from the sample before, where what is held, and what goes on by samples, has its inputs."""
        graph, share = self.graph, self.graph.leaf(SHARE, 0)
        now, before = {}, {}
        for (channel, lag), place in tuple(self.lagged.items()):
            leaf = graph.leaf(INPUT, place)
            before[leaf] = graph.leaf(INPUT, self.lagged.setdefault((channel, lag + 1.0), len(self.lagged)))
            way = self.apply(machine.SUB, leaf, before[leaf])
            now[leaf] = (
                self.apply(machine.FMA, share, way, before[leaf]) if self.terms.moving[channel] else before[leaf]
            )
        states = list(self.updates)
        self.updates = dict(zip(states, graph.replaced(list(self.updates.values()), before), strict=True))
        return graph.replaced(rates, now)

    def slopes(self, rates: list[int]) -> list[int]:
        """What a step goes along."""
        if self.terms.solver != ROSENBROCK or not rates:
            return rates
        if len(rates) > MOST_STATES_IMPLICIT:
            raise ConfigError(
                "too many states for implicit steps",
                where="solver",
                expected=f"at most {MOST_STATES_IMPLICIT} states with a rate",
                got=len(rates),
                remedy="write solver: runge-kutta, or make what is fast algebraic",
            )
        return implicit_slopes(self.graph, rates, self._slope_of_table, self.terms.sample_time or 1.0)

    def _slope_of_table(self, own: int) -> int:
        names = list(self.terms.tables)
        self.steep.setdefault(names[own], slopes_of(self.terms.tables[names[own]]))
        return len(names) + list(self.steep).index(names[own])

    def programs(self, rates: list[int], slopes: list[int], outputs: list[int], *, ahead: bool) -> Lowered:
        """All that was lowered, as programs."""
        system, terms, graph = self.system, self.terms, self.graph
        names = (*system.continuous, *system.discrete, *self.hidden)
        counts = graph.counts()
        counts[CONTINUOUS_STATE] = len(system.continuous)
        counts[DISCRETE_STATE] = len(system.discrete) + len(self.hidden)
        counts[FREE], counts[FIXED] = len(terms.free), len(terms.fixed)
        counts[WEIGHT], counts[NORM] = (self.nets[-1].stop if self.nets else 0), len(self.norms)
        counts[INPUT], counts[STEP], counts[SHARE] = len(self.lagged), 1, 1
        updates = [self.updates[graph.leaf(DISCRETE_STATE, i)] for i in range(counts[DISCRETE_STATE])]
        points = [*terms.tables.values(), *self.steep.values()]
        begins = np.cumsum([0, *map(len, points)])
        return Lowered(
            rates=graph.program(rates, counts),
            slopes=graph.program(slopes, counts),
            solver=terms.solver,
            updates=graph.program(updates, counts),
            outputs=graph.program(outputs, counts),
            probes=graph.program(self.probed, counts),
            counts=counts,
            states=names,
            lagged=tuple(self.lagged),
            nets=tuple(self.nets),
            switches=tuple(self.switches),
            norms=tuple(self.norms),
            places=np.array(
                [[begin, len(one)] for begin, one in zip(begins[:-1], points, strict=True)], dtype=np.int64
            ).reshape(-1, 2),
            table=np.array([point for one in points for point in one], dtype=np.float64).reshape(-1, 2),
            ahead=ahead,
        )
