"""Filtered noise and chirps."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.excitation.plan import AbstractExcitation, Plan, band_in_hertz, check


@dataclass(frozen=True, kw_only=True)
class FilteredNoise(AbstractExcitation):
    """Gaussian noise within a band, its rare peaks cut so that the range is used.

    Args:
        band: Lowest and highest frequency in Hz; white noise by default. From 0 on all that is slow is kept.
        peak: Standard deviations at which it is cut; 3 cuts a few samples of a thousand.
        order: Of the Butterworth filter.
    """

    band: tuple[float, float] | None = None
    peak: float = 3.0
    order: int = 5

    def draw(self, plan: Plan) -> NDArray[np.float64]:
        """The noise; see the base class."""
        check(0.5 <= self.peak <= 20.0, "peak", "0.5 to 20 standard deviations", self.peak)
        check(1 <= self.order <= 12, "order", "1 to 12", self.order)
        sections = self._sections(plan)
        return np.column_stack([self._filtered(sections, plan, k) for k in range(plan.channels)])

    def _filtered(self, sections: NDArray[np.float64] | None, plan: Plan, k: int) -> NDArray[np.float64]:
        # The filter has forgotten its beginning after a whole record more.
        lead = plan.samples if sections is not None else 0
        x = plan.rng(k).standard_normal(plan.samples + lead)
        if sections is not None:
            x = scipy.signal.sosfilt(sections, x)[lead:]
        size = float(np.sqrt(np.mean(x**2))) or 1.0
        return np.asarray(np.clip(x / (self.peak * size), -1.0, 1.0))

    def _sections(self, plan: Plan) -> NDArray[np.float64] | None:
        if self.band is None:
            return None
        low, high = band_in_hertz(self.band, plan)
        below, above = low > 0.0, high < plan.nyquist * (1.0 - 1e-9)
        if not below and not above:
            return None
        edges = (low, high) if below and above else low if below else high
        kind = "bandpass" if below and above else "highpass" if below else "lowpass"
        return np.asarray(scipy.signal.butter(self.order, edges, btype=kind, fs=1.0 / plan.sample_time, output="sos"))


class Sweep(Enum):
    """How the frequency of a chirp rises; the value is its name."""

    LINEAR = "linear"
    LOGARITHMIC = "logarithmic"


@dataclass(frozen=True, kw_only=True)
class Chirp(AbstractExcitation):
    """A sine whose frequency rises through a band; several channels are apart by a part of a turn.

    Channels of a chirp hold the same frequency at the same time: their responses cannot be told apart well. Use a
    multisine for several inputs.

    Args:
        band: Lowest and highest frequency in Hz; by default from one swing over the whole length to a quarter of the
            sampling frequency.
        sweep: How it rises.
    """

    band: tuple[float, float] | None = None
    sweep: Sweep = Sweep.LINEAR

    def draw(self, plan: Plan) -> NDArray[np.float64]:
        """The sweep; see the base class."""
        low, high = band_in_hertz(self.band or (1.0 / (plan.samples * plan.sample_time), 0.5 * plan.nyquist), plan)
        check(low > 0.0 or self.sweep is Sweep.LINEAR, "band", "a lowest frequency above 0 Hz", f"{low:g}:{high:g}")
        t = plan.sample_time * np.arange(plan.samples)
        phases = 90.0 + 180.0 * np.arange(plan.channels) / plan.channels
        method = self.sweep.value
        columns = [scipy.signal.chirp(t, low, t[-1], high, method=method, phi=-phase) for phase in phases]
        return np.column_stack(columns)
