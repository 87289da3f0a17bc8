"""Neural state space: free-run fit from the best linear model, several starts, and an honest choice between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.checkpoints import checkpoints_of
from sysid.estimation.linear.arx import rests_of
from sysid.estimation.networks.neural.directions import begun_from, in_few_directions, run_name
from sysid.estimation.networks.neural.ensemble import United, united
from sysid.estimation.networks.neural.layout import NeuralLayout
from sysid.estimation.networks.neural.map import learnt_map
from sysid.estimation.networks.neural.provider import NeuralProvider
from sysid.estimation.networks.neural.start import linear_start
from sysid.estimation.networks.neural.thinned import Thinned
from sysid.estimation.networks.posterior import Posterior, calibrate, laplace
from sysid.estimation.networks.starts import multistart as starts
from sysid.estimation.networks.starts.advancing import advanced
from sysid.estimation.networks.starts.choosing import Choice, choose
from sysid.estimation.networks.starts.output_weights import reweighted, weighed
from sysid.estimation.networks.starts.race import run_race
from sysid.estimation.networks.starts.result import left_on, multistart_result, multistart_status
from sysid.estimation.networks.starts.united import told as of_ensemble
from sysid.estimation.networks.training import FitProgress, Training, check_hidden_states, check_members
from sysid.estimation.networks.windows import Windows, in_place, with_note
from sysid.estimation.records.experiment import Experiment, experiments_of, unit_range, unit_ranges
from sysid.estimation.records.first_samples import other_note, shown_note
from sysid.estimation.results.result import FitResult
from sysid.kernels.neurons import NEURONS
from sysid.models import (
    AbstractStructure,
    Mapping,
    NeuralStateSpace,
    NeuralStateSpaceModel,
    Scaling,
    Start,
    VectorNeuralStateSpaceModel,
    VectorScaling,
)
from sysid.traces import Trace

STARTS = 6
"""Starts of a fit that asks for none: the linear model's, and five that differ (:class:`NeuralLayout`). Halved at each
checkpoint, all of them take some 1.6 times the iterations of one."""


def check_training(training: Training) -> None:
    """Refuse options that do not apply to hidden states.

    Args:
        training: How to train.

    Raises:
        ConfigError: If there are some, or an ensemble has more members than there are starts.
    """
    check_hidden_states("a neural state space", training, unites=True)
    check_members(training)


LINEAR_SHARE, LINEAR_SHARE_GIVEN = 0.3, 0.1
"""Share of a fit's time that its linear start may take; where a fit is given to begin from it is only what weights are
drawn to."""
LEAST_FREE = 0.5
"""Share of a fit's time that its starts have in any case, however long the linear model took that they begin with."""


