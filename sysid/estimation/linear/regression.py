"""Linear regression over several experiments, none of them concatenated: rows, solution, covariance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.errors import TraceError
from sysid.estimation.nonparametric.evidence import triangle
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.records.operating_point import OperatingPoint
from sysid.models import History, Lags

TALL = 4096
"""Rows from which on they are made as few as there are columns, by blocks: as exact, in a fifth of the time."""
FIRST = 1e-6
"""Part by which a column is made longer that pivoting shall take before others of its direction."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Solution:
    """A least-squares solution.

    Args:
        coefficients: Shape ``(n_columns,)``, or with a column for each of several targets; zero in directions that the
            data do not determine.
        unscaled_covariance: Inverse of the normal matrix, shape ``(n_columns, n_columns)``; NaN where it is singular.
        rank: Number of coefficients that the data determine.
    """

    coefficients: NDArray[np.float64]
    unscaled_covariance: NDArray[np.float64]
    rank: int


def regressor_matrix(experiment: Experiment, lags: Lags) -> NDArray[np.float64]:
    """Lagged inputs and lagged measured outputs of one experiment, history included.

    Args:
        experiment: The record.
        lags: The regressors.

    Returns:
        Shape ``(n_samples, n_regressors)``, in the channels' units.
    """
    past_inputs, past_output = experiment.history.padded(lags.depth)
    u = np.concatenate([past_inputs, experiment.inputs])
    y = np.concatenate([past_output, experiment.output])
    return lagged(u, y, lags, len(experiment.output))


def lagged(u: NDArray[np.float64], y: NDArray[np.float64], lags: Lags, n: int) -> NDArray[np.float64]:
    """Columns of lagged signals that carry their history.

    Args:
        u: Inputs with history, shape ``(depth + n, n_inputs)``; ``depth`` is at least that of the lags.
        y: Output with history, shape ``(depth + n,)``.
        lags: The regressors.
        n: Rows wanted.

    Returns:
        Shape ``(n, n_regressors)``.
    """
    depth = len(y) - n
    columns = [u[depth - lag : depth - lag + n, i] for i, lags_i in enumerate(lags.inputs) for lag in lags_i]
    columns += [y[depth - lag : depth - lag + n] for lag in lags.output]
    return np.column_stack(columns) if columns else np.empty((n, 0))


def deviation(experiment: Experiment, point: OperatingPoint) -> Experiment:
    """The same experiment counted from an operating point.

    Args:
        experiment: The record.
        point: What to subtract.

    Returns:
        The record of deviations.
    """
    history = type(experiment.history)(
        inputs=experiment.history.inputs - np.array(point.inputs), output=experiment.history.output - point.output
    )
    return replace(
        experiment,
        inputs=experiment.inputs - np.array(point.inputs),
        output=experiment.output - point.output,
        history=history,
    )


def regress(
    experiments: Sequence[Experiment], lags: Lags, *, intercept: bool, ridge: float = 0.0
) -> tuple[Solution, NDArray[np.float64]]:
    """Least squares over the rows that count; none crosses from one experiment into the next.

    Args:
        experiments: The records, with the weights of their rows.
        lags: The regressors.
        intercept: Add a column of ones after them.
        ridge: As for :func:`solve`.

    Returns:
        The solution, and the weighted residuals, shape ``(n_rows,)``.

    Raises:
        TraceError: If no row counts, or there are fewer rows than columns and no penalty.
    """

    def blocks() -> Iterator[NDArray[np.float64]]:
        for root, X, y in blocks_of(experiments, lags):
            yield np.column_stack([X, root, y] if intercept else [X, y])

    samples = sum(experiment.n_counted for experiment in experiments)
    if samples <= TALL:
        whole = np.concatenate([*blocks()])
        solution = solve(whole[:, :-1], whole[:, -1], ridge=ridge, constant=intercept)
        return solution, whole[:, -1] - whole[:, :-1] @ solution.coefficients
    reduced = triangle(blocks(), free=0)
    solution = solve(reduced.R, reduced.z, ridge=ridge, constant=intercept, samples=samples)
    return solution, np.concatenate([block[:, -1] - block[:, :-1] @ solution.coefficients for block in blocks()])


