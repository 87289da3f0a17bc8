"""A fit of equations before it begins: its model, and levels, ranges and a step as the records ask for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.equations import ROSENBROCK, RUNGE_KUTTA, Lowered, System
from sysid.equations.broken_powers import broken_powers
from sysid.errors import TraceError
from sysid.estimation.grey_box.finishing import Ready
from sysid.estimation.grey_box.preparing import WINDOW, first_terms, norms_for, provider_for, seen_terms, widths_for
from sysid.estimation.grey_box.provider import EquationProvider
from sysid.estimation.grey_box.record import Record
from sysid.estimation.grey_box.shooting import in_windows
from sysid.estimation.grey_box.stepping import (
    STIFF,
    Stepping,
    can_be_implicit,
    explicit_steps,
    hides_growth,
    solver_for,
)
from sysid.estimation.linear.arx import first_output
from sysid.estimation.parameters.named import named_of
from sysid.estimation.records.experiment import Experiment, experiments_of, unit_range
from sysid.models import AbstractStructure, Mapping, Start
from sysid.models.blocks.built_model import BuiltModel
from sysid.models.grey_box.grey_box import GreyBox, lowered
from sysid.models.grey_box.grey_box_model import GreyBoxModel, VectorGreyBoxModel
from sysid.traces import Trace

Array = NDArray[np.float64]

LOST = 10.0
"""Root mean square error of a free run, over half the output's range, from which on it tells nothing of the records."""

FIRST_SUBSTEPS = 8
"""Steps before it is known how many are needed."""


def built_template(
    traces: Sequence[Trace],
    mapping: Mapping,
    grey: GreyBox,
    *,
    built_of: AbstractStructure,
    start: Start,
    rest_output: float | None,
) -> tuple[BuiltModel, tuple[Experiment, ...]]:
    """A model of equations that were built of a structure, before its fit, and the records.

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which comes out.
        grey: The equations.
        built_of: The structure.
        start: What stands before each trace.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.

    Returns:
        The model and the records.
    """
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    experiments = experiments_of(traces, mapping, start, rest)
    n = len(mapping.inputs)
    template = BuiltModel(
        **common(traces[0], mapping, grey),
        built_of=built_of,
        scaling=replace(unit_range(experiments), input_offset=(0.0,) * n, input_scale=(1.0,) * n),
        output_unit=traces[0].channel(mapping.output).unit,
        rest_output=rest,
    )
    return template, experiments


def common(first: Trace, mapping: Mapping, grey: GreyBox) -> dict[str, Any]:
    """A model but for its parameters, what the records say of its states, and its outputs.

    Args:
        first: A trace.
        mapping: Which channels go in, which come out.
        grey: The equations.

    Returns:
        Fields of the model.
    """
    low = lowered(grey, mapping.inputs, mapping.outputs, first.sample_time)
    return {
        "grey": grey,
        "solver": grey.solver or RUNGE_KUTTA,
        "theta": np.array([*(one.start for one in grey.free), *[0.0] * low.n_weights]),
        "norms": low.norms,
        "levels": (0.0,) * low.n_states,
        "spans": (1.0,) * low.n_states,
        "substeps": grey.substeps or FIRST_SUBSTEPS,
        "mapping": mapping,
        "sample_time": first.sample_time,
        "input_units": tuple(first.channel(name).unit for name in mapping.inputs),
    }


