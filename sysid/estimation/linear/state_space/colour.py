"""What coloured errors of a free run say about the parameters of a state space or of polynomials."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.coloured_errors import colour, information
from sysid.estimation.linear.state_space.provider import PredictionErrors, Run

Array = NDArray[np.float64]


def coloured(errors: PredictionErrors, theta: Array) -> Array | None:
    """``J' R J`` over the errors' variance, at the least errors of a free run; ``None`` where they are white.

    Each output's errors have a colour of their own; what hangs together across outputs is taken to do so at once.

    Args:
        errors: The least-squares problem, of a system without a model of its noise.
        theta: Where it stands.

    Returns:
        Shape ``(n_parameters, n_parameters)``.
    """
    system = errors.chart.system(theta)
    left = [errors.weighted(errors.run(system, segment).residual, segment) for segment in errors.segments]
    counts = [segment.root_weights > 0.0 for segment in errors.segments]
    colours = [colour([one[:, o] for one in left], counts) for o in range(system.n_outputs)]
    if all(len(a) == 1 for a in colours):
        return None
    P, total = errors.chart.n_parameters, np.zeros((errors.chart.n_parameters,) * 2)
    for o, a in enumerate(colours):
        for (_, run, ahead), (_, _, blocks) in zip(errors.jacobians(theta), errors.jacobians(theta), strict=True):
            both = information(_of_output((block for _, block in blocks), run, o), a)
            kept = np.vstack([np.eye(P), -_seen(run, ahead)])  # the initial state takes its part away
            total += kept.T @ both @ kept
    return total


def _seen(run: Run, blocks: Iterator[tuple[slice, Array]]) -> Array:
    """What the initial state would take away of each parameter's effect: it lasts some samples only."""
    begun: list[Array] = []
    for _, block in blocks:
        begun.append(block.reshape(-1, block.shape[-1]))
        if sum(map(len, begun)) >= len(run.span):
            break
    return np.asarray(run.span.T @ np.concatenate(begun)[: len(run.span)])


def _of_output(blocks: Iterator[Array], run: Run, o: int) -> Iterator[Array]:
    """Derivatives of one output's errors by the parameters, beside the responses to the initial state."""
    span, first = run.span[o :: run.residual.shape[1]], 0
    for block in blocks:
        beside = np.zeros((len(block), span.shape[1]))
        part = span[first : first + len(block)]
        beside[: len(part)] = part
        first += len(block)
        yield np.concatenate([block[:, o], beside], axis=1)