def blocks_of(
    experiments: Sequence[Experiment], lags: Lags
) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]]:
    """Weighted regressors and targets some rows at a time: a long record times its lags is larger than any memory.

    Args:
        experiments: The records, with the weights of their rows; of several outputs as :func:`all_read` gives them.
        lags: The regressors.

    Yields:
        Square roots of the weights, regressors and targets of the rows that count, both times these roots.

    Raises:
        TraceError: If no row counts.
    """
    if not any(e.weights is None or (e.weights > 0.0).any() for e in experiments):
        raise nothing_in_a_row(lags.depth + 1, experiments)
    for e in experiments:
        past_inputs, past_output = e.history.padded(lags.depth)
        u, y = np.concatenate([past_inputs, e.inputs]), np.concatenate([past_output, e.output])
        n = len(e.output)
        for first in range(0, n, TALL):
            last = min(first + TALL, n)
            here = slice(first, lags.depth + last)
            X = lagged(u[here], y[here], lags, last - first)
            root = np.ones(last - first) if e.weights is None else np.sqrt(e.weights[first:last])
            kept = root > 0.0
            if kept.any():
                yield root[kept], X[kept] * root[kept, None], (e.output[first:last][kept].T * root[kept]).T


def all_read(experiment: Experiment) -> Experiment:
    """A record of several outputs whose past stands among the inputs, behind them: lags of any channel are of inputs.

    Args:
        experiment: The record, its output with columns.

    Returns:
        The record.
    """
    past = experiment.history
    history = History(inputs=np.column_stack([past.inputs, past.output]), output=past.output)
    return replace(experiment, inputs=np.column_stack([experiment.inputs, experiment.output]), history=history)


def nothing_in_a_row(needed: int, experiments: Sequence[Experiment]) -> TraceError:
    """The refusal of records of which no sample has its past beside it.

    Args:
        needed: Samples in a row that are asked for.
        experiments: The records.

    Returns:
        The error.
    """
    runs = [0]
    for e in experiments:
        usable = np.ones(len(e.output), dtype=np.bool_) if e.usable is None else e.usable
        edges = np.flatnonzero(np.diff(np.concatenate([[False], usable, [False]]).astype(np.int8)))
        runs += list(edges[1::2] - edges[::2])
    return TraceError(
        "no sample has its past beside it: the records are too short, or masked samples stand between the others",
        expected=f"at least {needed} samples in a row that are not masked",
        got=f"{max(runs)} in a row at most",
        remedy="fill short gaps, with repairs: {nan: interpolate}, ask for fewer lags, or fit what needs no past: a "
        "transfer function or a neural state space",
    )


def solve(
    X: NDArray[np.float64], y: NDArray[np.float64], *, ridge: float = 0.0, constant: bool = False, samples: int = 0
) -> Solution:
    r"""Least squares by QR with column pivoting on columns of unit length.

    Args:
        X: Shape ``(n_rows, n_columns)``.
        y: Shape ``(n_rows,)``, or with a column for each of several targets.
        ridge: Weight :math:`\rho` of the penalty :math:`\rho\sum_i \|x_i\|^2\theta_i^2`, which does not depend on
            the units of the columns; 0 for none.
        constant: Whether the last column is that of a constant: where it and another say the same, as the past of an
            output that never changes, the constant is what is told.
        samples: How many rows there were, where these are the triangle of more.

    Returns:
        The solution.

    Raises:
        TraceError: If there are fewer rows than columns and no penalty.
    """
    n, samples = X.shape[1], samples or len(X)
    if samples < n and ridge == 0.0:
        raise TraceError(
            "fewer samples than parameters",
            expected=f"at least {n} samples that count",
            got=samples,
            remedy="lower the orders, or use longer traces",
        )
    norms = np.linalg.norm(X, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    if constant:
        scale[-1] *= 1.0 - FIRST
    A = X / scale
    if ridge > 0.0:
        A, y = np.concatenate([A, np.sqrt(ridge) * np.eye(n)]), np.concatenate([y, np.zeros((n, *y.shape[1:]))])
    Q, R, order = linalg.qr(A, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(R))
    rank = int(np.count_nonzero(diagonal > samples * np.finfo(np.float64).eps * diagonal[0])) if n else 0
    coefficients, covariance = np.zeros((n, *y.shape[1:])), np.full((n, n), np.nan)
    kept = order[:rank]
    coefficients[kept] = linalg.solve_triangular(R[:rank, :rank], Q.T[:rank] @ y)
    inverse = linalg.solve_triangular(R[:rank, :rank], np.eye(rank))
    spread = inverse @ inverse.T
    if ridge > 0.0:  # white noise through a shrinking estimator
        spread = spread @ (np.eye(rank) - ridge * spread)
    covariance[np.ix_(kept, kept)] = spread
    return Solution(
        coefficients=(coefficients.T / scale).T, unscaled_covariance=covariance / np.outer(scale, scale), rank=rank
    )
