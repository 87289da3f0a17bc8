"""Where a linear system without noise rests: one rule, whatever its coordinates.

Inputs that stand have an equilibrium where no mode of the system is a sum. A sum stands still at some inputs only: it
rests, at any output, while its inputs have the nearest level at which it does (0 for one alone), and they go to their
first sample as the record begins; the output of that sample is the one at rest. A state that satisfies neither would
lie elsewhere in every set of coordinates.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

AT_ONE = 1e-9
"""Distance from 1 below which an eigenvalue is that of an integrator, which stays wherever it is."""
ROUNDED = 1e-13
"""Singular value of ``I - A``, as a part of the largest, of sums in a chain, whose eigenvalues rounding moves apart."""
SWEEPS = 4
"""Over all states, of what brings them to one size."""


def sums_of(A: Array) -> tuple[Array, Array]:
    """What adds up.

    Args:
        A: Shape ``(n_state, n_state)``.

    Returns:
        Rows that say of a change of the state how fast sums move, and states that stay, shapes ``(n_sums, n_state)``.

    Example:
        >>> rows, states = sums_of(np.diag([0.5, 1.0]))
        >>> np.abs(rows).tolist(), np.abs(states).tolist()
        ([[0.0, 1.0]], [[0.0, 1.0]])
    """
    U, sizes, Vt = scipy.linalg.svd(np.eye(len(A)) - A)
    largest = max(float(sizes[0]), 1.0)
    found = sizes <= AT_ONE * largest
    # Many slow modes together are as nearly singular as one sum is.
    if found.any() and sizes[-1] > ROUNDED * largest and np.abs(scipy.linalg.eigvals(A) - 1.0).min() > AT_ONE:
        found[:] = False
    return U[:, found].T, Vt[found]


def state_at_rest(matrices: tuple[Array, Array, Array, Array, Array], inputs: Array, outputs: Array) -> Array:
    """The state of a system that has stood still for ever.

    Args:
        matrices: ``A``, ``B``, ``C``, ``D`` and the constant of the outputs.
        inputs: First sample, shape ``(n_inputs,)``.
        outputs: Where the outputs stood, shape ``(n_outputs,)``; it counts for sums alone.

    Returns:
        Shape ``(n_state,)``.

    Example:
        >>> one, zero = np.ones((1, 1)), np.zeros((1, 1))
        >>> state_at_rest((one, one, one, zero, np.zeros(1)), np.array([2.0]), np.array([5.0])).tolist()
        [5.0]
    """
    A, B, C, D, constant = matrices
    if not len(A):
        return np.zeros(0)
    equilibrium, _, _, singular = scipy.linalg.lstsq(np.eye(len(A)) - A, B @ inputs)
    if singular[-1] > AT_ONE * max(float(singular[0]), 1.0):
        return np.asarray(equilibrium)
    sizes = _balanced(A, B, C)
    A, B, C = A * sizes / sizes[:, np.newaxis], B / sizes[:, np.newaxis], C * sizes
    rows, staying = sums_of(A)
    if not len(rows):
        return np.asarray(sizes * scipy.linalg.lstsq(np.eye(len(A)) - A, B @ inputs)[0])
    speed = _known(rows @ B, float(np.linalg.norm(B)))
    held = inputs - scipy.linalg.lstsq(speed, speed @ inputs)[0]
    x = scipy.linalg.lstsq(np.eye(len(A)) - A, B @ held, cond=AT_ONE)[0]
    level = outputs - C @ x - D @ inputs - constant
    x = x + staying.T @ scipy.linalg.lstsq(_known(C @ staying.T, float(np.linalg.norm(C))), level)[0]
    return np.asarray(sizes * x)


def _balanced(A: Array, B: Array, C: Array) -> Array:
    """Sizes of the states in which what drives each is as large as what it drives (Osborne 1960), in powers of 2.

    A basis whose pole comes to 1 has states of 1e-12, read by factors of 1e10: nothing small tells there.
    """
    sizes = np.ones(len(A))
    off = np.abs(A - np.diag(np.diag(A)))
    for _ in range(SWEEPS):
        for i in range(len(A)):
            onto = np.hypot(np.linalg.norm(off[i] * sizes), np.linalg.norm(B[i])) / sizes[i]
            from_it = np.hypot(np.linalg.norm(off[:, i] / sizes), np.linalg.norm(C[:, i])) * sizes[i]
            if onto > 0.0 and from_it > 0.0:
                sizes[i] *= 2.0 ** np.round(0.5 * np.log2(onto / from_it))
    return sizes


def _known(values: Array, scale: float) -> Array:
    """Numbers without those that are rounding beside a scale."""
    return np.where(np.abs(values) > AT_ONE * scale, values, 0.0)
