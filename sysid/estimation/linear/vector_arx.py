r"""ARX of several outputs by least squares, and what its residuals say of all outputs together.

Each output is a regression of its own over its own regressors, :math:`\hat\theta_i = P_i y_i` with
:math:`P_i = (X_i^T X_i)^{-1} X_i^T`, solved on one triangular factor of all channels' lags. Errors of one sample hang
together, and so do the coefficients of two outputs:

.. math:: \mathrm{cov}(\hat\theta_i, \hat\theta_j) = \sigma_{ij} P_i P_j^T

(Ljung 1999, "System Identification", section 9.2, of white residuals and a true structure). Where outputs read
different channels, weighing the rows by the inverse of :math:`\sigma` would be a little more exact (Zellner 1962, "An
efficient method of estimating seemingly unrelated regressions"); it is not done, as an error in the structure of one
output would then move the coefficients of the others.
"""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.clock import now
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.arx import rests_of
from sysid.estimation.linear.regression import Solution, all_read, blocks_of, solve
from sysid.estimation.nonparametric.evidence import triangle
from sysid.estimation.records.experiment import Experiment, experiments_of
from sysid.estimation.results.result import FitResult, Loop, Status
from sysid.estimation.results.uncertainty import Uncertainty, generalised_variance
from sysid.models import Mapping, Start, VectorARX, VectorARXModel
from sysid.traces import Trace

