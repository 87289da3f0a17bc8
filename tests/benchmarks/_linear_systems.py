"""Three linear systems of a review, from a seed; needs numpy and scipy only, so that peers' environments run it too."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

SAMPLES = 2_000
"""Of the record that is fitted, and of the one without noise after it."""
NAMES = {
    "white": "white noise, 10 dB",
    "coloured": "coloured noise, 10 dB",
    "mimo": "2x2, 6 states, process noise",
}
ORDERS = {"white": 4, "coloured": 4, "mimo": 6}


def systems(seed: int) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Inputs, measured outputs and outputs without noise of each system.

    Args:
        seed: Of inputs and noise, and of the matrices of the third one.

    Returns:
        Arrays of shape ``(2 * SAMPLES, n_channels)`` by name.
    """
    rng, n = np.random.default_rng(seed), 2 * SAMPLES

    def levels(hold: int) -> np.ndarray:
        return np.repeat(rng.choice([-1.0, 1.0], n // hold + 1), hold)[:n]

    found = {}
    B = [0.0, 0.0, 0.05, 0.04, 0.02]
    A = np.poly([0.95 * np.exp(0.3j), 0.95 * np.exp(-0.3j), 0.8, 0.6]).real
    for name in ("white", "coloured"):
        u = levels(8)
        clean = lfilter(B, A, u)
        clean /= clean.std()
        e = rng.standard_normal(n)
        v = e if name == "white" else lfilter([1.0, 0.5], [1.0, -1.6, 0.72], e)
        v *= 0.316 / v.std()
        found[name] = (u[:, None], (clean + v)[:, None], clean[:, None])
    A = np.zeros((6, 6))
    for i, (r, w) in enumerate(((0.98, 0.15), (0.9, 0.6), (0.95, 1.1))):
        A[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = r * np.array([[np.cos(w), np.sin(w)], [-np.sin(w), np.cos(w)]])
    B, C, K = rng.standard_normal((6, 2)), rng.standard_normal((2, 6)), 0.15 * rng.standard_normal((6, 2))
    u = np.stack([levels(5), levels(7)], axis=1)
    x, noisy = np.zeros(6), np.zeros(6)
    y, clean = np.zeros((n, 2)), np.zeros((n, 2))
    for t in range(n):
        e = 0.8 * rng.standard_normal(2)
        clean[t], y[t] = C @ x, C @ noisy + e
        x, noisy = A @ x + B @ u[t], A @ noisy + B @ u[t] + K @ e
    return found | {"mimo": (u, y, clean)}


REST = 30
"""Samples at rest that a record for comparison begins with, so that nobody has initial states to argue about."""
POLYNOMIALS = {"b": [0.0, 1.0, 0.5], "f": [1.0, -1.5, 0.7], "c": [1.0, 0.4]}

THREE_STATES = (
    np.array([[0.8, 0.3, 0.0], [-0.3, 0.6, 0.1], [0.0, 0.0, 0.4]]),
    np.array([[1.0, 0.2], [-0.4, 0.9], [0.7, -0.5]]),
    np.array([[1.0, 0.3, -0.6], [0.2, 1.1, 0.8]]),
)
"""``A``, ``B``, ``C`` of two inputs and two outputs."""


def same_estimate(seed: int = 0, n: int = 1_000) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Records on which two tools have to find the same, since they define the same estimate there.

    Args:
        seed: Of inputs and noise.
        n: Samples.

    Returns:
        Inputs and outputs, shape ``(n, n_channels)``, by name: systems of the second order with their own noise, and
        two inputs and two outputs of three states without any.
    """
    rng = np.random.default_rng(seed)
    u, e = np.sign(rng.normal(size=n)), 0.3 * rng.normal(size=n)
    u[:REST] = e[:REST] = 0.0
    b, f, c = (POLYNOMIALS[name] for name in "bfc")
    clean = lfilter(b, f, u)
    noise = {"ARX": lfilter([1.0], f, e), "OE": e, "ARMAX": lfilter(c, f, e)}
    found = {name: (u[:, None], (clean + v)[:, None]) for name, v in noise.items()}
    inputs, y = np.sign(rng.normal(size=(n, 2))), np.zeros((n, 2))
    A, B, C = THREE_STATES
    x = np.zeros(3)
    for t in range(n):
        y[t] = C @ x
        x = A @ x + B @ inputs[t]
    return found | {"2x2": (inputs, y)}


def impulse_response(A: np.ndarray, B: np.ndarray, C: np.ndarray, lags: int = 20) -> np.ndarray:
    """The impulse response of a state space, flat."""
    return np.ravel([C @ np.linalg.matrix_power(A, k) @ B for k in range(lags)])


def fit_percent(clean: np.ndarray, run: np.ndarray) -> float:
    """Fit on the part without noise, in percent; the mean over outputs."""
    y, yh = clean[SAMPLES:], np.asarray(run)[SAMPLES:]
    left = np.linalg.norm(y - yh, axis=0) / np.linalg.norm(y - y.mean(axis=0), axis=0)
    return float(100.0 * (1.0 - left.mean()))
