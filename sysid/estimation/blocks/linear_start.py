"""Where block-oriented fits start: the best linear model, whole or parted around a curve."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.blocks.first_block import searched
from sysid.estimation.blocks.sections import (
    INTEGRATOR,
    LARGEST_POLE,
    Block,
    Pair,
    Poles,
    block_of,
    responses,
    samples_for,
    sections_of,
)
from sysid.estimation.clock import now
from sysid.estimation.networks.neural.state_space import fit_neural_state_space
from sysid.estimation.networks.training import Training
from sysid.models import Mapping, NeuralStateSpace, NeuralStateSpaceModel, Scaling, Start
from sysid.traces import Trace

Array = NDArray[np.float64]

ITERATIONS = 60
ROUNDS, DRAWS = 20, 3
"""Alternating least squares between two blocks, and beginnings of it for each way to part the poles."""
KNOTS = 8
"""Breakpoints of the curve with which ways to part the linear model are compared."""
SLOWEST, ALIKE = 2.0, 1e-4
"""How much slower than the linear model's slowest pole a block may be that is looked for, at most; and the relative
difference of errors below which two ways to part the model are one."""
COMPARED, SETTLED = 20_000, 0.1
"""Samples over which they are, and the share of these that the blocks take to forget that they began at 0."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearStart:
    """The best linear model, in scaled numbers.

    Args:
        scaling: Between units and scaled numbers.
        poles: Shape ``(n_states,)``.
        response: Impulse response to each input, lag 0 first, shape ``(n_samples, n_inputs)``.
        level: What the output has where the inputs are 0.
        samples: Of the longest record.
        slope: What the output of a plant that integrates gains in a sample where the inputs are 0; ``None`` where it
            has a level.
        settles: Whether it is taken to settle, however slow its poles are.
    """

    scaling: Scaling
    poles: Poles
    response: Array
    level: float
    samples: int
    slope: float | None = None
    settles: bool = False

    def constant(self, block: Block) -> float:
        """What a block of these poles is fed beside its inputs, at its last state."""
        if self.slope is None:
            return self.level * block.stillness
        others = np.prod(1.0 - self.poles[self.poles != INTEGRATOR])
        return self.slope * float(np.real(others))

    @property
    def slowest(self) -> float:
        """The longest time constant, in samples."""
        return float(-1.0 / np.log(np.clip(np.abs(self.poles).max(initial=0.0), 1e-3, LARGEST_POLE)))

    @property
    def integrates(self) -> bool:
        """Whether a pole is as slow as the records: where they cannot tell it from an integrator.

        Such a block has no level of its own: a constant that it is fed is a slope of its output, and the level is
        where it began.
        """
        return not self.settles and bool(np.abs(self.poles).max(initial=0.0) >= np.exp(-1.0 / self.samples))


def shifted(traces: Sequence[Trace], mapping: Mapping, lags: Sequence[int]) -> list[Trace]:
    """Traces whose inputs come later by all but a sample of their dead times, the first value held."""
    found = []
    for trace in traces:
        names, values = [channel.name for channel in trace.channels], trace.values.copy()
        for name, lag in zip(mapping.inputs, lags, strict=True):
            j, late = names.index(name), max(0, lag - 1)
            if late:
                values[:, j] = np.concatenate([np.full(late, values[0, j]), values[:, j]])[: len(values)]
        found.append(replace(trace, values=values))
    return found


