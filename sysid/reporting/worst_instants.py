"""The worst instants of a free run: where to look first."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sysid.reporting.signals import CaseSignals

READABLE: Final = 12.0
"""How many times the error the target may move in a window: beyond, the two lines cannot be told apart."""

NARROWEST: Final = 10
"""Samples on each side of an instant that are always shown."""


@dataclass(frozen=True, kw_only=True)
class Instant:
    """A sample with a large error, and the window around it.

    Args:
        case: Name of the case.
        sample: Number of the sample.
        time: Seconds.
        target: Measured output there.
        simulated: Free run there; not finite where it diverged.
        first: First sample of the window.
        last: Last sample of the window.
    """

    case: str
    sample: int
    time: float
    target: float
    simulated: float
    first: int
    last: int

    @property
    def error(self) -> float:
        """Free run minus target."""
        return self.simulated - self.target


def worst_instants(signals: Dict[str, CaseSignals], count: int, *, share: float = 0.02) -> list[Instant]:
    """The samples with the largest errors, no two of them in one window.

    Args:
        signals: By case.
        count: How many at most.
        share: Half the length of a window, as a share of its case; it is at least 20 samples. What is shown of it is
            less where the target moves so far that the error could not be seen.

    Returns:
        The instants, worst first; a sample where the free run is not finite is worse than any other.
    """
    candidates = [
        instant for case, signal in signals.items() for instant in _instants_of_case(case, signal, count, share)
    ]
    return sorted(candidates, key=lambda instant: _badness(instant.error), reverse=True)[:count]


def _badness(error: float) -> float:
    return abs(error) if np.isfinite(error) else np.inf


def _instants_of_case(case: str, signal: CaseSignals, count: int, share: float) -> list[Instant]:
    size = np.abs(signal.simulated - signal.target)
    size[~np.isfinite(size)] = np.inf
    size[~signal.counted] = -1.0
    half = max(20, round(share * len(size)))
    found = []
    for _ in range(count):
        sample = int(np.argmax(size))
        if size[sample] <= 0.0:
            break
        around = _readable(signal.target, sample, half, size[sample])
        first, last = max(0, sample - around), min(len(size) - 1, sample + around)
        found.append(_instant(case, signal, sample, (first, last)))
        _blank(size, max(0, sample - 2 * half), sample + 2 * half)
    return found


def _readable(target: NDArray[np.float64], sample: int, half: int, error: float) -> int:
    """Half a window in which the error can be seen beside what the target does there."""
    while half > NARROWEST and np.ptp(target[max(0, sample - half) : sample + half + 1]) > READABLE * error:
        half = max(NARROWEST, int(0.8 * half))
    return half


def _blank(size: NDArray[np.float64], first: int, last: int) -> None:
    size[first : last + 1] = -1.0


def _instant(case: str, signal: CaseSignals, sample: int, window: tuple[int, int]) -> Instant:
    return Instant(
        case=case,
        sample=sample,
        time=float(signal.time[sample]),
        target=float(signal.target[sample]),
        simulated=float(signal.simulated[sample]),
        first=window[0],
        last=window[1],
    )
