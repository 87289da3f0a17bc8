"""Poles of one structure in another: which ones it contains, poles filled up, looked at in the z plane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.poles import sections_of
from sysid.estimation.linear.variable_projection import Sections
from sysid.models import TransferFunction
from sysid.models.converting.orthonormal_basis import Domain, section_poles

FASTEST = 30.0
"""Rate, times the sample time, of a pole that is there for no sample to see."""
FASTEST = 700.0
"""Growth within a sample beyond which numbers end."""
GROWS, BACK = 1e-6, 1e-6
"""Rate per sample from which a pole is one that grows, and by how much such a one is drawn back."""
MOST_CONTAINED = 12
"""Structures within one, over its inputs, up to which all of them are fitted as starts for it; of larger ones a chain
down to there."""


def next_smaller(orders: TransferFunction) -> list[TransferFunction]:
    """The largest structures that one contains, with one zero or one pole less.

    Where there are many of them it is a single one, with a pole less for each input that has the most, or a zero. One
    input after the other would be a chain as long as there are poles: of three inputs with three poles fifteen fits.

    Args:
        orders: The structure.

    Returns:
        The structures; none where it has one pole and no zero for each input.

    Example:
        >>> [one.label for one in next_smaller(TransferFunction(poles=(2,), zeros=(1,), delays=(1,)))]
        ['TF [2; 0; 1]', 'TF [1; 1; 1]']
    """
    pairs = list(enumerate(zip(orders.poles, orders.zeros, strict=True)))
    if _contained(orders) > MOST_CONTAINED // len(pairs):
        most, zero = max(orders.poles), max(orders.zeros)
        poles = tuple(n - (n == most > 1) for n in orders.poles)
        zeros = tuple(min(m - (most == 1 and m == zero), n) for m, n in zip(orders.zeros, poles, strict=True))
        return [replace(orders, poles=poles, zeros=zeros)]
    one_pole_less = [_with(orders, j, n - 1, min(m, n - 1)) for j, (n, m) in pairs if n > 1]
    return [*(_with(orders, j, n, m - 1) for j, (n, m) in pairs if m > 0), *one_pole_less]


def _with(orders: TransferFunction, j: int, poles: int, zeros: int) -> TransferFunction:
    return replace(
        orders,
        poles=(*orders.poles[:j], poles, *orders.poles[j + 1 :]),
        zeros=(*orders.zeros[:j], zeros, *orders.zeros[j + 1 :]),
    )


def _contained(orders: TransferFunction) -> int:
    """How many structures there are within one, itself among them."""
    each = [sum(min(m, k) + 1 for k in range(1, n + 1)) for n, m in zip(orders.poles, orders.zeros, strict=True)]
    return int(np.prod(each, dtype=np.float64))


def filled_up(sections: Sections, orders: TransferFunction, sample_time: float) -> Sections:
    """The same poles, and where some are missing such as change nothing: at 0, or faster than any sample shows.

    Args:
        sections: For each input its sections.
        orders: The structure to fill up to.
        sample_time: Seconds.

    Returns:
        For each input its sections.
    """
    filled = []
    for part, n in zip(sections, orders.poles, strict=True):
        poles = np.concatenate([section_poles(d, orders.domain) for d in part])
        extra = np.zeros(n - len(poles))
        if orders.domain is Domain.CONTINUOUS:
            # Faster than any sample shows, and one that has run away is brought back to there.
            limit = FASTEST / sample_time
            poles = np.where(np.abs(poles) < limit, poles, -limit)
            extra = np.full(n - len(poles), -limit)
        growth = (
            np.log(np.maximum(np.abs(poles), 1e-300)) if orders.domain is Domain.DISCRETE else poles.real * sample_time
        )
        # One that grows may stand where it can just be run freely: rounding must not move it beyond.
        poles = np.where(growth > GROWS, poles * (1.0 - BACK), poles)
        filled.append(sections_of(np.concatenate([poles, extra]).astype(np.complex128), orders.domain))
    return tuple(filled)


def _poles(sections: Sections, domain: Domain, sample_time: float) -> NDArray[np.complex128]:
    """All poles in the z plane."""
    poles = np.concatenate([section_poles(d, domain) for part in sections for d in part])
    if domain is Domain.DISCRETE:
        return poles
    moved = poles * sample_time
    return np.asarray(np.exp(np.minimum(moved.real, FASTEST) + 1j * moved.imag), dtype=np.complex128)


def slowness(sections: Sections, domain: Domain, sample_time: float) -> float:
    """Magnitude of the slowest pole in the z plane.

    Args:
        sections: For each input its sections.
        domain: Their domain.
        sample_time: Seconds.

    Returns:
        It.
    """
    return float(np.abs(_poles(sections, domain, sample_time)).max())
