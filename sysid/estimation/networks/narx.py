"""NARX networks of one output or several: open loop, closed loop, several starts, and an honest choice between them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.checkpoint import Checkpoint
from sysid.estimation.least_squares.checkpoints import checkpoints_of
from sysid.estimation.linear.arx import rests_of
from sysid.estimation.networks import ensemble, middle
from sysid.estimation.networks.basis import RegressorBasis
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.input_subsets import PartLayout, embedding, part_of, views
from sysid.estimation.networks.posterior import Posterior, calibrate, laplace
from sysid.estimation.networks.pretraining import StepSamples, WhileUsed, regressors_of
from sysid.estimation.networks.provider import RebasedRecursion, RecursionProvider
from sysid.estimation.networks.regressed import regressed
from sysid.estimation.networks.starts import cautious
from sysid.estimation.networks.starts import multistart as starts
from sysid.estimation.networks.starts.advancing import with_evidence
from sysid.estimation.networks.starts.choosing import Choice, choose
from sysid.estimation.networks.starts.output_weights import reweighted
from sysid.estimation.networks.starts.race import run_race
from sysid.estimation.networks.starts.result import left_on, multistart_result, multistart_status
from sysid.estimation.networks.starts.united import elects, ends_of
from sysid.estimation.networks.starts.united import told as of_ensemble
from sysid.estimation.networks.template import held_told, layout_of, template_of
from sysid.estimation.networks.training import FitProgress, Training, check_members
from sysid.estimation.networks.warm_start import check_initial, grown
from sysid.estimation.networks.windows import Windows, in_place, with_note
from sysid.estimation.records.experiment import Experiment, experiments_of
from sysid.estimation.results.result import FitResult, Loop
from sysid.models import NARX, History, Mapping, NARXModel, Start, VectorNARX, VectorNARXModel
from sysid.models.lagged.lagged_form import AbstractLaggedForm
from sysid.traces import Trace


def fit_narx(
    traces: Sequence[Trace],
    mapping: Mapping,
    network: NARX | VectorNARX,
    training: Training | None = None,
    *,
    start: Start | None = None,
    rest_output: float | Dict[str, float] | None = None,
    selection: Sequence[Trace] = (),
    initial: FitResult | None = None,
    resume: Checkpoint | None = None,
    on_checkpoint: Callable[[Checkpoint], None] = lambda _: None,
    vet: Callable[[starts.Network], bool] | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit a NARX network of one output or several by Levenberg-Marquardt with Bayesian regularisation.

    Of several outputs each counts over its range at first, and the best candidate is trained on with each over what is
    left of it, so that a noisy output does not blur what a clean one shows. An interruption from the keyboard keeps the
    best model so far (status ``INTERRUPTED``).

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which come out.
        network: The structure.
        training: How to train.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit, or by name; the mean of the traces' first samples where not given.
        selection: Traces that choose between starts; without them the evidence does, or where the record is short
            the distance from the middle of all (``middle.py``).
        initial: A fit whose parameters are the first start: of the same structure, of a smaller network over some of
            its lags, or of a linear model over them.
        resume: Where the fit of a single start was put aside; it goes on as if it had not been.
        on_checkpoint: Given the checkpoint from which the chosen start can go on.
        vet: Whether a model's free run is stable; the best stable one of the ten best candidates is then chosen.
        on_progress: Called after every iteration, from the threads that train; a
            :class:`~sysid.estimation.least_squares.checkpoints.Watch` keeps where the fit stands, too.

    Returns:
        The best start's model, with the spread over starts in its attempts. Of several outputs its errors are mean
        squares over them, in scaled numbers and so weighed.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the structure does not fit the mapping, ``initial`` has another structure, or limits that are to
            be found are not there.
    """
    began = now()
    training, start = training or Training(), start or Start()
    training, elected = training.with_starts(1), elects(training, selection)
    if not elected:
        check_members(training)
    lags = Layout.of(network, len(mapping.inputs), len(mapping.outputs)).columns
    rests = rests_of(traces, mapping, rest_output)
    rest = np.array(rests) if network.several_outputs else rests[0]
    experiments = tuple(e.from_measured(lags) for e in experiments_of(traces, mapping, start, rest))
    experiments = (*experiments, *_offset(experiments, mapping, training))
    template = template_of(traces[0], mapping, network, experiments, rests=rests)
    windows = Windows.of(experiments, training)
    seen = tuple(e.from_measured(lags) for e in windows.experiments)
    task = _Task.of(template, seen, training)
    multistart = starts.Multistart(
        training=training,
        layout=task.layout,
        provider=task.provider,
        to_plain=task.to_plain,
        template=task.template,
        selection=selection,
        start=start,
        initial=_initial_parameters(initial, task.template, task.layout, task.to_plain, training.seed),
        on_progress=on_progress,
        checkpoints=checkpoints_of(on_progress),
        resume=resume,
        pretraining=_pretraining(training, task, seen),
        prepared=_prepared(training, task, seen),
        until=starts.deadline(began, training, on_progress),
        again=True,
        # Selection traces elect among all looks at all starts; where there are none, members are starts at their ends.
        least=1 if elected else training.ensemble,
    )
    multistart = middle.compared(multistart)
    tasks = _started(multistart, task, seen)
    # A cautious fit is made anew, so that a fit that goes on ends where one in a single run would.
    raced = [one for one in tasks if not one.cautious]
    on_checkpoint(Checkpoint.of(choose(raced, training.choose_by).chosen.solution.state))
    tasks |= _by_noise(multistart, tasks)
    becomes = middle.placed(multistart, list(tasks), experiments)
    tasks = {becomes[one]: task for one, task in tasks.items()}
    whole = _ensemble_of(multistart, list(tasks), experiments, vet)
    choice, tasks = _chosen(multistart, windows, tasks, vet, whole)
    chosen = choice.chosen
    runs: list[tuple[NDArray[np.float64], History | None]] = [(e.inputs, e.history) for e in experiments]
    runs += [(t.columns(mapping.inputs), None) for t in selection]
    # Copies with other offsets stand behind the records that they are of.
    names = [t.name for t in traces] * (len(experiments) // len(traces)) + [t.name for t in selection]
    left = left_on(chosen.model, names, runs)
    status = multistart_status(chosen, list(tasks), left, interrupted=multistart.stop.is_set())
    posterior = _posterior(multistart, chosen, tasks[chosen], experiments)
    seconds = multistart.checkpoints.earlier_s + now() - began
    fit = with_note(multistart_result(choice, list(tasks), training, status, seconds, left=left), windows)
    held = held_told(template)
    twice = cautious.told(choice, list(tasks), tasks[chosen].provider.n_samples)
    made = of_ensemble(training, None if whole is None else whole[0], choice)
    return replace(fit, posterior=posterior, notes=(*fit.notes, *twice, *made, *held))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Task(ensemble.Task):
    """What is minimised for one size of the network and one set of its inputs.

    Args:
        template: The model but for its parameters.
        basis: The regressors' basis in training.
        provider: Residuals.
    """

    template: NARXModel | VectorNARXModel
    basis: RegressorBasis
    provider: RebasedRecursion

    @classmethod
    def of(
        cls,
        template: NARXModel | VectorNARXModel,
        experiments: Sequence[Experiment],
        training: Training,
        without: tuple[str, ...] = (),
    ) -> _Task:
        whole = layout_of(template)
        layout = part_of(whole, template.mapping, without)
        basis = _basis(training, template, experiments, layout)
        inner = RecursionProvider(
            template=template.recursion,
            experiments=tuple(experiments),
            closed=training.loop is Loop.CLOSED,
            stride=training.stride,
        )
        to_plain = embedding(layout, whole) @ basis.to_plain(layout)
        provider = RebasedRecursion(inner=inner, to_plain=to_plain)
        return cls(template=template, layout=layout, basis=basis, to_plain=to_plain, provider=provider)


def _chosen(
    multistart: starts.Multistart,
    windows: Windows,
    tasks: dict[starts.Candidate, _Task],
    vet: Callable[[starts.Network], bool] | None,
    whole: tuple[ensemble.United, _Task] | None,
) -> tuple[Choice, dict[starts.Candidate, _Task]]:
    """The choice, trained on over whole records, and with the evidence where it was looked at before that spoke."""
    by = multistart.training.choose_by
    if whole is None:
        choice = choose(list(tasks), by, vet)
    else:
        choice = whole[0].choice(list(tasks), by, vet)
        tasks = tasks | {whole[0].candidate: whole[1]}
    before = after = choice.chosen
    if windows.samples:
        choice = _over_all(multistart, windows, choice, tasks[before])
        after = choice.chosen
    if after.solution.evidence is None and any(one.solution.evidence is not None for one in tasks):
        after = with_evidence(after, tasks[before].provider)
    tasks = dict(zip(in_place(list(tasks), before, after), tasks.values(), strict=True))
    return replace(choice, chosen=after), tasks


def _posterior(
    multistart: starts.Multistart, chosen: starts.Candidate, task: _Task, experiments: Sequence[Experiment]
) -> Posterior | None:
    """Of the weights, calibrated on the selection traces."""
    training, model = multistart.training, chosen.model
    copies, stride = 1 + len(training.offsets), training.stride
    found = laplace(chosen.solution.state, model, task.to_plain, experiments, copies=copies, stride=stride)
    if found is None:
        return None
    selection = [Experiment.for_model(trace, model, multistart.start) for trace in multistart.selection]
    return calibrate(found, model, selection)


def _over_all(multistart: starts.Multistart, windows: Windows, choice: Choice, task: _Task) -> Choice:
    """The choice, trained on over all samples of the records."""
    inner = replace(task.provider.inner, experiments=windows.records)
    own = replace(multistart, to_plain=task.to_plain)
    if choice.chosen.without:
        whole = layout_of(task.template)
        own = replace(own, layout=PartLayout(part=task.layout, whole=whole))
    state = choice.chosen.solution.state
    provider = RebasedRecursion(inner=inner, to_plain=task.to_plain)
    return windows.finished(own, choice, provider, state.theta, state.prior.centre)


def _started(
    multistart: starts.Multistart, task: _Task, experiments: Sequence[Experiment]
) -> dict[starts.Candidate, _Task]:
    """Every start at every checkpoint with what it minimises; each subset of the inputs is halved by itself."""
    tasks: dict[starts.Candidate, _Task] = {}
    for view in views(multistart.training, task.template.mapping):
        own = replace(
            multistart, training=view.training, on_progress=view.report(multistart.on_progress), iterations={}
        )
        if view.without:
            part = _Task.of(task.template, experiments, multistart.training, view.without)
            own = replace(
                own,
                name=f"without {', '.join(view.without)}, ",
                layout=PartLayout(part=part.layout, whole=task.layout),
                provider=part.provider,
                to_plain=part.to_plain,
                initial=None,
                resume=None,
                pretraining=_pretraining(view.training, part, experiments),
                prepared=_prepared(view.training, part, experiments),
                again=False,
            )
        found = run_race(own)
        named = [replace(one, number=one.number + view.first, without=view.without) for one in found]
        tasks |= dict.fromkeys(named, part if view.without else task)
        if multistart.stop.is_set():
            break
    return tasks


def _by_noise(multistart: starts.Multistart, tasks: Dict[starts.Candidate, _Task]) -> dict[starts.Candidate, _Task]:
    """The best start of several outputs, or all that came to their end, trained on with each over what is left."""
    found, by = dict[starts.Candidate, _Task](), multistart.training.choose_by
    for one in [choose(list(tasks), by).chosen] if multistart.least == 1 else ends_of(list(tasks), by):
        own = replace(multistart, to_plain=tasks[one].to_plain)
        found |= {
            again: replace(tasks[one], provider=provider)
            for again, provider in reweighted(own, tasks[one].provider, one)
        }
    return found


def _ensemble_of(
    multistart: starts.Multistart,
    candidates: Sequence[starts.Candidate],
    experiments: Sequence[Experiment],
    vet: Callable[[starts.Network], bool] | None,
) -> tuple[ensemble.United, _Task] | None:
    """The ensemble, with its task; none where no second pick helps, or nobody waits for it."""
    if multistart.training.ensemble == 1 or multistart.stop.is_set():
        return None
    try:
        members = ensemble.members_of(multistart, candidates, experiments, vet)
    except KeyboardInterrupt:  # the starts are there, and the best of them stands
        multistart.stop.set()
        return None
    if members is None:
        return None
    task = _Task.of(members.model, experiments, multistart.training)
    return ensemble.as_start(multistart, members, task), task


def _pretraining(training: Training, task: _Task, experiments: Sequence[Experiment]) -> StepSamples | None:
    if not training.pretraining or not task.layout.linear or not task.layout.neurons:
        return None
    return _step_samples(training, task, experiments, training.pretraining)


def _prepared(training: Training, task: _Task, experiments: Sequence[Experiment]) -> starts.Prepared:
    """What is linear in a random start by least squares; a start that was given or pretrained stays as it is.

    So does one of several outputs: where there is little noise, their fits came out worse from there.
    """
    kept = WhileUsed(lambda: _step_samples(training, task, experiments, sys.maxsize))

    def prepared(multistart: starts.Multistart, number: int, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        given = number == 0 and multistart.initial is not None
        several = len(task.template.mapping.outputs) > 1
        samples = None if training.pretraining or given or several else kept.made()
        return theta if samples is None else regressed(theta, samples, multistart.provider)

    return prepared


def _step_samples(
    training: Training, task: _Task, experiments: Sequence[Experiment], samples: int
) -> StepSamples | None:
    found = StepSamples.of(task.template, experiments, task.layout, task.basis, samples=samples, seed=training.seed)
    # A record that stands at its limits throughout, as a truth value does, has no sample that says what a step does.
    return found if found.n_samples else None


def _offset(experiments: Sequence[Experiment], mapping: Mapping, training: Training) -> list[Experiment]:
    """The experiments once more with each offset of their channels."""
    copies = []
    channels = (*mapping.inputs, *mapping.outputs)
    for offset in training.offsets:
        strangers = sorted(set(offset) - set(channels))
        if strangers:
            raise ChannelError(strangers, channels, where="offsets")
        by, up = (
            np.array([float(offset.get(name, 0.0)) for name in some]) for some in (mapping.inputs, mapping.outputs)
        )
        for e in experiments:
            up = up.reshape(e.output.shape[1:])
            history = History(inputs=e.history.inputs + by, output=e.history.output + up)
            copies.append(replace(e, inputs=e.inputs + by, output=e.output + up, history=history))
    return copies


def _basis(
    training: Training, template: NARXModel | VectorNARXModel, experiments: Sequence[Experiment], layout: Layout
) -> RegressorBasis:
    if training.basis == "plain" or not layout.linear:
        # The constant and linear part absorb the shift of the basis; without them the plain regressors remain.
        return RegressorBasis.identity(layout.lags)
    records = [regressors_of(template, experiment, layout)[0] for experiment in experiments]
    return RegressorBasis.incremental(layout.lags, np.concatenate(records))


def _initial_parameters(
    initial: FitResult | None,
    template: NARXModel | VectorNARXModel,
    layout: Layout,
    to_plain: NDArray[np.float64],
    seed: int,
) -> NDArray[np.float64] | None:
    """Plain parameters of the first start; what the initial fit lacks is drawn as a random start draws it."""
    if initial is None:
        return None
    check_initial(template.network, initial.model.structure, len(template.mapping.inputs))
    form = initial.model.recursion
    if initial.model.structure == template.network and form.scaling == template.scaling:
        return form.numbers
    centre = np.linalg.solve(to_plain, layout.centre())
    fresh = to_plain @ layout.draw(np.random.default_rng(seed), np.asarray(centre, dtype=np.float64))
    return grown(cast("AbstractLaggedForm", form), template.recursion, fresh)
