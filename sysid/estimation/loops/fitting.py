"""Numbers of a loop by the least error of its free run: Levenberg-Marquardt over what the outputs do not read linearly.

Factors of the states in the outputs are least squares for any other numbers (variable projection, Golub and Pereyra
1973); of the rest differences give the slopes. Numbers are few, and a run is compiled.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid.estimation.loops.loop import Array, Loop, Samples

DIFFERENCE, RIDGE = 1e-6, 1e-14
"""Step of a difference, and what keeps states that do alike from factors without bound."""
FIRST, LESS, MORE, TRIES = 1e-2, 5.0, 4.0, 8
"""Damping at first, by how much it falls and rises, and how often it may rise."""
GAIN = 1e-3
"""Share of the error by which an iteration has to better it."""


def fitted(loop: Loop, samples: Samples, iterations: int) -> tuple[float, Loop]:
    """Fit a loop.

    Args:
        loop: Where it begins.
        samples: What it is fitted to.
        iterations: At most.

    Returns:
        The root of the mean square of what is left, in shares of the ranges, infinite where it runs away; and the loop.
    """
    theta, left = loop.theta, _left(loop, samples, loop.theta)
    if left is None:
        return np.inf, loop
    error, damping = float(left @ left), FIRST
    for _ in range(iterations):
        slopes = _slopes(loop, samples, theta, left)
        before = error
        theta, left, error, damping = _stepped(loop, samples, (theta, left, error, damping), slopes)
        if before - error < GAIN * before:
            break
    found = replace(loop, theta=theta)
    return float(np.sqrt(error / len(left))), replace(found, read=_read(found, samples))


def _left(loop: Loop, samples: Samples, theta: Array) -> Array | None:
    terms = loop.run(samples, theta)
    return None if terms is None else (samples.outputs - terms @ _factors(terms, samples.outputs)).ravel()


def _factors(terms: Array, outputs: Array) -> Array:
    """Least squares of the outputs on the states."""
    size = np.maximum(np.abs(terms).max(axis=0), 1e-9)
    scaled = terms / size
    q, r = np.linalg.qr(scaled)
    # States that do alike would have factors without bound.
    found = r.T @ (q.T @ outputs)
    gram = r.T @ r + RIDGE * len(terms) * np.eye(len(r))
    return np.asarray(np.linalg.solve(gram, found) / size[:, np.newaxis])


def _read(loop: Loop, samples: Samples) -> Array:
    terms = loop.run(samples, loop.theta)
    assert terms is not None  # noqa: S101 - its error is finite
    return _factors(terms, samples.outputs)


def _slopes(loop: Loop, samples: Samples, theta: Array, left: Array) -> Array:
    free = np.flatnonzero(loop.free)
    slopes = np.zeros((len(left), len(free)))
    for k, place in enumerate(free):
        other, by = theta.copy(), DIFFERENCE * max(1.0, abs(theta[place]))
        other[place] += by
        moved = _left(loop, samples, other)
        if moved is not None:
            slopes[:, k] = (moved - left) / by
    return slopes


def _stepped(
    loop: Loop, samples: Samples, now: tuple[Array, Array, float, float], slopes: Array
) -> tuple[Array, Array, float, float]:
    """Numbers, what is left, its squares and the damping after a step; as before where none is better."""
    theta, left, error, damping = now
    gram, fall = slopes.T @ slopes, slopes.T @ left
    weights = np.maximum(np.diag(gram), 1e-12)
    for _ in range(TRIES):
        try:
            step = np.linalg.solve(gram + np.diag(damping * weights + 1e-14), -fall)
        except np.linalg.LinAlgError:
            damping *= MORE
            continue
        other = theta.copy()
        other[loop.free] += step
        trial = _left(loop, samples, other)
        if trial is not None and float(trial @ trial) < error:
            return other, trial, float(trial @ trial), max(damping / LESS, 1e-12)
        damping *= MORE
    return theta, left, error, damping
