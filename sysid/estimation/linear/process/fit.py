"""Process models by the least error of the free run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.estimation.clock import now
from sysid.estimation.linear.arx import first_output
from sysid.estimation.linear.process.problem import Bounds, Problem, ProcessRecord
from sysid.estimation.linear.process.search import End, finished, raced
from sysid.estimation.linear.process.starts import Begun, begun_at, starts
from sysid.estimation.linear.process.uncertainty import process_uncertainty
from sysid.estimation.linear.process.words import of_bounds, of_errors, of_open, of_parameters
from sysid.estimation.linear.segments import scaling_of
from sysid.estimation.linear.stretches import stretches, told_of
from sysid.estimation.linear.transfer_function.words import of_stability
from sysid.estimation.nonparametric.dead_time import likely, longest_dead_time
from sysid.estimation.records.experiment import Experiment, experiments_of
from sysid.estimation.records.informative import informative
from sysid.estimation.results.result import FitResult, Loop
from sysid.models import FittedProcess, Mapping, ProcessModel, Scaling, Start
from sysid.models.process.process_type import GAIN
from sysid.traces import Trace

Array = NDArray[np.float64]


def fit_process(
    traces: Sequence[Trace],
    mapping: Mapping,
    process: ProcessModel,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
) -> FitResult:
    """Fit a process model to the free run.

    A record whose start is at rest, or held, begins at the equilibrium of its first inputs; of others, and of all where
    the plant integrates, the state at the first row is fitted beside the parameters.

    Args:
        traces: Estimation traces; never concatenated.
        mapping: Which channels go in, which comes out.
        process: The structure.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.

    Returns:
        The fit, with the uncertainty of the parameters by their names.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the types do not fit the inputs.
        TraceError: If there are fewer samples than parameters, or an input does not move.
        FitDivergedError: If no start gives a finite free run.
    """
    began = now()
    process = process.for_inputs(len(mapping.inputs))
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    whole = experiments_of(traces, mapping, start or Start(), rest)
    _check(process, mapping, whole)
    scaling = scaling_of(whole, constant=process.intercept)
    if any(kind.integrates for kind in process.types):
        whole = tuple(one.begun_anywhere for one in whole)
    channels = {
        "mapping": mapping,
        "sample_time": traces[0].sample_time,
        "input_units": tuple(traces[0].channel(name).unit for name in mapping.inputs),
        "output_unit": traces[0].channel(mapping.output).unit,
        "rest_output": rest,
    }
    part, sample_time = stretches(whole), traces[0].sample_time
    begun: Begun | End = raced(_begun(process, mapping, scaling, sample_time, part or whole))
    if part is not None:
        values = begun.problem.values(begun.theta)
        problem = _problem(process, mapping, scaling, sample_time, whole).rows_for(values)
        begun = begun_at(problem, values, begun.problem.offset(begun.theta))
    end = finished(begun)
    found = _result(process, end, scaling, channels)
    told = () if part is None else (told_of(part),)
    return replace(found, notes=(*told, *found.notes), train_time_s=now() - began)


def _problem(
    process: ProcessModel, mapping: Mapping, scaling: Scaling, sample_time: float, experiments: Sequence[Experiment]
) -> Problem:
    records = tuple(ProcessRecord.of(one, scaling) for one in experiments)
    longest = max(len(one.target) for one in records)
    return Problem(
        types=process.types,
        records=records,
        bounds=Bounds.of(process, mapping.inputs, scaling, sample_time, longest),
        sample_time=sample_time,
        constant=process.intercept,
        middles=np.array(scaling.input_offset),
    )


def _begun(
    process: ProcessModel, mapping: Mapping, scaling: Scaling, sample_time: float, experiments: Sequence[Experiment]
) -> list[Begun]:
    """Points of the grid from which the search begins."""
    problem = _problem(process, mapping, scaling, sample_time, experiments)
    most = longest_dead_time([len(one.output) for one in experiments])
    found = likely(experiments, [kind.order for kind in problem.types], most, 0)
    return starts(problem, [own if kind.dead else [0] for own, kind in zip(found, problem.types, strict=True)])


def _result(process: ProcessModel, end: End, scaling: Scaling, channels: dict[str, Any]) -> FitResult:
    """The fit from where the search ended."""
    problem = end.problem
    values = problem.each(problem.values(end.theta))
    own = [values[j].copy() for j in range(len(values))]
    offset = problem.offset(end.theta)
    constant, level = scaling.output_offset, np.zeros(len(own))
    for j, kind in enumerate(problem.types):
        own[j][kind.names.index(GAIN)] *= scaling.output_scale / scaling.input_scale[j]
        if kind.integrates:
            level[j] = scaling.input_offset[j] + (scaling.input_scale[j] * offset if j == problem.levelled else 0.0)
        else:
            constant -= float(own[j][0]) * scaling.input_offset[j]
    if problem.levelled is None:
        constant += scaling.output_scale * offset
    model = FittedProcess.of(process, own, constant=constant, level=level, scaling=scaling, **channels)
    known = process_uncertainty(model, end)
    warned = (*of_bounds(model, end), *of_open(model, known, end))
    unit = 2.0 * scaling.output_scale**2 / max(problem.n_counted, 1)
    return FitResult(
        model=model,
        status=end.status,
        loop=Loop.CLOSED,
        history={
            "iteration": np.arange(len(end.curve), dtype=np.float64),
            "mse": unit * np.array(end.curve),
        },
        train_time_s=0.0,
        uncertainty=known,
        notes=(of_parameters(model, known), *of_errors(end), *warned, of_stability(model)),
        warnings=warned,
    )


def _check(process: ProcessModel, mapping: Mapping, experiments: Sequence[Experiment]) -> None:
    """Refuse records that say nothing of an input, or less than is asked."""
    seen = [one.inputs if one.usable is None else one.inputs[one.usable] for one in experiments]
    kept = informative(np.concatenate(seen))
    lost = [name for j, name in enumerate(mapping.inputs) if j not in kept]
    if lost:
        raise TraceError(
            f"{', '.join(lost)} never changes, or only as other inputs do: no record tells what it does",
            expected="an input that moves by itself in a record",
            got="one that does not",
            remedy="leave it out of the mapping; where a record begins with its step, put a sample before it in which "
            "the input has still the value before the step",
        )
    states = sum(kind.order for kind in process.types) * sum(one.free for one in experiments)
    needed = sum(len(kind.names) for kind in process.types) + process.intercept + states
    counted = sum(one.n_counted for one in experiments)
    if counted < needed:
        raise TraceError(
            "fewer samples than parameters and initial states" if states else "fewer samples than parameters",
            expected=f"at least {needed} samples that count",
            got=counted,
            remedy="take a type with fewer letters, or longer records",
        )
