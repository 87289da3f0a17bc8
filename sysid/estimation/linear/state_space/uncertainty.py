"""How well data determine a state space: covariance of its polynomials, which no change of coordinates moves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.linear.state_space.coordinates import flat, split
from sysid.estimation.linear.state_space.search import Found
from sysid.estimation.uncertainty import Uncertainty
from sysid.models import LinearStateSpaceModel
from sysid.models.innovations import Innovations
from sysid.models.linear_state_space import polynomials

Array = NDArray[np.float64]

STEP = 1e-30
"""Of a derivative along the imaginary axis, which has no rounding."""


def coordinates_covariance(found: Found) -> Array:
    """Covariance of the local coordinates at the least prediction error; NaN where the data leave one open.

    Args:
        found: The fit.

    Returns:
        Shape ``(n_parameters, n_parameters)``.
    """
    H, P = found.at.gauss_newton, found.chart.n_parameters
    variance = 2.0 * found.at.loss / max(found.n_samples - P, 1)
    root = np.sqrt(np.diag(H))
    sizes, vectors = linalg.eigh(H / np.outer(root, root))
    if not sizes[0] > 1e-14 * sizes[-1]:
        return np.full((P, P), np.nan)
    half = vectors / np.sqrt(sizes) / root[:, np.newaxis]
    return np.asarray(variance * (half @ half.T))


def derivatives(found: Found, function: Callable[[Innovations], NDArray[np.complex128]]) -> Array:
    """Derivatives of an analytic function of the matrices with respect to the local coordinates.

    Args:
        found: The fit.
        function: From a system, of complex matrices, to some numbers.

    Returns:
        Shape ``(n_numbers, n_parameters)``.
    """
    base = flat(found.system)
    columns = [
        function(split(base + 1j * STEP * direction, found.system)).imag / STEP for direction in found.chart.basis.T
    ]
    return np.column_stack(columns)


def state_space_uncertainty(model: LinearStateSpaceModel, found: Found) -> Uncertainty:
    """What the prediction errors say about denominator, numerators, noise and constant, in the channels' units.

    Args:
        model: The fitted model.
        found: How it was found.

    Returns:
        The uncertainty: ``F(lag)``, ``B(input, lag)``, ``C(lag)`` of the innovations, ``constant``.
    """
    gains = model.scaling.output_scale / np.array(model.scaling.input_scale)
    first, orders = (0 if model.orders.feedthrough else 1), model.orders

    def coefficients(system: Innovations) -> NDArray[np.complex128]:
        F, numerators, noise = polynomials(system)
        parts = [gain * row[first:] for gain, row in zip(gains, numerators[0], strict=True)]
        parts += [F[1:]] + [noise[0, 0, 1:]] * orders.noise
        return np.concatenate([*parts, model.scaling.output_scale * system.constant * orders.intercept])[: len(names)]

    lags = range(1, orders.states + 1)
    names = [f"B({name}, {lag})" for name in model.mapping.inputs for lag in range(first, orders.states + 1)]
    names += [f"F({lag})" for lag in lags] + [f"C({lag})" for lag in lags] * orders.noise
    names += ["constant"] * orders.intercept
    J = derivatives(found, coefficients)
    values = np.real(coefficients(found.system))
    if orders.intercept:
        values[-1] += model.scaling.output_offset
    variance = float(found.covariance[0, 0]) * model.scaling.output_scale**2
    return Uncertainty(
        names=tuple(names),
        values=values,
        covariance=J @ coordinates_covariance(found) @ J.T,
        noise_variance=variance,
    )
