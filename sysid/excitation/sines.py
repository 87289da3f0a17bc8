"""Multisines: sums of sines on lines that are chosen, with phases that keep the peak low."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, rfft

from sysid.excitation.plan import AbstractExcitation, Plan, band_in_hertz, check


class Lines(Enum):
    """Which multiples of the base frequency are excited; the value is its name."""

    FULL = "full"
    ODD = "odd"
    """Odd ones only: what appears on even ones is even distortion."""
    ODD_RANDOM = "odd-random"
    """Odd ones, one left out of each group of four: what appears on those left out is odd distortion."""


@dataclass(frozen=True, kw_only=True)
class Multisine(AbstractExcitation):
    """Sines of equal amplitude with random phases, periodic: the response averages over periods, the noise does not.

    Several channels share the lines out in turn, so that each is on its own in the spectrum.

    Args:
        band: Lowest and highest frequency in Hz; all that a period can hold by default.
        periods: How many; leave out the first of them when the response has to settle.
        lines: Which lines of the band are excited.
        iterations: Steps by which the phases are improved for a low peak: the signal is clipped, the phases of what is
            left are taken over, less and less is clipped (van der Ouderaa, Schoukens and Renneboog 1988). 0 keeps the
            random phases, as the best linear approximation over several experiments wants them.
    """

    band: tuple[float, float] | None = None
    periods: int = 1
    lines: Lines = Lines.FULL
    iterations: int = 500

    def draw(self, plan: Plan) -> NDArray[np.float64]:
        """The sum; see the base class."""
        check(1 <= self.periods <= plan.samples // 4, "periods", f"1 to {plan.samples // 4}", self.periods)
        check(0 <= self.iterations <= 100_000, "iterations", "0 to 100,000", self.iterations)
        length = plan.samples // self.periods
        excited = self._excited(plan, length)
        repeat = np.arange(plan.samples) % length
        columns = []
        for k in range(plan.channels):
            own = excited[k :: plan.channels]
            check(len(own) > 0, "band", f"{plan.channels} lines at least, one a channel", f"{len(excited)} lines")
            x = _low_crest(own, length, plan.rng(k), self.iterations)
            columns.append(x[repeat] / np.abs(x).max())
        return np.column_stack(columns)

    def _excited(self, plan: Plan, length: int) -> NDArray[np.int64]:
        base = 1.0 / (length * plan.sample_time)
        low, high = band_in_hertz(self.band, plan, slowest=base)
        # Neither the mean nor the line at half the sampling frequency, whose phase is not free.
        lines = np.arange(max(1, int(np.ceil(low / base - 1e-9))), min(int(high / base + 1e-9), (length - 1) // 2) + 1)
        if self.lines is not Lines.FULL:
            lines = lines[lines % 2 == 1]
        if self.lines is Lines.ODD_RANDOM:
            groups = [lines[i : i + 4] for i in range(0, len(lines), 4)]
            rng = np.random.default_rng([plan.seed, 1_000_003])
            lines = np.concatenate([np.delete(g, rng.integers(len(g))) if len(g) > 1 else g for g in groups] or [lines])
        check(len(lines) > 0, "band", f"at least one line of {base:g} Hz in it", f"{low:g}:{high:g}")
        return np.asarray(lines, dtype=np.int64)


def _sum(lines: NDArray[np.int64], phases: NDArray[np.float64], length: int) -> NDArray[np.float64]:
    spectrum = np.zeros(length // 2 + 1, dtype=np.complex128)
    spectrum[lines] = np.exp(1j * phases)
    return np.asarray(irfft(spectrum, length))


def _crest(x: NDArray[np.float64]) -> float:
    return float(np.abs(x).max() / np.sqrt(np.mean(x**2)))


def _low_crest(lines: NDArray[np.int64], length: int, rng: np.random.Generator, iterations: int) -> NDArray[np.float64]:
    """A period whose peak is low for its power."""
    phases = rng.uniform(-np.pi, np.pi, len(lines))
    x = _sum(lines, phases, length)
    if iterations == 0:
        return x
    best = x
    for step in range(iterations):
        share = 0.75 + 0.24 * step / iterations
        top = share * np.abs(x).max()
        phases = np.angle(rfft(np.clip(x, -top, top))[lines])
        x = _sum(lines, phases, length)
        if _crest(x) < _crest(best):
            best = x
    return best
