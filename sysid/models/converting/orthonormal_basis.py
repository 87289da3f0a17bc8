r"""Orthonormal (Kautz) bases: a rational function as a chain of sections of first or second order, tapped between them.

A transfer function :math:`B/F` with :math:`n_p` poles and :math:`n_z \le n_p` zeros is written

.. math::
    \frac{B}{F} = \sum_k \theta_k \psi_k, \qquad F = \prod_j F_j,

where the :math:`\psi_k` span exactly the functions with that :math:`F` and a numerator of degree :math:`n_z`. With all
numerators allowed they are the Takenaka-Malmquist (for pairs of poles: Kautz) functions, orthonormal on the unit circle
or the imaginary axis: each section is tapped and handed on through its all-pass :math:`\tilde F_j/F_j` (Ninness and
Gustafsson 1997, "A unifying construction of orthonormal bases for system identification"; the basis of the
Sanathanan-Koerner iterations in Drmač et al. 2015). Fewer zeros are had by handing on through :math:`1/F_j`, untapped,
at the head of the chain; as many zeros as poles by tapping the input itself.

Why not polynomials: the roots of a polynomial of degree 20 with roots near 1 move by more than their distance from the
circle when its coefficients are rounded. Sections keep every pole to full precision.

Coefficients stand in ascending powers of :math:`q^{-1}` (discrete) or of :math:`s` (continuous).
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError

_TINY = 1e-12


class Domain(enum.Enum):
    """Which variable a transfer function is written in."""

    DISCRETE = "discrete"
    CONTINUOUS = "continuous"


@dataclass(frozen=True, kw_only=True, eq=False)
class BasisSection:
    """One section of a basis, with numerators over its own denominator.

    Args:
        denominator: Shape ``(order + 1,)``.
        taps: Numerators of what is tapped, shape ``(n_taps, order + 1)``.
        onward: Numerator of what is handed on, shape ``(order + 1,)``.
    """

    denominator: NDArray[np.float64]
    taps: NDArray[np.float64]
    onward: NDArray[np.float64]

    @property
    def order(self) -> int:
        """Poles of the section."""
        return len(self.denominator) - 1


def section_orders(n_poles: int) -> tuple[int, ...]:
    """Orders of the sections that hold that many poles: pairs, and one alone at the end.

    Args:
        n_poles: Number of poles.

    Returns:
        The orders.

    Example:
        >>> section_orders(5)
        (2, 2, 1)
    """
    return (2,) * (n_poles // 2) + (1,) * (n_poles % 2)


def basis_of(denominators: Sequence[NDArray[np.float64]], n_zeros: int, domain: Domain) -> tuple[BasisSection, ...]:
    """The basis of some sections whose taps span all numerators of a degree.

    Args:
        denominators: Of each section: ``[1, c1, c2]`` in powers of ``1/q``, or ``[c0, c1, 1]`` in powers of ``s``.
        n_zeros: Degree of the numerator, at most the number of poles.
        domain: Which of the two.

    Returns:
        One section per section; their taps number ``n_zeros + 1``.

    Raises:
        ConfigError: If there are more zeros than poles.
    """
    left = sum(len(d) - 1 for d in denominators)
    wanted = n_zeros + 1
    if not 0 < wanted <= left + 1:
        raise ConfigError(
            "not the orders of a transfer function",
            expected=f"no more zeros than poles, from 0 to {left} zeros",
            got=f"{left} poles and {n_zeros} zeros",
            remedy="lower the number of zeros, or raise the number of poles",
        )
    basis = []
    for denominator in denominators:
        order = len(denominator) - 1
        taps, all_pass = _orthonormal(denominator, domain)
        pole_gain = denominator.sum() if domain is Domain.DISCRETE else denominator[0]
        plain = np.zeros(order + 1)
        plain[0] = max(abs(pole_gain), _TINY)
        if wanted <= left - order:
            section = BasisSection(denominator=denominator, taps=np.empty((0, order + 1)), onward=plain)
        elif wanted > left:  # the first section: its own denominator as a numerator hands the input through
            section = BasisSection(denominator=denominator, taps=np.vstack([denominator, taps]), onward=all_pass)
        elif wanted == left:
            section = BasisSection(denominator=denominator, taps=taps, onward=all_pass)
        else:
            section = BasisSection(denominator=denominator, taps=plain[np.newaxis], onward=plain)
        wanted -= len(section.taps)
        left -= order
        basis.append(section)
    return tuple(basis)


def _orthonormal(d: NDArray[np.float64], domain: Domain) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Numerators of the orthonormal functions of one section, and of its all-pass."""
    if domain is Domain.DISCRETE:
        if len(d) == 2:
            return np.array([[_root(1.0 - d[1] ** 2), 0.0]]), np.array([d[1], 1.0])
        c2 = d[2]
        b = -d[1] / (1.0 + c2) if 1.0 + c2 != 0.0 else 0.0
        first = _root(1.0 - c2**2)
        return np.array([[first, -b * first, 0.0], [0.0, first * _root(1.0 - b**2), 0.0]]), d[::-1].copy()
    if len(d) == 2:
        return np.array([[_root(2.0 * d[0]), 0.0]]), np.array([-d[0], 1.0])
    c0, c1 = d[0], d[1]
    slope = _root(2.0 * c1)
    return np.array([[0.0, slope, 0.0], [slope * _root(c0), 0.0, 0.0]]), np.array([c0, -c1, 1.0])


