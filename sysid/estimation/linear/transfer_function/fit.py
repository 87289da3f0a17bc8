"""Transfer functions by least squares on the simulation error, from several starts."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from sysid.errors import TraceError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.state import Iteration
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.arx import first_output
from sysid.estimation.linear.begun_at_rest import Beginning, at_rest, left_out
from sysid.estimation.linear.delay_search import check_max_delay, without_dead_time
from sysid.estimation.linear.determined import Determined
from sysid.estimation.linear.pole_starts import PoleStart, arx_starts, free_starts, pole_starts, slower_starts
from sysid.estimation.linear.segments import delayed_inputs, scaling_of
from sysid.estimation.linear.stretches import stretches, told_of
from sysid.estimation.linear.time_record import TimeRecord
from sysid.estimation.linear.transfer_function.delays import DelaySearch
from sysid.estimation.linear.transfer_function.level import integrating, standing
from sysid.estimation.linear.transfer_function.pole_moves import slowness
from sysid.estimation.linear.transfer_function.problem import AbstractProblem, Score
from sysid.estimation.linear.transfer_function.runs import Delays, End
from sysid.estimation.linear.transfer_function.search import solve
from sysid.estimation.linear.transfer_function.training import Terms, TransferFunctionTraining
from sysid.estimation.linear.variable_projection import SeparableProvider
from sysid.estimation.nonparametric.dead_time import likely, longest_dead_time
from sysid.estimation.nonparametric.feedback import find_feedback
from sysid.estimation.nonparametric.segments import Segment
from sysid.estimation.records.experiment import Experiment, experiments_of
from sysid.estimation.records.informative import informative
from sysid.estimation.results.result import FitResult
from sysid.models import AbstractModel, Domain, Mapping, Scaling, Start, TransferFunction, TransferFunctionModel
from sysid.models.converting.realisation import parted
from sysid.traces import Trace


def _ignore(_: Iteration) -> None:
    """The callback of those who do not watch."""


def fit_transfer_function(
    traces: Sequence[Trace],
    mapping: Mapping,
    orders: TransferFunction,
    training: TransferFunctionTraining | None = None,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
    selection: Sequence[Trace] = (),
    on_iteration: Callable[[Iteration], None] = _ignore,
) -> FitResult:
    """Fit a transfer function to the free run.

    The state before each trace is the equilibrium at its first inputs for a start at rest, or with the first sample
    held; for an estimated or a measured start it is fitted beside the parameters, and all samples count but those
    whose input, a dead time ago, came before the record.

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which comes out.
        orders: The structure; dead times that it leaves open are searched.
        training: How to fit.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.
        selection: Traces that choose among starts and how far to refine them, by the free run; without them the
            estimation loss chooses, which favours what has been refined the longest.
        on_iteration: Called after every iteration of the final run.

    Returns:
        The fit, the spread over starts among its notes, and the uncertainty of numerators and denominators.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the orders do not fit the inputs, or a largest dead time is asked for and none is searched.
        TraceError: If there are fewer samples than parameters.
        FitDivergedError: If no start gives a finite free run.
    """
    began = now()
    start, orders = start or Start(), orders.for_inputs(len(mapping.inputs))
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    whole = experiments_of(traces, mapping, start, rest)
    _check(orders, whole)
    training = training or TransferFunctionTraining()
    check_max_delay(training.max_delay, searched=orders.delays is None, field="delays")
    determined = Determined.of(whole)
    experiments, own = tuple(determined.only(e) for e in whole), determined.narrowed(orders)
    scaling = scaling_of(whole, constant=orders.intercept)
    units = tuple(traces[0].channel(name).unit for name in mapping.inputs)

    def of_all_inputs(model: AbstractModel) -> AbstractModel:
        if own is orders:
            return model
        return determined.widened(cast("TransferFunctionModel", model), orders, mapping, scaling, units)

    def score(model: AbstractModel) -> float:
        return _mean_mse(of_all_inputs(model), selection, start)

    problem = _Problem(
        experiments=experiments,
        scaling=scaling_of(experiments, constant=orders.intercept),
        orders=own,
        training=training,
        terms=Terms(
            mapping=determined.mapping(mapping),
            sample_time=traces[0].sample_time,
            input_units=tuple(units[j] for j in determined.kept),
            output_unit=traces[0].channel(mapping.output).unit,
            rest_output=rest,
        ),
        as_scored=None if all(e.free for e in whole) else lambda model: _mean_mse(model, traces, start),
    )
    # BLAS threads that wake for matrices of some ten columns cost more than they give: beside one other process on two
    # cores a fit took four times as long with them.
    with one_blas_thread():
        fit = solve(problem, began, on_iteration, score if selection else None)
    return replace(fit, model=of_all_inputs(fit.model))


def _third(experiment: Experiment) -> int:
    """Samples before which a third of those that are not masked lie: so many may be left out for a dead time."""
    usable = experiment.usable
    if usable is None or not usable.any():
        return len(experiment.output)
    places = np.flatnonzero(usable)
    return int(places[len(places) // 3])


def _mean_mse(model: AbstractModel, traces: Sequence[Trace], start: Start) -> float:
    """Mean over records of the free run's mean squared error; infinite where a free run is not finite."""
    errors = []
    for trace in traces:
        experiment = Experiment.for_model(trace, model, start)
        error = model.simulate(experiment.inputs, experiment.history) - experiment.output
        weights = np.ones(len(error)) if experiment.weights is None else experiment.weights
        errors.append(float(np.sum(weights * error**2) / max(experiment.n_counted, 1)))
    return float(np.mean(errors)) if np.isfinite(errors).all() else np.inf


