"""What a name in equations stands for, now or some samples ago, as a value of a graph."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

from sysid.equations.graph import (
    CONTINUOUS_STATE,
    DISCRETE_STATE,
    FIXED,
    FREE,
    INPUT,
    Graph,
)
from sysid.equations.lowered import Switch, Terms
from sysid.equations.syntax import Call, Delayed, Node, equation_error
from sysid.equations.system import System
from sysid.kernels import register_machine as machine

MOST_DELAYED = 100
"""Samples that are kept of what is computed; what goes in may be delayed by any number of samples."""
LONGEST_DELAY = 1_000_000
"""Samples."""
_WHOLE = 1e-6
"""Samples by which a delay may miss a whole number."""


@dataclass(kw_only=True)
class Names(ABC):
    """What is made of the names in equations and of what they were some samples ago: leaves, and states that hand on.

    Args:
        system: The equations.
        terms: What else they are written with.
        graph: Of all values.
    """

    system: System
    terms: Terms
    graph: Graph = field(default_factory=Graph)
    updates: dict[int, int] = field(default_factory=dict)
    """By the leaf of a state what it is at the next sample."""
    hidden: list[str] = field(default_factory=list)
    """Names of the states of what remembers."""
    lagged: dict[tuple[int, float], int] = field(default_factory=dict)
    chains: dict[object, list[int]] = field(default_factory=dict)
    unfinished: list[str] = field(default_factory=list)
    definitions: dict[str, int] = field(default_factory=dict)
    entered: list[str] = field(default_factory=list)
    remembering: dict[object, int] = field(default_factory=dict)
    switches: list[Switch] = field(default_factory=list)
    probed: list[int] = field(default_factory=list)

    # What functions make values with

    def constant(self, value: float) -> int:
        """A number."""
        return self.graph.constant(value)

    def value_of(self, node: int) -> float | None:
        """The number that a value is, where it is one."""
        return self.graph.value_of(node)

    def apply(self, operation: int, a: int, b: int | None = None, c: int | None = None, own: int = 0) -> int:
        """An operation on values."""
        return self.graph.apply(operation, a, b, c, own)

    def switch(self, operation: int, a: int) -> int:
        """A switch or a root with a width of its own, the same for the same argument."""
        root, known = operation == machine.SQRT, self.value_of(a)
        if root and known is not None:
            return self.constant(math.sqrt(max(known, 0.0)))
        key = ("root" if root else "switch", a)
        if key not in self.remembering:
            self.remembering[key] = len(self.switches)
            self.switches.append(Switch(probe=self.probe(a), root=root))
        return self.graph.apply(operation, a, own=self.remembering[key])

    def probe(self, value: int) -> int:
        """The place of a value that is looked at in every step."""
        self.probed.append(value)
        return len(self.probed) - 1

    # Names

    def state(self, name: str) -> int:
        """The leaf of a state with a name."""
        if name in self.system.continuous:
            return self.graph.leaf(CONTINUOUS_STATE, self.system.continuous.index(name))
        return self.graph.leaf(DISCRETE_STATE, self.system.discrete.index(name))

    def memory(self, name: str) -> int:
        """The leaf of a new state of something that remembers."""
        self.hidden.append(name)
        return self.graph.leaf(DISCRETE_STATE, len(self.system.discrete) + len(self.hidden) - 1)

    def named(self, name: str, at: int) -> int:
        """The value of a name, now."""
        terms = self.terms
        if name in self.system.states:
            return self.state(name)
        if name in self.system.definitions:
            return self._definition(name, at)
        if name in terms.free:
            return self.graph.leaf(FREE, terms.free.index(name))
        if name in terms.fixed:
            return self.graph.leaf(FIXED, terms.fixed.index(name))
        return self.input(name, 0.0, at)

    def input(self, name: str, lag: float, at: int) -> int:
        """An input of the mapping, some samples ago."""
        if name not in self.terms.inputs:
            raise equation_error(
                f"nothing says what {name} is",
                self.system.text,
                at,
                expected=f"an input: {', '.join(self.terms.inputs) or 'there is none'}",
                got=name,
                remedy=f"add {name} to the mapping's inputs, or {name}: 1 to the parameters",
            )
        key = (self.terms.inputs.index(name), lag)
        return self.graph.leaf(INPUT, self.lagged.setdefault(key, len(self.lagged)))

    def _definition(self, name: str, at: int) -> int:
        if name in self.entered:
            raise equation_error(
                f"{name} needs itself: {' -> '.join([*self.entered[self.entered.index(name) :], name])}",
                self.system.text,
                at,
                expected="definitions that can be computed one after the other",
                remedy="a delay of less than a sample reads what is now too: make it a sample or more",
            )
        if name not in self.definitions:
            self.entered.append(name)
            self.definitions[name] = self.value(self.system.definitions[name].right)
            self.entered.pop()
        return self.definitions[name]

    # Delays

    def samples(self, node: Delayed | Call, seconds: float) -> float:
        """A delay in samples; a whole number but for rounding is one."""
        if not 0.0 <= seconds < math.inf:
            raise equation_error(
                "a delay is a number of seconds from 0 on", self.system.text, node.at, remedy="correct it"
            )
        if self.terms.sample_time is None:
            return min(math.ceil(seconds), 1)
        lag = seconds / self.terms.sample_time
        return float(round(lag)) if abs(lag - round(lag)) < _WHOLE else lag

    def delayed(self, node: Delayed) -> int:
        """The value of a name some samples or seconds ago."""
        lag = self.samples(node, node.lag) if node.seconds else node.lag
        if lag > LONGEST_DELAY:
            raise equation_error(
                f"a delay of {lag:,.0f} samples",
                self.system.text,
                node.at,
                expected=f"at most {LONGEST_DELAY:,}",
                remedy="correct the delay, or the sample time of the data",
            )
        name = node.name
        if name not in {*self.system.states, *self.system.definitions, *self.system.parameters}:
            return self.input(name, lag, node.at)
        if name in self.system.parameters or lag == 0.0:
            return self.named(name, node.at)
        if name not in self.chains:
            self.unfinished.append(name)
        return self.kept(name, name, lag, node.at, lambda: self.named(name, node.at))

    def kept(self, key: object, name: str, lag: float, at: int, now: Callable[[], int]) -> int:
        """What something was some samples ago, from states that hand it on."""
        chain = self.chains.setdefault(key, [])
        while len(chain) < math.ceil(lag):
            if sum(map(len, self.chains.values())) >= MOST_DELAYED:
                raise equation_error(
                    f"more than {MOST_DELAYED} past samples of what is computed are read",
                    self.system.text,
                    at,
                    expected="short delays of states and definitions; inputs may be delayed by any time",
                    remedy="delay the inputs that it is computed from instead, or use a larger sample time",
                )
            chain.append(self.memory(f"{name}[k-{len(chain) + 1}]"))
        whole = math.floor(lag)
        rest = lag - whole
        newer = chain[whole - 1] if whole else now()
        if rest == 0.0:
            return newer
        share = self.apply(machine.MUL, self.constant(rest), self.apply(machine.SUB, chain[whole], newer))
        return self.apply(machine.ADD, newer, share)

    def finish_delays(self) -> None:
        """Say what the first state of each delay holds next: what the name is now."""
        while self.unfinished:
            name = self.unfinished.pop()
            self.chains[name] = self.chains.get(name, [])
            value = self.named(name, 0)
            if self.chains[name]:
                self.updates[self.chains[name][0]] = value
        for chain in self.chains.values():
            for newer, older in pairwise(chain):
                self.updates[older] = newer

    @abstractmethod
    def value(self, node: Node) -> int:
        """The value of an expression."""
