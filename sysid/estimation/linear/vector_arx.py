r"""ARX of several outputs by least squares, and what its residuals say of all outputs together.

Each output is a regression of its own over its own regressors, :math:`\hat\theta_i = P_i y_i` with
:math:`P_i = (X_i^T X_i)^{-1} X_i^T`, solved on one triangular factor of all channels' lags. Errors of one sample hang
together, and so do the coefficients of two outputs:

.. math:: \mathrm{cov}(\hat\theta_i, \hat\theta_j) = \sigma_{ij} P_i P_j^T

over the rows that both have: a row is only those outputs' that are measured there with all that they read (Ljung 1999,
"System Identification", section 9.2, of white residuals and a true structure). Where outputs read different channels,
weighing the rows by the inverse of :math:`\sigma` would be a little more exact (Zellner 1962, "An efficient method of
estimating seemingly unrelated regressions"); it is not done, as an error in the structure of one output would then move
the coefficients of the others.
"""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.clock import now
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.arx import rests_of
from sysid.estimation.linear.regression import Solution, all_read, blocks_of, nothing_in_a_row, solve
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
        residuals: Of the factor's rows, shape ``(n_rows, n_outputs)``; 0 in those that an output does not have.
        owned: 1 where a row is an output's, else 0, likewise.
        spread: Mean squared deviation of each output from its mean.
        samples: Rows that count for each output.
    """

    solutions: tuple[Solution, ...]
    residuals: Array
    owned: Array
    spread: Array
    samples: NDArray[np.int64]

    @cached_property
    def covariance(self) -> Array:
        """Of the residuals, shape ``(n_outputs, n_outputs)``: squares over the samples that parameters leave.

        Two outputs hang together as they do in the rows that both have; of many outputs with few of these, the nearest
        matrix that is a covariance.
        """
        left = np.array([max(n - one.rank, 1) for n, one in zip(self.samples, self.solutions, strict=True)])
        size = np.sqrt(np.sum(self.residuals**2, axis=0) / left)
        shared = (self.residuals**2).T @ self.owned  # of each output in the rows of each other
        together = self.residuals.T @ self.residuals / np.sqrt(np.maximum(shared * shared.T, _TINY))
        np.fill_diagonal(together, 1.0)
        values, vectors = np.linalg.eigh(together)
        if values[0] < 0.0:
            together = (vectors * np.maximum(values, 0.0)) @ vectors.T
            together /= np.sqrt(np.outer(np.diag(together), np.diag(together)))
        return np.asarray(np.outer(size, size) * together)

    def parameter_covariance(self) -> Array:
        """Of all parameters, output by output; NaN for those that the data do not determine."""
        noise = self.covariance
        maps = [one.coefficients[:, 1:] for one in self.solutions]
        found = np.block([[noise[i, j] * (P @ Q.T) for j, Q in enumerate(maps)] for i, P in enumerate(maps)])
        unknown = np.concatenate([np.isnan(np.diag(one.unscaled_covariance)) for one in self.solutions])
        found[unknown] = found[:, unknown] = np.nan
        return found


_TINY = 1e-300


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
        traces: Estimation traces; a regression row never crosses from one into the next, and an output has the
            rows on which it, and all that it reads, is measured.
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


@dataclass(frozen=True, kw_only=True, eq=False)
class _Part:
    """The rows that some outputs have and the others have not.

    Args:
        records: As :func:`~sysid.estimation.linear.regression.all_read` gives them; other rows weigh nothing.
        owners: Which outputs, shape ``(n_outputs,)``.
    """

    records: tuple[Experiment, ...]
    owners: NDArray[np.bool_]

    @property
    def samples(self) -> int:
        """Rows that count."""
        return sum(one.n_counted for one in self.records)


def _records(traces: Sequence[Trace], mapping: Mapping, start: Start, rests: Array) -> list[Experiment]:
    """The records with all that was measured of the outputs, whatever the inputs lack."""
    given = experiments_of(traces, mapping, start, rests)
    own = [t.columns(mapping.outputs)[len(t) - len(one.output) :] for t, one in zip(traces, given, strict=True)]
    return [replace(one, output=output) for one, output in zip(given, own, strict=True)]


def _parts_of(
    records: Sequence[Experiment], traces: Sequence[Trace], mapping: Mapping, orders: VectorARX
) -> list[_Part]:
    """The rows, by the outputs that have them; no more parts than there are such sets."""
    owned = [_owned(one, trace, mapping, orders) for one, trace in zip(records, traces, strict=True)]
    numbers = [rows @ 2 ** np.arange(rows.shape[1]) for rows in owned]
    found = []
    for number in np.unique(np.concatenate(numbers)):
        if number:
            some = [
                replace(all_read(one), weights=np.where(own == number, _weights(one, trace), 0.0))
                for one, own, trace in zip(records, numbers, traces, strict=True)
            ]
            owners = (int(number) >> np.arange(len(mapping.outputs))) & 1
            found.append(_Part(records=tuple(some), owners=owners.astype(np.bool_)))
    lacking = ~np.any([np.zeros(len(mapping.outputs), dtype=np.bool_), *(one.owners for one in found)], axis=0)
    if lacking.any():
        raise nothing_in_a_row(orders.lags.depth + 1, records)
    return found


def _weights(one: Experiment, trace: Trace) -> Array:
    n = len(one.output)
    return np.ones(n) if trace.weights is None else trace.weights[len(trace) - n :]


def _owned(one: Experiment, trace: Trace, mapping: Mapping, orders: VectorARX) -> NDArray[np.bool_]:
    """Which rows each output has: it is measured there, and every channel at every lag that it reads of it."""
    first, m, depth = len(trace) - len(one.output), len(mapping.inputs), orders.lags.depth
    rows = np.ones((len(one.output), len(mapping.outputs)), dtype=np.bool_)
    for c, name in enumerate(mapping.channels):
        usable = trace.usable_of([name])
        past = usable[:first] if first else one.past
        channel = replace(one, usable=usable[first:], past=past)
        for i in range(rows.shape[1]):
            lags = {lag for row, read, lag in orders.terms if (row, read) == (i, c)} | ({0} if c == m + i else set())
            rows[:, i] &= channel.known_rows(depth, lags)
    return rows & (_weights(one, trace) > 0.0)[:, np.newaxis]


def _solved(traces: Sequence[Trace], mapping: Mapping, orders: VectorARX, start: Start, rests: Array) -> _Solved:
    lags = orders.lags
    parts, width = _parts_of(_records(traces, mapping, start, rests), traces, mapping, orders), lags.n_regressors
    tables, owners = [], []
    for part in parts:
        reduced = triangle((np.column_stack([X, root, y]) for root, X, y in blocks_of(part.records, lags)), free=0)
        tables.append(np.column_stack([reduced.R, reduced.z]))
        owners += [part.owners] * len(tables[-1])
    whole, has = np.concatenate(tables), np.array(owners)
    samples = np.sum([part.samples * part.owners for part in parts], axis=0)
    solutions, residuals, spread = [], np.zeros((len(whole), len(mapping.outputs))), []
    for i, at in enumerate(_columns(orders)):
        table, target = whole[has[:, i]], whole[has[:, i], width + 1 + i]
        both = np.column_stack([target, np.eye(len(whole))[has[:, i]]])
        solutions.append(solve(table[:, at], both, constant=orders.intercept, samples=int(samples[i])))
        residuals[has[:, i], i] = target - table[:, at] @ solutions[-1].coefficients[:, 0]
        # What a constant leaves of the output, from the same factor: its column and the output's.
        constant = table[:, width] / np.linalg.norm(table[:, width])
        spread.append(float(np.sum((target - constant * (constant @ target)) ** 2)) / samples[i])
    return _Solved(
        solutions=tuple(solutions),
        residuals=residuals,
        owned=has.astype(np.float64),
        spread=np.maximum(spread, np.finfo(np.float64).tiny),
        samples=samples,
    )


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
    records = _records(traces, model.mapping, start, np.array(model.rest_outputs))
    parts = _parts_of(records, traces, model.mapping, orders)
    for _ in range(ROUNDS):
        quiet = _stabilised(model)
        runs = [all_read(replace(one, output=quiet.simulate(one.inputs, one.history))) for one in records]
        own = []
        for i, at in enumerate(_columns(orders)):
            X, y, Z = _tables([part for part in parts if part.owners[i]], runs, orders)
            instruments = Z[:, at] / np.maximum(np.linalg.norm(Z[:, at], axis=0), np.finfo(np.float64).tiny)
            Q = np.linalg.qr(instruments)[0]
            own.append(solve(Q.T @ X[:, at], Q.T @ y[:, i], samples=len(X)).coefficients)
        coefficients, intercepts = _parts(own, n)
        model = replace(model, coefficients=coefficients, intercepts=intercepts)
    return model


def _tables(parts: Sequence[_Part], runs: Sequence[Experiment], orders: VectorARX) -> tuple[Array, Array, Array]:
    """Regressors of all outputs with the constant behind them, the targets, and the regressors of some runs."""
    measured, made = [], []
    for part in parts:
        weighed = [replace(run, weights=one.weights) for run, one in zip(runs, part.records, strict=True)]
        measured += [*blocks_of(part.records, orders.lags)]
        made += [np.column_stack([X, root]) for root, X, _ in blocks_of(weighed, orders.lags)]
    X = np.concatenate([np.column_stack([X, root]) for root, X, _ in measured])
    return X, np.concatenate([y for *_, y in measured]), np.concatenate(made)


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
