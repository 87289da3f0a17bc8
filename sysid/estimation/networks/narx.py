"""NARX networks: open loop, closed loop, several starts, and an honest choice between them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.checkpoint import Checkpoint
from sysid.estimation.least_squares.checkpoints import checkpoints_of
from sysid.estimation.linear.arx import first_output
from sysid.estimation.linear.regression import lagged
from sysid.estimation.networks import ensemble
from sysid.estimation.networks.basis import RebasedProvider, RegressorBasis
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.input_subsets import PartLayout, embedding, part_of, views
from sysid.estimation.networks.posterior import Posterior, calibrate, laplace
from sysid.estimation.networks.pretraining import StepSamples, WhileUsed
from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.networks.regressed import regressed
from sysid.estimation.networks.starts import cautious
from sysid.estimation.networks.starts import multistart as starts
from sysid.estimation.networks.starts.advancing import with_evidence
from sysid.estimation.networks.starts.choosing import Choice, choose
from sysid.estimation.networks.starts.race import run_race
from sysid.estimation.networks.starts.result import left_on, multistart_result, multistart_status
from sysid.estimation.networks.training import FitProgress, Training
from sysid.estimation.networks.warm_start import check_initial, grown
from sysid.estimation.networks.windows import Windows, in_place, with_note
from sysid.estimation.records.experiment import Experiment, experiments_of, unit_range
from sysid.estimation.records.output_ends import ends_of, told
from sysid.estimation.results.result import FitResult, Loop
from sysid.models import NARX, History, Mapping, NARXModel, Recursion, Start
from sysid.traces import Trace


def fit_narx(
    traces: Sequence[Trace],
    mapping: Mapping,
    network: NARX,
    training: Training | None = None,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
    selection: Sequence[Trace] = (),
    initial: FitResult | None = None,
    resume: Checkpoint | None = None,
    on_checkpoint: Callable[[Checkpoint], None] = lambda _: None,
    vet: Callable[[starts.Network], bool] | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit a NARX network by Levenberg-Marquardt with Bayesian regularisation.

    An interruption from the keyboard keeps the best model so far (status ``INTERRUPTED``).

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which comes out.
        network: The structure.
        training: How to train.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.
        selection: Traces that choose between starts; without them the evidence chooses.
        initial: A fit whose parameters are the first start: of the same structure, of a smaller network over some of
            its lags, or of a linear model over them.
        resume: Where the fit of a single start was put aside; it goes on as if it had not been.
        on_checkpoint: Given the checkpoint from which the chosen start can go on.
        vet: Whether a model's free run is stable; the best stable one of the ten best candidates is then chosen.
        on_progress: Called after every iteration, from the threads that train; a
            :class:`~sysid.estimation.least_squares.checkpoints.Watch` keeps where the fit stands, too.

    Returns:
        The best start's model, with the spread over starts in its attempts.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the structure does not fit the mapping, ``initial`` has another structure, or limits that are to
            be found are not there.
    """
    began = now()
    training, start = training or Training(), start or Start()
    ensemble.check(training, selection)
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    lags = network.lags(len(mapping.inputs))
    experiments = tuple(e.from_measured(lags) for e in experiments_of(traces, mapping, start, rest))
    experiments = (*experiments, *_offset(experiments, mapping, training))
    template = _template(traces[0], mapping, network, experiments, rest)
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
    )
    tasks = _started(multistart, task, seen)
    # A cautious fit is made anew, so that a fit that goes on ends where one in a single run would.
    raced = [one for one in tasks if not one.cautious]
    on_checkpoint(Checkpoint.of(choose(raced, training.choose_by).chosen.solution.state))
    tasks |= _with_ensemble(multistart, list(tasks), experiments, vet)
    choice, tasks = _chosen(multistart, windows, tasks, vet)
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
    # All of them have the template's limits.
    held = (told(template.between, mapping.output, template.output_unit),) if template.limits else ()
    twice = cautious.told(choice, list(tasks), tasks[chosen].provider.n_samples)
    return replace(fit, posterior=posterior, notes=(*fit.notes, *twice, *held))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Task(ensemble.Task):
    """What is minimised for one size of the network and one set of its inputs.

    Args:
        template: The model but for its parameters.
        basis: The regressors' basis in training.
        inner: Residuals over plain parameters.
    """

    template: NARXModel
    basis: RegressorBasis
    inner: RecursionProvider

    @classmethod
    def of(
        cls, template: NARXModel, experiments: Sequence[Experiment], training: Training, without: tuple[str, ...] = ()
    ) -> _Task:
        whole = Layout.of(template.network, len(template.mapping.inputs))
        layout = part_of(whole, template.mapping, without)
        basis = _basis(training, template, experiments, layout)
        inner = RecursionProvider(
            template=template.recursion,
            experiments=tuple(experiments),
            closed=training.loop is Loop.CLOSED,
            stride=training.stride,
        )
        to_plain = embedding(layout, whole) @ basis.to_plain(layout)
        provider = RebasedProvider(inner=inner, to_plain=to_plain)
        return cls(template=template, layout=layout, basis=basis, to_plain=to_plain, provider=provider, inner=inner)