def ready_for(
    template: GreyBoxModel | VectorGreyBoxModel, experiments: Sequence[Experiment], *, shoots: bool = False
) -> Ready:
    """Levels, ranges and a step, from the records at the declared start.

    Args:
        template: The model before its fit.
        experiments: The records.
        shoots: Whether starts may begin by multiple shooting: where the free run from the declared start is lost, what
            is hidden is then looked at in short windows, each begun at the state that it shows.

    Returns:
        What a fit begins with.

    Raises:
        TraceError: If the equations have no free run there.
    """
    form = template.recursion
    records = tuple(Record.of(experiment, form) for experiment in experiments)
    means = np.array([np.mean([np.mean(record.output[:, j]) for record in records]) for j in range(form.n_outputs)])
    whole = provider_for(template, first_terms(form, template.mapping.outputs, means), records)
    named = named_of(template.grey, template.cases, template.lowered.n_weights)
    places = np.array([one.place for one in named], dtype=np.int64)
    declared = np.zeros(whole.n_parameters)
    declared[places] = template.theta[places] / whole.scale[places]
    provider, theta, stepping = _looked_at(template, whole, declared)
    # Without networks another start has multiple shooting in any case, and the far end of a run shows levels enough.
    most = LOST**2 * whole.n_samples if template.lowered.nets else np.inf
    runs, parted = 2.0 * provider.loss(theta) < most, False
    if not runs and shoots:
        other = _looked_at(template, *in_windows(whole, declared), begun=True)
        if parted := bool(np.isfinite(other[0].loss(other[1]))):
            provider, theta, stepping = other
    if not np.isfinite(provider.loss(theta)) or hides_growth(provider, theta):
        raise no_run(_stiff_remedy(template.grey, provider, theta) + power_remedy(template.grey.system))
    seen = provider.form
    template = replace(
        template,
        solver=seen.lowered.solver,
        norms=tuple(map(float, norms_for(provider, theta))),
        levels=tuple(map(float, seen.terms.level)),
        spans=tuple(map(float, seen.terms.scale)),
        substeps=stepping.substeps,
    )
    found = whole.with_form(replace(template.recursion, widths=widths_for(provider, theta)))
    if parted:
        theta = found.with_states(declared, found.states(declared, WINDOW))
    return Ready(template=template, provider=found, theta=theta, stepping=stepping, runs=not parted)


def no_run(more: str = "") -> TraceError:
    """What is said of equations that cannot be run over the records.

    Args:
        more: What helps beside.

    Returns:
        The error.
    """
    return TraceError(
        "the equations have no free run at their declared start",
        where="equations",
        expected="numbers over every record",
        got="what grows without bound, or is no number",
        remedy="start the parameters and initial states at values with which the equations run: look for "
        f"a sign, a division by 0, or the logarithm of what is not above 0{more}",
    )


def power_remedy(system: System) -> str:
    """What helps where a power in equations may be no number, to stand behind other remedies; nothing without one."""
    broken = broken_powers(system)
    return "" if not broken else f"; {broken[0][0]} is no number where what is raised is below 0: write {broken[0][1]}"


def _looked_at(
    template: GreyBoxModel | VectorGreyBoxModel, provider: EquationProvider, theta: Array, *, begun: bool = False
) -> tuple[EquationProvider, Array, Stepping]:
    """Records as they are run, with levels and ranges of the states that they visit, and what is trained."""
    provider, theta, stepping = _stepping(template, provider, theta, begun=begun)
    seen, states = seen_terms(provider, theta)
    provider = provider.with_form(seen)
    theta = provider.with_states(theta, states)
    return provider, theta if begun else provider.with_states(theta, provider.states(theta, WINDOW)), stepping


def _stiff_remedy(grey: GreyBox, provider: EquationProvider, theta: Array) -> str:
    """What else helps where explicit steps were asked for that are too long."""
    if grey.solver != RUNGE_KUTTA or not can_be_implicit(provider.form.lowered):
        return ""
    needed = explicit_steps(provider, theta)
    return (
        f". Runge-Kutta steps, which are asked for, would have to be {needed:,.0f} a sample to stay bounded: leave "
        "solver out"
    ) * (needed > provider.form.substeps)


def _stepping(
    template: GreyBoxModel | VectorGreyBoxModel, provider: EquationProvider, theta: Array, *, begun: bool
) -> tuple[EquationProvider, Array, Stepping]:
    """The solver and its steps; and what is trained, with the states from where the records are then looked at."""
    explicit, asked = provider.form, template.grey.substeps
    implicit = (
        partial(_implicit, template) if template.grey.solver is None and can_be_implicit(explicit.lowered) else None
    )
    needed = 0.0 if implicit is None else explicit_steps(provider, theta)
    stiff = implicit is not None and needed > max(STIFF, asked or 0)
    if implicit is not None and stiff:  # explicitly the records would show no states
        provider = provider.with_form(replace(explicit, lowered=implicit()))
    if not begun:
        theta = provider.with_states(theta, provider.states(theta, WINDOW))
    if asked is not None:
        return provider, theta, Stepping(substeps=asked, change=0.0, explicit=needed if stiff else 0.0)
    provider, stepping = solver_for(provider.with_form(explicit), theta, implicit)
    return provider, theta, stepping


def _implicit(template: GreyBoxModel | VectorGreyBoxModel) -> Lowered:
    return replace(template, solver=ROSENBROCK).lowered
