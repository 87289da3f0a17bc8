"""Poles as sections: pairing, reflection, and the way between the planes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.models.converting.orthonormal_basis import Domain, section_orders

TOO_FAST = 10.0
"""How many times faster than half of the sampling rate a pole is that no record shows: it settles within a sample."""

_EDGE = 1e-6
"""How far inside the stable region a reflected pole comes to lie at least (relative in the s plane)."""


def too_fast(poles: NDArray[np.complex128], sample_time: float) -> NDArray[np.complex128]:
    """Poles of the s plane that records of a sample time do not show.

    Args:
        poles: In rad/s.
        sample_time: In seconds.

    Returns:
        Those of them.

    Example:
        >>> too_fast(np.array([-1.0 + 0.0j, -1e6]), 0.1)
        array([-1000000.+0.j])
    """
    return poles[np.abs(poles) > TOO_FAST * np.pi / sample_time]


def sections_of(poles: NDArray[np.complex128], domain: Domain) -> tuple[NDArray[np.float64], ...]:
    """Denominators of the sections that have these poles.

    Args:
        poles: Closed under conjugation but for rounding.
        domain: Of the plane.

    Returns:
        Sections of second order, and one of first order at the end if the number is odd.

    Example:
        >>> [d.tolist() for d in sections_of(np.array([0.5, 0.25, -0.5]), Domain.DISCRETE)]
        [[1.0, -0.75, 0.125], [1.0, 0.5]]
    """
    tolerance = 1e-9 * np.maximum(np.abs(poles), 1e-300)
    upper = poles[poles.imag > tolerance]
    real = np.sort(poles[np.abs(poles.imag) <= tolerance].real)[::-1]
    missing = len(poles) - 2 * len(upper) - len(real)
    if missing:  # a conjugate was lost to rounding: what is left of the pair counts as real
        real = np.concatenate([real, np.zeros(max(missing, 0))])
    quadratic = [np.array([1.0, -2.0 * p.real, abs(p) ** 2]) for p in upper]
    quadratic += [np.array([1.0, -(a + b), a * b]) for a, b in zip(real[0:-1:2], real[1::2], strict=False)]
    linear = [np.array([1.0, -real[-1]])] if len(real) % 2 else []
    found = [d if domain is Domain.DISCRETE else d[::-1].copy() for d in (*quadratic, *linear)]
    orders = section_orders(len(poles))
    return tuple(found[: len(orders)])


def stabilised(poles: NDArray[np.complex128], domain: Domain) -> NDArray[np.complex128]:
    """The same poles, those outside the stable region mirrored into it.

    Args:
        poles: In the z or the s plane.
        domain: Of the plane.

    Returns:
        The same shape.
    """
    if domain is Domain.DISCRETE:
        outside = np.abs(poles) >= 1.0 - _EDGE
        inverse = 1.0 / np.conj(np.where(np.abs(poles) > 0.0, poles, 1.0))
        mirrored = np.where(np.abs(poles) > 1.0, inverse, poles)
        limited = mirrored * np.minimum(1.0, (1.0 - _EDGE) / np.maximum(np.abs(mirrored), 1e-300))
        return np.where(outside, limited, poles)
    least = _EDGE * np.maximum(np.abs(poles), 1e-300)
    return np.asarray(-np.maximum(np.abs(poles.real), least) + 1j * poles.imag)


def continuous_from(poles: NDArray[np.complex128], sample_time: float) -> NDArray[np.complex128]:
    """Poles in the s plane of what was sampled to poles in the z plane.

    Args:
        poles: In the z plane. A real one that is not positive belongs to no sampled system of that order; it becomes
            a fast real one.
        sample_time: Seconds.

    Returns:
        The same shape.
    """
    fast = (np.abs(poles.imag) < 1e-12) & (poles.real < 0.02)
    return np.asarray(np.log(np.where(fast, 0.02, poles)) / sample_time, dtype=np.complex128)


def scattered(
    n_poles: int, n_rows: int, sample_time: float, rng: np.random.Generator, domain: Domain
) -> NDArray[np.complex128]:
    """Random stable poles, real and in pairs, whose time constants lie between a few samples and the record.

    Args:
        n_poles: How many.
        n_rows: Length of the record in samples.
        sample_time: Seconds.
        rng: Source of randomness.
        domain: Of the plane.

    Returns:
        Shape ``(n_poles,)``.
    """
    pairs = n_poles // 2
    rates = 1.0 / np.exp(rng.uniform(np.log(2.0), np.log(max(n_rows / 10.0, 4.0)), pairs + n_poles % 2))
    damping = rng.uniform(0.4, 1.5, pairs)
    split = np.sqrt(np.asarray(damping**2 - 1.0, dtype=np.complex128))
    first, second = rates[:pairs] * (-damping + split), rates[:pairs] * (-damping - split)
    s = np.concatenate([first, second, -rates[pairs:]])
    return np.asarray(np.exp(s) if domain is Domain.DISCRETE else s / sample_time, dtype=np.complex128)
