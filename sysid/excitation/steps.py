"""Signals of steps: pseudo-random binary sequences, with two levels or many, and staircases."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.excitation.plan import AbstractExcitation, Plan, check

SMALLEST, LARGEST = 2, 24
"""Bits of the shift register."""


@dataclass(frozen=True, kw_only=True)
class PRBS(AbstractExcitation):
    """A pseudo-random binary sequence of maximum length: two levels, flat spectrum, the least crest factor.

    Several channels have the same sequence, shifted as far from each other as they can be: uncorrelated as long as a
    response is shorter than the shift.

    Args:
        clock: Samples that a level is held at least: a longer clock has more power at low frequencies, and almost none
            near and above ``1 / (clock * sample_time)``.
        order: Bits of the shift register; the period is ``(2 ** order - 1) * clock``. By default the longest period
            that fits into the experiment.
    """

    clock: int = 1
    order: int | None = None

    def draw(self, plan: Plan) -> NDArray[np.float64]:
        """The sequence; see the base class."""
        check(1 <= self.clock <= plan.samples, "clock", f"1 to {plan.samples} samples", self.clock)
        order = self.order if self.order is not None else self._fitting(plan)
        check(SMALLEST <= order <= LARGEST, "order", f"{SMALLEST} to {LARGEST} bits", order)
        period = 2**order - 1
        check(plan.channels <= period, "order", f"a period of at least {plan.channels} clocks, one a channel", order)
        bits = scipy.signal.max_len_seq(order)[0].astype(np.float64) * 2.0 - 1.0
        first = int(np.random.default_rng(plan.seed).integers(period))
        clocks = np.arange(plan.samples) // self.clock
        shifts = first + np.arange(plan.channels) * period // plan.channels
        return np.asarray(bits[(clocks[:, None] + shifts[None, :]) % period])

    def _fitting(self, plan: Plan) -> int:
        """Bits of the longest period that fits in."""
        clocks = plan.samples // self.clock
        return int(np.clip(np.floor(np.log2(clocks + 1)), SMALLEST, LARGEST))


@dataclass(frozen=True, kw_only=True)
class APRBS(AbstractExcitation):
    """Random levels held for random times: an amplitude-modulated pseudo-random sequence, for systems not linear.

    The levels fill the range evenly: it is cut into as many strips as there are levels, and each strip is visited once,
    in random order, the ends of the range among them.

    Args:
        hold: Shortest time at a level, in samples.
        longest: Longest time, in samples; three times the shortest by default.
    """

    hold: int = 10
    longest: int | None = None

    def draw(self, plan: Plan) -> NDArray[np.float64]:
        """The levels; see the base class."""
        longest = 3 * self.hold if self.longest is None else self.longest
        check(1 <= self.hold <= plan.samples, "hold", f"1 to {plan.samples} samples", self.hold)
        check(self.hold <= longest, "longest", f"{self.hold} samples or more", longest)
        return np.column_stack([self._channel(plan.rng(k), plan.samples, longest) for k in range(plan.channels)])

    def _channel(self, rng: np.random.Generator, samples: int, longest: int) -> NDArray[np.float64]:
        holds = rng.integers(self.hold, longest + 1, size=samples // self.hold + 1)
        count = int(np.searchsorted(np.cumsum(holds), samples)) + 1
        strips = -1.0 + 2.0 * (np.arange(count) + rng.random(count)) / count
        strips[0], strips[-1] = -1.0, 1.0
        return np.repeat(rng.permutation(strips), holds[:count])[:samples]


class Direction(Enum):
    """In which order a staircase visits its levels; the value is its name."""

    UP_DOWN = "up-down"
    RANDOM = "random"


@dataclass(frozen=True, kw_only=True)
class Staircase(AbstractExcitation):
    """Even steps over the range and back, each held: for steady gains, hysteresis and settling times.

    Several channels are a part of a turn apart, or, at random, each on its own.

    Args:
        levels: How many different levels.
        hold: Samples at each; by default so long that the whole staircase fits into the experiment once.
        direction: Up and down again, or each level in random order.
    """

    levels: int = 5
    hold: int | None = None
    direction: Direction = Direction.UP_DOWN

    def draw(self, plan: Plan) -> NDArray[np.float64]:
        """The staircase; see the base class."""
        check(2 <= self.levels <= plan.samples, "levels", f"2 to {plan.samples}", self.levels)
        rise = np.linspace(-1.0, 1.0, self.levels)
        around = np.concatenate([rise, rise[-2::-1]])
        fitting = plan.samples // (len(around) if self.direction is Direction.UP_DOWN else self.levels)
        hold = max(1, fitting) if self.hold is None else self.hold
        check(1 <= hold <= plan.samples, "hold", f"1 to {plan.samples} samples", hold)
        return np.column_stack([self._channel(plan, k, around, hold) for k in range(plan.channels)])

    def _channel(self, plan: Plan, k: int, around: NDArray[np.float64], hold: int) -> NDArray[np.float64]:
        count = -(-plan.samples // hold)
        rng = plan.rng(k)
        if self.direction is Direction.RANDOM:
            rounds = [rng.permutation(around[: self.levels]) for _ in range(-(-count // self.levels))]
            order = np.concatenate(rounds)
        else:
            # One turn is as long as its steps but the last, the first of the next; two channels are a quarter apart.
            turn = around[:-1] if count > len(around) else around
            start = round(k * len(turn) / (2 * plan.channels))
            order = turn[(start + np.arange(count)) % len(turn)]
        return np.repeat(order[:count], hold)[: plan.samples]
