"""Neural state space: free-run fit from the best linear model, several starts, and an honest choice between them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from sysid.errors import ConfigError
from sysid.estimation.experiment import Experiment, experiments_of, unit_range
from sysid.estimation.least_squares.checkpoints import checkpoints_of
from sysid.estimation.linear.arx import first_output
from sysid.estimation.networks import multistart as starts
from sysid.estimation.networks.choosing import choose
from sysid.estimation.networks.multistart_result import multistart_result, multistart_status
from sysid.estimation.networks.neural_provider import NeuralProvider
from sysid.estimation.networks.neural_start import NeuralLayout, linear_start
from sysid.estimation.networks.posterior import Posterior, calibrate, laplace
from sysid.estimation.networks.training import FitProgress, Training
from sysid.estimation.result import FitResult, Loop
from sysid.models import Mapping, NeuralStateSpace, NeuralStateSpaceModel, Start
from sysid.traces import Trace

STARTS = 6
"""Starts of a fit that asks for none: the linear model's, and five that differ (:class:`NeuralLayout`). Halved at each
checkpoint, all of them take some 1.6 times the iterations of one."""

LAGGED_ONLY = ("basis", "offsets", "pretraining", "stride", "ensemble", "input_subsets")
"""Options of a training that concern lagged regressors."""


def fit_neural_state_space(
    traces: Sequence[Trace],
    mapping: Mapping,
    network: NeuralStateSpace,
    training: Training | None = None,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
    selection: Sequence[Trace] = (),
    vet: Callable[[starts.Network], bool] | None = None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> FitResult:
    """Fit a neural state space by Levenberg-Marquardt with Bayesian regularisation, always in free run.

    A record whose start is measured has its own initial state, estimated with the parameters; the others start where
    the model's map from the oldest sample says, which is estimated too.

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which comes out.
        network: The structure.
        training: How to train; options for lagged regressors do not apply.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.
        selection: Traces that choose between starts; without them the evidence chooses.
        vet: Whether a model's free run is stable; the best stable one of the ten best candidates is then chosen.
        on_progress: Called after every iteration, from the threads that train.

    Returns:
        The best start's model, with the spread over starts in its attempts.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the training is for one step ahead, which a hidden state does not have, or has options that are
            for lagged regressors alone.
    """
    began = time.perf_counter()
    training, start = (training or Training()).with_starts(STARTS), start or Start()
    check_training(training)
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    experiments = experiments_of(traces, mapping, start, rest)
    template = _template(traces[0], mapping, network, experiments, rest)
    provider = NeuralProvider(template=template.recursion, experiments=experiments)
    starts.check_samples(provider)
    multistart = starts.Multistart(
        training=training,
        layout=NeuralLayout(
            sizes=template.recursion.sizes, base=linear_start(provider), longest=max(len(e.output) for e in experiments)
        ),
        provider=provider,
        to_plain=np.eye(template.n_parameters, provider.n_parameters),
        template=template,
        selection=selection,
        start=start,
        initial=None,
        on_progress=on_progress,
        checkpoints=checkpoints_of(on_progress),
    )
    candidates = starts.run(multistart)
    choice = choose(candidates, training.choose_by, vet)
    records = [(e.inputs, e.history) for e in experiments]
    records += [(e.inputs, e.history) for e in experiments_of(selection, mapping, start, rest)]
    status = multistart_status(choice.chosen, candidates, records, interrupted=multistart.stop.is_set())
    posterior = _posterior(choice.chosen, provider, traces, selection, start)
    seconds = multistart.checkpoints.earlier_s + time.perf_counter() - began
    return replace(multistart_result(choice, candidates, training, status, seconds), posterior=posterior)


def _posterior(
    chosen: starts.Candidate,
    provider: NeuralProvider,
    traces: Sequence[Trace],
    selection: Sequence[Trace],
    start: Start,
) -> Posterior | None:
    """Of the model's weights; those of its map to an initial state only where a record begins by it."""
    model = chosen.model
    to_plain = np.eye(model.n_parameters, provider.n_parameters)
    if provider.all_free:
        to_plain[provider.template.sizes.start] = 0.0
    runs, others = ([Experiment.for_model(t, model, start) for t in some] for some in (traces, selection))
    found = laplace(chosen.solution.state, model, to_plain, runs, copies=1)
    return None if found is None else calibrate(found, model, others)


def check_training(training: Training) -> None:
    """Refuse what does not apply to hidden states.

    Args:
        training: How to train.

    Raises:
        ConfigError: If it is for one step ahead, or has options that are for lagged regressors alone.
    """
    if training.loop is not Loop.CLOSED:
        raise ConfigError(
            "a neural state space has no open loop",
            where="loop",
            expected="closed",
            got=training.loop.value,
            remedy="leave loop out: its states are hidden, and only the free run can be compared with a measurement",
        )
    strangers = [name for name in LAGGED_ONLY if getattr(training, name) != getattr(Training(), name)]
    if strangers:
        raise ConfigError(
            f"a neural state space is not trained with {', '.join(strangers)}",
            where="training",
            expected="options that do not concern lagged regressors",
            remedy=f"leave out {', '.join(strangers)}",
        )


def _template(
    first: Trace, mapping: Mapping, network: NeuralStateSpace, experiments: Sequence[Experiment], rest: float
) -> NeuralStateSpaceModel:
    """The model but for its parameters."""
    scaling = unit_range(experiments)
    if network.output == "absolute":
        # An absolute value is one in scaled numbers only where both have the same zero.
        largest = max(float(np.abs(e.output).max()) for e in experiments)
        scaling = replace(scaling, output_offset=0.0, output_scale=largest or 1.0)
    return NeuralStateSpaceModel(
        network=network,
        theta=np.zeros(network.sizes(len(mapping.inputs)).count),
        scaling=scaling,
        mapping=mapping,
        sample_time=first.sample_time,
        input_units=tuple(first.channel(name).unit for name in mapping.inputs),
        output_unit=first.channel(mapping.output).unit,
        rest_output=rest,
    )
