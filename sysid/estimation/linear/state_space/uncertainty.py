"""How well data determine a state space: covariance of its polynomials, which no change of coordinates moves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.linear.coloured_errors import sandwich
from sysid.estimation.linear.state_space.refinement import Found
from sysid.estimation.results.uncertainty import Uncertainty, generalised_variance
from sysid.models import LinearStateSpaceModel, VectorStateSpaceModel
from sysid.models.linear.innovations import Innovations
from sysid.models.linear.state_space_polynomials import polynomials, state_space_names

Array = NDArray[np.float64]

STEP = 1e-30
"""Of a derivative along the imaginary axis, which has no rounding."""

LEFT_OPEN = 1e-14
"""Curvature of a direction, relative to the largest, below which the data leave it open."""


def _coordinates_covariance(found: Found) -> Array:
    """Covariance of the local coordinates at the least prediction error; NaN where the data leave one open."""
    half, P = coordinates_root(found), found.chart.n_parameters
    return np.asarray(half @ half.T) if half.shape[1] == P else np.full((P, P), np.nan)


def coordinates_root(found: Found) -> Array:
    """A factor of that covariance, over the directions that the data determine.

    Where errors hang together it is that of the sandwich, see :mod:`sysid.estimation.linear.coloured_errors`.

    Args:
        found: The fit.

    Returns:
        Shape ``(n_parameters, n_directions)``.
    """
    deviation = np.sqrt(2.0 * found.at.loss / max(found.n_samples - found.chart.n_parameters, 1))
    root, scaled = found.at.scaled()
    sizes, vectors = linalg.eigh(scaled)
    kept = sizes > LEFT_OPEN * sizes[-1]
    half = vectors[:, kept] / np.sqrt(sizes[kept]) / root[:, np.newaxis]
    return np.asarray(deviation * (half if found.coloured is None else sandwich(half, found.coloured, found.n_samples)))


def derivatives(found: Found, function: Callable[[Innovations], NDArray[np.complex128]]) -> Array:
    """Derivatives of an analytic function of the matrices with respect to the local coordinates.

    Args:
        found: The fit.
        function: From a system, of complex matrices, to some numbers.

    Returns:
        Shape ``(n_numbers, n_parameters)``.
    """
    base = found.system.entries
    columns = [function(found.system.at(base + 1j * STEP * direction)).imag / STEP for direction in found.chart.basis.T]
    return np.column_stack(columns)


def state_space_uncertainty(model: LinearStateSpaceModel | VectorStateSpaceModel, found: Found) -> Uncertainty:
    """What the prediction errors say about denominator, numerators, noise and constant, in the channels' units.

    Args:
        model: The fitted model.
        found: How it was found.

    Returns:
        The uncertainty: ``B(input, lag)``, ``F(lag)``, ``C(lag)`` of the innovations and ``constant``; of several
        outputs ``B(output, input, lag)``, ``F(lag)``, ``C(output, innovation, lag)`` and ``constant(output)``. Its
        noise variance is that of the innovations, of several outputs the root of their covariance's determinant.
    """
    scaling, orders, p = model.scaling, model.orders, found.system.n_outputs
    scale, offset = np.atleast_1d(scaling.output_scale), np.atleast_1d(scaling.output_offset)
    gains = scale[:, np.newaxis] / np.array(scaling.input_scale)
    across = scale[:, np.newaxis] / scale
    first = orders.shortest

    def coefficients(system: Innovations) -> NDArray[np.complex128]:
        F, numerators, noise = polynomials(system)
        parts = [(gains[:, :, np.newaxis] * numerators)[:, :, first:].ravel(), F[1:]]
        parts += [(across[:, :, np.newaxis] * noise)[:, :, 1:].ravel()] * orders.noise
        return np.concatenate([*parts, *[scale * system.constant] * orders.intercept])

    J = derivatives(found, coefficients)
    values = np.real(coefficients(found.system))
    if orders.intercept:
        values[-p:] += offset
    covariance = found.covariance * np.outer(scale, scale)
    return Uncertainty(
        names=state_space_names(orders, model.mapping),
        values=values,
        covariance=J @ _coordinates_covariance(found) @ J.T,
        noise_variance=generalised_variance(covariance),
        noise_covariance=covariance if p > 1 else None,
    )
