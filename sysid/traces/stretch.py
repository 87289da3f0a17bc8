"""A stretch of time: between two seconds of a record's own time, or up to one of its ends."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FUZZ = 1e-6
"""How far outside of a stretch, in sample times, a stamp still counts as its end: ends are decimal numbers."""


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """A stretch of time; both ends belong to it.

    Args:
        start: Seconds; from the first sample on where it is left out.
        stop: Seconds; up to the last sample where it is left out.
    """

    start: float | None = None
    stop: float | None = None

    def span(self, sample_time: float) -> tuple[float, float]:
        """Its ends, where a stamp may lie a little outside.

        Args:
            sample_time: Seconds.

        Returns:
            The first and the last second; infinite where it has no end.
        """
        fuzz = FUZZ * sample_time
        low = -math.inf if self.start is None else self.start - fuzz - 4.0 * math.ulp(self.start)
        return low, math.inf if self.stop is None else self.stop + fuzz + 4.0 * math.ulp(self.stop)

    def holds(self, stamps: NDArray[np.float64], sample_time: float) -> NDArray[np.bool_]:
        """Which stamps lie within it.

        Args:
            stamps: Seconds; NaN lies nowhere.
            sample_time: Seconds.

        Returns:
            Of the shape of the stamps.
        """
        low, high = self.span(sample_time)
        return np.asarray((stamps >= low) & (stamps <= high))

    @property
    def told(self) -> str:
        """Its ends in words."""
        ends = (("from", self.start), ("to", self.stop))
        return " ".join(f"{word} {end:.15g} s" for word, end in ends if end is not None)