def linear_start(
    traces: Sequence[Trace], mapping: Mapping, states: int, *, start: Start, rest_output: float | None, output: str,
    seconds: float = math.inf,
) -> LinearStart:  # fmt: skip
    """The linear model of least error in free run.

    Args:
        traces: Estimation traces, their dead times taken away.
        mapping: Which channels go in, which comes out.
        states: Number of states.
        start: What stands before each trace.
        rest_output: Output at rest, in its unit.
        output: ``plain``, or ``absolute``.
        seconds: Wall time at most.

    Returns:
        The start.
    """
    training = Training(starts=1, max_iterations=ITERATIONS, max_time_s=max(seconds, 0.0), choose_by="evidence")
    structure = NeuralStateSpace(states=states, neurons=0, output=output)
    fit = fit_neural_state_space(traces, mapping, structure, training, start=start, rest_output=rest_output)
    model = fit.model
    assert isinstance(model, NeuralStateSpaceModel)  # noqa: S101 - it is what that fits
    sizes = model.recursion.sizes
    M, L = (model.theta[part].reshape(-1, sizes.row) for part in (sizes.linear, sizes.output_linear))
    A, B, drift = M[:, :states], M[:, states:-1], M[:, -1]
    C, D = L[0, :states], L[0, states:-1]
    poles = np.linalg.eigvals(A).astype(np.complex128)
    response, row = np.zeros((samples_for(poles), B.shape[1])), C
    response[0] = D
    for k in range(1, len(response)):
        response[k] = row @ B
        row = row @ A
    level = L[0, -1] + C @ np.linalg.lstsq(np.eye(states) - A, drift, rcond=None)[0]
    return LinearStart(
        scaling=model.scaling, poles=poles, response=response, level=float(level), samples=max(map(len, traces))
    )


def integrating_start(
    traces: Sequence[Trace], mapping: Mapping, states: int, *, start: Start, scaling: Scaling,
    seconds: float = math.inf,
) -> LinearStart:  # fmt: skip
    """The linear model of least error with a pole of 1: that of the output's steps, summed up.

    The free run's own error says little of the other poles of a plant that integrates: the slow one takes it all.

    Args:
        traces: As for :func:`linear_start`.
        mapping: Which channels go in, which comes out.
        states: Number of states, the integrator among them.
        start: What stands before each trace.
        scaling: Of the output itself.
        seconds: Wall time at most.

    Returns:
        The start.
    """
    stepped = []
    for trace in traces:
        values, at = trace.values.copy(), [channel.name for channel in trace.channels].index(mapping.output)
        values[1:, at], values[0, at] = np.diff(trace.values[:, at]), 0.0
        stepped.append(replace(trace, values=values))
    steps = linear_start(
        stepped, mapping, max(states - 1, 1), start=start, rest_output=0.0, output="plain", seconds=seconds
    )
    ratio = steps.scaling.output_scale / scaling.output_scale
    poles = steps.poles if states > 1 else np.zeros(0, dtype=np.complex128)
    return LinearStart(
        scaling=scaling, poles=np.append(INTEGRATOR, poles), response=np.cumsum(steps.response, axis=0) * ratio,
        level=0.0, samples=steps.samples,
        slope=(steps.level + steps.scaling.output_offset / steps.scaling.output_scale) * ratio,
    )  # fmt: skip


def whole(begun: LinearStart, *, direct: Sequence[bool]) -> Block:
    """The linear model as one block."""
    found = block_of(begun.poles, begun.response, direct=any(direct))
    return replace(found, direct=np.where(direct, found.direct, 0.0))


def parted(
    begun: LinearStart, first: int, signals: tuple[Array, Array], *, direct: Sequence[bool], rng: np.random.Generator,
    seconds: float = math.inf,
) -> list[Pair]:  # fmt: skip
    """Ways to part the linear model around a curve, the most promising first.

    Which pole and zero belongs before the curve a linear model cannot say (Sjoberg and Schoukens 2012): every way to
    part the poles is tried, the gains by alternating least squares, and judged by the best static curve between. Where
    the curve distorts much, its poles are not the blocks': first blocks are sought without it, too
    (:mod:`sysid.estimation.blocks.first_block`).

    Args:
        begun: The linear model.
        first: States before the curve.
        signals: Scaled inputs, shape ``(n_samples, n_inputs)``, and output of a record.
        direct: Of each input whether it is read within the sample.
        rng: Source of randomness.
        seconds: Wall time at most, once every way to part the poles was tried.

    Returns:
        The pairs, those that are alike once.
    """
    until = now() + seconds
    found = [
        _judged(*_factors(*way, begun.response, direct, rng), signals)
        for way in _ways(begun.poles, first)
        for _ in range(DRAWS)
    ]
    blocks = [pair.before for _, pair in found]
    second, slowest = len(begun.poles) - first, SLOWEST * begun.slowest
    found += searched(blocks, second, signals, direct=direct, slowest=slowest, rng=rng, until=until)
    return _distinct(sorted(found, key=lambda one: one[0]))


