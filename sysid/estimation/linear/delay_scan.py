"""Which dead times a frequency response may have: Sanathanan-Koerner iterations of all that are tried at once.

A scan compares some hundred dead times, and of each only what it comes to after a few steps counts. So the steps are
those of :mod:`sysid.estimation.linear.sanathanan_koerner` for all of them together, with powers of the scaled frequency
over the denominator of the step before in place of an orthonormal basis: for the few poles of one model they are as
good, and a batch of them is one call of LAPACK's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.poles import stabilised
from sysid.models.converting.orthonormal_basis import Domain

Complex = NDArray[np.complex128]
Array = NDArray[np.float64]

BATCH = 64
"""Dead times at once: more take no less time each."""
TINY = 1e-300


def scan_losses(
    dead: Complex,
    target: Complex,
    variable: Complex,
    start: Complex,
    zeros: int,
    *,
    domain: Domain,
    root_weights: Array,
    iterations: int,
) -> Array:
    """What is left with each of some dead times.

    Args:
        dead: The input with each dead time, shape ``(n_delays, n_points)``.
        target: Output spectrum, shape ``(n_points,)``.
        variable: ``1/z`` or ``s`` at each point, shape ``(n_points,)``.
        start: Poles to begin with.
        zeros: Degree of the numerator, at most the number of poles.
        domain: Of the poles.
        root_weights: Square root of each point's weight, shape ``(n_points,)``.
        iterations: How many.

    Returns:
        Weighted squares of the errors with poles that are stable, shape ``(n_delays,)``.
    """
    parts = [
        _losses(dead[at : at + BATCH], target, variable, start, zeros, domain, root_weights, iterations)
        for at in range(0, len(dead), BATCH)
    ]
    return np.concatenate(parts)


def _losses(  # noqa: PLR0917 - as above
    dead: Complex,
    target: Complex,
    variable: Complex,
    start: Complex,
    zeros: int,
    domain: Domain,
    root: Array,
    steps: int,
) -> Array:
    n, discrete = len(start), domain is Domain.DISCRETE
    unit = 1.0 if discrete else float(np.abs(variable).max())
    powers = (variable / unit)[:, np.newaxis] ** np.arange(n + 1)
    poles = np.tile(start / unit, (len(dead), 1))
    for _ in range(steps):
        below = _polynomials(stabilised(poles, domain), discrete=discrete)
        over = powers[np.newaxis] / (below @ powers.T)[:, :, np.newaxis]
        free = over[:, :, 1:] if discrete else over[:, :, :n]
        table = np.concatenate(
            [-free * target[:, np.newaxis], over[:, :, : zeros + 1] * dead[:, :, np.newaxis]], axis=2
        )
        known = over[:, :, 0] if discrete else over[:, :, n]
        rows = np.asarray(table * root[:, np.newaxis], dtype=np.complex128)
        solution = _solved(rows, np.asarray(known * target * root, dtype=np.complex128))[0]
        following = np.concatenate(
            [np.ones((len(dead), 1)), solution[:, :n]] if discrete else [solution[:, :n], np.ones((len(dead), 1))],
            axis=1,
        )
        poles = _roots(following, discrete=discrete)
    below = _polynomials(stabilised(poles, domain), discrete=discrete)
    over = powers[np.newaxis, :, : zeros + 1] / (below @ powers.T)[:, :, np.newaxis]
    table = np.asarray(over * (dead * root)[:, :, np.newaxis], dtype=np.complex128)
    return _solved(table, np.broadcast_to(target * root, dead.shape))[1]


def _polynomials(poles: Complex, *, discrete: bool) -> Array:
    """Denominators by rising powers of ``1/z`` or ``s``, shape ``(n_delays, n + 1)``."""
    found = np.ones((len(poles), 1), dtype=np.complex128)
    zero = np.zeros((len(poles), 1))
    for k in range(poles.shape[1]):
        found = np.concatenate([found, zero], axis=1) - poles[:, k : k + 1] * np.concatenate([zero, found], axis=1)
    # By falling powers of z or s: those of 1/z rise.
    return np.asarray(found.real if discrete else found.real[:, ::-1])


def _roots(polynomials: Array, *, discrete: bool) -> Complex:
    """Poles of denominators by rising powers, whose leading one is 1, shape ``(n_delays, n)``."""
    falling = polynomials if discrete else polynomials[:, ::-1]
    n = falling.shape[1] - 1
    companion = np.zeros((len(falling), n, n))
    companion[:, 0, :] = -falling[:, 1:]
    companion[:, np.arange(1, n), np.arange(n - 1)] = 1.0
    return np.asarray(np.linalg.eigvals(companion), dtype=np.complex128)


def _solved(table: Complex, target: Complex) -> tuple[Array, Array]:
    """Real least squares of complex rows, each: solutions, and squares of what is left."""
    rows = np.concatenate([table.real, table.imag], axis=1)
    wanted = np.concatenate([target.real, target.imag], axis=1)[:, :, np.newaxis]
    scale = np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), TINY)
    Q, R = np.linalg.qr(rows / scale)
    along = np.swapaxes(Q, 1, 2) @ wanted
    # What the columns do not tell apart is left where it is: a scan goes on all the same.
    R = R + 1e-12 * np.eye(R.shape[-1])
    left = wanted - Q @ along
    return np.linalg.solve(R, along)[:, :, 0] / scale[:, 0, :], np.sum(left[:, :, 0] ** 2, axis=1)
