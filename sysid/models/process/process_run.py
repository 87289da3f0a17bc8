"""The run of one input's process model at the samples, and how it moves with each parameter: both exact.

The input is held between samples, and reaches the plant a dead time later, which need not be a whole number of samples:
within a sample time it then has two values. Derivatives come from the plant with a copy of itself for each parameter,
sampled as one system; that of the dead time is the output's own rate, with the sign turned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.kernels import linear as kernel
from sysid.models.converting.realisation import Realisation, parted
from sysid.models.process.process_type import DEAD_TIME, STEP, ProcessType

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class ProcessRun:
    """What a path does over a record.

    Args:
        output: Shape ``(n_samples,)``.
        slopes: Its derivatives with respect to the parameters, shape ``(n_samples, n_parameters)``.
        beginnings: With respect to the state at the first row, shape ``(n_samples, order)``.
    """

    output: Array
    slopes: Array
    beginnings: Array


def run(
    kind: ProcessType,
    values: Array,
    inputs: Array,
    past: float,
    sample_time: float,
    *,
    first: int = 0,
    state: Array | None = None,
) -> ProcessRun:
    """Run one path.

    Args:
        kind: Its type.
        values: Its parameters, shape ``(n_parameters,)``, in seconds.
        inputs: Shape ``(n_samples,)``.
        past: The input before them.
        sample_time: Seconds.
        first: The first row that is run; inputs before it are known, and come a dead time later.
        state: The state there, shape ``(order,)``; by default it rests at ``past``.

    Returns:
        The run, of the rows from ``first`` on.
    """
    A, B, C, D = (np.asarray(one, dtype=np.float64) for one in kind.system(values))
    n, names = kind.order, kind.names
    moves: dict[str, list[Array]] = {}
    for i, name in enumerate(names):
        if name != DEAD_TIME:
            moved = kind.system(values + 1j * STEP * np.eye(len(names))[i])
            moves[name] = [np.asarray(np.imag(one) / STEP) for one in moved]
    copies = [name for name, (dA, dB, *_) in moves.items() if dA.any() or dB.any()]
    size = n * (1 + len(copies))
    wide: Array = np.kron(np.eye(1 + len(copies)), A).astype(np.float64)
    drive = np.zeros(size)
    drive[:n] = B
    rows, direct = np.zeros((1 + len(names), size)), np.zeros(1 + len(names))
    rows[0, :n], direct[0] = C, D
    for i, name in enumerate(names):
        if name == DEAD_TIME:
            rows[1 + i, :n], direct[1 + i] = -C @ A, -float(C @ B)
            continue
        dA, dB, rows[1 + i, :n], direct[1 + i] = moves[name]
        if name in copies:
            at = slice(n * (1 + copies.index(name)), n * (2 + copies.index(name)))
            wide[at, :n], drive[at], rows[1 + i, at] = dA, dB, C
    dead = float(kind.at(values, DEAD_TIME).real)
    k, part = parted(dead / sample_time)
    plant = Realisation(A=wide, B=drive, C=rows, D=direct).sampled(sample_time, late=part)
    u = _late(inputs, past, k)[first:, np.newaxis]
    before = float(_late(inputs, past, k + 1)[first])
    begun = _rest(kind, past) if state is None else state
    x = np.zeros(len(plant.A))
    x[:n] = begun
    if part:
        x[-1] = before
    found = np.empty((len(u), len(rows)))
    kernel.state_space(plant.A, plant.B[:, np.newaxis], plant.C, plant.D[:, np.newaxis], u, x, found)
    beginnings = np.empty((len(u), n))
    kernel.state_space(plant.A[:n, :n].T, np.zeros((n, 1)), np.eye(n), np.zeros((n, 1)), u, C.copy(), beginnings)
    if DEAD_TIME in names:  # a state that is given does not move with the dead time, whatever its rate was
        rate = A @ begun + B * (before if part else u[0, 0])
        found[:, -1] += beginnings @ rate
    return ProcessRun(output=found[:, 0], slopes=found[:, 1:], beginnings=beginnings)


def _late(inputs: Array, past: float, k: int) -> Array:
    return np.concatenate([np.full(min(k, len(inputs)), past), inputs[: max(len(inputs) - k, 0)]])


def _rest(kind: ProcessType, past: float) -> Array:
    """The state at an input that has stood for ever; a sum begins at nothing."""
    found = np.full(kind.order, past)
    if kind.swings:
        found[1] = 0.0
    if kind.integrates:
        found[-1] = 0.0
    return found
