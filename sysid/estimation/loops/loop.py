"""A linear system closed by one element that is not linear, as numbers: its layout and its free run."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.kernels.loop import DEAD_ZONE, MOST, RELAY, SATURATION, WAITS, loop_states

Array = NDArray[np.float64]
Records = list[tuple[Array, Array]]

NAMES = {DEAD_ZONE: "a dead zone", SATURATION: "limits", WAITS: "limits at which an integral waits", RELAY: "a relay"}
"""What the element is called."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples:
    """The first samples of records, in shares of their ranges, one record after the other.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``.
        outputs: Shape ``(n_samples, n_outputs)``.
        begins: Where a record begins, shape ``(n_samples,)``.
    """

    inputs: Array
    outputs: Array
    begins: NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False)
class Scaled:
    """Records in shares of their ranges, from where they begin.

    Args:
        begin: Inputs there.
        reach: How far each input goes from there.
        rest: Outputs of the first sample.
        span: How far each output goes.
        records: Inputs and outputs of each.
    """

    begin: Array
    reach: Array
    rest: Array
    span: Array
    records: Records

    @classmethod
    def of(cls, records: Records) -> Scaled | None:
        """Records; ``None`` where a channel stands."""
        begin, rest = records[0][0][0], records[0][1][0]
        reach = np.max([np.abs(u - begin).max(axis=0) for u, _ in records], axis=0)
        span = np.ptp(np.concatenate([y for _, y in records]), axis=0)
        if (reach <= 0.0).any() or (span <= 0.0).any():
            return None
        scaled = [((u - begin) / reach, (y - rest) / span) for u, y in records]
        return cls(begin=begin, reach=reach, rest=rest, span=span, records=scaled)

    @cached_property
    def longest(self) -> int:
        """Samples of the longest record."""
        return max(len(y) for _, y in self.records)

    def first(self, samples: int) -> Samples:
        """The first samples of each record."""
        parts = [(u[:samples], y[:samples]) for u, y in self.records]
        begins = np.zeros(sum(len(y) for _, y in parts), dtype=bool)
        begins[np.cumsum([0, *(len(y) for _, y in parts[:-1])])] = True
        inputs, outputs = (np.ascontiguousarray(np.concatenate(some)) for some in zip(*parts, strict=True))
        return Samples(inputs=inputs, outputs=outputs, begins=begins)


@dataclass(frozen=True, kw_only=True, eq=False)
class Loop:
    """Such a system; its outputs are sums of its states and a constant, found by least squares for any numbers.

    Args:
        kind: The element, one of those of :mod:`sysid.kernels.loop`.
        states: How many.
        steps: From sample to sample.
        sizes: What each state is fed with in a sample, shape ``(states,)``.
        theta: Its numbers, as :func:`~sysid.kernels.loop.loop_states` has them.
        free: Which of its numbers are estimated.
        read: Factors of the states and of 1 in the outputs, shape ``(states + 1, n_outputs)``; empty before a fit.
    """

    kind: int
    states: int
    steps: int
    sizes: Array
    theta: Array
    free: NDArray[np.bool_]
    read: Array

    @property
    def element(self) -> str:
        """What it is closed by, in words."""
        return NAMES[self.kind]

    def run(self, samples: Samples, theta: Array) -> Array | None:
        """States and 1 at the end of each sample with other numbers; ``None`` where they run away."""
        n = self.states
        out = np.ones((len(samples.inputs), n + 1 + (self.kind == RELAY)))
        loop_states(self.kind, self.steps, n, self.sizes, theta, samples.inputs, samples.begins, out)
        out[:, n] = 1.0
        terms = out[:, : n + 1]
        return None if np.abs(terms).max() >= MOST else terms

    def outputs(self, samples: Samples) -> Array:
        """Its free run, shape ``(n_samples, n_outputs)``; not a number where it runs away."""
        terms = self.run(samples, self.theta)
        return np.full(samples.outputs.shape, np.nan) if terms is None else terms @ self.read

    def moves(self) -> tuple[Array, Array]:
        """What is left of each state after a step, and what it is fed with in it, as the kernel has both."""
        a = self.theta[: self.states] / self.steps
        slow = np.abs(a) <= 1e-9
        share = np.where(slow, 1.0, (1.0 - np.exp(-a)) / np.where(slow, 1.0, a))
        return np.exp(-a), self.sizes / self.steps * share

    def part(self, name: str, inputs: int) -> Array:
        """Some of its numbers, by their name in the equations."""
        n, m = self.states, inputs
        sizes = {"rates": n, "drives": n * m, "sees": n, "sees_inputs": m, "begins": n, "limits": 2}
        sizes |= {"winds": n, "winds_inputs": m, "winds_by": 1} if self.kind == WAITS else {}
        sizes |= {"leads": 1} if self.kind == DEAD_ZONE else {"on": 1} if self.kind == RELAY else {}
        ends = np.cumsum(list(sizes.values()))
        at = list(sizes).index(name)
        return self.theta[ends[at] - sizes[name] : ends[at]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """A loop that records are of.

    Args:
        left: Root of the mean square of what it leaves of them in free run, as a share of the outputs' ranges.
        scaled: The records.
        loop: The loop.
    """

    left: float
    scaled: Scaled
    loop: Loop
