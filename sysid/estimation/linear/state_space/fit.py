"""Linear state spaces of traces: by subspace methods and by the prediction error."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from sysid.errors import TraceError
from sysid.estimation.experiment import experiments_of, unit_range
from sysid.estimation.linear.arx import first_output
from sysid.estimation.linear.segments import segments_of
from sysid.estimation.linear.state_space.search import METHODS, Found, StateSpaceTraining, search
from sysid.estimation.linear.state_space.uncertainty import state_space_uncertainty
from sysid.estimation.result import FitResult, Loop
from sysid.models import LinearStateSpace, LinearStateSpaceModel, Mapping, Start
from sysid.traces import Trace


def fit_state_space(
    traces: Sequence[Trace],
    mapping: Mapping,
    orders: LinearStateSpace,
    training: StateSpaceTraining | None = None,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
) -> FitResult:
    """Fit a linear state space.

    Args:
        traces: Estimation traces; never concatenated, each with an initial state of its own.
        mapping: Which channels go in, which comes out.
        orders: The structure.
        training: How to fit.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.

    Returns:
        The fit; after the prediction-error method with the uncertainty of its polynomials.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        TraceError: If there are fewer samples than parameters, or no record is long enough.
        FitDivergedError: If no start gives a finite prediction.
    """
    began, training = time.perf_counter(), training or StateSpaceTraining()
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    experiments = experiments_of(traces, mapping, start or Start(), rest)
    counted, needed = sum(e.n_counted for e in experiments), orders.n_parameters(len(mapping.inputs))
    needed += orders.states * sum(e.free for e in experiments)
    if counted < needed:
        raise TraceError(
            "fewer samples than parameters and initial states",
            expected=f"at least {needed} samples that count",
            got=counted,
            remedy="ask for fewer states, or use longer traces",
        )
    scaling = unit_range(experiments)
    found = search(segments_of(experiments, scaling), orders, training)
    model = LinearStateSpaceModel(
        orders=orders,
        system=found.system,
        scaling=scaling,
        mapping=mapping,
        sample_time=traces[0].sample_time,
        input_units=tuple(traces[0].channel(name).unit for name in mapping.inputs),
        output_unit=traces[0].channel(mapping.output).unit,
        rest_output=rest,
    )
    unit = float(found.covariance[0, 0]) * scaling.output_scale**2 / max(found.curve[-1].mse, 1e-300)
    exact = training.method == METHODS[1]
    return FitResult(
        model=model,
        status=found.status,
        loop=Loop.OPEN if orders.noise else Loop.CLOSED,
        history={
            "iteration": np.array([one.iteration for one in found.curve], dtype=np.float64),
            "mse": unit * np.array([one.mse for one in found.curve]),
        },
        train_time_s=time.perf_counter() - began,
        uncertainty=None if exact else state_space_uncertainty(model, found),
        notes=(*_notes(found, orders), _stability(model)),
    )


def _notes(found: Found, orders: LinearStateSpace) -> tuple[str, ...]:
    sizes = found.singular_values[: orders.states + 3]
    told = ", ".join(f"{size:.3f}" for size in sizes)
    begun = f"The subspace estimate is by {found.weighting.value}."
    return (begun, f"Canonical correlations of past and future: {told}; the states are those that stand out.")


def _stability(model: LinearStateSpaceModel) -> str:
    """Whether the free run is stable, as a sentence."""
    verdict = "stable" if model.pole_radius < 1.0 else "not stable"
    return f"The free run is {verdict}: the largest pole has magnitude {model.pole_radius:.6f}."
