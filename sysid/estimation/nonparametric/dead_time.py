r"""How long the dead times may be: a correlation that knows what a response looks like, at every lag at once.

An input passed through a pole, :math:`x = u/(1 - p q^{-1})^m`, is the response of a plant without dead time; of one
with dead time :math:`k` it is the same, shifted. For a few poles :math:`p` the correlation of the output with
:math:`x(t - k)` is had for all :math:`k` by one fast Fourier transform; where the share of the output that it explains
is largest, a transfer function is worth fitting. Several inputs are taken in turn, each against what the others leave
(Mallat and Zhang 1993, "Matching pursuits with time-frequency dictionaries"). What comes out says where to look: the
loss of the transfer function itself decides.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.records.experiment import Experiment
from sysid.kernels.linear import slowed

TIME_CONSTANTS = (0.0, 2.0, 5.0, 12.0, 30.0, 80.0, 200.0)
"""Of the poles, in samples; those longer than the record are left out."""

LONGEST_SHARE = 3
"""A dead time may be a third of the longest record."""

PEAKS = 4
"""Places in the correlation about which transfer functions are fitted, and how far around each."""

AROUND = 2

ROUNDS = 3


def longest_dead_time(lengths: Sequence[int]) -> int:
    """The longest dead time that is looked for.

    Args:
        lengths: Of the records, in samples.

    Returns:
        In samples.
    """
    return max(1, max(lengths) // LONGEST_SHARE)


def shares(
    inputs: Sequence[NDArray[np.float64]], targets: Sequence[NDArray[np.float64]], most: int, order: int
) -> NDArray[np.float64]:
    """For every dead time the largest share of the output that one response of the bank explains.

    Args:
        inputs: Of each record, shape ``(n_samples,)``.
        targets: Of each record, shape ``(n_samples,)``; zero where masked.
        most: The longest dead time.
        order: How often each pole is passed.

    Returns:
        Shape ``(most + 1,)``, from 0 to 1.
    """
    longest = max(len(y) for y in targets)
    found = np.zeros(most + 1)
    total = sum(float(y @ y) for y in targets) or 1.0
    for constant in TIME_CONSTANTS:
        if constant > longest / 2.0:
            continue
        p = float(np.exp(-1.0 / constant)) if constant else 0.0
        top, energy = np.zeros(most + 1), np.zeros(most + 1)
        for u, y in zip(inputs, targets, strict=True):
            x = u
            for _ in range(order):
                x = slowed(x, p, 0.0)
            n = len(x)
            x = x - x.mean()
            size = scipy.fft.next_fast_len(n + most + 1, real=True)
            lags = min(most, n - 1)
            crossed = scipy.fft.rfft(y, size) * np.conj(scipy.fft.rfft(x, size))
            top[: lags + 1] += scipy.fft.irfft(crossed, size)[: lags + 1]
            before = np.cumsum(x[::-1] ** 2)[::-1]  # energy of what is left after a shift pushes the end out
            whole = before[0] - np.concatenate([[0.0], np.cumsum(x[::-1] ** 2)])[: lags + 1]
            energy[: lags + 1] += whole
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(energy > 1e-12 * energy[0], top**2 / (energy * total), 0.0)
        found = np.maximum(found, share)
    return found


def likely(experiments: Sequence[Experiment], orders: Sequence[int], most: int, least: int) -> list[list[int]]:
    """For each input the dead times about which to look, the likeliest first.

    Args:
        experiments: The records.
        orders: Number of poles of each input.
        most: The longest dead time.
        least: The shortest.

    Returns:
        At most :data:`PEAKS` for each input.
    """
    usable = [np.ones(len(e.output), dtype=np.bool_) if e.weights is None else e.weights > 0.0 for e in experiments]
    left = [_centred(e.output, ok) for e, ok in zip(experiments, usable, strict=True)]
    n_inputs = experiments[0].inputs.shape[1]
    chosen: list[list[int]] = [[least]] * n_inputs
    own = [np.zeros((n_inputs, len(y))) for y in left]
    for _ in range(1 if n_inputs == 1 else ROUNDS):
        for j in range(n_inputs):
            targets = [y - (part.sum(axis=0) - part[j]) for y, part in zip(left, own, strict=True)]
            inputs = [e.inputs[:, j] - e.inputs[:, j].mean() for e in experiments]
            share = shares(inputs, targets, most, min(orders[j], 2))
            # What an integrator puts out is no shifted copy of anything; its rate is.
            rates = shares(inputs, [np.diff(y, prepend=y[:1]) for y in targets], most, max(min(orders[j], 2) - 1, 1))
            share[:least] = rates[:least] = 0.0
            chosen[j] = list(dict.fromkeys([*_peaks(share), *_peaks(rates)[:2]]))
            for r, (u, y, ok) in enumerate(zip(inputs, targets, usable, strict=True)):
                own[r][j] = np.where(ok, _explained(u, y, chosen[j][0]), 0.0)
    return chosen


def _centred(y: NDArray[np.float64], usable: NDArray[np.bool_]) -> NDArray[np.float64]:
    return np.where(usable, y - y[usable].mean(), 0.0) if usable.any() else np.zeros(len(y))


def _explained(u: NDArray[np.float64], y: NDArray[np.float64], k: int) -> NDArray[np.float64]:
    """What responses with that dead time explain together."""
    delayed = np.concatenate([np.full(min(k, len(u)), u[0]), u[: max(len(u) - k, 0)]])
    poles = [float(np.exp(-1.0 / constant)) if constant else 0.0 for constant in TIME_CONSTANTS]
    columns = np.column_stack([slowed(delayed, p, 0.0) for p in poles])
    return np.asarray(columns @ np.linalg.lstsq(columns, y, rcond=1e-6)[0])


def _peaks(share: NDArray[np.float64]) -> list[int]:
    """The highest places, none within reach of a higher one."""
    found: list[int] = []
    for k in np.argsort(-share, kind="stable"):
        if all(abs(int(k) - other) > AROUND for other in found):
            found.append(int(k))
        if len(found) == PEAKS:
            break
    return found


def descend(
    start: tuple[int, ...], least: int, most: int, loss: Callable[[tuple[int, ...]], float], gain: float = 0.0
) -> tuple[int, ...]:
    """From some dead times to those with the least loss about them, one input after the other.

    Args:
        start: In samples.
        least: The shortest.
        most: The longest.
        loss: Of some dead times.
        gain: Part of the loss that a move has to take away.

    Returns:
        Dead times about which none is better, up to :data:`AROUND` samples away in one input.
    """
    current, best = start, loss(start)
    moved = True
    while moved:
        moved = False
        for j in range(len(start)):
            losses = {trial: loss(trial) for trial in around(current, j, least, most)}
            trial = min(losses, key=losses.__getitem__, default=current)
            if trial != current and losses[trial] < (1.0 - gain) * best:
                current, best, moved = trial, losses[trial], True
    return current


def around(delays: tuple[int, ...], j: int, least: int, most: int) -> list[tuple[int, ...]]:
    """Dead times that differ in one input.

    Args:
        delays: In samples.
        j: Which input.
        least: The shortest.
        most: The longest.

    Returns:
        Those up to :data:`AROUND` samples away.
    """
    near = range(max(delays[j] - AROUND, least), min(delays[j] + AROUND, most) + 1)
    return [(*delays[:j], k, *delays[j + 1 :]) for k in near if k != delays[j]]
