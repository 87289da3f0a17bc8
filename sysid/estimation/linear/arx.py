"""ARX by least squares: one QR factorisation over several experiments, none of them concatenated."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.estimation.clock import now
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.regression import Solution, deviation, regress
from sysid.estimation.records.experiment import Experiment, experiments_of
from sysid.estimation.records.operating_point import OperatingPoint
from sysid.estimation.results.result import FitResult, Loop, Status
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import ARX, ARXModel, Mapping, Start
from sysid.traces import Trace


def fit_arx(
    traces: Sequence[Trace],
    mapping: Mapping,
    orders: ARX,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
    operating_point: OperatingPoint | None = None,
    ridge: float = 0.0,
) -> FitResult:
    """Fit an ARX model by least squares on the one-step prediction error.

    Args:
        traces: Estimation traces; a regression row never crosses from one into the next.
        mapping: Which channels go in, which comes out.
        orders: The structure.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.
        operating_point: Fit deviations from it; for orders without an intercept. The model speaks of the channels'
            values all the same: its constant follows from the point and is not counted as a parameter.
        ridge: Penalty on the coefficients relative to the length of their columns; 0 for none.

    Returns:
        The fit, with status ``EXACT`` and the uncertainty of its parameters.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the orders do not fit the inputs.
        TraceError: If there are fewer samples than parameters.
    """
    began, orders = now(), orders.for_inputs(len(mapping.inputs))
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    experiments = arx_experiments(
        traces, mapping, orders, start=start or Start(), rest_output=rest, operating_point=operating_point
    )
    solution, residual = regress(experiments, orders.lags, intercept=orders.intercept, ridge=ridge)
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
        notes=(*_rank_note(solution), stability_note(model)),
    )


def first_output(traces: Sequence[Trace], mapping: Mapping) -> float:
    """The mean of the traces' first output samples that are not masked: the rest value where none is declared.

    Args:
        traces: Estimation traces.
        mapping: Names the output.

    Returns:
        A value in the output's unit.
    """
    return float(np.mean([trace[mapping.output][int(np.argmax(trace.usable_samples))] for trace in traces]))


def rests_of(traces: Sequence[Trace], mapping: Mapping, given: float | Dict[str, float] | None) -> tuple[float, ...]:
    """Each output at rest.

    Args:
        traces: Estimation traces.
        mapping: Names the outputs.
        given: The value of the only output, or values by name; :func:`first_output` where there is none.

    Returns:
        Values in the outputs' units.
    """
    told = given if isinstance(given, Dict) else {} if given is None else {mapping.output: given}
    return tuple(told[one.output] if one.output in told else first_output(traces, one) for one in mapping.each)


def arx_experiments(
    traces: Sequence[Trace],
    mapping: Mapping,
    orders: ARX,
    *,
    start: Start,
    rest_output: float,
    operating_point: OperatingPoint | None,
) -> tuple[Experiment, ...]:
    """The records of an ARX fit, as deviations where that is asked for.

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which comes out.
        orders: The structure.
        start: What stands before each trace.
        rest_output: Output at rest.
        operating_point: What the records are counted from; ``None`` for the values themselves.

    Returns:
        One experiment per trace; rows that look at masked samples do not count.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        TraceError: If deviations go with an intercept.
    """
    if operating_point is not None and orders.intercept:
        raise TraceError(
            "deviations from an operating point leave nothing for an intercept to do",
            expected="one of the two",
            got="both",
            remedy="set intercept: false, or give no operating point",
        )
    experiments = tuple(e.one_step(orders.lags) for e in experiments_of(traces, mapping, start, rest_output))
    return experiments if operating_point is None else tuple(deviation(e, operating_point) for e in experiments)


def arx_model(
    parameters: NDArray[np.float64],
    orders: ARX,
    mapping: Mapping,
    example: Trace,
    *,
    rest_output: float,
    operating_point: OperatingPoint | None,
) -> ARXModel:
    """The model with these parameters.

    Args:
        parameters: ``[b of input 1 | ... | a]`` and the intercept where it is fitted.
        orders: The structure.
        mapping: Which channels go in, which comes out.
        example: A trace, for sample time and units.
        rest_output: Output at rest.
        operating_point: What the parameters' deviations are counted from.

    Returns:
        The model, in the channels' units.
    """
    coefficients = parameters[: orders.lags.n_regressors]
    intercept = float(parameters[-1]) if orders.intercept else 0.0
    if operating_point is not None:
        intercept = operating_point.intercept(orders, coefficients)
    return ARXModel(
        orders=orders,
        coefficients=coefficients,
        intercept=intercept,
        mapping=mapping,
        sample_time=example.sample_time,
        input_units=tuple(example.channel(name).unit for name in mapping.inputs),
        output_unit=example.channel(mapping.output).unit,
        rest_output=rest_output,
    )


def arx_uncertainty(
    solution: Solution, residual: NDArray[np.float64], n_counted: int, orders: ARX, mapping: Mapping
) -> Uncertainty:
    """What the residuals say about the parameters (Ljung 1999, eq. 9.20: white residuals, true structure).

    Args:
        solution: The regression.
        residual: Shape ``(n_samples,)``.
        n_counted: Samples that count.
        orders: The structure.
        mapping: Names the inputs.

    Returns:
        The uncertainty, parameter by parameter.
    """
    variance = float(residual @ residual) / max(n_counted - solution.rank, 1)
    lags = orders.lags
    names = [f"b({name}, {lag})" for name, lags_i in zip(mapping.inputs, lags.inputs, strict=True) for lag in lags_i]
    names += [f"a({lag})" for lag in lags.output] + ["intercept"] * orders.intercept
    return Uncertainty(
        names=tuple(names),
        values=solution.coefficients,
        covariance=variance * solution.unscaled_covariance,
        noise_variance=variance,
    )


def _rank_note(solution: Solution) -> tuple[str, ...]:
    n = len(solution.coefficients)
    if solution.rank == n:
        return ()
    return (f"The data determine {solution.rank} of {n} parameters; the others are zero.",)


def stability_note(model: ARXModel) -> str:
    """Whether the free run is stable, as a sentence.

    Args:
        model: The model.

    Returns:
        The sentence, with the largest pole.
    """
    return slow_poles.stability(float(np.abs(model.poles).max(initial=0.0)))
