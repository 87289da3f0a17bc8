"""The posterior of linear models: what their covariance says of the output."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.state_space.fit import matrices_root
from sysid.estimation.networks.posterior import Noise, Posterior, free_run_errors, remaining
from sysid.estimation.nonparametric.noise import persistence
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.results.result import FitResult
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import (
    AbstractModel,
    ARXModel,
    FittedProcess,
    LinearStateSpaceModel,
    Start,
    TransferFunctionModel,
    VectorARXModel,
    VectorStateSpaceModel,
)
from sysid.models.linear.polynomial import PolynomialModel
from sysid.traces import Trace

GROWTH = 1e-6
"""By how much a pole's magnitude may exceed 1 before a free run is known at no sample."""

LinearPosterior = Callable[[Any, Uncertainty, Sequence[Trace], Start], Posterior | None]
"""From a model, what is known of its parameters, its estimation traces, and how a free run over them begins."""


def linear_posterior(of: LinearPosterior, fit: FitResult, traces: Sequence[Trace], start: Start) -> Posterior | None:
    """The posterior of a linear fit.

    Args:
        of: That of its kind of structure.
        fit: The fit.
        traces: Estimation traces.
        start: How a free run over them begins.

    Returns:
        The posterior; ``None`` where the fit has no uncertainty, or its free run grows without bound.
    """
    radius = fit.model.pole_radius
    if fit.uncertainty is None or (radius is not None and radius > 1.0 + GROWTH):
        return None
    return of(fit.model, fit.uncertainty, traces, start)


def arx_posterior(model: ARXModel, known: Uncertainty, traces: Sequence[Trace], start: Start) -> Posterior | None:
    """Of an ARX model: least squares says it of the coefficients, under white residuals one step ahead."""
    n = len(model.coefficients)
    root = _root(known.covariance)
    factor = np.zeros((1 + n, root.shape[1]))  # the recursion has the constant first
    factor[1:] = root[:n]
    if len(root) > n:
        factor[0] = root[n]
    noise = _noise(model, traces, start, len(root))
    return Posterior(factor=factor, noise=replace(noise, one_step=known.noise_variance))


def vector_arx_posterior(
    model: VectorARXModel, known: Uncertainty, traces: Sequence[Trace], start: Start
) -> Posterior | None:
    """Of an ARX model of several outputs: as of one, with the covariance between their coefficients."""
    n, root = len(model.coefficients), _root(known.covariance)
    constants = root[n:] if len(root) > n else np.zeros((len(model.intercepts), root.shape[1]))
    noise = _noise(model, traces, start, len(root))
    covariance = known.noise_covariance
    assert covariance is not None  # noqa: S101 - of several outputs there is one
    return Posterior(
        factor=model.spread(root[:n], constants), noise=replace(noise, one_step=np.diag(covariance).copy())
    )


def polynomial_posterior(
    model: PolynomialModel, known: Uncertainty, traces: Sequence[Trace], start: Start
) -> Posterior | None:
    """Of OE, Box-Jenkins and ARMAX: their coefficients, under white innovations; none where the noise drifts."""
    if model.orders.drifts:
        return None
    root = _root(known.covariance) / model.gains[:, np.newaxis]
    return Posterior(factor=root, noise=_noise(model, traces, start, len(root)))


def state_space_posterior(
    model: LinearStateSpaceModel | VectorStateSpaceModel,
    _: Uncertainty,
    traces: Sequence[Trace],
    start: Start,
) -> Posterior | None:
    """Of a state space: the entries of its matrices, along the directions that change what it does."""
    root = matrices_root(model, traces, start)
    return Posterior(factor=root, noise=_noise(model, traces, start, root.shape[1]))


def _noise(model: AbstractModel, traces: Sequence[Trace], start: Start, parameters: int) -> Noise:
    """Errors of both runs over the estimation traces, with what the parameters took away from them."""
    runs = [Experiment.for_model(trace, model, start) for trace in traces]
    counted = len(model.mapping.outputs) * sum(run.n_counted for run in runs)
    # What a free run leaves persists: as many parameters take more of it away than of white errors.
    paid = min(parameters * persistence(free_run_errors(model, runs)), 0.5 * counted)
    left = remaining(model, runs)
    white = counted / max(counted - parameters, 0.5 * counted)
    return Noise(free_run=left.free_run * counted / (counted - paid), one_step=left.one_step * white)


def transfer_function_posterior(
    model: TransferFunctionModel, known: Uncertainty, traces: Sequence[Trace], start: Start
) -> Posterior | None:
    """Of a transfer function: its polynomials, under white errors of the free run, of which the fit knows all."""
    del traces, start
    root, names = _root(known.covariance), _polynomial_names(model)
    factor = np.zeros((len(names), root.shape[1]))
    for i, name in enumerate(known.names):  # an input that the records do not determine is not among them
        factor[names.index(name)] = root[i]
    return Posterior(factor=factor, noise=Noise(free_run=known.noise_variance, one_step=float("nan")))


def process_posterior(
    model: FittedProcess, known: Uncertainty, traces: Sequence[Trace], start: Start
) -> Posterior | None:
    """Of a process model: its parameters, under white errors of the free run, of which the fit knows all."""
    del traces, start
    root, names = _root(known.covariance), [*model.parameters, "constant"]
    factor = np.zeros((len(names), root.shape[1]))
    for i, name in enumerate(known.names):  # the last is the constant, or the level of what integrates
        factor[names.index(name) if name in names else -1] = root[i]
    return Posterior(factor=factor, noise=Noise(free_run=known.noise_variance, one_step=float("nan")))


def _polynomial_names(model: TransferFunctionModel) -> list[str]:
    """What :attr:`sysid.models.linear.polynomial_moves.Polynomials.vector` holds, as a fit's uncertainty calls it."""
    found = []
    for j, name in enumerate(model.mapping.inputs):
        n = len(model.denominator(j)) - 1
        first = 0 if model.polynomials.sample_time is not None else 1
        found += [f"B({name}, {power})" for power in range(len(model.numerator(j)))]
        found += [f"F({name}, {power})" for power in range(first, first + n)]
    return [*found, "constant", *(f"Td({model.mapping.inputs[j]})" for j in model.polynomials.late)]


def _root(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """``R`` with ``R R^T`` the covariance; what the data do not determine stays where it is."""
    known = np.where(np.isfinite(covariance), covariance, 0.0)
    scale = np.sqrt(np.maximum(np.diag(known), np.finfo(np.float64).tiny))
    values, vectors = np.linalg.eigh(known / np.outer(scale, scale))
    kept = values > 1e-14 * max(float(values.max(initial=0.0)), np.finfo(np.float64).tiny)
    return np.asarray(scale[:, np.newaxis] * vectors[:, kept] * np.sqrt(values[kept]))