@dataclass(frozen=True, kw_only=True, eq=False)
class _Problem(AbstractProblem):
    """Records over time."""

    experiments: tuple[Experiment, ...]
    scaling: Scaling
    orders: TransferFunction
    training: TransferFunctionTraining
    terms: Terms
    as_scored: Score = None
    rested: bool = True
    between: bool = True

    def provider(self, delays: Delays, *, unknown: int | None = None) -> SeparableProvider:
        """The least-squares problem with these dead times; see the base class."""
        return SeparableProvider(
            poles=self.pole_parameters(max(len(e.output) for e in self.experiments)),
            n_zeros=self.orders.zeros,
            records=self._records(delays, unknown),
            constant=self.orders.intercept,
        )

    def starts(self, provider: SeparableProvider, *, few: bool, alone: bool = True) -> list[PoleStart]:
        """From ARX models and instrumental variables, and scattered ones; see the base class."""
        records = [record for record in provider.records if isinstance(record, TimeRecord)]
        n_poles, n_zeros, training = self.orders.poles, self.orders.zeros, self.training
        found = (
            arx_starts(records, n_poles, n_zeros)
            if few
            else pole_starts(
                records,
                n_poles,
                n_zeros,
                n_scattered=training.scattered_starts,
                seed=training.seed,
                instruments=alone,
            )
        )

        def loss(start: PoleStart) -> float:
            return provider.loss(provider.poles.theta(start.sections))

        # Most records are sampled slowly enough, and nothing is gained by them.
        least = min(map(loss, found))
        found += [start for start in slower_starts(records, n_poles, n_zeros) if loss(start) < least]
        return [*found, *self.free_starts(provider)] if few and training.stable is False else found

    def part(self) -> _Problem | None:
        """Stretches of long records; see the base class."""
        few = stretches(self.experiments)
        return None if few is None else replace(self, experiments=few)

    def about_part(self) -> str:
        """How many samples it has; see the base class."""
        return told_of(self.experiments)

    def delay_range(self) -> tuple[int, int]:
        """Up to a third of the longest record where nothing else is said; see the base class."""
        most = self.training.max_delay
        if most is None:
            most = longest_dead_time([len(experiment.output) for experiment in self.experiments])
            most = min(most, max(map(_third, self.experiments)))
        return 0 if self.orders.domain is Domain.CONTINUOUS else min(1, most), most

    def direct(self, delays: tuple[int, ...]) -> tuple[int, ...]:
        """None where an input clearly acts within the sample and no controller sets one there; see the base class."""
        if 1 not in delays:
            return delays
        targets = [e.output[rows] for e in self.experiments for rows in _counted(e)]
        whole = self.scaling.scale_output(np.concatenate(targets))
        constant = 0.5 * float(np.sum((whole - whole.mean()) ** 2)), len(whole)
        found = without_dead_time(delays, 1, DelaySearch(problem=self).loss_at, constant)
        return delays if found == delays or self._fed_back() else found

    def _fed_back(self) -> bool:
        stretches = [
            Segment(inputs=e.inputs[rows], output=e.output[rows]) for e in self.experiments for rows in _counted(e)
        ]
        kept = informative(np.concatenate([s.inputs for s in stretches]))
        found = find_feedback([replace(s, inputs=s.inputs[:, list(kept)]) for s in stretches])
        return not isinstance(found, str) and found.at_once

    def begun_in_motion(self) -> _Problem | None:
        """With first samples left out that stand; see the base class."""
        # Where dead times are tried that are longer than all records, those that begin at rest alone tell of them.
        long = max(len(e.output) for e in self.experiments) > self.delay_range()[1]
        rests = long and any(e.free and at_rest(_beginning(e), 0) for e in self.experiments)
        return replace(self, rested=False) if rests else None

    def likely_delays(self, least: int, most: int) -> list[list[int]]:
        """By correlation; see the base class."""
        return likely(self.experiments, self.orders.poles, most, least)

    def told(self, end: End) -> tuple[str, ...]:
        """Of slow poles, and of errors that hang together; see the base class."""
        separated = end.provider.separated(end.theta)
        if separated is None or separated.mirrored:
            return ()
        radius = slowness(end.sections, self.orders.domain, self.terms.sample_time)
        return slow_poles.notes(radius, end.lengths, end.errors)

    def unbounded(self) -> _Problem:
        """With inputs as they are: the offset of an input adds up in an integrator, and no constant undoes it."""
        scaling = replace(self.scaling, input_offset=(0.0,) * len(self.scaling.input_offset))
        unknown = tuple(e.begun_anywhere for e in self.experiments)
        return replace(
            self, scaling=scaling, experiments=unknown, training=replace(self.training, stable=False)
        )  # fmt: skip

    def levelled(self, end: End) -> _Problem | None:
        """With inputs from the value at which the first that integrates stands; see the base class."""
        separated = end.provider.separated(end.theta) if self.orders.intercept else None
        j = None if separated is None else integrating(separated, self.orders.domain, self.terms.sample_time)
        if j is None:
            return None
        raised = self._from(j, -1.0).provider(end.delays)
        level = standing(end.provider, raised, end.theta, j)
        return None if level is None or not np.isfinite(level) else self._from(j, level)

    def _from(self, j: int, level: float) -> _Problem:
        """With an input counted from another level, in scaled numbers."""
        offset = list(self.scaling.input_offset)
        offset[j] += level * self.scaling.input_scale[j]
        return replace(self, scaling=replace(self.scaling, input_offset=tuple(offset)))

    def free_starts(self, provider: SeparableProvider) -> list[PoleStart]:
        """ARX as it is, and integrators; see the base class."""
        records = [record for record in provider.records if isinstance(record, TimeRecord)]
        return free_starts(records, self.orders.poles)

    def _records(self, delays: Delays, most: int | None) -> tuple[TimeRecord, ...]:
        """Records whose first samples are left out where an input a dead time ago would come before a record.

        Dead times that are compared (up to ``most``) leave out the same samples: whether a record begins at rest is
        not judged by each of them.
        """
        unknown, dead = (math.ceil(max(delays)), int(min(delays))) if most is None else (most, 0)
        lost = [unknown] * len(self.experiments)
        if self.rested:
            lost = left_out([_beginning(experiment) for experiment in self.experiments], unknown, dead)
        known = [self._record(one, delays, n) for one, n in zip(self.experiments, lost, strict=True)]
        records = tuple(record for record in known if len(record.target))
        if not records:
            raise TraceError(
                "no record is longer than the dead time",
                expected=f"more than {unknown} samples",
                got=f"{max(len(e.output) for e in self.experiments)} samples",
                remedy="shorten the dead times, or use longer records",
            )
        return records

    def _record(self, experiment: Experiment, delays: Delays, unknown: int) -> TimeRecord:
        """A record with its measured history put before it."""
        measured = experiment.past is not None and experiment.past.any()
        inputs, output = experiment.inputs, experiment.output
        weights = np.ones(len(output)) if experiment.weights is None else experiment.weights
        past = experiment.history.inputs[0]
        if measured:
            inputs = np.concatenate([experiment.history.inputs, inputs])
            output = np.concatenate([experiment.history.output, output])
            weights = np.concatenate([experiment.past_weights, weights])
        scaled, held = self.scaling.scale_inputs(inputs), self.scaling.scale_inputs(past[np.newaxis])[0]
        first = unknown if experiment.free else 0
        rows, (whole, late) = slice(first, None), zip(*map(parted, delays), strict=True)
        delayed = delayed_inputs(scaled, held, whole)
        return TimeRecord(
            inputs=np.asfortranarray(delayed[rows]),
            # From a state that is fitted any past can be reached, and zero is one that every system has.
            past=np.zeros(len(held)) if experiment.free else held,
            target=self.scaling.scale_output(output)[rows],
            root_weights=np.sqrt(weights)[rows],
            domain=self.orders.domain,
            sample_time=self.terms.sample_time,
            free_start=experiment.free,
            moving=self.orders.moving(self.terms.mapping.inputs),
            late=late,
            before=delayed[first - 1] if 0 < first <= len(delayed) else held,  # no row is left of a shorter record
        )


def _beginning(experiment: Experiment) -> Beginning:
    """What says whether a record begins at rest."""
    return experiment.inputs, experiment.output[:, np.newaxis], experiment.usable


def _counted(experiment: Experiment) -> list[slice]:
    """Stretches of samples that count."""
    if experiment.weights is None:
        return [slice(0, len(experiment.output))]
    counts = np.concatenate([[False], experiment.weights > 0.0, [False]])
    edges = np.flatnonzero(counts[1:] != counts[:-1]).reshape(-1, 2)
    return [slice(int(first), int(last)) for first, last in edges]


def _check(orders: TransferFunction, experiments: Sequence[Experiment]) -> None:
    states = sum(orders.poles) * sum(experiment.free for experiment in experiments)
    needed = sum(orders.poles) + sum(orders.zeros) + len(orders.zeros) + orders.intercept + states
    counted = sum(experiment.n_counted for experiment in experiments)
    if counted < needed:
        raise TraceError(
            "fewer samples than parameters and initial states" if states else "fewer samples than parameters",
            expected=f"at least {needed} samples that count",
            got=counted,
            remedy="lower the orders, or use longer traces",
        )
