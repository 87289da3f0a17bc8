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


def fit_percent(clean: np.ndarray, run: np.ndarray) -> float:
    """Fit on the part without noise, in percent; the mean over outputs."""
    y, yh = clean[SAMPLES:], np.asarray(run)[SAMPLES:]
    left = np.linalg.norm(y - yh, axis=0) / np.linalg.norm(y - y.mean(axis=0), axis=0)
    return float(100.0 * (1.0 - left.mean()))