def _root(square: float) -> float:
    """A scale: exact where the section is stable, and any positive number where it is not."""
    return float(np.sqrt(max(abs(square), _TINY)))


def numerators(basis: Sequence[BasisSection]) -> NDArray[np.float64]:
    """The numerator of every tap over the whole denominator.

    Args:
        basis: The sections.

    Returns:
        Shape ``(n_taps, n_poles + 1)``, ascending powers.
    """
    n = sum(section.order for section in basis)
    rows = []
    before = np.ones(1)
    for i, section in enumerate(basis):
        after = denominator(basis[i + 1 :])
        for tap in section.taps:
            product = np.convolve(np.convolve(before, tap), after)[: n + 1]
            rows.append(np.pad(product, (0, n + 1 - len(product))))
        before = np.convolve(before, section.onward)
    return np.array(rows)


def denominator(basis: Sequence[BasisSection]) -> NDArray[np.float64]:
    """The product of the sections' denominators.

    Args:
        basis: The sections.

    Returns:
        Shape ``(n_poles + 1,)``, ascending powers.
    """
    product = np.ones(1)
    for section in basis:
        product = np.convolve(product, section.denominator)
    return product


def section_poles(d: NDArray[np.float64], domain: Domain) -> NDArray[np.complex128]:
    """Poles of one section, in the z or the s plane.

    Args:
        d: Its denominator.
        domain: Which plane.

    Returns:
        Shape ``(order,)``.
    """
    return np.asarray(np.roots(d if domain is Domain.DISCRETE else d[::-1]), dtype=np.complex128)


def growth(d: NDArray[np.float64], domain: Domain) -> float:
    """How fast the slowest pole of one section dies away, or the fastest grows.

    Args:
        d: Its denominator, of order 1 or 2.
        domain: Its domain.

    Returns:
        The largest magnitude of a pole (discrete), the largest real part (continuous).
    """
    if domain is Domain.CONTINUOUS:
        c1, c0 = float(d[-2]), float(d[0])
        if len(d) == 2:
            return -c0
        bent = c1 * c1 - 4.0 * c0
        return 0.5 * (-c1 + (math.sqrt(bent) if bent > 0.0 else 0.0))
    c1 = float(d[1])
    if len(d) == 2:
        return abs(c1)
    c2 = float(d[2])
    bent = c1 * c1 - 4.0 * c2
    return math.sqrt(c2) if bent < 0.0 else 0.5 * (abs(c1) + math.sqrt(bent))


def responses(basis: Sequence[BasisSection], variable: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Every tap's value on a grid of ``1/z`` or ``s``.

    Args:
        basis: The sections.
        variable: Shape ``(n_points,)``.

    Returns:
        Shape ``(n_points, n_taps)``.
    """
    columns = []
    x = np.ones(len(variable), dtype=np.complex128)
    for section in basis:
        powers = powers_of(variable, section.order)
        v = x / (powers @ section.denominator)
        columns.append((powers @ section.taps.T) * v[:, np.newaxis])
        x = (powers @ section.onward) * v
    return np.concatenate(columns, axis=1)


def powers_of(variable: NDArray[np.complex128], order: int) -> NDArray[np.complex128]:
    """Powers by multiplication: NumPy's ``**`` takes a logarithm of every complex number.

    Args:
        variable: Shape ``(n_points,)``.
        order: The highest.

    Returns:
        Shape ``(n_points, order + 1)``.
    """
    powers = np.ones((len(variable), order + 1), dtype=np.complex128)
    for k in range(order):
        np.multiply(powers[:, k], variable, out=powers[:, k + 1])
    return powers
