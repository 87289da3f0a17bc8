"""The poles of a linear model as an engineer reads them, with intervals: time constants, natural frequencies, damping.

A pole ``z`` of the samples is the pole ``s = log(z)/T`` of the plant. Its covariance follows from that of the
denominator's coefficients to first order, ``dz = -sum z^(n-i) df_i / F'(z)`` (Guillaume, Schoukens and Pintelon 1989,
"Sensitivity of roots to errors in the coefficient of polynomials obtained by frequency-domain estimation methods"),
taken on the logarithm of what is positive, so that no interval leaves the numbers that there are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.linear.of_polynomials import of_polynomials
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import AbstractModel
from sysid.models.contract.ratio import Ratio
from sysid.models.converting.continuous import NEGATIVE

AT_ONE = 1e-9
"""Distance of a discrete pole from 1 below which it is an integrator's."""

Interval = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Mode:
    """A real pole, or a pair of complex ones.

    Args:
        of: The input that it belongs to; empty where all share the denominator.
        pole: In the z plane, of a continuous model in the s plane; of a pair the one above the axis.
        rate: In the s plane, in rad/s; ``None`` where the pole has no continuous form, being zero or negative.
        time_constant: In seconds; negative where it grows; ``None`` of a pair and of an integrator.
        natural_frequency: In rad/s; ``None`` of a real pole.
        damping: Ratio; ``None`` of a real pole.
        intervals: Of these three, by name; without an entry where the data do not tell.
    """

    of: str
    pole: complex
    rate: complex | None
    time_constant: float | None = None
    natural_frequency: float | None = None
    damping: float | None = None
    intervals: dict[str, Interval]


def modes(model: AbstractModel, uncertainty: Uncertainty | None, probability: float = 0.95) -> tuple[Mode, ...]:
    """Time constants, natural frequencies and damping of a linear model.

    Args:
        model: The model.
        uncertainty: Of its parameters, as its fit has it; ``None`` leaves the intervals out.
        probability: That an interval holds the true value.

    Returns:
        One entry a real pole or pair, the slowest first, denominator by denominator; dead times are not among them.
    """
    uncertainty = of_polynomials(model, uncertainty)
    found: list[Mode] = []
    seen: set[str] = set()
    ratios = model.ratios
    for (_, j), ratio in ratios.items():
        if ratio.of_denominator in seen or not len(ratio.B):
            continue
        seen.add(ratio.of_denominator)
        shared = sum(other.of_denominator == ratio.of_denominator for other in ratios.values())
        several = len(ratios) > 1 and shared == 1
        found += _modes(ratio, model.sample_time, uncertainty, probability, model.mapping.inputs[j] if several else "")
    own = None if ratios else _of_series(model, uncertainty)
    return tuple(found if own is None else _modes(own, model.sample_time, uncertainty, probability, ""))


def _of_series(model: AbstractModel, uncertainty: Uncertainty | None) -> Ratio | None:
    """The denominator of a model without inputs, which only innovations drive; ``None`` where it has none."""
    poles: NDArray[np.complex128] | None = getattr(model, "poles", None)
    if poles is None or model.mapping.inputs or not len(poles):
        return None
    names = () if uncertainty is None else uncertainty.names
    begins = next((start for start in ("a(", "A(", "F(") if any(name.startswith(start) for name in names)), "A(")
    F = np.real(np.poly(poles))
    return Ratio(B=np.ones(1), F=F, delay=0, discrete=True, of_numerator="", of_denominator=begins)


def _modes(ratio: Ratio, T: float, uncertainty: Uncertainty | None, probability: float, of: str) -> Iterator[Mode]:
    falling = ratio.F if ratio.discrete else ratio.F[::-1]
    falling = falling / falling[0]
    n = len(falling) - 1
    poles = np.roots(falling).astype(np.complex128)
    covariance = _covariance(ratio, uncertainty, n)
    slope = np.polyder(np.poly1d(falling))
    quantile = float(scipy.stats.norm.ppf(0.5 + 0.5 * probability))
    speeds: NDArray[np.float64] = np.abs(np.log(np.where(poles == 0.0, 1e-300, poles)) if ratio.discrete else poles)
    for z in poles[np.argsort(speeds)]:
        if z.imag < 0.0:
            continue
        s, moves = _rate(complex(z), ratio, T)
        if s is None:
            yield Mode(of=of, pole=complex(z), rate=None, intervals={})
            continue
        with np.errstate(all="ignore"):
            by = moves * -(z ** np.arange(n - 1, -1, -1)) / slope(z)
            spread = np.array([by.real, by.imag])
            yield _mode(of, complex(z), s, spread @ covariance @ spread.T, quantile)


def _rate(z: complex, ratio: Ratio, T: float) -> tuple[complex | None, complex]:
    """The pole in the s plane, and how it moves with the one that the polynomial has."""
    if not ratio.discrete:
        return z, 1.0
    if abs(z.imag) < NEGATIVE and z.real <= NEGATIVE:
        return None, 0.0
    if abs(z - 1.0) < AT_ONE:
        return 0.0, 1.0 / T
    return complex(np.log(z)) / T, 1.0 / (z * T)


def _mode(of: str, z: complex, s: complex, covariance: NDArray[np.float64], quantile: float) -> Mode:
    intervals: dict[str, Interval] = {}
    size = abs(s)
    if z.imag == 0.0:
        if size == 0.0:
            return Mode(of=of, pole=z, rate=s, intervals={})
        tau = -1.0 / s.real
        half = quantile * float(np.sqrt(covariance[0, 0])) / size
        if np.isfinite(half):
            ends = sorted((tau * np.exp(-half), tau * np.exp(half)))
            intervals["time_constant"] = (float(ends[0]), float(ends[1]))
        return Mode(of=of, pole=z, rate=s, time_constant=tau, intervals=intervals)
    along = np.array([s.real / size, s.imag / size])  # of the natural frequency
    damping = -s.real / size
    across = np.array([-1.0, 0.0]) / size - damping * along / size
    halves = [quantile * max(float(row @ covariance @ row), 0.0) ** 0.5 for row in (along / size, across)]
    if np.isfinite(halves).all():
        intervals["natural_frequency"] = (size * float(np.exp(-halves[0])), size * float(np.exp(halves[0])))
        intervals["damping"] = (damping - halves[1], damping + halves[1])
    return Mode(of=of, pole=z, rate=s, natural_frequency=size, damping=damping, intervals=intervals)


def _covariance(ratio: Ratio, uncertainty: Uncertainty | None, n: int) -> NDArray[np.float64]:
    """Of the denominator's coefficients below the leading one, falling powers; NaN where it is not known."""
    unknown = np.full((n, n), np.nan)
    if uncertainty is None:
        return unknown
    at = [i for i, name in enumerate(uncertainty.names) if name.startswith(ratio.of_denominator)]
    if len(at) != n:
        return unknown
    at = at if ratio.discrete else at[::-1]
    return np.asarray(uncertainty.covariance[np.ix_(at, at)])
