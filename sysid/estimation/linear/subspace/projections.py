r"""From windows to a state: the projections and weightings of the subspace methods.

The future outputs of a window are :math:`Y_f = \Theta_W W_p + \Theta_U U_f + \text{noise}` with the past :math:`W_p`;
what the past says of them goes through the state, so that :math:`\Theta_W` has rank :math:`n` but for noise.
Weightings differ in what they decompose (Van Overschee and De Moor 1996, "Subspace identification for linear
systems", theorem
12):

* ``N4SID``: :math:`\Theta_W W_p`, the oblique projection;
* ``MOESP``: :math:`\Theta_W W_p \Pi`, where :math:`\Pi` takes away what the future inputs explain;
* ``CVA``: the same, outputs weighted by the inverse root of their covariance given the inputs, so that the singular
  values are canonical correlations;
* ``SSARX`` (Jansson 2003, "Subspace identification and ARX modeling"): the Markov parameters of the predictor are those
  of a long ARX model; what it says of the future inputs and outputs is subtracted from :math:`Y_f`, and canonical
  correlations of the rest with :math:`W_p` give the state. Future inputs may then depend on past noise: it is the
  choice for records under feedback.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.linear.subspace.windows import Windows

Array = NDArray[np.float64]

NOTHING = 1e-9
"""Singular values below this share of the largest carry nothing: a record without noise has many."""


class Weighting(enum.Enum):
    """How a subspace method weighs what it decomposes."""

    N4SID = "N4SID"
    MOESP = "MOESP"
    CVA = "CVA"
    SSARX = "SSARX"


@dataclass(frozen=True, kw_only=True, eq=False)
class Projection:
    """The state as a function of the past.

    Args:
        singular_values: Descending; the state has as many directions as stand out.
        to_state: From a window's constant and past to all directions of the state, scaled by their singular values,
            shape ``(n_past_columns, n_directions)``.
    """

    singular_values: Array
    to_state: Array

    def state(self, n: int) -> Array:
        """From a window's constant and past to the first directions, shape ``(n_past_columns, n)``."""
        return self.to_state[:, :n]


def project(windows: Windows, weighting: Weighting, *, feedthrough: bool) -> Projection:
    """Decompose what the past says of the future.

    Args:
        windows: The data.
        weighting: Which method.
        feedthrough: Whether outputs depend on inputs of the same sample.

    Returns:
        The projection.
    """
    ones, future = windows.constant, windows.outputs(0, windows.future)
    past = np.concatenate([ones, windows.at(-windows.past, 0)], axis=1)
    if weighting is Weighting.SSARX:
        own = future - _foreseen(windows, past, feedthrough=feedthrough)
        theta = regress(past, own)
        return _decomposed(_rest(past, ones), theta, _whitening(_rest(own, ones)))
    given = np.concatenate([ones, windows.inputs(0, windows.future)], axis=1)
    theta = regress(np.concatenate([past, given[:, 1:]], axis=1), future)[: past.shape[1]]
    if weighting is Weighting.N4SID:
        return _decomposed(_rest(past, ones), theta, np.eye(future.shape[1]))
    left = _rest(past, given)
    weights = _whitening(_rest(future, given)) if weighting is Weighting.CVA else np.eye(future.shape[1])
    return _decomposed(left, theta, weights)


def regress(columns: Array, targets: Array) -> Array:
    """Least squares by columns of a like size; the shortest solution where they leave a choice.

    Args:
        columns: Shape ``(n_rows, n_columns)``.
        targets: Shape ``(n_rows, n_targets)``.

    Returns:
        Shape ``(n_columns, n_targets)``.
    """
    if not columns.size or not targets.size:
        return np.zeros((columns.shape[1], targets.shape[1]))
    norms = np.linalg.norm(columns, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    found = linalg.lstsq(columns / scale, targets, cond=1e-11, check_finite=False, lapack_driver="gelsy")[0]
    return np.asarray(found / scale[:, np.newaxis])


def _rest(columns: Array, given: Array) -> Array:
    """What some columns leave of others."""
    basis = linalg.orth(given / np.maximum(np.linalg.norm(given, axis=0), np.finfo(np.float64).tiny))
    return np.asarray(columns - basis @ (basis.T @ columns))


def _whitening(columns: Array) -> Array:
    """The inverse root of a covariance; directions without any variance are left out."""
    _, sizes, Vt = linalg.svd(columns, full_matrices=False)
    kept = sizes > NOTHING * max(float(sizes[0]), np.finfo(np.float64).tiny)
    return np.asarray(Vt[kept].T / sizes[kept])


def _decomposed(past: Array, theta: Array, weights: Array) -> Projection:
    _, sizes, Vt = linalg.svd(past @ theta @ weights, full_matrices=False)
    return Projection(singular_values=sizes, to_state=theta @ weights @ Vt.T)


def _foreseen(windows: Windows, past: Array, *, feedthrough: bool) -> Array:
    """What a long ARX model says of future outputs from inputs and outputs within the future."""
    p, width = windows.n_outputs, windows.n_inputs + windows.n_outputs
    now = windows.inputs(0, 1)
    regressors = np.concatenate([past, now], axis=1) if feedthrough else past
    theta = regress(regressors, windows.outputs(0, 1))
    markov = theta[1 : past.shape[1]].reshape(windows.past, width, p)  # oldest lag first
    direct = theta[past.shape[1] :]
    found = np.zeros((len(past), windows.future, p))
    for k in range(windows.future):
        lags = min(k, windows.past)
        if lags:
            found[:, k] = windows.at(k - lags, k) @ markov[windows.past - lags :].reshape(lags * width, p)
        if feedthrough:
            found[:, k] += windows.inputs(k, k + 1) @ direct
    return found.reshape(len(past), -1)


def arx_orders(windows: Windows) -> list[float]:
    """Akaike's criterion of long ARX models with one lag, two, and so on up to the past's length.

    Args:
        windows: The data.

    Returns:
        One value an order, from 1 on.
    """
    target, found = windows.outputs(0, 1), []
    for order in range(1, windows.past + 1):
        columns = np.concatenate([windows.constant, windows.at(-order, 0)], axis=1)
        left = target - columns @ regress(columns, target)
        covariance = left.T @ left / max(windows.n_rows, 1)
        sign, size = np.linalg.slogdet(covariance + 1e-18 * np.eye(len(covariance)))
        count = columns.shape[1] * windows.n_outputs
        found.append(windows.n_rows * (size if sign > 0 else -np.inf) + 2.0 * count)
    return found