def _distinct(found: list[tuple[float, Pair]]) -> list[Pair]:
    """Of pairs of the same error one."""
    kept: list[tuple[float, Pair]] = []
    for error, pair in found:
        if not kept or error - kept[-1][0] > ALIKE * kept[-1][0]:
            kept.append((error, pair))
    return [pair for _, pair in kept]


def _ways(poles: Poles, first: int) -> list[tuple[Poles, Poles]]:
    """Every way to take so many of some poles, pairs staying together."""
    units = [np.array([p, p.conjugate()]) for p in poles if p.imag > 0.0] + [
        np.array([p]) for p in poles if p.imag == 0.0
    ]
    found = []
    for n in range(len(units) + 1):
        for taken in combinations(range(len(units)), n):
            before = [units[i] for i in taken]
            if sum(map(len, before)) == first:
                rest = [one for i, one in enumerate(units) if i not in taken]
                found.append((np.concatenate(before), np.concatenate(rest)))
    if found:
        return found
    pair = min((one for one in units if len(one) == 2), key=lambda one: float(abs(one[0])))
    real = np.array([abs(pair[0]), 0.9 * abs(pair[0])], dtype=np.complex128)  # a pair that has to be divided
    others = [p for p in poles if p not in pair]
    return _ways(np.array([*others, *real]), first)


def _factors(
    before: Poles, behind: Poles, response: Array, direct: Sequence[bool], rng: np.random.Generator
) -> tuple[Block, Block]:
    """Two blocks in a row with the impulse response of one."""
    n, m = response.shape
    now = np.eye(n)[:, :1]
    P = np.concatenate([now, responses(sections_of(before), n)], axis=1)
    Q = np.concatenate([now, responses(sections_of(behind), n)], axis=1)
    size = 2 * n
    T = np.fft.irfft(np.fft.rfft(P, size, axis=0)[:, :, None] * np.fft.rfft(Q, size, axis=0)[:, None, :], size, axis=0)[
        :n
    ]
    open_ = np.ones((P.shape[1], m), dtype=np.bool_)
    open_[0] = direct
    q, p = rng.standard_normal(Q.shape[1]) / np.maximum(np.linalg.norm(Q, axis=0), 1e-12), np.zeros((P.shape[1], m))
    for _ in range(ROUNDS):
        each = T @ q
        for j in range(m):
            p[:, j] = 0.0
            p[open_[:, j], j] = np.linalg.lstsq(each[:, open_[:, j]], response[:, j], rcond=1e-10)[0]
        whole_ = np.einsum("kab,aj->kjb", T, p).reshape(n * m, -1)
        q = np.linalg.lstsq(whole_, response.ravel(), rcond=1e-10)[0]
    return (
        Block(sections=sections_of(before), gains=p[1:], direct=p[0]),
        Block(sections=sections_of(behind), gains=q[1:, None], direct=q[:1]),
    )


def _judged(before: Block, behind: Block, signals: tuple[Array, Array]) -> tuple[float, Pair]:
    """The squared error with the best curve between two blocks, and both, what lies between from -1 to 1."""
    w, y = signals[0][:COMPARED], signals[1][:COMPARED]
    x = before.from_rest(w)
    span = float(np.abs(x).max())
    if not np.isfinite(span) or span == 0.0:
        return np.inf, Pair(before=before, behind=behind, x=x, y=x)
    x = x / span
    before = replace(before, gains=before.gains / span, direct=before.direct / span)
    behind = replace(behind, gains=behind.gains * span, direct=behind.direct * span)
    knots = np.linspace(x.min(), x.max(), KNOTS + 2)[1:-1]
    columns = [x, *(np.maximum(x - at, 0.0) for at in knots)]
    first = round(SETTLED * len(y))
    design = np.column_stack([np.ones(len(y)), *(behind.filtered(one[:, None] - one[0]) for one in columns)])[first:]
    found = np.linalg.lstsq(design, y[first:], rcond=None)[0]
    error = float(np.mean((y[first:] - design @ found) ** 2))
    pair = Pair(before=before, behind=behind, x=x, y=np.column_stack(columns) @ found[1:])
    return (error if np.isfinite(error) else np.inf), pair
