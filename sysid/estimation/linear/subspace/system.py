"""From a state to the system's matrices: regressions among states, inputs and outputs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.linear.subspace.projections import Projection, regress
from sysid.estimation.linear.subspace.windows import Windows
from sysid.models.linear.innovations import Innovations, spectral_radius

Array = NDArray[np.float64]

EDGE, INSIDE = 1.0 - 1e-6, 1.0 - 1e-4
"""Largest magnitude of a pole where a system is to be stable, and that at which one outside begins."""


def realise(windows: Windows, projection: Projection, n: int, *, feedthrough: bool, noise: bool) -> Innovations:
    """The system whose state is the first directions of a projection.

    Args:
        windows: The data.
        projection: From :func:`~sysid.estimation.linear.subspace.projections.project`.
        n: How many states.
        feedthrough: Whether outputs depend on inputs of the same sample.
        noise: Whether the noise is modelled.

    Returns:
        The system; its predictor is stable.
    """
    J, ones, u, y = projection.state(n), windows.constant, windows.inputs(0, 1), windows.outputs(0, 1)
    now = np.concatenate([ones, windows.at(-windows.past, 0)], axis=1) @ J
    after = np.concatenate([ones, windows.at(1 - windows.past, 1)], axis=1) @ J
    size = np.linalg.norm(now, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    now, after = now / size, after / size
    m = windows.n_inputs
    seen = np.concatenate([now, ones, *([u] if feedthrough else [])], axis=1)
    of_output = regress(seen, y).T
    C, constant = of_output[:, :n], of_output[:, n]
    D = of_output[:, n + 1 :] if feedthrough else np.zeros((len(C), m))
    e = y - seen @ of_output.T
    # The innovation is among the regressors: an input under feedback depends on it.
    moving = np.concatenate([now, ones, u, e], axis=1)
    moved = regress(moving, after).T
    A, drift, B, K = np.split(moved, [n, n + 1, n + 1 + m], axis=1)
    # The state's own constant is moved into the output, where the model has it.
    origin = linalg.lstsq(np.eye(n) - A, drift[:, 0], cond=1e-9)[0]
    if not noise:
        K = np.zeros_like(K)
    elif spectral_radius(A - K @ C) >= EDGE:
        left = after - moving @ moved.T
        K = _by_riccati(A, C, left.T @ left + K @ (e.T @ e) @ K.T, e.T @ e, K @ (e.T @ e))
    return Innovations(A=A, B=B, C=C, D=D, K=K, constant=constant + C @ origin)


def _by_riccati(A: Array, C: Array, Q: Array, R: Array, S: Array) -> Array:
    """The Kalman gain for covariances of the state's and the output's noise, whose predictor is stable."""
    floor = 1e-12 * max(float(np.trace(R)), np.finfo(np.float64).tiny)
    R, Q = R + floor * np.eye(len(R)), Q + floor * np.eye(len(Q))
    try:
        P = linalg.solve_discrete_are(A.T, C.T, Q, R, s=S)
    except (linalg.LinAlgError, ValueError):
        return np.zeros((len(A), len(C)))
    K = np.asarray(linalg.solve(C @ P @ C.T + R, (A @ P @ C.T + S).T, assume_a="pos").T)
    return K if spectral_radius(A - K @ C) < 1.0 else np.zeros_like(K)  # there is next to no noise to tell it from


def foreseeing(system: Innovations) -> Innovations:
    """The same system with a gain whose predictor is stable, for innovations as large in each output.

    Args:
        system: The system, with a model of the noise or without.

    Returns:
        It as it is where its predictor is stable, or has no gain.
    """
    K, one = system.K, np.eye(system.n_outputs)
    if not K.any() or system.predictor_radius < EDGE:
        return system
    return replace(system, K=_by_riccati(system.A, system.C, K @ K.T, one, K))


def stabilised(system: Innovations, largest: float = EDGE) -> Innovations:
    """The same system with every pole outside the unit circle mirrored into it.

    Args:
        system: The system.
        largest: Magnitude that no pole may reach.

    Returns:
        The system as it is where it is stable; otherwise with the output map kept and ``B`` to be fitted again.
    """
    if system.radius < largest:
        return system
    inside = min(INSIDE, 2.0 * largest - 1.0)
    T, Z = linalg.schur(system.A, output="complex")
    poles = np.diag(T)
    size = np.maximum(np.abs(poles), np.finfo(np.float64).tiny)
    mirrored = np.where(size > inside, poles / size * np.minimum(1.0 / np.maximum(size, 1.0), inside), poles)
    T = T - np.diag(poles) + np.diag(mirrored)
    A = np.real(Z @ T @ Z.conj().T)
    return Innovations(A=A, B=system.B, C=system.C, D=system.D, K=system.K, constant=system.constant)
