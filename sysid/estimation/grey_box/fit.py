"""Grey boxes of traces: the free run's least error over parameters, weights and initial states, from several starts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.equations import ROSENBROCK, RUNGE_KUTTA, Lowered
from sysid.errors import TraceError
from sysid.estimation.clock import now
from sysid.estimation.experiment import Experiment, experiments_of, unit_range, unit_ranges
from sysid.estimation.findings import Findings
from sysid.estimation.first_samples import shown_note
from sysid.estimation.grey_box.by_case import case_notes, with_cases
from sysid.estimation.grey_box.finishing import Done, Ready, finished, settled
from sysid.estimation.grey_box.layout import Begun, EquationLayout
from sysid.estimation.grey_box.preparing import (
    WINDOW,
    first_terms,
    norms_for,
    provider_for,
    seen_terms,
    widths_for,
)
from sysid.estimation.grey_box.profile import Profiler
from sysid.estimation.grey_box.provider import EquationProvider, Record
from sysid.estimation.grey_box.stepping import (
    STIFF,
    Stepping,
    can_be_implicit,
    explicit_steps,
    solver_for,
    step_note,
    step_warning,
)
from sysid.estimation.least_squares.checkpoints import checkpoints_of
from sysid.estimation.linear.arx import first_output
from sysid.estimation.named import Named, named_of
from sysid.estimation.networks import multistart as starts
from sysid.estimation.networks.choosing import Choice, choose
from sysid.estimation.networks.multistart_result import left_on, multistart_result, multistart_status
from sysid.estimation.networks.posterior import Posterior, calibrate, laplace
from sysid.estimation.networks.training import FitProgress, Training, check_hidden_states
from sysid.estimation.networks.windows import Windows, in_place, with_note
from sysid.estimation.result import FitResult, Status
from sysid.models import AbstractStructure, Mapping, Start
from sysid.models.built_model import BuiltModel
from sysid.models.grey_box import PROFILE, GreyBox, VectorGreyBox, lowered
from sysid.models.grey_box_model import GreyBoxModel, VectorGreyBoxModel
from sysid.traces import Trace

Array = NDArray[np.float64]

STARTS = 4
"""Starts of a fit that asks for none: the declared parameters, and three around them. Halved at each checkpoint."""

FIRST_SUBSTEPS = 8
"""Steps before it is known how many are needed."""

check_training = partial(check_hidden_states, "a grey box")
"""Refuses options that do not apply to hidden states."""


def fit_grey_box(
    traces: Sequence[Trace],
    mapping: Mapping,
    grey: GreyBox,
    training: Training | None = None,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
    selection: Sequence[Trace] = (),
    vet: Callable[[starts.Network], bool] | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit the parameters of equations, and the weights of networks in them, by the least error of the free run.

    A record whose start is estimated has its own initial state, estimated with the parameters; the others begin at
    rest, or where the structure says.

    Args:
        traces: Estimation traces; never concatenated.
        mapping: Which channels go in, which comes out.
        grey: The equations.
        training: How to train; options for lagged regressors do not apply.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.
        selection: Traces that choose between starts; without them the evidence chooses.
        vet: Whether a model's free run is stable; the best stable one of the ten best candidates is then chosen.
        on_progress: Called after every iteration, from the threads that train.

    Returns:
        The fit, with the uncertainty of its parameters and the posterior of its output.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the equations do not know a channel of the mapping, or an option does not apply.
        TraceError: If no sample counts, or the equations have no free run at their declared start.
    """
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    experiments = experiments_of(traces, mapping, start or Start(), rest)
    grey.check_mapping(mapping)
    n = len(mapping.inputs)  # which are read as they are
    template = GreyBoxModel(
        **_common(traces[0], mapping, grey),
        scaling=replace(unit_range(experiments), input_offset=(0.0,) * n, input_scale=(1.0,) * n),
        output_unit=traces[0].channel(mapping.output).unit,
        rest_output=rest,
    )
    return fit_equations(
        template, experiments, training, (traces, selection, start or Start()), vet=vet, on_progress=on_progress
    )


