"""A ring buffer of the last minute, and the changes and rates that a brake computer takes from it."""

from __future__ import annotations

import numpy as np


class Ring:
    """The last samples of one pressure.

    Args:
        seconds: How far it reaches back.
        sample_time: In s.

    Example:
        >>> ring = Ring(seconds=60.0, sample_time=0.5)
        >>> for value in (90.0, 89.0, 88.0):
        ...     ring.push(value)
        >>> ring.change(1.0), ring.rate(1.0), ring.full
        (-2.0, -2.0, False)
    """

    def __init__(self, *, seconds: float, sample_time: float) -> None:
        self.sample_time = sample_time
        self._values = np.zeros(max(2, round(seconds / sample_time) + 1))
        self._count = 0

    @property
    def full(self) -> bool:
        """Whether it has been filled once."""
        return self._count >= len(self._values)

    @property
    def newest(self) -> float:
        """The last value."""
        return float(self._values[(self._count - 1) % len(self._values)])

    def push(self, value: float) -> None:
        """Add a value; the oldest one goes."""
        self._values[self._count % len(self._values)] = value
        self._count += 1

    def _back(self, seconds: float) -> int:
        return min(round(seconds / self.sample_time), self._count - 1, len(self._values) - 1)

    def covers(self, seconds: float) -> bool:
        """Whether values reach that far back."""
        return self._count - 1 >= round(seconds / self.sample_time)

    def change(self, seconds: float) -> float:
        """Newest value less the one so many seconds ago (or the oldest there is)."""
        return self.newest - float(self._values[(self._count - 1 - self._back(seconds)) % len(self._values)])

    def rate(self, seconds: float) -> float:
        """Mean rate over so many seconds, per second; 0 with a single value."""
        back = self._back(seconds)
        return self.change(seconds) / (back * self.sample_time) if back else 0.0

    def recent(self, seconds: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """The values of the last so many seconds, oldest first."""
        index = np.arange(self._count - 1 - self._back(seconds), self._count) % len(self._values)
        return self._values[index]

    def swing(self, seconds: float) -> float:
        """Largest less smallest value over so many seconds."""
        values = self.recent(seconds)
        return float(values.max() - values.min())
