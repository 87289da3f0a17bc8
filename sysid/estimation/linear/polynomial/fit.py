"""Polynomial models of traces, by the least prediction error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.errors import ConfigError, FitDivergedError, TraceError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.least_squares.state import Solution
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.arx import first_output
from sysid.estimation.linear.coloured_errors import sandwich
from sysid.estimation.linear.determined import Determined
from sysid.estimation.linear.long_arx import LongARX
from sysid.estimation.linear.polynomial.chart import PolynomialChart
from sysid.estimation.linear.polynomial.contained import has_common, next_smaller, parts_of, with_root
from sysid.estimation.linear.polynomial.slow import AbstractWays, next_to_transfer_function
from sysid.estimation.linear.polynomial.slow_noise import next_to_output_error
from sysid.estimation.linear.polynomial.starts import long_models, looked_at, of_state_space, starts_of
from sysid.estimation.linear.segments import Segment, scaling_of, segments_of, torn
from sysid.estimation.linear.state_space.colour import coloured
from sysid.estimation.linear.state_space.provider import PredictionErrors
from sysid.estimation.linear.stretches import stretches, told_of
from sysid.estimation.linear.transfer_function.runs import flat_prior
from sysid.estimation.records.experiment import Experiment, experiments_of
from sysid.estimation.results.result import FitResult, Loop, Status
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import Mapping, Start
from sysid.models.linear.polynomial import PolynomialModel
from sysid.models.linear.polynomial_orders import AbstractPolynomial
from sysid.models.orders.typed_fields import TypedFields
from sysid.traces import Trace

Array = NDArray[np.float64]

SHORT, TRIED = 6, 5
"""Steps from the best starts, before the best end goes on; and how many of these there are."""
NEAR = 1e-6
"""Relative difference of two losses that is none where one was not run to its end."""
NESTED, CANCELLED = 200_000, (0.0, 0.5, 0.9)
"""Samples times squared poles up to which models with fewer are fitted first; and poles that are cancelled in them."""


@dataclass(frozen=True, kw_only=True)
class PolynomialTraining(TypedFields):
    """How a polynomial model is fitted.

    Args:
        max_iterations: Steps from the best start.
        max_time_s: Wall time in seconds.
        stable: Keep all poles inside the unit circle; ``None`` does so where the noise is not modelled, since the free
            run of an unstable plant is then lost.
        seed: Nothing is random; here so that all training has one.

    Raises:
        ConfigError: If a number is negative.
    """

    max_iterations: int = 100
    max_time_s: float = float("inf")
    stable: bool | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if self.max_iterations < 0:
            raise ConfigError(
                "max_iterations is negative", expected="0 or more", got=self.max_iterations, remedy="correct it"
            )


def fit_polynomial(
    traces: Sequence[Trace],
    mapping: Mapping,
    orders: AbstractPolynomial,
    training: PolynomialTraining | None = None,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
) -> FitResult:
    """Fit OE, Box-Jenkins or ARMAX.

    Args:
        traces: Estimation traces; never concatenated, each with an initial state of its own.
        mapping: Which channels go in, which comes out.
        orders: The structure.
        training: How to fit.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.

    Returns:
        The fit, with the uncertainty of its coefficients.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the orders do not fit the inputs.
        TraceError: If there are fewer samples than parameters.
        FitDivergedError: If no start gives a finite prediction.
    """
    began, training = now(), training or PolynomialTraining()
    orders = orders.for_inputs(len(mapping.inputs))
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    experiments = experiments_of(traces, mapping, start or Start(), rest)
    _check(orders, experiments)
    scaling = scaling_of(experiments, constant=orders.intercept or orders.drifts)
    units, determined = tuple(traces[0].channel(name).unit for name in mapping.inputs), Determined.of(experiments)
    if len(determined.kept) < len(mapping.inputs):
        own = determined.mapping(mapping), determined.narrowed(orders)
        fit = fit_polynomial(traces, *own, training, start=start, rest_output=rest)
        return determined.polynomials(fit, orders, mapping, scaling, units)
    segments, part = segments_of(experiments, scaling), stretches(experiments)
    until = began + training.max_time_s
    with one_blas_thread():  # threads that wake for such small matrices cost more than they give
        from_part = part and _from_part(segments_of(part, scaling), segments, orders, training, until)
        errors, solution = from_part or _search(segments, orders, training, until)
        if training.stable is None:
            next_to = next_to_output_error if orders.noise else next_to_transfer_function
            data = traces, mapping, start or Start(), rest, experiments
            ways = _Ways(data=data, training=training, until=until)
            errors, solution, scaling = next_to((errors, solution, scaling), orders, ways)
        at = errors.linearise(solution.theta)
        system = errors.chart.system(solution.theta)
        variance = float(errors.covariance(system)[0, 0])
        hang = None if orders.noise else coloured(errors, solution.theta)
        left, lengths = None if orders.noise else errors.errors(system), [len(one) for one in errors.segments]
    model = PolynomialModel(
        orders=orders,
        theta=solution.theta,
        scaling=scaling,
        mapping=mapping,
        sample_time=traces[0].sample_time,
        input_units=units,
        output_unit=traces[0].channel(mapping.output).unit,
        rest_output=rest,
    )
    unit, slow = scaling.output_scale**2, slow_poles.notes(model.pole_radius, lengths, left)
    fit = FitResult(
        model=model,
        status=Status.CONVERGED if solution.status in {Status.STALLED, Status.NOT_IMPROVED} else solution.status,
        loop=Loop.OPEN if orders.noise else Loop.CLOSED,
        history={
            "iteration": np.array([one.iteration for one in solution.curve], dtype=np.float64),
            "mse": unit * np.array([one.mse for one in solution.curve]),
        },
        train_time_s=now() - began,
        uncertainty=_uncertainty(model, at, hang, errors.n_samples, variance * unit),
        notes=(
            *slow,
            *(torn(errors.segments, system.n_state, records=len(traces)) if orders.noise else ()),
            *((told_of(part),) if part and from_part else ()),
            slow_poles.stability(model.pole_radius),
        ),
        warnings=slow_poles.warnings(model.pole_radius, lengths, slow),
    )
    return fit if determined.moves else determined.polynomials(fit, orders, mapping, scaling, units)


def _search(
    segments: Sequence[Segment],
    orders: AbstractPolynomial,
    training: PolynomialTraining,
    until: float,
    known: dict[AbstractPolynomial, Array | None] | None = None,
) -> tuple[PredictionErrors, Solution]:
    """Short runs from every start, and a long one from the best; what it contains first, all by the same clock."""
    pieces = [piece for segment in segments for piece in segment.pieces()]
    errors = _errors(segments, orders, training)
    looked = looked_at(pieces, orders)
    longs = long_models(looked, orders)
    starts = [
        *starts_of(looked, orders, longs),
        np.zeros(orders.n_parameters),
    ]  # the last is finite whatever the record
    known = {} if known is None else known
    straight = _straight(errors, starts, longs[0], training, until) if orders.noise else None
    # With denominators of their own there are as many smaller structures as products of theirs: too many to ask for.
    if straight is not None and not has_common(orders):
        return errors, straight
    fewer = _of_fewer(segments, orders, training, until, known)
    if straight is not None and straight.at.loss <= min(map(errors.loss, fewer), default=np.inf):
        return errors, straight
    starts = [theta for theta in (*starts, *of_state_space(looked, orders)) if np.isfinite(theta).all()]
    if not errors.stable or training.stable is not None:
        return errors, _minimum(errors, starts, training, until, fewer)
    lengths = [len(segment) for segment in errors.segments]
    bounded = replace(errors, largest=slow_poles.largest_pole(lengths))
    inside = _minimum(bounded, starts, training, until, fewer)
    system = errors.chart.system(inside.theta)
    if not slow_poles.unseen(system.radius, lengths):
        return bounded, inside
    beyond = _minimum(errors, [inside.theta, *starts], training, until, fewer)
    better = slow_poles.significantly_better(
        errors.errors(errors.chart.system(beyond.theta)),
        errors.errors(system),
        parameters=orders.n_parameters,
        scale=float(np.mean([np.mean(segment.outputs**2) for segment in segments])),
    )
    return (errors, beyond) if better else (bounded, inside)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Ways(AbstractWays):
    """How structures beside the one that is fitted are."""

    training: PolynomialTraining

    def fitted(self, orders: AbstractPolynomial) -> PolynomialModel:
        """A polynomial model in the time that is left; see the base class."""
        traces, mapping, start, rest, _ = self.data
        training = _within(self.training, self.until)
        model = fit_polynomial(traces, mapping, orders, training, start=start, rest_output=rest).model
        return cast("PolynomialModel", model)

    def run(self, problem: AbstractProvider, theta: Array, *, stays: bool = False) -> Solution:
        """To the minimum; see the base class."""
        training = replace(self.training, max_iterations=0) if stays else _within(self.training, self.until)
        return _run(problem, theta, training)


def _errors(segments: Sequence[Segment], orders: AbstractPolynomial, training: PolynomialTraining) -> PredictionErrors:
    """The least-squares problem over some records."""
    pieces = [piece for segment in segments for piece in segment.pieces()]
    stable = not orders.noise if training.stable is None else training.stable
    return PredictionErrors(
        chart=PolynomialChart(orders=orders),
        segments=tuple(pieces) if orders.noise else tuple(segments),
        whitening=np.eye(1),
        stable=stable and not orders.drifts,
    )


def _from_part(
    part: Sequence[Segment],
    segments: Sequence[Segment],
    orders: AbstractPolynomial,
    training: PolynomialTraining,
    until: float,
) -> tuple[PredictionErrors, Solution] | None:
    """The minimum over all samples next to that of a part of them.

    Returns:
        It; ``None`` where the part misleads: a pole is too slow for it, or a start by all samples leads further down.
    """
    begun, found = _search(part, orders, training, until)
    lengths = [len(segment) for segment in begun.segments]
    if slow_poles.unseen(begun.chart.system(found.theta).radius, lengths):
        return None
    errors = _errors(segments, orders, training)
    if errors.stable and training.stable is None:
        errors = replace(errors, largest=slow_poles.largest_pole([len(segment) for segment in errors.segments]))
    solution = _run(errors, found.theta, _within(training, until))
    looked = looked_at([piece for segment in segments for piece in segment.pieces()], orders)
    rivals = [(errors.loss(theta), theta) for theta in starts_of(looked, orders, long_models(looked, orders)[:1])]
    short = replace(_within(training, until), max_iterations=min(SHORT, training.max_iterations))
    rival = _run(errors, min(rivals, key=lambda one: one[0])[1], short)
    return None if rival.at.loss < solution.at.loss * (1.0 - NEAR) else (errors, solution)


def _straight(
    errors: PredictionErrors, starts: Sequence[Array], long: LongARX, training: PolynomialTraining, until: float
) -> Solution | None:
    """From the best start to its end, if one-step errors are then as small as those of a long ARX model.

    No other start can gain more than chance then. A model without noise has ends next to each other that differ by
    chance in their errors and by much in their free runs; there the others are tried.
    """
    ranked = sorted((loss, at) for at, theta in enumerate(starts) if np.isfinite(loss := errors.loss(theta)))
    if not ranked or long.yardstick is None:
        return None
    solution = _run(errors, starts[ranked[0][1]], _within(training, until))
    covariance = errors.covariance(errors.chart.system(solution.theta))
    return solution if long.yardstick.reached(covariance, len(solution.theta)) else None


def _within(training: PolynomialTraining, until: float) -> PolynomialTraining:
    """The same training in what is left of its time."""
    return replace(training, max_time_s=max(until - now(), 0.0))


def _minimum(
    errors: PredictionErrors,
    starts: Sequence[Array],
    training: PolynomialTraining,
    until: float,
    fewer: Sequence[Array] = (),
) -> Solution:
    """Short runs from the best starts and from all of models with fewer poles, and a long one from the best end."""
    training = _within(training, until)
    short = replace(training, max_iterations=min(SHORT, training.max_iterations))
    ranked = sorted((loss, at) for at, theta in enumerate(starts) if np.isfinite(loss := errors.loss(theta)))
    tried = [starts[at] for _, at in ranked[:TRIED]] + [theta for theta in fewer if np.isfinite(errors.loss(theta))]
    found: list[tuple[float, int, Solution]] = []
    for at, theta in enumerate(tried):
        solution = _run(errors, theta, short)
        found.append((solution.at.loss, at, solution))
    if not found:
        raise FitDivergedError(
            "no start gives a finite prediction",
            remedy="lower the orders, or fit an ARX model or a state space first to see what the records ask for",
        )
    best = min(found, key=lambda entry: entry[:2])[2]
    if training.max_iterations <= SHORT:
        return best
    return LevenbergMarquardt(termination=_limits(training), evidence_after=None).resume(errors, best.state)


def _run(errors: AbstractProvider, theta: Array, training: PolynomialTraining) -> Solution:
    engine = LevenbergMarquardt(termination=_limits(training), evidence_after=None)
    return engine.minimise(errors, theta, flat_prior(len(theta)))


def _limits(training: PolynomialTraining) -> Termination:
    return Termination(
        max_iterations=training.max_iterations, max_time_s=training.max_time_s, tolerance=1e-11, patience=3
    )


def _of_fewer(
    segments: Sequence[Segment],
    orders: AbstractPolynomial,
    training: PolynomialTraining,
    until: float,
    known: dict[AbstractPolynomial, Array | None],
) -> list[Array]:
    """The best models with one pole less, and a pole and a zero that cancel: the start is as good as those are.

    Args:
        segments: The records.
        orders: The structure.
        training: How to fit.
        until: When the time is up.
        known: What structures have come to, which is added to; ``None`` of one that could not be fitted.

    Returns:
        Coefficients.
    """
    if sum(map(len, segments)) * sum((*orders.denominators, orders.order("na"), orders.order("nd"))) ** 2 > NESTED:
        return []
    found = []
    for smaller, widened in next_smaller(orders):
        if smaller not in known:
            try:
                known[smaller] = _search(segments, smaller, training, until, known)[1].theta
            except (FitDivergedError, TraceError):
                known[smaller] = None
        theta = known[smaller]
        if theta is None:
            continue
        parts = np.split(theta, np.cumsum([size for _, size in parts_of(smaller)]))
        # The same root again and again would be a multiple one, which rounding tears apart.
        apart = (0.6 * np.cos(2.4 * max(orders.order("nc"), 1)),)
        for pole in CANCELLED if "F" in widened else apart:
            wider = [
                with_root(part, pole, monic=name != "B") if name in widened else part
                for (name, _), part in zip(parts_of(smaller), parts, strict=False)
            ]
            found.append(np.concatenate([*wider, parts[-1]]))
    return found


def _uncertainty(
    model: PolynomialModel, at: Linearisation, hang: Array | None, n: int, noise_variance: float
) -> Uncertainty:
    """What the prediction errors say about the coefficients, in the channels' units."""
    names, P = model.orders.names(model.mapping.inputs), len(model.theta)
    gains = model.gains
    values = gains * model.theta
    values[P - model.orders.level :] += model.scaling.output_offset
    root, scaled = at.scaled()
    sizes, vectors = linalg.eigh(scaled)
    covariance = np.full((P, P), np.nan)
    if sizes[0] > 1e-14 * sizes[-1]:
        half = (vectors / np.sqrt(sizes)) / root[:, np.newaxis]
        half = gains[:, np.newaxis] * (half if hang is None else sandwich(half, hang, n))
        covariance = 2.0 * at.loss / max(n - P, 1) * (half @ half.T)
    return Uncertainty(names=names, values=values, covariance=covariance, noise_variance=noise_variance)


def _check(orders: AbstractPolynomial, experiments: Sequence[Experiment]) -> None:
    counted = sum(e.n_counted for e in experiments)
    needed = orders.n_parameters + max(4, sum(orders.denominators)) * len(experiments)
    if counted < needed:
        raise TraceError(
            "fewer samples than parameters and initial states",
            expected=f"at least {needed} samples that count",
            got=counted,
            remedy="lower the orders, or use longer traces",
        )
