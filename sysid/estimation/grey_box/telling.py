"""What is told of a fit of equations: its parameters, its steps, what was chosen on the way, and its posterior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sysid.equations.units_checked import unit_contradictions
from sysid.estimation.grey_box.by_case import case_notes
from sysid.estimation.grey_box.finishing import Done
from sysid.estimation.grey_box.open_runs import OpenRuns
from sysid.estimation.grey_box.profile import Profiler
from sysid.estimation.grey_box.readying import power_remedy
from sysid.estimation.grey_box.stepping import step_note, step_warning
from sysid.estimation.least_squares.minimum import at_minimum
from sysid.estimation.networks.posterior import Posterior, calibrate, laplace
from sysid.estimation.parameters.findings import Findings
from sysid.estimation.parameters.named import Named
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.records.first_samples import shown_note
from sysid.estimation.results.result import FitResult, Status
from sysid.models import Start
from sysid.models.blocks.built_model import BuiltModel
from sysid.models.grey_box.grey_box import PROFILE
from sysid.models.grey_box.grey_box_model import EquationModel
from sysid.traces import Trace

NEAR = 0.1
"""How near a minimum intervals are told: within a third of a standard deviation, squared."""


def told(
    found: FitResult, done: Done, data: tuple[Sequence[Trace], Sequence[Trace], Start], named: tuple[Named, ...]
) -> FitResult:
    """The result with what is known of its parameters, and what was chosen on the way.

    Args:
        found: The result.
        done: The fit.
        data: Estimation traces, those that choose between starts, and what stands before each.
        named: The parameters.

    Returns:
        The result.
    """
    model, solution = done.model, done.candidate.solution
    posterior = _posterior(done, *data)
    built = isinstance(model, BuiltModel)
    findings = Findings.of(solution, done.provider, named, built=built)
    notes = []
    n = max(done.provider.n_samples - model.n_parameters, 1)
    there = at_minimum(solution.state, done.provider, NEAR / n)
    if model.grey.intervals == PROFILE and solution.status is Status.CONVERGED:
        try:
            findings = replace(findings, profiles=Profiler(provider=done.provider, solution=solution).all(named))
        except KeyboardInterrupt:  # the fit is there without them, and is made again by who asks again
            found = replace(found, status=Status.INTERRUPTED)
    elif model.grey.intervals == PROFILE:
        notes.append("No intervals by profile likelihood: the fit has not come to a minimum from which they are told.")
    variance = 2.0 * solution.at.loss / n * model.scaling.error_unit
    notes += [step_note(model, done.stepping)] if model.lowered.n_continuous else []
    notes += shown_note([one.name for one in done.provider.records if one.shows is not None])
    notes += case_notes(model, data[0])
    unread = [one for i, one in enumerate(model.mapping.inputs) if i not in {i for i, _ in model.lowered.lagged}]
    notes += [f"The equations do not read {', '.join(unread)}."] if unread else []
    switches = sum(not one.root for one in model.lowered.switches)
    if switches:
        notes.append(
            f"{switches} switch{'es' * (switches > 1)} were trained through a soft form and are exact in the model; "
            f"the squared error of the exact form is {done.softened:.3g} times that of the soft one."
        )
    notes += findings.profiled
    if not there and not built and model.grey.free:
        findings = replace(findings, covariance=np.full_like(findings.covariance, np.nan))
        warnings = [*_contradictions(model), *_not_there(model)]
        found = replace(found, status=Status.STALLED) if found.status is Status.CONVERGED else found
    else:
        warnings = [] if built else [*_contradictions(model), *findings.warnings]
    if built and posterior is not None and (runs := OpenRuns.of(model, posterior, data[0])) is not None:
        said, warned = runs.told(findings)
        notes += said
        warnings += warned
    if model.lowered.n_continuous and not done.stepping.enough:
        warnings.append(step_warning(model, done.stepping))
    return replace(
        found,
        posterior=posterior,
        uncertainty=findings.uncertainty(variance) if model.grey.free else None,
        notes=(*found.notes, *notes, *warnings),
        warnings=(*found.warnings, *warnings),
    )


def _not_there(model: EquationModel) -> list[str]:
    """Why there are no intervals, and what of the equations may have no value where the fit would go."""
    return [
        "The fit has not come to a minimum, and intervals are told of one alone: these parameters are a place on the "
        f"way. Start others, narrow their bounds, or allow more iterations{power_remedy(model.grey.system)}."
    ]


def _contradictions(model: EquationModel) -> list[str]:
    """What contradicts itself in the units of the equations; a channel in ``1`` may be in anything."""
    ends = model.ends
    channels = zip((*ends.inputs, *ends.outputs), (*ends.input_units, *ends.output_units), strict=True)
    units = {name: "" if unit == "1" else unit for name, unit in channels}
    units |= {name: one.unit for name, one in model.grey.begins.items() if one.unit}
    return unit_contradictions(model.grey.system, units | {one.name: one.unit for one in model.grey.named})


def _posterior(done: Done, traces: Sequence[Trace], selection: Sequence[Trace], start: Start) -> Posterior | None:
    """Of the model's parameters; those at a bound stay there."""
    model, solution = done.model, done.candidate.solution
    p = len(done.provider.scale)
    low, high = (side[:p] for side in done.provider.bounds)
    theta = solution.theta[:p]
    free = (theta > low) & (theta < high)
    to_plain = np.eye(p, done.provider.n_parameters) * np.where(free, done.provider.scale, 0.0)[:, None]
    runs, others = ([Experiment.for_model(t, model, start) for t in some] for some in (traces, selection))
    found = laplace(solution.state, model, to_plain, runs, copies=1)
    return None if found is None else calibrate(found, model, others)