Array = NDArray[np.float64]
ROUNDS, INSIDE = 3, 0.999
"""Rounds of instruments, and the largest pole of the model that makes them."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Solved:
    """The regressions of all outputs.

    Args:
        solutions: Of each output, for the target and then for each row of the factor.
        residuals: Of the factor's rows, shape ``(n_rows, n_outputs)``.
        spread: Mean squared deviation of each output from its mean.
        samples: Rows that count.
    """

    solutions: tuple[Solution, ...]
    residuals: Array
    spread: Array
    samples: int

    @property
    def covariance(self) -> Array:
        """Of the residuals, shape ``(n_outputs, n_outputs)``: squares over the samples that parameters leave."""
        left = np.array([max(self.samples - one.rank, 1) for one in self.solutions])
        return np.asarray(self.residuals.T @ self.residuals / np.sqrt(np.outer(left, left)))

    def parameter_covariance(self) -> Array:
        """Of all parameters, output by output; NaN for those that the data do not determine."""
        noise = self.covariance
        maps = [one.coefficients[:, 1:] for one in self.solutions]
        found = np.block([[noise[i, j] * (P @ Q.T) for j, Q in enumerate(maps)] for i, P in enumerate(maps)])
        unknown = np.concatenate([np.isnan(np.diag(one.unscaled_covariance)) for one in self.solutions])
        found[unknown] = found[:, unknown] = np.nan
        return found


def fit_vector_arx(
    traces: Sequence[Trace],
    mapping: Mapping,
    orders: VectorARX,
    *,
    start: Start | None = None,
    rest_output: float | Dict[str, float] | None = None,
) -> FitResult:
    """Fit an ARX model of several outputs by least squares on the one-step prediction errors.

    Args:
        traces: Estimation traces; a regression row never crosses from one into the next, and all outputs have the rows
            on which every lag of any of them is known.
        mapping: Which channels go in, which come out.
        orders: The structure.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit, or by name; the mean of the traces' first samples where not given.

    Returns:
        The fit, with status ``EXACT`` and the uncertainty of its parameters. Its error is the mean over the outputs of
        squared errors, each over the variance of its output.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the orders do not fit the channels.
        TraceError: If there are fewer samples than parameters of an output.
    """
    began, m = now(), len(mapping.inputs)
    orders = orders.sized(m, len(mapping.outputs))
    rests = rests_of(traces, mapping, rest_output)
    solved = _solved(traces, mapping, orders, start or Start(), np.array(rests))
    n = _counts(orders)
    coefficients, intercepts = _parts([one.coefficients[:, 0] for one in solved.solutions], n)
    model = VectorARXModel(
        orders=orders,
        coefficients=coefficients,
        intercepts=intercepts,
        mapping=mapping,
        sample_time=traces[0].sample_time,
        input_units=tuple(traces[0].channel(name).unit for name in mapping.inputs),
        output_units=tuple(traces[0].channel(name).unit for name in mapping.outputs),
        rest_outputs=rests,
    )
    mse = float(np.mean(np.sum(solved.residuals**2, axis=0) / solved.samples / solved.spread))
    return FitResult(
        model=model,
        status=Status.EXACT,
        loop=Loop.OPEN,
        history={"iteration": np.array([0.0]), "mse": np.array([mse])},
        train_time_s=now() - began,
        uncertainty=_uncertainty(solved, model, n),
        notes=(*_rank_notes(solved, mapping), slow_poles.stability(model.pole_radius)),
    )


def _counts(orders: VectorARX) -> NDArray[np.int64]:
    """Coefficients of each output."""
    return np.bincount([i for i, *_ in orders.terms], minlength=len(orders.na))


def _parts(own: Sequence[Array], n: NDArray[np.int64]) -> tuple[Array, Array]:
    """Parameters output by output as a model has them: the coefficients of all, and the constant of each, or 0."""
    pairs = [*zip(own, n, strict=True)]
    return np.concatenate([values[:k] for values, k in pairs]), np.array([values[k:].sum() for values, k in pairs])


def _columns(orders: VectorARX) -> list[list[int]]:
    """Of each output where its regressors stand among those of all, the constant behind them."""
    lags = orders.lags
    places = {pair: at for at, pair in enumerate((c, lag) for c, read in enumerate(lags.inputs) for lag in read)}
    constant = [len(places)] * orders.intercept
    return [[places[c, lag] for row, c, lag in orders.terms if row == i] + constant for i in range(len(orders.na))]


def _solved(traces: Sequence[Trace], mapping: Mapping, orders: VectorARX, start: Start, rests: Array) -> _Solved:
    lags = orders.lags
    records = [all_read(one).one_step(lags) for one in experiments_of(traces, mapping, start, rests)]
    samples, width = sum(one.n_counted for one in records), lags.n_regressors
    blocks = (np.column_stack([X, root, y]) for root, X, y in blocks_of(records, lags))
    reduced = triangle(blocks, free=0)
    table = np.column_stack([reduced.R, reduced.z])
    solutions, residuals = [], []
    for i, at in enumerate(_columns(orders)):
        target = table[:, width + 1 + i]
        both = np.column_stack([target, np.eye(len(table))])
        solutions.append(solve(table[:, at], both, constant=orders.intercept, samples=samples))
        residuals.append(target - table[:, at] @ solutions[-1].coefficients[:, 0])
    # What a constant leaves of each output, from the same factor: its column and the outputs'.
    constant = table[:, width] / np.linalg.norm(table[:, width])
    moved = table[:, width + 1 :] - np.outer(constant, constant @ table[:, width + 1 :])
    spread = np.maximum(np.sum(moved**2, axis=0) / samples, np.finfo(np.float64).tiny)
    return _Solved(
        solutions=tuple(solutions), residuals=np.column_stack(residuals), spread=spread, samples=samples
    )  # fmt: skip


def by_instruments(traces: Sequence[Trace], model: VectorARXModel, start: Start) -> VectorARXModel:
    """The same orders by instruments, outputs of a free run, which noise on the outputs does not bend.

    Ljung 1999, section 7.6; of the four steps of :func:`~sysid.estimation.linear.instrumental.fit_iv4` the first two,
    the second of them twice: consistent, and not the most exact.

    Args:
        traces: Estimation traces.
        model: The estimate by least squares.
        start: What stands before each trace.

    Returns:
        The model.

    Raises:
        TraceError: If no row counts.
    """
    orders, n = model.orders, _counts(model.orders)
    records = experiments_of(traces, model.mapping, start, np.array(model.rest_outputs))
    for _ in range(ROUNDS):
        quiet = _stabilised(model)
        runs = [replace(one, output=quiet.simulate(one.inputs, one.history)) for one in records]
        (X, y), (Z, _) = (_table(some, orders) for some in (records, runs))
        own = []
        for i, at in enumerate(_columns(orders)):
            instruments = Z[:, at] / np.maximum(np.linalg.norm(Z[:, at], axis=0), np.finfo(np.float64).tiny)
            Q = np.linalg.qr(instruments)[0]
            own.append(solve(Q.T @ X[:, at], Q.T @ y[:, i], samples=len(X)).coefficients)
        coefficients, intercepts = _parts(own, n)
        model = replace(model, coefficients=coefficients, intercepts=intercepts)
    return model


def _table(records: Sequence[Experiment], orders: VectorARX) -> tuple[Array, Array]:
    """Regressors of all outputs with the constant behind them, and the targets, of the rows that count."""
    blocks = [*blocks_of([all_read(one).one_step(orders.lags) for one in records], orders.lags)]
    table = np.concatenate([np.column_stack([X, root]) for root, X, _ in blocks])
    return table, np.concatenate([y for *_, y in blocks])


def _stabilised(model: VectorARXModel) -> VectorARXModel:
    """The same model with all poles drawn in, so that the largest lies inside the unit circle."""
    part, m = INSIDE / max(model.pole_radius, INSIDE), len(model.mapping.inputs)
    drawn = [part**lag if c >= m else 1.0 for _, c, lag in model.orders.terms]
    return replace(model, coefficients=model.coefficients * drawn)


def _uncertainty(solved: _Solved, model: VectorARXModel, n: NDArray[np.int64]) -> Uncertainty:
    """In the order of the model: the coefficients of all outputs, then the intercepts."""
    inputs, outputs = model.mapping.inputs, model.mapping.outputs
    names = [
        f"b({outputs[i]}, {inputs[c]}, {lag})"
        if c < len(inputs)
        else f"a({outputs[i]}, {outputs[c - len(inputs)]}, {lag})"
        for i, c, lag in model.orders.terms
    ]
    constant = np.concatenate([np.arange(len(s.coefficients)) >= k for s, k in zip(solved.solutions, n, strict=True)])
    order = np.argsort(constant, kind="stable")
    values = np.concatenate([one.coefficients[:, 0] for one in solved.solutions])
    return Uncertainty(
        names=(*names, *(f"intercept({name})" for name in outputs if model.orders.intercept)),
        values=values[order],
        covariance=solved.parameter_covariance()[np.ix_(order, order)],
        noise_variance=generalised_variance(solved.covariance),
        noise_covariance=solved.covariance,
    )


def _rank_notes(solved: _Solved, mapping: Mapping) -> list[str]:
    return [
        f"The data determine {one.rank} of {len(one.coefficients)} parameters of {name}; the others are zero."
        for name, one in zip(mapping.outputs, solved.solutions, strict=True)
        if one.rank < len(one.coefficients)
    ]


def polynomials_of(model: VectorARXModel, known: Uncertainty) -> tuple[tuple[str, ...], Array, Array]:
    """What is known of the coefficients as polynomials of each input and output, as their views read it.

    Args:
        model: The model.
        known: Of its coefficients.

    Returns:
        Names ``B(output, input, lag)`` and ``F(lag)``, their values, and how they move with what is known, shape
        ``(n_values, n_known)``.
    """
    found, inputs, outputs = model.polynomials, model.mapping.inputs, model.mapping.outputs
    names = [f"F({lag})" for lag in range(1, len(found.denominator))]
    values, rows = [found.denominator[1:]], [found.slopes()[1:]]
    for o, j in model.ratios:
        numerator, first = found.numerator(o, j), found.delay(o, j)
        names += [f"B({outputs[o]}, {inputs[j]}, {first + k})" for k in range(len(numerator))]
        values.append(numerator)
        rows.append(found.slopes(o, j))
    table = np.zeros((len(names), len(known.names)))
    table[:, : len(model.coefficients)] = np.concatenate(rows)
    return tuple(names), np.concatenate(values), table
