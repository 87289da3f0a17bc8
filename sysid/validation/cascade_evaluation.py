"""A whole cascade over every case: free run from its inputs alone, each output judged on its own."""

from __future__ import annotations

import time
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError
from sysid.models import Activity, Cascade, CascadeRun, Ends
from sysid.traces import Role, Trace, TraceSet
from sysid.validation.evaluation import CaseResult, Evaluation
from sysid.validation.metrics import figures, none


@dataclass(frozen=True, kw_only=True, eq=False)
class CascadeEvaluation:
    """A cascade on all cases.

    Args:
        outputs: For each output that the traces have, its evaluation: as for a model, but that the free run is the
            whole's. One step ahead is the member alone on measured signals, and the run time the whole's.
        activity: For each case how often each output was held.
    """

    outputs: Dict[str, Evaluation]
    activity: Dict[str, Dict[str, Activity]]

    def mse(self, output: str) -> dict[str, float]:
        """Mean squared error of the free run by case, in the output's unit squared.

        Args:
            output: The output.

        Returns:
            By name of the case.

        Raises:
            ChannelError: If it was not evaluated.
        """
        if output not in self.outputs:
            raise ChannelError([output], tuple(self.outputs), where="evaluation of the cascade")
        return {name: case.free_run.mse for name, case in self.outputs[output].cases.items()}

    @property
    def held(self) -> dict[str, list[str]]:
        """Sentences on limits and bounds that were active, by case; cases without any are left out."""
        found = {
            case: [f"{name} {one.sentence}" for name, one in activity.items() if one.low or one.high or one.lost]
            for case, activity in self.activity.items()
        }
        return {case: sentences for case, sentences in found.items() if sentences}

    def to_dict(self) -> dict[str, Any]:
        """Figures and run times as JSON values, without the signals."""
        return {
            "outputs": {
                name: {case: result.to_dict() for case, result in evaluation.cases.items()}
                for name, evaluation in self.outputs.items()
            },
            "held": self.held,
        }


def evaluate_cascade(
    cascade: Cascade, traces: TraceSet, *, outputs: Sequence[str] | None = None, repeats: int = 5
) -> CascadeEvaluation:
    """Run a cascade over every trace of a set, from its inputs alone.

    Args:
        cascade: The cascade.
        traces: The cases.
        outputs: Outputs to judge; by default all that the traces have.
        repeats: Timed repetitions of each free run.

    Returns:
        The evaluation.

    Raises:
        ChannelError: If a trace lacks an input or an output that is asked for, or has none of the outputs.
    """
    measured = [channel.name for channel in traces.channels]
    names = [name for name in cascade.outputs if name in measured] if outputs is None else list(outputs)
    strangers = [name for name in names if name not in cascade.outputs]
    if strangers or not names:
        raise ChannelError(strangers or cascade.outputs, measured, where=f"data set {traces.name}")
    cases: dict[str, dict[str, CaseResult]] = {name: {} for name in names}
    activity = {}
    for trace in traces:
        timed = _timed(cascade, trace, repeats)
        activity[trace.name] = timed.run.activity
        for name in names:
            cases[name][trace.name] = _case(cascade, trace, traces.roles[trace.name], timed, name)
    return CascadeEvaluation(
        outputs={name: Evaluation(cases=results) for name, results in cases.items()}, activity=activity
    )


@dataclass(frozen=True, eq=False)
class _Timed:
    """A run and the seconds that it took."""

    run: CascadeRun
    seconds: float


def _timed(cascade: Cascade, trace: Trace, repeats: int) -> _Timed:
    run, seconds = cascade.simulate_trace(trace), []
    for _ in range(repeats):
        began = time.perf_counter()
        cascade.simulate_trace(trace)
        seconds.append(time.perf_counter() - began)
    return _Timed(run, float(np.median(seconds)) if seconds else float("nan"))


def _case(cascade: Cascade, trace: Trace, role: Role, timed: _Timed, name: str) -> CaseResult:
    run = timed.run
    target, unit = trace.columns([name])[:, 0], cascade.units[name]
    counted = trace.usable_of([*cascade.inputs, name])
    predicted = _one_step_ahead(cascade, trace, run, name)
    return CaseResult(
        case=trace.name,
        role=role,
        free_run=figures(target, run[name], unit, counted),
        one_step=none(unit) if np.isnan(predicted).all() else figures(target, predicted, unit, counted),
        run_time_s=timed.seconds,
        time=trace.time,
        target=target,
        simulated=run[name],
        predicted=predicted,
        counts=None if counted.all() else counted,
    )


def _one_step_ahead(cascade: Cascade, trace: Trace, run: CascadeRun, output: str) -> NDArray[np.float64]:
    """What the member of an output predicts one step ahead from measured signals alone; NaN where it does not predict.

    Where the case lacks a channel, the free run's stands in for it.
    """
    model = cascade.member(output)
    ends = Ends.of(model)
    known = {n: trace[n] if n in trace.channel_names else run[n] for n in (*ends.inputs, *ends.outputs)}
    rest = dict(zip(cascade.wiring.channels, cascade.levels(trace.columns(cascade.inputs)[0]), strict=True))
    return model.predict_outputs(known, rest)[output]