def _chosen(
    multistart: starts.Multistart,
    windows: Windows,
    tasks: dict[starts.Candidate, _Task],
    vet: Callable[[starts.Network], bool] | None,
) -> tuple[Choice, dict[starts.Candidate, _Task]]:
    """The choice, trained on over whole records, and with the evidence where it was looked at before that spoke."""
    choice = choose(list(tasks), multistart.training.choose_by, vet)
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
    inner = replace(task.inner, experiments=windows.records)
    own = replace(multistart, to_plain=task.to_plain)
    if choice.chosen.without:
        whole = Layout.of(task.template.network, len(task.template.mapping.inputs))
        own = replace(own, layout=PartLayout(part=task.layout, whole=whole))
    state = choice.chosen.solution.state
    provider = RebasedProvider(inner=inner, to_plain=task.to_plain)
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


def _with_ensemble(
    multistart: starts.Multistart,
    candidates: Sequence[starts.Candidate],
    experiments: Sequence[Experiment],
    vet: Callable[[starts.Network], bool] | None,
) -> dict[starts.Candidate, _Task]:
    """The ensemble as one more candidate, with its task; none where no second pick helps, or nobody waits for it."""
    if multistart.training.ensemble == 1 or multistart.stop.is_set():
        return {}
    try:
        found = ensemble.selected(multistart, candidates, vet)
    except KeyboardInterrupt:  # the starts are there, and the best of them stands
        multistart.stop.set()
        return {}
    if found is None:
        return {}
    task = _Task.of(found[0].model, experiments, multistart.training)
    return {ensemble.as_candidate(multistart, *found, task): task}


def _pretraining(training: Training, task: _Task, experiments: Sequence[Experiment]) -> StepSamples | None:
    if not training.pretraining or not task.layout.linear or not task.layout.neurons:
        return None
    return _step_samples(training, task, experiments, training.pretraining)


def _prepared(training: Training, task: _Task, experiments: Sequence[Experiment]) -> starts.Prepared:
    """What is linear in a random start by least squares; a start that was given or pretrained stays as it is."""
    kept = WhileUsed(lambda: _step_samples(training, task, experiments, sys.maxsize))

    def prepared(multistart: starts.Multistart, number: int, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        given = number == 0 and multistart.initial is not None
        samples = None if training.pretraining or given else kept.made()
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
    channels = (*mapping.inputs, mapping.output)
    for offset in training.offsets:
        strangers = sorted(set(offset) - set(channels))
        if strangers:
            raise ChannelError(strangers, channels, where="offsets")
        *by, up = (float(offset.get(name, 0.0)) for name in channels)
        for e in experiments:
            history = History(inputs=e.history.inputs + np.array(by), output=e.history.output + up)
            copies.append(replace(e, inputs=e.inputs + np.array(by), output=e.output + up, history=history))
    return copies


def _template(
    first: Trace, mapping: Mapping, network: NARX, experiments: Sequence[Experiment], rest: float
) -> NARXModel:
    """The model but for its parameters."""
    layout = Layout.of(network, len(mapping.inputs))
    return NARXModel(
        network=network,
        theta=layout.centre(),
        scaling=unit_range(experiments),
        mapping=mapping,
        sample_time=first.sample_time,
        input_units=tuple(first.channel(name).unit for name in mapping.inputs),
        output_unit=first.channel(mapping.output).unit,
        rest_output=rest,
        between=ends_of(network.limits, experiments, mapping.output),
    )


def _basis(
    training: Training, template: NARXModel, experiments: Sequence[Experiment], layout: Layout
) -> RegressorBasis:
    if training.basis == "plain" or not layout.linear:
        # The constant and linear part absorb the shift of the basis; without them the plain regressors remain.
        return RegressorBasis.identity(layout.lags)
    records = []
    for experiment in experiments:
        u, y = template.recursion.extended(experiment.inputs, experiment.history)
        y[-len(experiment.output) :] = template.scaling.scale_output(experiment.output)
        records.append(lagged(u, y, layout.lags, len(experiment.output)))
    return RegressorBasis.incremental(layout.lags, np.concatenate(records))


def _initial_parameters(
    initial: FitResult | None, template: NARXModel, layout: Layout, to_plain: NDArray[np.float64], seed: int
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
    return grown(cast("Recursion", form), template.recursion, fresh)
