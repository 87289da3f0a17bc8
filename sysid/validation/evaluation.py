"""A model over every case, in free run and one step ahead, told apart everywhere."""

from __future__ import annotations

import time
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.estimation import Posterior
from sysid.estimation.records.experiment import Experiment
from sysid.models import AbstractModel, Start, beginning
from sysid.models.contract import gaps
from sysid.traces import Role, Trace, TraceSet
from sysid.validation.intervals import CaseIntervals, case_intervals
from sysid.validation.metrics import Figures, figures, none
from sysid.validation.resolution import parts_of


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseResult:
    """One model on one case.

    Args:
        case: Name of the trace.
        role: What the trace was used for.
        free_run: Figures of the free run, the one that counts.
        one_step: Figures of the prediction one step ahead from measured output; NaN where the model has none.
        run_time_s: Seconds that the free run took: median of repeats, warm.
        time: Seconds, shape ``(n_samples,)``.
        target: Measured output, shape ``(n_samples,)``.
        simulated: Free run, shape ``(n_samples,)``.
        predicted: One step ahead, shape ``(n_samples,)``; NaN where the model does not predict.
        first: Sample of the trace at which the free run begins; those before gave it its history and are not scored.
        intervals: Of the output, where the fit has a posterior.
        by_state: By the name of a state: figures of the free run while it lasts, and its share of the samples that
            count; ``None`` where nobody said in which state a sample is.
        constants: Parameters that differ by case, as the run had them, by name; empty where none does.
        errors: Mean squared errors of the free run by part of the case, in the output's unit squared.
        counts: Which samples figures count, shape ``(n_samples,)``: not those that are masked; ``None`` where all do.
    """

    case: str
    role: Role
    free_run: Figures
    one_step: Figures
    run_time_s: float
    time: NDArray[np.float64]
    target: NDArray[np.float64]
    simulated: NDArray[np.float64]
    predicted: NDArray[np.float64]
    first: int = 0
    intervals: CaseIntervals | None = None
    by_state: Dict[str, tuple[Figures, float]] | None = None
    constants: Dict[str, float] = field(default_factory=dict)
    errors: tuple[float, ...] = ()
    counts: NDArray[np.bool_] | None = None

    def to_dict(self) -> dict[str, Any]:
        """Figures and run time as JSON values, without the signals."""
        states = {} if self.by_state is None else {"by_state": _states(self.by_state)}
        return (
            states
            | {
                "role": self.role.value,
                "free_run": self.free_run.to_dict(),
                "one_step": self.one_step.to_dict(),
                "run_time_s": self.run_time_s,
                "n_samples": len(self.target) if self.counts is None else int(self.counts.sum()),
                "begins_at": self.first,
                "predicts": not bool(np.isnan(self.predicted).all()),
                "simulated_s": float(self.time[-1] - self.time[0]),
            }
            | ({} if self.intervals is None else {"coverage": self.intervals.to_dict()})
            | ({"constants": dict(self.constants)} if self.constants else {})
        )


def _states(by_state: Dict[str, tuple[Figures, float]]) -> dict[str, Any]:
    return {name: {**found.to_dict(), "share": share} for name, (found, share) in by_state.items()}


@dataclass(frozen=True, kw_only=True, eq=False)
class Evaluation:
    """One model on all cases.

    Args:
        cases: Results by name of the case, in the data set's order.
    """

    cases: Dict[str, CaseResult]

    def mean_mse(self, *roles: Role) -> float:
        """Mean over cases of the free run's mean squared error.

        Args:
            roles: Only cases with one of these roles; all if none is given.

        Returns:
            The mean in the output's unit squared; NaN if there is no such case.
        """
        values = [c.free_run.mse for c in self.cases.values() if not roles or c.role in roles]
        return float(np.mean(values)) if values else float("nan")