def fit_vector_grey_box(
    traces: Sequence[Trace],
    mapping: Mapping,
    grey: VectorGreyBox,
    training: Training | None = None,
    *,
    start: Start | None = None,
    rest_output: Dict[str, float] | None = None,
    selection: Sequence[Trace] = (),
    vet: Callable[[starts.Network], bool] | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit equations of several outputs, each of which counts over what is left of it; see :func:`fit_grey_box`.

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which come out.
        grey: The equations.
        training: How to train.
        start: What stands before each trace.
        rest_output: Outputs at rest by name, in their units; the mean of the traces' first samples where not given.
        selection: Traces that choose between starts.
        vet: Whether a model's free run is stable.
        on_progress: Called after every iteration.

    Returns:
        The fit. Its errors are mean squares over the outputs, in scaled numbers.

    Raises:
        ChannelError: As for one output.
        ConfigError: Likewise.
        TraceError: Likewise.
    """
    given = rest_output or {}
    rests = tuple(given[one.output] if one.output in given else first_output(traces, one) for one in mapping.each)
    experiments = experiments_of(traces, mapping, start or Start(), np.array(rests))
    grey.check_mapping(mapping)
    n = len(mapping.inputs)  # which are read as they are
    template = VectorGreyBoxModel(
        **_common(traces[0], mapping, grey),
        scaling=replace(unit_ranges(experiments), input_offset=(0.0,) * n, input_scale=(1.0,) * n),
        output_units=tuple(traces[0].channel(name).unit for name in mapping.outputs),
        rest_outputs=rests,
    )
    return fit_equations(
        template, experiments, training, (traces, selection, start or Start()), vet=vet, on_progress=on_progress
    )


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
        **_common(traces[0], mapping, grey),
        built_of=built_of,
        scaling=replace(unit_range(experiments), input_offset=(0.0,) * n, input_scale=(1.0,) * n),
        output_unit=traces[0].channel(mapping.output).unit,
        rest_output=rest,
    )
    return template, experiments


def fit_equations(
    template: GreyBoxModel | VectorGreyBoxModel,
    experiments: Sequence[Experiment],
    training: Training | None,
    data: tuple[Sequence[Trace], Sequence[Trace], Start],
    *,
    begins: Sequence[Begun] = (),
    scattered: frozenset[str] | None = None,
    began: float | None = None,
    vet: Callable[[starts.Network], bool] | None,
    on_progress: Callable[[FitProgress], None],
) -> FitResult:
    """Fit equations of any number of outputs.

    Args:
        template: The model before its fit.
        experiments: The records.
        training: How to train.
        data: Estimation traces, those that choose between starts, and what stands before each.
        begins: Where the first starts begin; where equations declare it by default.
        scattered: Parameters around which later starts are drawn; ``None`` for all.
        began: When the fit began, where that was before.
        vet: Whether a model's free run is stable.
        on_progress: Called after every iteration.

    Returns:
        The fit.
    """
    began = now() if began is None else began
    training = (training or Training()).with_starts(STARTS)
    check_training(training)
    template = with_cases(template, experiments, data[1], data[2])
    windows, ready, multistart = _prepared(
        template, experiments, training, data, begins=begins, scattered=scattered, began=began, on_progress=on_progress
    )
    # The latest first: of a start that converged, the last look at it is chosen, and not one that saw the same.
    candidates = [settled(one, ready.provider) for one in reversed(starts.run(multistart))]
    choice = choose(candidates, _chosen_by(training, ready), vet)
    if windows.samples:
        race = choice.chosen
        ready, choice = _over_all(ready, multistart, windows, choice)
        candidates = in_place(candidates, race, choice.chosen)
    done = finished(ready, choice.chosen, training, until=multistart.until, stopped=multistart.stop.is_set())
    candidates = [done.candidate if one is choice.chosen else one for one in candidates]
    choice = replace(choice, chosen=done.candidate)
    left = left_on(done.candidate.model, [t.name for t in data[0]], [(e.inputs, e.history) for e in experiments])
    status = multistart_status(done.candidate, candidates, left, interrupted=multistart.stop.is_set())
    seconds = multistart.checkpoints.earlier_s + now() - began
    found = with_note(multistart_result(choice, candidates, training, status, seconds, left=left), windows)
    return _told(found, done, data, ready.named)


def raced_equations(
    template: BuiltModel,
    experiments: Sequence[Experiment],
    training: Training,
    data: tuple[Sequence[Trace], Sequence[Trace], Start],
    *,
    begins: Sequence[Begun] = (),
    scattered: frozenset[str] | None = None,
    began: float,
) -> tuple[BuiltModel, float]:
    """What the starts of equations come to, before anything is made of the best of them.

    Args:
        template: The model before its fit.
        experiments: The records.
        training: How to train.
        data: As for :func:`fit_equations`.
        begins: Likewise.
        scattered: Likewise.
        began: Likewise.

    Returns:
        The model of least loss on the estimation traces, and that loss.
    """
    *_, multistart = _prepared(
        template,
        experiments,
        training,
        data,
        begins=begins,
        scattered=scattered,
        began=began,
        on_progress=lambda _: None,
    )
    best = min(starts.run(multistart), key=lambda one: (not one.solution.status.usable, one.loss))
    assert isinstance(best.model, BuiltModel)  # noqa: S101 - the template is one
    return best.model, best.loss


def _prepared(
    template: GreyBoxModel | VectorGreyBoxModel,
    experiments: Sequence[Experiment],
    training: Training,
    data: tuple[Sequence[Trace], Sequence[Trace], Start],
    *,
    begins: Sequence[Begun],
    scattered: frozenset[str] | None,
    began: float,
    on_progress: Callable[[FitProgress], None],
) -> tuple[Windows, Ready, starts.Multistart]:
    """The windows of the records, what is trained on them, and its starts."""
    windows = Windows.of(experiments, replace(training, window=0) if template.grey.by_case else training)
    ready = _ready(template, windows.experiments)
    starts.check_samples(ready.provider)
    layout = EquationLayout(
        named=ready.named,
        first_weight=len(template.grey.free),
        nets=ready.template.lowered.nets,
        provider=ready.provider,
        begun=ready.theta,
        begins=tuple(begins),
        scattered=scattered,
    )
    multistart = starts.Multistart(
        training=training,
        layout=layout,
        provider=ready.provider,
        to_plain=ready.to_plain,
        template=ready.template,
        selection=data[1],
        start=data[2],
        initial=None,
        on_progress=on_progress,
        checkpoints=checkpoints_of(on_progress),
        until=starts.deadline(began, training, on_progress),
    )
    return windows, ready, multistart


def _over_all(ready: Ready, multistart: starts.Multistart, windows: Windows, choice: Choice) -> tuple[Ready, Choice]:
    """The choice, trained on over all samples of the records, and what it is trained on with."""
    whole = replace(ready.provider, records=tuple(Record.of(one, ready.provider.form) for one in windows.records))
    p = len(whole.scale)
    state = choice.chosen.solution.state
    begun = np.zeros(whole.n_parameters)
    begun[:p] = state.theta[:p]
    begun = whole.with_states(begun, whole.states(begun, WINDOW))
    found = [np.concatenate([values[:p], begun[p:]]) for values in (state.theta, state.prior.centre)]
    ready = replace(ready, provider=whole)
    layout = multistart.layout
    assert isinstance(layout, EquationLayout)  # noqa: S101 - it was made so
    own = replace(multistart, layout=replace(layout, provider=whole), to_plain=ready.to_plain)
    choice = windows.finished(own, choice, whole, *found)
    return ready, replace(choice, chosen=settled(choice.chosen, whole))


def _chosen_by(training: Training, ready: Ready) -> str:
    """What chooses: without networks there is nothing that evidence would hold small, and the least error is best."""
    if training.choose_by == "selection" and not ready.template.lowered.nets:
        return "loss"
    return training.choose_by


def _common(first: Trace, mapping: Mapping, grey: GreyBox) -> dict[str, Any]:
    """A model but for its parameters, what the records say of its states, and its outputs."""
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


def _ready(template: GreyBoxModel | VectorGreyBoxModel, experiments: Sequence[Experiment]) -> Ready:
    """Levels, ranges and a step, from the records at the declared start."""
    grey, form = template.grey, template.recursion
    records = tuple(Record.of(experiment, form) for experiment in experiments)
    means = np.array([np.mean([np.mean(record.output[:, j]) for record in records]) for j in range(form.n_outputs)])
    provider = provider_for(template, first_terms(form, template.mapping.outputs, means), records)
    places = np.array([one.place for one in named_of(grey, template.cases, template.lowered.n_weights)], dtype=np.int64)
    theta = np.zeros(provider.n_parameters)
    theta[places] = template.theta[places] / provider.scale[places]
    provider, theta, stepping = _stepping(template, provider, theta)
    seen, begun = seen_terms(provider, theta)
    provider = provider.with_form(seen)
    theta = provider.with_states(theta, begun)
    theta = provider.with_states(theta, provider.states(theta, WINDOW))
    if not np.isfinite(provider.loss(theta)):
        raise TraceError(
            "the equations have no free run at their declared start",
            where="equations",
            expected="numbers over every record",
            got="what grows without bound, or is no number",
            remedy="start the parameters and initial states at values with which the equations run: look for "
            "a sign, a division by 0, or the logarithm of what is not above 0" + _stiff_remedy(grey, provider, theta),
        )
    seen = provider.form
    template = replace(
        template,
        solver=seen.lowered.solver,
        norms=tuple(map(float, norms_for(provider, theta))),
        levels=tuple(map(float, seen.terms.level)),
        spans=tuple(map(float, seen.terms.scale)),
        substeps=stepping.substeps,
    )
    provider = provider.with_form(replace(template.recursion, widths=widths_for(provider, theta)))
    return Ready(template=template, provider=provider, theta=theta, stepping=stepping)


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
    template: GreyBoxModel | VectorGreyBoxModel, provider: EquationProvider, theta: Array
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
    theta = provider.with_states(theta, provider.states(theta, WINDOW))
    if asked is not None:
        return provider, theta, Stepping(substeps=asked, change=0.0, explicit=needed if stiff else 0.0)
    provider, stepping = solver_for(provider.with_form(explicit), theta, implicit)
    return provider, theta, stepping


def _implicit(template: GreyBoxModel | VectorGreyBoxModel) -> Lowered:
    return replace(template, solver=ROSENBROCK).lowered


def _told(
    found: FitResult, done: Done, data: tuple[Sequence[Trace], Sequence[Trace], Start], named: tuple[Named, ...]
) -> FitResult:
    """The result with what is known of its parameters, and what was chosen on the way."""
    model, solution = done.model, done.candidate.solution
    posterior = _posterior(done, *data)
    built = isinstance(model, BuiltModel)
    findings = Findings.of(solution, done.provider, named, built=built)
    notes = []
    if model.grey.intervals == PROFILE and solution.status is Status.CONVERGED:
        try:
            findings = replace(findings, profiles=Profiler(provider=done.provider, solution=solution).all(named))
        except KeyboardInterrupt:  # the fit is there without them, and is made again by who asks again
            found = replace(found, status=Status.INTERRUPTED)
    elif model.grey.intervals == PROFILE:
        notes.append("No intervals by profile likelihood: the fit has not come to a minimum from which they are told.")
    n = max(done.provider.n_samples - model.n_parameters, 1)
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
    warnings = list(findings.more_than_shown if built else findings.warnings)
    if model.lowered.n_continuous and not done.stepping.enough:
        warnings.append(step_warning(model, done.stepping))
    return replace(
        found,
        posterior=posterior,
        uncertainty=findings.uncertainty(variance) if model.grey.free else None,
        notes=(*found.notes, *notes, *warnings),
        warnings=(*found.warnings, *warnings),
    )


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
