"""Grey boxes of traces: the free run's least error over parameters, weights and initial states, from several starts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from collections.abc import Mapping as Dict
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation.clock import now
from sysid.estimation.grey_box.by_case import with_cases
from sysid.estimation.grey_box.finishing import Ready, finished, settled
from sysid.estimation.grey_box.layout import Begun, EquationLayout
from sysid.estimation.grey_box.preparing import (
    WINDOW,
)
from sysid.estimation.grey_box.readying import common, no_run, power_remedy, ready_for
from sysid.estimation.grey_box.record import Record
from sysid.estimation.grey_box.shot import (
    AUTO,
    SINGLE,
    may_shoot,
    shooting_terms,
    way_of,
    with_starts_begun,
    with_way,
)
from sysid.estimation.grey_box.telling import told
from sysid.estimation.least_squares.checkpoints import checkpoints_of
from sysid.estimation.linear.arx import rests_of
from sysid.estimation.networks.starts import multistart as starts
from sysid.estimation.networks.starts.choosing import Choice, choose
from sysid.estimation.networks.starts.race import run_race
from sysid.estimation.networks.starts.result import left_on, multistart_result, multistart_status
from sysid.estimation.networks.training import FitProgress, Training, check_hidden_states
from sysid.estimation.networks.windows import Windows, in_place, with_note
from sysid.estimation.records.experiment import Experiment, experiments_of, unit_range, unit_ranges
from sysid.estimation.results.result import FitResult
from sysid.models import History, Mapping, Start, beginning
from sysid.models.blocks.built_model import BuiltModel
from sysid.models.grey_box.grey_box import GreyBox
from sysid.models.grey_box.grey_box_model import EquationModel, GreyBoxModel, VectorGreyBoxModel
from sysid.traces import Trace

Array = NDArray[np.float64]

STARTS = 4
"""Starts of a fit that asks for none: the declared parameters, and three around them. Halved at each checkpoint."""

check_training = partial(check_hidden_states, "a grey box", shoots=True)
"""Refuses options that do not apply to hidden states."""


def fit_grey_box(
    traces: Sequence[Trace],
    mapping: Mapping,
    grey: GreyBox,
    training: Training | None = None,
    *,
    start: Start | None = None,
    rest_output: float | Dict[str, float] | None = None,
    selection: Sequence[Trace] = (),
    vet: Callable[[starts.Network], bool] | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit the parameters of equations, and the weights of networks in them, by the least error of the free run.

    A record whose start is estimated has its own initial state, estimated with the parameters; the others begin at
    rest, or where the structure says. Of several outputs each counts over what is left of it.

    Args:
        traces: Estimation traces; never concatenated.
        mapping: Which channels go in, which come out.
        grey: The equations.
        training: How to train; options for lagged regressors do not apply.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit, or by name; the mean of the traces' first samples where not given.
        selection: Traces that choose between starts; without them the evidence chooses.
        vet: Whether a model's free run is stable; the best stable one of the ten best candidates is then chosen.
        on_progress: Called after every iteration, from the threads that train.

    Returns:
        The fit, with the uncertainty of its parameters and the posterior of its output. Of several outputs its errors
        are mean squares over them, in scaled numbers.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the equations do not know a channel of the mapping, or an option does not apply.
        TraceError: If no sample counts, or the equations have no free run at their declared start.
    """
    rests = rests_of(traces, mapping, rest_output)
    several, begun = grey.several_outputs, start or Start()
    experiments = experiments_of(traces, mapping, begun, np.array(rests) if several else rests[0])
    grey.check_mapping(mapping)
    units = tuple(traces[0].channel(name).unit for name in mapping.outputs)
    as_read: dict[str, Any] = {
        "input_offset": (0.0,) * len(mapping.inputs),
        "input_scale": (1.0,) * len(mapping.inputs),
    }
    template: GreyBoxModel | VectorGreyBoxModel
    if several:
        template = VectorGreyBoxModel(
            **common(traces[0], mapping, grey),
            scaling=replace(unit_ranges(experiments), **as_read),
            output_units=units,
            rest_outputs=rests,
        )
    else:
        template = GreyBoxModel(
            **common(traces[0], mapping, grey),
            scaling=replace(unit_range(experiments), **as_read),
            output_unit=units[0],
            rest_output=rests[0],
        )
    return fit_equations(template, experiments, training, (traces, selection, begun), vet=vet, on_progress=on_progress)


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
    training = multistart.training
    candidates = [settled(one, ready.provider) for one in reversed(run_race(multistart))]
    if not ready.runs and not any(np.isfinite(one.loss) for one in candidates):
        raise no_run(power_remedy(template.grey.system))
    choice = choose(candidates, _chosen_by(training, ready), vet)
    if windows.samples:
        race = choice.chosen
        ready, choice = _over_all(ready, multistart, windows, choice)
        candidates = in_place(candidates, race, choice.chosen)
    done = finished(ready, choice.chosen, training, until=multistart.until, stopped=multistart.stop.is_set())
    candidates = [done.candidate if one is choice.chosen else one for one in candidates]
    choice = replace(choice, chosen=done.candidate)
    left = left_on(done.candidate.model, [t.name for t in data[0]], _runs(done.model, data[0], data[2]))
    status = multistart_status(done.candidate, candidates, left, interrupted=multistart.stop.is_set())
    seconds = multistart.checkpoints.earlier_s + now() - began
    begun = with_starts_begun(training, multistart, candidates)
    found = with_note(multistart_result(choice, candidates, begun, status, seconds, left=left), windows)
    found = with_way(found, done.candidate, way_of(training, template, begins, runs=ready.runs), begun, training)
    return told(found, done, data, ready.named)


def _runs(model: EquationModel, traces: Sequence[Trace], start: Start) -> Iterator[tuple[Array, History | None]]:
    """Inputs and history of each record as it is scored: from the state that is declared there may be no run."""
    for trace in traces:
        inputs, usable = trace.columns(model.mapping.inputs), trace.usable_of(model.mapping.channels)
        begun = beginning(model, inputs, model.measured(trace), start, usable, case=trace.name)
        yield inputs[begun.first :], begun.history


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
    best = min(run_race(multistart), key=lambda one: (not one.solution.status.usable, one.loss))
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
    ready = ready_for(template, windows.experiments, shoots=may_shoot(training, template, begins))
    starts.check_samples(ready.provider)
    priors = any(one.parameter.prior is not None for one in ready.named)
    if training.regularisation and not ready.template.lowered.nets and not priors:
        raise ConfigError(
            "there is nothing to regularise", where="regularisation",
            expected="networks among the equations, or parameters with a prior", got=training.regularisation,
            remedy="leave regularisation out",
        )  # fmt: skip
    if not len(ready.theta):  # nothing to estimate, and one start is as good as another
        training = replace(training, starts=1, shooting=SINGLE)
    way = way_of(training, ready.template, begins, runs=ready.runs)
    layout = EquationLayout(
        declared=2 if way == AUTO else 1,
        named=ready.named,
        first_weight=len(template.grey.free),
        nets=ready.template.lowered.nets,
        provider=ready.provider,
        begun=ready.theta,
        norms=ready.template.norms,
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
        **shooting_terms(way, ready.provider),
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
