"""The input at which a plant that integrates stands: no constant of the output undoes the ramp that another one makes.

It is linear beside the numerator: what the input adds up to from its level is what it adds up to from zero, and a ramp.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.records import tap_slices
from sysid.estimation.linear.variable_projection import SeparableProvider, Separated
from sysid.models.converting.orthonormal_basis import Domain, section_poles

Array = NDArray[np.float64]


def integrating(separated: Separated, domain: Domain, sample_time: float) -> int | None:
    """The first input with a pole at the edge, but for rounding.

    Args:
        separated: The linear part at some poles.
        domain: Of the poles.
        sample_time: Seconds.

    Returns:
        Which one; ``None`` where there is none.
    """
    for j, basis in enumerate(separated.bases):
        poles = np.concatenate([section_poles(section.denominator, domain) for section in basis])
        if at_edge(poles, domain, sample_time).any():
            return j
    return None


def at_edge(poles: NDArray[np.complex128], domain: Domain, sample_time: float) -> NDArray[np.bool_]:
    """Which poles are those of integrators.

    Args:
        poles: Of one input, in the z or the s plane.
        domain: Of the poles.
        sample_time: Seconds.

    Returns:
        The same shape.
    """
    away = poles - 1.0 if domain is Domain.DISCRETE else poles * sample_time
    return np.asarray(np.abs(away) <= slow_poles.INTEGRATES)


def standing(provider: SeparableProvider, raised: SeparableProvider, theta: Array, j: int) -> float | None:
    """The value of an integrating input, in scaled numbers, at which the output does not move on.

    Args:
        provider: The least-squares problem, with states that are fitted before each record.
        raised: The same with that input larger by 1.
        theta: Poles, one of that input at the edge.
        j: Which input.

    Returns:
        The value; ``None`` where there is none, or the errors are those of a predictor.
    """
    here, there = provider.separated(theta), raised.separated(theta)
    if here is None or there is None or here.mirrored or there.mirrored:
        return None
    table = provider.design(here.columns, here.constants)
    target = np.concatenate([record.target * record.root_weights for record in provider.records])
    own = tap_slices(here.bases)[j]
    by_one = np.concatenate(
        [
            (b[:, own] - a[:, own]) * record.root_weights[:, np.newaxis]
            for a, b, record in zip(here.columns, there.columns, provider.records, strict=True)
        ]
    )
    # First with a ramp of any size, for the numerator; then with the ramp of that numerator.
    taps = _solved(np.hstack([table, by_one]), target)[own]
    ramp = by_one @ taps
    if not ramp.any():
        return None
    return -float(_solved(np.column_stack([table, ramp]), target)[-1])


def _solved(table: Array, target: Array) -> Array:
    norms = np.linalg.norm(table, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    return np.asarray(np.linalg.lstsq(table / scale, target, rcond=1e-11)[0] / scale)
