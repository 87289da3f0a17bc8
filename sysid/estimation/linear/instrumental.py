r"""ARX by instrumental variables, for noise that is not white after the recursion.

Least squares is biased where the equation error :math:`A y - B u` is coloured, because past outputs carry the same
noise. Instruments that carry the signal and not the noise, outputs of a free run, remove the bias. The four steps are
those of Ljung 1999, "System identification", section 15.3 (IV4, after Söderström and Stoica 1983):

1. least squares;
2. instruments from the free run of that model, first instrumental-variable estimate;
3. an autoregression :math:`L(q)` that whitens its equation error;
4. instruments from the new free run and all signals filtered by :math:`L`, final estimate.

Limits: the noise must not depend on the inputs, so not for data from a closed loop with feedback from the output.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.clock import now
from sysid.estimation.linear.arx import arx_experiments, arx_model, arx_uncertainty, first_output, stability_note
from sysid.estimation.linear.regression import Solution, regress, regressor_matrix, solve
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.records.given import Given, Records, given
from sysid.estimation.records.operating_point import OperatingPoint
from sysid.estimation.results.result import FitResult, Loop, Status
from sysid.models import ARX, ARXModel, Start


def fit_iv4(
    traces: Records,
    mapping: Given,
    orders: ARX,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
    operating_point: OperatingPoint | None = None,
) -> FitResult:
    """Fit an ARX model by the four-step instrumental-variable method.

    Args:
        traces: A data set, whose records for estimation are taken; a record, or several.
        mapping: Which channels go in, which comes out: ``"u -> y"``.
        orders: The structure, with at least one past output or one past input.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.
        operating_point: Fit deviations from it; for orders without an intercept.

    Returns:
        The fit, with status ``EXACT`` and the uncertainty of its parameters.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the orders do not fit the inputs.
        TraceError: If there are fewer samples than parameters.
    """
    traces, mapping = given(traces, mapping)
    began, orders = now(), orders.for_inputs(len(mapping.inputs))
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    experiments = arx_experiments(
        traces, mapping, orders, start=start or Start(), rest_output=rest, operating_point=operating_point
    )

    def model_of(theta: NDArray[np.float64]) -> ARXModel:
        return arx_model(theta, orders, mapping, traces[0], rest_output=rest, operating_point=None)

    unfiltered = np.ones(1)
    theta = regress(experiments, orders.lags, intercept=orders.intercept)[0].coefficients
    theta = _estimate(experiments, model_of(theta), unfiltered).coefficients
    whitening = _whitening(experiments, model_of(theta), orders.na + sum(orders.nb))
    solution = _estimate(experiments, model_of(theta), whitening)
    residual = _equation_error(experiments, model_of(solution.coefficients), whitening)
    model = arx_model(
        solution.coefficients, orders, mapping, traces[0], rest_output=rest, operating_point=operating_point
    )
    n_counted = sum(experiment.n_counted for experiment in experiments)
    return FitResult(
        model=model,
        status=Status.EXACT,
        loop=Loop.OPEN,
        history={"iteration": np.array([0.0]), "mse": np.array([residual @ residual / n_counted])},
        train_time_s=now() - began,
        uncertainty=arx_uncertainty(solution, residual, n_counted, orders, mapping),
        notes=("Instrumental variables (IV4): the mean squared error is that of the whitened equation error.",
               stability_note(model)),
    )  # fmt: skip


def _estimate(experiments: Sequence[Experiment], model: ARXModel, whitening: NDArray[np.float64]) -> Solution:
    """Instruments from the model's free run; the instrumental-variable estimate of filtered data."""
    orders = model.orders
    Z: list[NDArray[np.float64]] = []
    X: list[NDArray[np.float64]] = []
    y: list[NDArray[np.float64]] = []
    runner = _stabilised(model).recursion
    for experiment in experiments:
        free = replace(experiment, output=runner.simulate(experiment.inputs, experiment.history))
        keep = _kept(experiment, len(whitening))
        for table, source in ((Z, free), (X, experiment)):
            rows = regressor_matrix(source, orders.lags)
            rows = np.column_stack([rows, np.ones(len(rows))]) if orders.intercept else rows
            table.append(_filtered(rows, whitening)[keep])
        y.append(_filtered(experiment.output[:, np.newaxis], whitening)[keep, 0])
    instruments, regressors = np.concatenate(Z), np.concatenate(X)
    scale = np.maximum(np.linalg.norm(instruments, axis=0), np.finfo(np.float64).tiny)
    Q, R = linalg.qr(instruments / scale, mode="economic")
    projected = Q.T @ regressors
    pseudo = linalg.pinv(projected)
    return Solution(
        coefficients=pseudo @ (Q.T @ np.concatenate(y)),
        unscaled_covariance=pseudo @ pseudo.T,
        rank=int(np.linalg.matrix_rank(R)),
    )


def _equation_error(
    experiments: Sequence[Experiment], model: ARXModel, whitening: NDArray[np.float64]
) -> NDArray[np.float64]:
    """``L (y - one step ahead)`` over all samples that count."""
    parts = []
    for experiment in experiments:
        predicted = model.recursion.predict(experiment.inputs, experiment.output, experiment.history, 1)
        error = _filtered((experiment.output - predicted)[:, np.newaxis], whitening)[:, 0]
        parts.append(error[_kept(experiment, len(whitening))])
    return np.concatenate(parts)


def _whitening(experiments: Sequence[Experiment], model: ARXModel, order: int) -> NDArray[np.float64]:
    """An autoregression of the equation error, as the filter ``[1, l1, ..., l_order]``."""
    rows, targets = [], []
    for experiment in experiments:
        error = _equation_error([replace(experiment, weights=None)], model, np.ones(1))
        keep = _kept(experiment, order + 1)
        past = np.column_stack([np.roll(error, lag) for lag in range(1, order + 1)])
        rows.append(past[keep])
        targets.append(error[keep])
    return np.concatenate([[1.0], -solve(np.concatenate(rows), np.concatenate(targets)).coefficients])


def _filtered(columns: NDArray[np.float64], taps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Columns through a finite filter; the first ``len(taps) - 1`` rows lack a past and are to be dropped."""
    result: NDArray[np.float64] = float(taps[0]) * columns
    for lag, tap in enumerate(taps[1:], start=1):
        result[lag:] += tap * columns[:-lag]
    return result


def _kept(experiment: Experiment, length: int) -> NDArray[np.bool_]:
    """Rows whose filter of that length sees only samples that count."""
    n = len(experiment.output)
    counted = np.ones(n, dtype=np.bool_) if experiment.weights is None else experiment.weights > 0.0
    seen = np.convolve(counted, np.ones(length))[:n]
    return np.asarray(seen > length - 0.5)


def _stabilised(model: ARXModel) -> ARXModel:
    """The same model with poles outside the unit circle reflected into it, so that instruments stay finite."""
    poles = model.poles
    if np.abs(poles).max(initial=0.0) < 1.0:
        return model
    outside = np.abs(poles) >= 1.0
    poles = np.where(outside, 0.999 / np.conj(np.where(outside, poles, 1.0)), poles)
    n = len(model.coefficients) - model.orders.na
    coefficients = np.concatenate([model.coefficients[:n], -np.real(np.poly(poles))[1:]])
    return replace(model, coefficients=coefficients)