def fit_neural_state_space(
    traces: Sequence[Trace],
    mapping: Mapping,
    network: NeuralStateSpace,
    training: Training | None = None,
    *,
    start: Start | None = None,
    rest_output: float | Dict[str, float] | None = None,
    selection: Sequence[Trace] = (),
    initial: FitResult | None = None,
    vet: Callable[[starts.Network], bool] | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit a neural state space by Levenberg-Marquardt with Bayesian regularisation, always in free run.

    A record whose start is measured has its own initial state, estimated with the parameters; the others start where
    the model's map from the oldest sample says, which is estimated too. Of several outputs each counts over what the
    linear model leaves of it, and the best candidate is trained on with what that leaves, so that a noisy output does
    not blur what a clean one shows of the states they share.

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which come out.
        network: The structure.
        training: How to train; options for lagged regressors do not apply.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit, or by name; the mean of the traces' first samples where not given.
        selection: Traces that choose between starts; without them the evidence chooses.
        initial: A fit of the same structure, whose parameters are the first start, in its scaled numbers.
        vet: Whether a model's free run is stable; the best stable one of the ten best candidates is then chosen.
        on_progress: Called after every iteration, from the threads that train.

    Returns:
        The best start's model, with the spread over starts in its attempts. Of several outputs its errors are mean
        squares over them, in scaled numbers and so weighed.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the training is for one step ahead, which a hidden state does not have, or has options that are
            for lagged regressors alone.
    """
    rests = rests_of(traces, mapping, rest_output)
    named, begun = dict(zip(mapping.outputs, rests, strict=True)), start or Start()
    given: dict[str, Any] = {"mapping": mapping, "network": network, "start": begun, "rest_output": named, "vet": vet}
    given |= {"traces": traces, "selection": selection, "on_progress": on_progress}
    if initial is None and network.directions is not None and network.neurons + network.output_neurons:
        return in_few_directions(given, training or Training(), fit_neural_state_space)
    sparse = None if initial is not None else Thinned.of(given, training or Training())
    if sparse is not None:
        return sparse.fit(fit_neural_state_space)
    several = network.several_outputs
    experiments = experiments_of(traces, mapping, begun, np.array(rests) if several else rests[0])
    ranges = unit_ranges(experiments) if several else unit_range(experiments)
    units = tuple(traces[0].channel(name).unit for name in mapping.outputs)
    shared: dict[str, Any] = {
        "network": network,
        "theta": np.zeros(network.sizes(len(mapping.inputs), len(mapping.outputs)).count),
        "scaling": _signed(ranges, network, experiments) if initial is None else _scaling(initial),
        "mapping": mapping,
        "sample_time": traces[0].sample_time,
        "input_units": tuple(traces[0].channel(name).unit for name in mapping.inputs),
    }
    template: NeuralStateSpaceModel | VectorNeuralStateSpaceModel
    if several:
        template = VectorNeuralStateSpaceModel(output_units=units, rest_outputs=rests, **shared)
    else:
        template = NeuralStateSpaceModel(output_unit=units[0], rest_output=rests[0], **shared)
    records = Records(traces=traces, selection=selection, start=begun, experiments=experiments, initial=initial)
    return _fit(template, records, training, vet, on_progress)


@dataclass(frozen=True, kw_only=True, eq=False)
class Records:
    """What a fit is made of.

    Args:
        traces: Estimation traces.
        selection: Traces that choose.
        start: What stands before each.
        experiments: The estimation traces as the fit sees them.
        initial: A fit whose parameters are the first start.
    """

    traces: Sequence[Trace]
    selection: Sequence[Trace]
    start: Start
    experiments: tuple[Experiment, ...]
    initial: FitResult | None = None

    def runs(self, model: starts.Network) -> tuple[list[Experiment], list[Experiment]]:
        """Estimation and selection traces as the model's free run goes over them."""
        estimation, selection = (
            [Experiment.for_model(t, model, self.start) for t in some] for some in (self.traces, self.selection)
        )
        return estimation, selection


def _fit(
    template: NeuralStateSpaceModel | VectorNeuralStateSpaceModel,
    records: Records,
    training: Training | None,
    vet: Callable[[starts.Network], bool] | None,
    on_progress: Callable[[FitProgress], None],
) -> FitResult:
    """Fit a model of any number of outputs."""
    began = now()
    training = training or Training()
    check_training(training)
    training = training.with_starts(STARTS)
    experiments, windows = records.experiments, Windows.of(records.experiments, training)
    provider = NeuralProvider(
        template=template.recursion, experiments=windows.experiments, stable=bool(training.stable)
    )
    starts.check_samples(provider)
    share = LINEAR_SHARE if records.initial is None else LINEAR_SHARE_GIVEN
    base = linear_start(provider, until=now() + share * training.max_time_s)
    provider = weighed(provider, base)
    multistart = _multistart(template, records, training, provider, base=base, began=began, on_progress=on_progress)
    candidates = run_race(multistart)
    for best in _ends(candidates, training):
        candidates += [one for one, _ in reweighted(multistart, provider, best)]
    whole = None
    if training.ensemble > 1 and not multistart.stop.is_set():
        whole = united(multistart, provider, candidates, vet)
    choice = (
        choose(candidates, training.choose_by, vet)
        if whole is None
        else whole.choice(candidates, training.choose_by, vet)
    )
    candidates += [] if whole is None else [whole.candidate]
    if windows.samples:
        race = choice.chosen
        multistart, provider, choice = _over_all(
            multistart, windows, replace(provider, experiments=experiments), choice
        )
        candidates = in_place(candidates, race, choice.chosen)
    told = list[str]()
    if training.ensemble == 1 and not multistart.stop.is_set():
        before = choice.chosen
        provider, chosen = _as_scored(multistart, provider, before)
        scored = provider.as_scored(multistart.learnt(chosen.solution.theta))
        unmended = [] if scored is None else [name for name in scored.shown if name not in provider.shown]
        told = [*shown_note(provider.shown), *other_note(unmended)]
        choice, candidates = replace(choice, chosen=chosen), in_place(candidates, before, chosen)
    others = experiments_of(records.selection, template.mapping, records.start, template.resting)
    names = [trace.name for trace in (*records.traces, *records.selection)]
    left = left_on(choice.chosen.model, names, [(e.inputs, e.history) for e in (*experiments, *others)])
    status = multistart_status(choice.chosen, candidates, left, interrupted=multistart.stop.is_set())
    posterior = _posterior(choice.chosen, provider, records, whole)
    seconds = multistart.checkpoints.earlier_s + now() - began
    found = with_note(multistart_result(choice, candidates, training, status, seconds, left=left), windows)
    notes = (*found.notes, *told, *of_ensemble(training, whole, choice))
    return replace(found, posterior=posterior, notes=notes)


def _multistart(
    template: NeuralStateSpaceModel | VectorNeuralStateSpaceModel,
    records: Records,
    training: Training,
    provider: NeuralProvider,
    *,
    base: NDArray[np.float64],
    began: float,
    on_progress: Callable[[FitProgress], None],
) -> starts.Multistart:
    """What the starts of a fit have in common."""
    return starts.Multistart(
        training=training,
        layout=NeuralLayout(
            sizes=template.recursion.sizes,
            base=base,
            longest=max(len(e.output) for e in records.experiments),
            loss=None if NEURONS[template.network.activation].bounded else provider.loss,
        ),
        provider=provider,
        to_plain=np.eye(len(template.theta), provider.n_parameters),
        template=template,
        selection=records.selection,
        start=records.start,
        initial=None if records.initial is None else begun_from(records.initial, provider),
        on_progress=on_progress,
        learnt=partial(learnt_map, provider),
        checkpoints=checkpoints_of(on_progress),
        # A fit whose linear start took all of its time would be that start alone.
        least=training.ensemble,
        name="" if records.initial is None else run_name(records.initial, template.network),
        until=max(starts.deadline(began, training, on_progress), now() + LEAST_FREE * training.max_time_s),
    )


def _over_all(
    multistart: starts.Multistart, windows: Windows, provider: NeuralProvider, choice: Choice
) -> tuple[starts.Multistart, NeuralProvider, Choice]:
    """The choice, trained on over all samples of the records."""
    state = choice.chosen.solution.state
    theta, centre = map(provider.begun, (multistart.learnt(state.theta), state.prior.centre))
    provider = weighed(provider, theta)
    to_plain = np.eye(len(multistart.template.theta), provider.n_parameters)
    own = replace(multistart, learnt=partial(learnt_map, provider), to_plain=to_plain)
    return own, provider, windows.finished(own, choice, provider, theta, centre)


def _as_scored(
    multistart: starts.Multistart, provider: NeuralProvider, before: starts.Candidate
) -> tuple[NeuralProvider, starts.Candidate]:
    """A candidate, trained on from the state that a run is scored from, where that run is another one."""
    state = before.solution.state
    theta, centre = map(multistart.learnt, (state.theta, state.prior.centre))
    scored = provider.as_scored(theta)
    if scored is None:
        return provider, before
    own = replace(multistart, learnt=partial(learnt_map, scored))
    iterations = multistart.training.max_iterations
    after = advanced(own, scored, before, name="as scored", iterations=iterations, begun=(theta, centre))
    # The map to what is expected of a state is learnt anew: only what it comes to then counts.
    better = scored.loss(own.learnt(after.solution.theta)) < scored.loss(theta)
    return (scored, after) if better else (provider, before)


def _ends(candidates: Sequence[starts.Candidate], training: Training) -> list[starts.Candidate]:
    """The best candidate; for an ensemble every start that was trained to its end."""
    if training.ensemble == 1:
        return [choose(candidates, training.choose_by).chosen]
    return list({one.number: one for one in candidates[-training.ensemble :]}.values())


def _posterior(
    chosen: starts.Candidate, provider: NeuralProvider, records: Records, whole: United | None
) -> Posterior | None:
    """Of the model's weights; those of its map to an initial state only where a record begins by it."""
    model = chosen.model
    runs, others = records.runs(model)
    sizes = provider.template.sizes
    places = np.arange(sizes.count)
    unread = places[sizes.start] if provider.all_free else places[:0]
    if whole is not None and chosen is whole.candidate:
        found = whole.posterior(runs, unread)
    else:
        to_plain = np.eye(len(model.theta), provider.n_parameters)
        to_plain[unread] = 0.0
        sizes.along(chosen.solution.theta, to_plain.T)
        found = laplace(chosen.solution.state, model, to_plain, runs, copies=1)
    return None if found is None else calibrate(found, model, others)


def check_neural_initial(network: AbstractStructure, initial: AbstractStructure, n_inputs: int) -> None:  # noqa: ARG001
    """Refuse an initial fit of another structure: hidden states of another one are others.

    Args:
        network: The structure that is to start from it.
        initial: The structure of the initial fit.
        n_inputs: Inputs of the mapping.

    Raises:
        ConfigError: If they differ.
    """
    free = replace(network, directions=None) if isinstance(network, NeuralStateSpace) else network
    if initial not in (network, free):
        raise ConfigError(
            "the initial fit has other hidden states than what is to start from it", where="initial",
            expected=network.label, got=initial.label,
            remedy="start from a fit of the same structure, or of the same without directions, or leave initial out",
        )  # fmt: skip


def _scaling(initial: FitResult) -> Any:
    """The scaled numbers that an initial fit's parameters are for."""
    return initial.model.recursion.scaling


def _signed(
    scaling: Scaling | VectorScaling, network: NeuralStateSpace, experiments: Sequence[Experiment]
) -> Scaling | VectorScaling:
    """The scaling of outputs that may be absolute values: such are one in scaled numbers only with the same zero."""
    if network.output != "absolute":
        return scaling
    largest = np.max([np.abs(e.output).max(axis=0) for e in experiments], axis=0)
    scale = np.where(largest > 0.0, largest, 1.0)
    if isinstance(scaling, VectorScaling):
        return replace(scaling, output_offset=(0.0,) * len(scale), output_scale=tuple(scale.tolist()))
    return replace(scaling, output_offset=0.0, output_scale=float(scale))
