"""A graph of operations, each value once, and the programs that the register machine runs of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.kernels import register_machine as machine

MOST_NODES = 50_000
"""Values of one set of equations."""

CONSTANT = "constant"
FREE, WEIGHT, FIXED, NORM, STEP, SHARE = "free", "weight", "fixed", "norm", "step", "share"
"""Parameters: those that have names and are estimated, weights of networks, those that are declared, the levels and
scales of what a network sees, the seconds of a step, and the share of the way to a sample that lies behind."""
CONTINUOUS_STATE, DISCRETE_STATE, INPUT = "continuous", "discrete", "input"
LEAVES = (FREE, WEIGHT, FIXED, NORM, STEP, SHARE, CONTINUOUS_STATE, DISCRETE_STATE, INPUT)
"""What is given to a program, in the order of its registers."""

WITH_OWN = frozenset({machine.GREATER, machine.NOT_LESS, machine.SIGN, machine.SQRT, machine.TABLE})
"""Operations that have a switch or a table."""
COMMUTES = frozenset({machine.ADD, machine.MUL, machine.MIN, machine.MAX})

OPERATION = "operation"
STEEP = 1e300
"""Times what is not 0, it holds as a condition."""


class Value(NamedTuple):
    """What a node of the graph is.

    Args:
        kind: A constant, a kind of leaf, or an operation.
        number: Of a constant.
        place: Of a leaf among those of its kind; of an operation, which one.
        reads: Nodes that an operation reads.
        own: The operation's own number: a switch or a table.
    """

    kind: str
    number: float = 0.0
    place: int = 0
    reads: tuple[int, ...] = ()
    own: int = 0


@dataclass(frozen=True, kw_only=True, eq=False)
class Program:
    """Instructions for the register machine, and what another target prints.

    Args:
        code: Instructions ``(operation, a, b, c, own)``, shape ``(n, 5)``, over the registers ``[constants | parameters
            | states | inputs | results]``.
        results: Registers of the results.
        constants: Values of the constants.
        sizes: Numbers of parameters, states and inputs.
    """

    code: NDArray[np.uint64]
    results: NDArray[np.uint64]
    constants: NDArray[np.float64]
    sizes: tuple[int, int, int]

    @property
    def arrays(self) -> tuple[NDArray[np.uint64], NDArray[np.uint64], NDArray[np.float64]]:
        """As the machine takes it."""
        return self.code, self.results, self.constants

    @property
    def first(self) -> int:
        """The first register that an instruction writes."""
        return len(self.constants) + sum(self.sizes)


@dataclass(kw_only=True)
class Graph:
    """Values that are computed, each once whatever asks for it.

    A value is the number of its node. A node is a constant, a leaf (a parameter, state or input), or an operation over
    values that stand before it.
    """

    nodes: list[Value] = field(default_factory=list)
    known: dict[Value, int] = field(default_factory=dict)

    def _node(self, value: Value) -> int:
        if value not in self.known:
            if len(self.nodes) >= MOST_NODES:
                raise ConfigError(
                    "the equations compute too many values",
                    where="equations",
                    expected=f"at most {MOST_NODES:,}",
                    remedy="use fewer or smaller networks, or shorter delays",
                )
            self.known[value] = len(self.nodes)
            self.nodes.append(value)
        return self.known[value]

    def constant(self, value: float) -> int:
        """A number."""
        return self._node(Value(kind=CONSTANT, number=float(value) + 0.0))

    def leaf(self, kind: str, place: int) -> int:
        """A parameter, state or input, by its place among those of its kind."""
        return self._node(Value(kind=kind, place=place))

    def counts(self) -> dict[str, int]:
        """How many there are of each kind of leaf, from the places that were asked for."""
        found = dict.fromkeys(LEAVES, 0)
        for node in self.nodes:
            if node.kind in found:
                found[node.kind] = max(found[node.kind], node.place + 1)
        return found

    def value_of(self, node: int) -> float | None:
        """The value of a constant; ``None`` for what is none."""
        value = self.nodes[node]
        return value.number if value.kind == CONSTANT else None

    def apply(self, operation: int, a: int, b: int | None = None, c: int | None = None, own: int = 0) -> int:
        """An operation over values; of constants the constant that it gives.

        Args:
            operation: Which, as the machine names it.
            a: What it reads first.
            b: Second, where there is one.
            c: Third, where there is one.
            own: The operation's own number: a switch or a table.

        Returns:
            The value.
        """
        found = self._simpler(operation, a, b)
        if found is None and operation == machine.MUL and b is not None:
            found = self._bent(a, b)
        if found is not None:
            return found
        if operation in COMMUTES and b is not None and b < a:
            a, b = b, a
        if operation == machine.ADD and b is not None:
            for product, other in ((b, a), (a, b)):
                factors = self.nodes[product]
                if factors.kind == OPERATION and factors.place == machine.MUL:
                    return self._operation(machine.FMA, *factors.reads, other)
        reads = tuple(one for one in (a, b, c) if one is not None)
        given = [value for one in reads if (value := self.value_of(one)) is not None]
        if len(given) == len(reads) and operation not in WITH_OWN:
            folded = computed(operation, given)
            if math.isfinite(folded):
                return self.constant(folded)
        return self._operation(operation, *reads, own=own)

    def _operation(self, operation: int, *reads: int, own: int = 0) -> int:
        return self._node(Value(kind=OPERATION, place=operation, reads=reads, own=own))

    def _simpler(self, operation: int, a: int, b: int | None) -> int | None:
        """What is no operation at all: nothing is added, or multiplied by 1."""
        first, second = self.value_of(a), None if b is None else self.value_of(b)
        if operation == machine.ADD:
            return b if first == 0.0 else a if second == 0.0 else None
        if operation == machine.SUB and second == 0.0:
            return a
        if operation == machine.MUL:
            return b if first == 1.0 else a if second == 1.0 else None
        if operation == machine.DIV and second == 1.0:
            return a
        if operation == machine.POW and second == 1.0:
            return a
        return None

    def _bent(self, a: int, b: int) -> int | None:
        """A product in which ``abs(x)^n`` and ``x`` stand, as papers write ``sign(x)*abs(x)^(n + 1)``.

        It is 0 at 0 for every ``n`` above -1, where ``abs(x)^n`` alone is infinite and the product not a number. The
        power is therefore that of 1 there.
        """
        for product, x in ((a, b), (b, a)):
            value = self.nodes[product]
            if value.kind != OPERATION:
                continue
            if value.place == machine.POW:
                base, power = value.reads
                known, size = self.value_of(power), Value(kind=OPERATION, place=machine.ABS, reads=(x,))
                if self.nodes[base] == size and (known is None or known < 0.0):
                    away = self.apply(machine.MUL, base, self.constant(STEEP))
                    base = self.apply(machine.SELECT, away, base, self.constant(1.0))
                    return self._operation(machine.MUL, x, self.apply(machine.POW, base, power))
            if value.place == machine.MUL:
                for one, other in (value.reads, value.reads[::-1]):
                    if (found := self._bent(one, x)) is not None:
                        return self.apply(machine.MUL, found, other)
        return None

    def program(self, results: Sequence[int], counts: Mapping[str, int]) -> Program:
        """What computes some values, and nothing else.

        Args:
            results: The values.
            counts: How many leaves of each kind there are, used or not.

        Returns:
            The program.
        """
        needed = self.needed(results)
        constants = [node for node in needed if self.nodes[node].kind == CONSTANT]
        place = {node: at for at, node in enumerate(constants)}
        at, firsts = len(constants), {}
        for kind in LEAVES:
            firsts[kind], at = at, at + counts[kind]
        n_theta = sum(counts[kind] for kind in LEAVES[: LEAVES.index(CONTINUOUS_STATE)])
        sizes = (n_theta, counts[CONTINUOUS_STATE] + counts[DISCRETE_STATE], counts[INPUT])
        code: list[list[int]] = []
        for node in needed:
            value = self.nodes[node]
            if value.kind in firsts:
                place[node] = firsts[value.kind] + value.place
            elif value.kind == OPERATION:
                reads = [*(place[one] for one in value.reads), 0, 0][:3]
                code.append([value.place, *reads, value.own])
                place[node], at = at, at + 1
        return Program(
            code=np.array(code, dtype=np.uint64).reshape(-1, 5),
            results=np.array([place[node] for node in results], dtype=np.uint64),
            constants=np.array([self.value_of(node) for node in constants], dtype=np.float64),
            sizes=sizes,
        )

    def replaced(self, results: Sequence[int], by: Mapping[int, int]) -> list[int]:
        """The same values of other leaves.

        Args:
            results: The values.
            by: What stands in the place of some leaves.

        Returns:
            The values.
        """
        found = dict(by)
        for node in self.needed(results):
            value = self.nodes[node]
            if any(found.get(one, one) != one for one in value.reads):
                a, b, c = [*(found.get(one, one) for one in value.reads), None, None][:3]
                assert a is not None  # noqa: S101 - every operation reads something
                found[node] = self.apply(value.place, a, b, c, own=value.own)
        return [found.get(node, node) for node in results]

    def needed(self, results: Sequence[int]) -> list[int]:
        """Every value that some need, in the order in which they can be computed."""
        found: set[int] = set()
        waiting = list(results)
        while waiting:
            node = waiting.pop()
            if node not in found:
                found.add(node)
                waiting += self.nodes[node].reads
        return sorted(found)


def computed(operation: int, values: Sequence[float]) -> float:
    """One operation on numbers, by the machine itself.

    Args:
        operation: Which; no switch and no table.
        values: What it reads.

    Returns:
        What it gives.
    """
    v = np.array([*values, *[0.0] * (4 - len(values))])
    # Unsigned, as every program's: for other integers the machine is compiled a second time.
    code = np.array([[operation, 0, min(1, len(values) - 1), min(2, len(values) - 1), 0]], dtype=np.uint64)
    machine.evaluate(code, 0, 1, v, 3, np.zeros(1), np.zeros((0, 2), dtype=np.int64), np.zeros((0, 2)))
    return float(v[3])