def evaluate(
    model: AbstractModel, traces: TraceSet, start: Start, *, repeats: int = 5, posterior: Posterior | None = None
) -> Evaluation:
    """Run a model of one output over every trace of a set.

    Args:
        model: The model.
        traces: The cases.
        start: How each free run begins, and from which sample on it is scored.
        repeats: Timed repetitions of each free run, after one that warms up.
        posterior: Of the model's parameters, for intervals of its output; without one there are none.

    Returns:
        The evaluation.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the model has several outputs.
    """
    return evaluate_outputs(model, traces, start, repeats=repeats, posterior=posterior)[model.mapping.output]


def evaluate_outputs(
    model: AbstractModel, traces: TraceSet, start: Start, *, repeats: int = 5, posterior: Posterior | None = None
) -> dict[str, Evaluation]:
    """Run a model of any number of outputs over every trace of a set.

    Args:
        model: The model.
        traces: The cases.
        start: How each free run begins, and from which sample on it is scored.
        repeats: Timed repetitions of each free run, after one that warms up.
        posterior: As for :func:`evaluate`.

    Returns:
        By output its evaluation; the run time is that of the whole model.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
    """
    cases = {
        trace.name: case_results(model, trace, traces.roles[trace.name], start, repeats, posterior=posterior)
        for trace in traces
    }
    return {
        output: Evaluation(cases={name: case[output] for name, case in cases.items()})
        for output in model.mapping.outputs
    }


def evaluate_case(
    model: AbstractModel, trace: Trace, role: Role, start: Start, repeats: int, *, posterior: Posterior | None = None
) -> CaseResult:
    """Run a model of one output over one trace; see :func:`case_results`."""
    return case_results(model, trace, role, start, repeats, posterior=posterior)[model.mapping.output]


def case_results(
    model: AbstractModel, trace: Trace, role: Role, start: Start, repeats: int, *, posterior: Posterior | None = None
) -> dict[str, CaseResult]:
    """Run a model of any number of outputs over one trace.

    Args:
        model: The model.
        trace: The case.
        role: What it was used for.
        start: How the free run begins, and from which sample on it is scored.
        repeats: Timed repetitions of the free run.
        posterior: Of the model's parameters, for intervals of its output.

    Returns:
        The result by output.

    Raises:
        ChannelError: If the trace lacks a channel of the mapping.
    """
    inputs, target = trace.columns(model.mapping.inputs), model.measured(trace)
    usable = trace.usable_of(model.mapping.channels)
    begun = beginning(model, inputs, target, start, usable, case=trace.name)
    history, scored = begun.history, slice(begun.first, None)
    inputs, target = inputs[scored], target[scored]
    counts = [trace.usable_of([*model.mapping.inputs, output])[scored] for output in model.mapping.outputs]
    simulated = model.simulate(inputs, history)
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        model.simulate(inputs, history)
        seconds.append(time.perf_counter() - began)
    predicts = model.recursion.predicts
    known = np.column_stack(counts) if target.ndim > 1 else counts[0]
    ahead_of = gaps.predicted(model, inputs, target, history, known) if predicts else np.full(target.shape, np.nan)
    intervals: tuple[CaseIntervals | None, ...] = (None,) * len(model.mapping.outputs)
    if posterior is not None:
        experiment = Experiment.for_model(trace, model, start)
        intervals = case_intervals(posterior, model, experiment, simulated, ahead_of)
    columns = [array.reshape(len(target), -1).T for array in (target, simulated, ahead_of)]
    return {
        output: CaseResult(
            case=trace.name,
            role=role,
            free_run=figures(measured, run, unit, counted),
            one_step=figures(measured, ahead, unit, counted) if predicts else none(unit),
            run_time_s=float(np.median(seconds)) if seconds else float("nan"),
            first=begun.first,
            time=trace.time[scored],
            target=measured,
            simulated=run,
            predicted=ahead,
            intervals=interval,
            constants=dict(zip(model.recursion.constants, history.constants, strict=True)),
            errors=parts_of((run - measured)[counted]),
            counts=None if counted.all() else counted,
        )
        for output, unit, measured, run, ahead, counted, interval in zip(
            model.mapping.outputs, model.ends.output_units, *columns, counts, intervals, strict=True
        )
    }
