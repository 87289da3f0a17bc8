"""ARX by least squares: one QR factorisation over several experiments, none of them concatenated."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.errors import TraceError
from sysid.estimation.provider import Experiment, experiments_of
from sysid.estimation.result import FitResult, Loop, Status
from sysid.models import ARX, ARXModel, Lags, Mapping, Start
from sysid.traces import Trace


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
    n, depth = len(experiment.output), lags.depth
    columns = [u[depth - lag : depth - lag + n, i] for i, lags_i in enumerate(lags.inputs) for lag in lags_i]
    columns += [y[depth - lag : depth - lag + n] for lag in lags.output]
    return np.column_stack(columns)


def fit_arx(
    traces: Sequence[Trace],
    mapping: Mapping,
    orders: ARX,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
) -> FitResult:
    """Fit an ARX model by least squares on the one-step prediction error.

    Args:
        traces: Estimation traces; a regression row never crosses from one into the next.
        mapping: Which channels go in, which comes out.
        orders: The structure.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.

    Returns:
        The fit, with status ``EXACT``.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        TraceError: If there are fewer samples than parameters, or the orders do not fit the inputs.
    """
    began = time.perf_counter()
    if len(orders.nb) != len(mapping.inputs):
        raise TraceError(
            "the orders do not match the inputs",
            expected=f"{len(mapping.inputs)} values of nb and nk for {mapping}",
            got=f"{len(orders.nb)} values",
            remedy="give one nb and one nk for each input",
        )
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    experiments = experiments_of(traces, mapping, start or Start(), rest)
    rows = [regressor_matrix(experiment, orders.lags) for experiment in experiments]
    if orders.intercept:
        rows = [np.column_stack([matrix, np.ones(len(matrix))]) for matrix in rows]
    roots = [np.ones(len(e.output)) if e.weights is None else np.sqrt(e.weights) for e in experiments]
    X = np.concatenate([matrix * root[:, None] for matrix, root in zip(rows, roots, strict=True)])
    y = np.concatenate([e.output * root for e, root in zip(experiments, roots, strict=True)])
    coefficients, note = _solve(X, y)
    residual = y - X @ coefficients
    model = ARXModel(
        orders=orders,
        coefficients=coefficients[: orders.lags.n_regressors],
        intercept=float(coefficients[-1]) if orders.intercept else 0.0,
        mapping=mapping,
        sample_time=traces[0].sample_time,
        input_units=tuple(traces[0].channel(name).unit for name in mapping.inputs),
        output_unit=traces[0].channel(mapping.output).unit,
        rest_output=rest,
    )
    n_counted = sum(experiment.n_counted for experiment in experiments)
    return FitResult(
        model=model,
        status=Status.EXACT,
        loop=Loop.OPEN,
        history={"iteration": np.array([0.0]), "mse": np.array([residual @ residual / n_counted])},
        train_time_s=time.perf_counter() - began,
        notes=(*note, _stability_note(model)),
    )


def first_output(traces: Sequence[Trace], mapping: Mapping) -> float:
    """The mean of the traces' first output samples: the rest value where none is declared.

    Args:
        traces: Estimation traces.
        mapping: Names the output.

    Returns:
        A value in the output's unit.
    """
    return float(np.mean([trace[mapping.output][0] for trace in traces]))


def _solve(X: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Least squares by QR with column pivoting on scaled columns; directions without data stay at zero."""
    if len(X) < X.shape[1]:
        raise TraceError(
            "fewer samples than parameters",
            expected=f"at least {X.shape[1]} samples that count",
            got=len(X),
            remedy="lower the orders, or use longer traces",
        )
    norms = np.linalg.norm(X, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    Q, R, order = linalg.qr(X / scale, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(R))
    rank = int(np.count_nonzero(diagonal > len(X) * np.finfo(np.float64).eps * diagonal[0])) if len(diagonal) else 0
    coefficients = np.zeros(X.shape[1])
    coefficients[order[:rank]] = linalg.solve_triangular(R[:rank, :rank], Q.T[:rank] @ y)
    note = (
        () if rank == X.shape[1] else (f"The data determine {rank} of {X.shape[1]} parameters; the others are zero.",)
    )
    return coefficients / scale, note


def _stability_note(model: ARXModel) -> str:
    largest = float(np.abs(model.poles).max(initial=0.0))
    verdict = "stable" if largest < 1.0 else "not stable"
    return f"The free run is {verdict}: the largest pole has magnitude {largest:.6f}."
