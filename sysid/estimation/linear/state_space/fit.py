"""Linear state spaces of traces: by subspace methods and by the prediction error."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.estimation.clock import now
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.arx import rests_of
from sysid.estimation.linear.determined import Determined
from sysid.estimation.linear.segments import Segment, scaling_of, segments_of, side_by_side
from sysid.estimation.linear.state_space.dead_times import behind_dead_times, late
from sysid.estimation.linear.state_space.refinement import Found, Level
from sysid.estimation.linear.state_space.search import around, search
from sysid.estimation.linear.state_space.training import METHODS, StateSpaceTraining
from sysid.estimation.linear.state_space.uncertainty import coordinates_root, state_space_uncertainty
from sysid.estimation.records.experiment import experiments_of
from sysid.estimation.results.result import FitResult, Loop
from sysid.models import (
    LinearStateSpace,
    LinearStateSpaceModel,
    Mapping,
    Scaling,
    Start,
    VectorScaling,
    VectorStateSpaceModel,
)
from sysid.traces import Trace


def fit_state_space(
    traces: Sequence[Trace],
    mapping: Mapping,
    orders: LinearStateSpace,
    training: StateSpaceTraining | None = None,
    *,
    start: Start | None = None,
    rest_output: float | Dict[str, float] | None = None,
) -> FitResult:
    """Fit a linear state space.

    Args:
        traces: Estimation traces; never concatenated, each with an initial state of its own.
        mapping: Which channels go in, which come out.
        orders: The structure; dead times that it leaves open (``nk="auto"``) are searched, and told.
        training: How to fit.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit, or by name; the mean of the traces' first samples where not given.

    Returns:
        The fit; after the prediction-error method with the uncertainty of its polynomials. Of several outputs its
        errors are mean squares over them, each relative to its innovations.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the dead times do not fit the inputs.
        TraceError: If there are fewer samples than parameters, or no record is long enough.
        FitDivergedError: If no start gives a finite prediction.
    """
    began, training = now(), training or StateSpaceTraining()
    orders = orders.for_inputs(len(mapping.inputs))
    rests = rests_of(traces, mapping, rest_output)
    input_units = tuple(traces[0].channel(name).unit for name in mapping.inputs)
    scalings, segments, determined = records_of(traces, mapping, orders, start=start, rests=rests)
    scaling: Any = VectorScaling.of(scalings) if orders.several_outputs else scalings[0]
    if len(determined.kept) < len(mapping.inputs):
        own, given = (
            (determined.mapping(mapping), determined.narrowed(orders)),
            dict(zip(mapping.outputs, rests, strict=True)),
        )
        fit = fit_state_space(traces, *own, training, start=start, rest_output=given)
        return determined.states(fit, mapping, scaling, input_units)
    orders, segments, told = behind_dead_times(segments, orders, training)
    found = search(segments, orders, training, _zero(scalings[0]))
    if found.level is not None:
        scaling = replace(scaling, input_offset=_offset(scaling, found.level))
    shared: dict[str, Any] = {
        "orders": orders,
        "system": found.system,
        "mapping": mapping,
        "sample_time": traces[0].sample_time,
        "input_units": input_units,
    }
    units = tuple(traces[0].channel(name).unit for name in mapping.outputs)
    model: LinearStateSpaceModel | VectorStateSpaceModel
    if orders.several_outputs:
        unit = 1.0
        model = VectorStateSpaceModel(scaling=scaling, output_units=units, rest_outputs=rests, **shared)
    else:
        unit = float(found.covariance[0, 0]) * scalings[0].output_scale ** 2 / max(found.curve[-1].mse, _TINY)
        model = LinearStateSpaceModel(scaling=scaling, output_unit=units[0], rest_output=rests[0], **shared)
    fit = _result(model, replace(found, notes=(*told, *found.notes)), orders, training, began=began, unit=unit)
    return fit if determined.moves else determined.states(fit, mapping, scaling, input_units)


_TINY = 1e-300


def _zero(scaling: Scaling) -> Level:
    """What is zero of each input, in scaled numbers."""
    return tuple((-np.array(scaling.input_offset) / np.array(scaling.input_scale)).tolist())


def _offset(scaling: Scaling | VectorScaling, level: Level) -> tuple[float, ...]:
    """The values of inputs, in their units, from which integrators add them up."""
    return tuple((np.array(scaling.input_offset) + np.array(level) * np.array(scaling.input_scale)).tolist())


def records_of(
    traces: Sequence[Trace],
    mapping: Mapping,
    orders: LinearStateSpace,
    *,
    start: Start | None,
    rests: tuple[float, ...],
) -> tuple[list[Scaling], tuple[Segment, ...], Determined]:
    """The scaling of each output, the records in scaled numbers, before any dead time, and which inputs say anything.

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which come out.
        orders: The structure.
        start: What stands before each trace.
        rests: Each output at rest, in its unit.

    Returns:
        All three.

    Raises:
        TraceError: If there are fewer samples than parameters.
    """
    each = [experiments_of(traces, one, start or Start(), rest) for one, rest in zip(mapping.each, rests, strict=True)]
    counted = len(each) * sum(e.n_counted for e in each[0])
    needed = orders.n_parameters(len(mapping.inputs), len(each)) + orders.states * sum(e.free for e in each[0])
    if counted < needed:
        raise TraceError(
            "fewer samples than parameters and initial states",
            expected=f"at least {-(-needed // len(each))} samples that count",
            got=counted // len(each),
            remedy="ask for fewer states, or use longer traces",
        )
    scalings = [scaling_of(experiments, constant=orders.intercept) for experiments in each]
    segments = side_by_side([segments_of(e, scaling) for e, scaling in zip(each, scalings, strict=True)])
    return scalings, segments, Determined.of(each[0])


def matrices_root(
    model: LinearStateSpaceModel | VectorStateSpaceModel, traces: Sequence[Trace], start: Start
) -> NDArray[np.float64]:
    """A factor of the covariance of a fitted model's matrices, along what changes the system.

    Args:
        model: The model, at the least prediction error of the traces.
        traces: Estimation traces.
        start: What stands before each.

    Returns:
        Shape ``(n_entries, n_directions)``, entries as :attr:`sysid.models.linear.innovations.Innovations.entries`.
    """
    rests = tuple(float(rest) for rest in model.ends.rest_outputs)
    scalings, segments, _ = records_of(traces, model.mapping, model.orders, start=start, rests=rests)
    own, given = model.scaling, scalings[0]
    if own.input_offset != given.input_offset:  # what integrates counts its inputs from a level, and begins anywhere
        level = (np.array(own.input_offset) - np.array(given.input_offset)) / np.array(given.input_scale)
        segments = tuple(replace(one, inputs=one.inputs - level, rest=None) for one in segments)
    found = around(model.system, late(segments, model.orders), model.orders)
    return np.asarray(found.chart.basis @ coordinates_root(found))


def _result(
    model: LinearStateSpaceModel | VectorStateSpaceModel,
    found: Found,
    orders: LinearStateSpace,
    training: StateSpaceTraining,
    *,
    began: float,
    unit: float,
) -> FitResult:
    by_subspace = training.method == METHODS[1]
    return FitResult(
        model=model,
        status=found.status,
        loop=Loop.OPEN if orders.noise else Loop.CLOSED,
        history={
            "iteration": np.array([one.iteration for one in found.curve], dtype=np.float64),
            "mse": unit * np.array([one.mse for one in found.curve]),
        },
        train_time_s=now() - began,
        uncertainty=None if by_subspace else state_space_uncertainty(model, found),
        notes=(*_notes(found, orders), *found.notes, slow_poles.stability(model.pole_radius)),
        warnings=found.warnings,
    )


def _notes(found: Found, orders: LinearStateSpace) -> tuple[str, ...]:
    sizes = found.singular_values[: orders.states + 3]
    told = ", ".join(f"{size:.3f}" for size in sizes)
    begun = f"The subspace estimate is by {found.weighting.value}."
    if not told:
        return (begun,)
    return (begun, f"Canonical correlations of past and future: {told}; the states are those that stand out.")
