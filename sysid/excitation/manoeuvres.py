"""Signals as a person at a lever makes them: ramps, one slow swing, the same small move again and again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.excitation.plan import AbstractExcitation, Plan, check


@dataclass(frozen=True, kw_only=True)
class Ramps(AbstractExcitation):
    """Random levels, each reached at a constant rate and held: what steps do not show, how it follows.

    Args:
        rise: Samples of the shortest ramp.
        longest_rise: Of the longest; ten times the shortest by default.
        hold: Samples of the shortest hold, 0 for ramps that turn at once.
        longest_hold: Of the longest; as long as the longest ramp by default.
    """

    rise: int = 20
    longest_rise: int | None = None
    hold: int = 0
    longest_hold: int | None = None

    def draw(self, plan: Plan) -> NDArray[np.float64]:
        """The ramps; see the base class."""
        rise = 10 * self.rise if self.longest_rise is None else self.longest_rise
        hold = max(self.hold, rise) if self.longest_hold is None else self.longest_hold
        check(1 <= self.rise <= plan.samples, "rise", f"1 to {plan.samples} samples", self.rise)
        check(self.rise <= rise, "longest_rise", f"{self.rise} samples or more", rise)
        check(self.hold >= 0, "hold", "0 samples or more", self.hold)
        check(self.hold <= hold, "longest_hold", f"{self.hold} samples or more", hold)
        return np.column_stack([self._channel(plan.rng(k), plan.samples, rise, hold) for k in range(plan.channels)])

    def _channel(self, rng: np.random.Generator, samples: int, rise: int, hold: int) -> NDArray[np.float64]:
        most = samples // (self.rise + self.hold) + 2
        lengths = np.column_stack([rng.integers(self.rise, rise + 1, most), rng.integers(self.hold, hold + 1, most)])
        ends = np.cumsum(lengths.ravel())
        # Levels that are reached within the experiment fill the range evenly, its ends among them.
        count = max(int(np.searchsorted(ends[::2], samples)) + 1, 2)
        strips = -1.0 + 2.0 * (np.arange(count) + rng.random(count)) / count
        strips[0], strips[-1] = -1.0, 1.0
        levels = np.concatenate([rng.permutation(strips), rng.uniform(-1.0, 1.0, most)])[: most + 1]
        values = np.concatenate([levels[:1], np.repeat(levels[1:], 2)])
        return np.asarray(np.interp(np.arange(samples), np.concatenate([[0], ends]), values))


@dataclass(frozen=True, kw_only=True)
class Sine(AbstractExcitation):
    """One swing over the whole range, of one frequency: slow ones show hysteresis, quick ones what does not follow.

    Args:
        periods: How many fit into the experiment; drawn at random, evenly over its logarithm, by default.
        fewest: Fewest that are drawn.
        most: Most that are drawn, as far as the samples hold them.
    """

    periods: float | None = None
    fewest: float = 3.0
    most: float = 60.0

    def draw(self, plan: Plan) -> NDArray[np.float64]:
        """The swing; see the base class."""
        top = 0.5 * plan.samples
        for name, value in (("periods", self.periods), ("fewest", self.fewest)):
            check(value is None or 0.0 < value <= top, name, f"above 0, up to {top:g}", value)
        check(self.fewest <= self.most, "most", f"{self.fewest:g} or more", self.most)
        return np.column_stack([self._channel(plan.rng(k), plan.samples, top) for k in range(plan.channels)])

    def _channel(self, rng: np.random.Generator, samples: int, top: float) -> NDArray[np.float64]:
        drawn = float(np.exp(rng.uniform(np.log(self.fewest), np.log(self.most))))
        periods = min(drawn, top) if self.periods is None else self.periods
        return np.asarray(np.sin(2.0 * np.pi * (periods * np.arange(samples) / samples + rng.random())))


@dataclass(frozen=True, kw_only=True)
class Pulses(AbstractExcitation):
    """The same move from the upper end of the range and back, again and again: what does not come back adds up.

    Args:
        hold: Fewest samples at either end.
        longest: Most; ten times the fewest by default.
        depth: How far it goes, as a share of the range; all of it by default.
    """

    hold: int = 10
    longest: int | None = None
    depth: float = 1.0

    def draw(self, plan: Plan) -> NDArray[np.float64]:
        """The pulses; see the base class."""
        longest = 10 * self.hold if self.longest is None else self.longest
        check(1 <= self.hold <= plan.samples, "hold", f"1 to {plan.samples} samples", self.hold)
        check(self.hold <= longest, "longest", f"{self.hold} samples or more", longest)
        check(0.0 < self.depth <= 1.0, "depth", "above 0, up to 1", self.depth)
        return np.column_stack([self._channel(plan.rng(k), plan.samples, longest) for k in range(plan.channels)])

    def _channel(self, rng: np.random.Generator, samples: int, longest: int) -> NDArray[np.float64]:
        holds = rng.integers(self.hold, longest + 1, size=samples // self.hold + 2)
        levels = np.where(np.arange(len(holds)) % 2 == 0, 1.0, 1.0 - 2.0 * self.depth)
        return np.repeat(levels, holds)[:samples]
