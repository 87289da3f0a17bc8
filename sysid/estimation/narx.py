"""NARX networks: open loop, closed loop, several starts, and an honest choice between them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError
from sysid.estimation import starts
from sysid.estimation.arx import first_output
from sysid.estimation.attempts import Attempt
from sysid.estimation.basis import RebasedProvider, RegressorBasis
from sysid.estimation.batched import device_named
from sysid.estimation.checkpoint import Checkpoint
from sysid.estimation.growing import grown
from sysid.estimation.initialise import Layout
from sysid.estimation.posterior import calibrate, laplace
from sysid.estimation.prelude import StepSamples
from sysid.estimation.provider import Experiment, RecursionProvider, experiments_of
from sysid.estimation.regression import lagged
from sysid.estimation.result import FitResult, Loop, Status
from sysid.estimation.scouting import Patrol, Scout
from sysid.estimation.training import FitProgress, Training
from sysid.models import NARX, ARXModel, History, Mapping, NARXModel, Scaling, Start
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
        on_progress: Called after every iteration, from the threads that train.

    Returns:
        The best start's model, with the spread over starts in its attempts.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        ConfigError: If the structure does not fit the mapping, or ``initial`` has another structure.
    """
    began = time.perf_counter()
    training, start = training or Training(), start or Start()
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    experiments = experiments_of(traces, mapping, start, rest)
    experiments = (*experiments, *_offset(experiments, mapping, training))
    template = _template(traces[0], mapping, network, experiments, rest)
    layout = Layout.of(network, len(mapping.inputs))
    basis = _basis(training, template, experiments, layout)
    to_plain = basis.to_plain(layout)
    inner = RecursionProvider(
        template=template.recursion,
        experiments=experiments,
        closed=training.loop is Loop.CLOSED,
        stride=training.stride,
    )
    race = starts.Race(
        training=training,
        layout=layout,
        provider=RebasedProvider(inner=inner, to_plain=to_plain),
        to_plain=to_plain,
        template=template,
        selection=selection,
        start=start,
        initial=_initial_parameters(initial, template, layout, to_plain, training.seed),
        on_progress=on_progress,
        resume=resume,
        prelude=_prelude(training, template, experiments, layout, basis),
        scouted=_scouted(training, inner, to_plain, layout),
        curriculum=[RebasedProvider(inner=replace(inner, horizon=k), to_plain=to_plain) for k in training.curriculum],
    )
    candidates = starts.run(race)
    choice = starts.choose(candidates, training.choose_by, vet)
    chosen = choice.chosen
    on_checkpoint(Checkpoint.of(chosen.solution.state))
    records: list[tuple[NDArray[np.float64], History | None]] = [(e.inputs, e.history) for e in experiments]
    records += [(t.columns(mapping.inputs), None) for t in selection]
    status = raced_status(chosen, candidates, records, interrupted=race.stop.is_set())
    posterior = laplace(
        chosen.solution.state,
        chosen.model,
        to_plain,
        experiments,
        copies=1 + len(training.offsets),
        stride=training.stride,
    )
    if posterior is not None:
        posterior = calibrate(posterior, chosen.model, experiments_of(selection, mapping, start, rest))
    fit = raced_result(choice, candidates, training, status, time.perf_counter() - began)
    return replace(fit, posterior=posterior)


def _scouted(
    training: Training, inner: RecursionProvider, to_plain: NDArray[np.float64], layout: Layout
) -> list[Scout]:
    """The best of the scouts as starts; none where none are asked for, or no device is there to send them out on."""
    if not training.scouts or (training.device == "auto" and device_named("auto") == "cpu"):
        return []
    patrol = Patrol(
        provider=inner,
        to_plain=to_plain,
        layout=layout,
        centre=np.asarray(np.linalg.solve(to_plain, layout.centre())),
        regularisation=training.regularisation,
        device=training.device,
    )
    return patrol.scouts(range(training.seed, training.seed + training.scouts))[: training.starts]


def _prelude(
    training: Training,
    template: NARXModel,
    experiments: Sequence[Experiment],
    layout: Layout,
    basis: RegressorBasis,
) -> StepSamples | None:
    if not training.prelude or not layout.linear or not layout.neurons:
        return None
    return StepSamples.of(template, experiments, layout, basis, samples=training.prelude, seed=training.seed)


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
        scaling=Scaling.to_unit_range([e.inputs for e in experiments], [e.output for e in experiments]),
        mapping=mapping,
        sample_time=first.sample_time,
        input_units=tuple(first.channel(name).unit for name in mapping.inputs),
        output_unit=first.channel(mapping.output).unit,
        rest_output=rest,
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
        y[layout.lags.depth :] = template.scaling.scale_output(experiment.output)
        records.append(lagged(u, y, layout.lags, len(experiment.output)))
    return RegressorBasis.levels_and_rates(layout.lags, np.concatenate(records))


def _initial_parameters(
    initial: FitResult | None, template: NARXModel, layout: Layout, to_plain: NDArray[np.float64], seed: int
) -> NDArray[np.float64] | None:
    """Plain parameters of the first start; what the initial fit lacks is drawn as a random start draws it."""
    if initial is None:
        return None
    if not isinstance(initial.model, ARXModel | NARXModel):
        raise ConfigError(
            "the initial fit is neither a network nor an ARX model",
            where="initial",
            expected=f"{template.network.label}, a smaller network, or an ARX model over its lags",
            got=initial.model.structure.label,
            remedy="name such a fit, or leave initial out",
        )
    if isinstance(initial.model, NARXModel) and _same(initial.model, template):
        return initial.model.theta
    centre = np.linalg.solve(to_plain, layout.centre())
    fresh = to_plain @ layout.draw(np.random.default_rng(seed), np.asarray(centre, dtype=np.float64))
    return grown(initial.model.recursion, template.recursion, fresh)


def _same(model: NARXModel, template: NARXModel) -> bool:
    return model.network == template.network and model.scaling == template.scaling


def raced_status(
    chosen: starts.Candidate,
    candidates: Sequence[starts.Candidate],
    records: Sequence[tuple[NDArray[np.float64], History | None]],
    *,
    interrupted: bool,
) -> Status:
    """How a race ended.

    Args:
        chosen: The candidate chosen.
        candidates: All of them.
        records: Inputs and history of each record over which the free run must stay within its bounds.
        interrupted: Whether the race was.

    Returns:
        The status.
    """
    if interrupted:
        return Status.INTERRUPTED
    if any(_leaves_its_bounds(chosen.model, inputs, history) for inputs, history in records):
        return Status.UNSTABLE
    iteration = chosen.solution.state.iteration
    later = any(c.number == chosen.number and c.solution.state.iteration > iteration for c in candidates)
    return Status.STOPPED_EARLY if later else chosen.solution.status


def _leaves_its_bounds(model: starts.Network, inputs: NDArray[np.float64], history: History | None) -> bool:
    scaled = model.scaling.scale_output(model.simulate(inputs, history))
    return not bool(np.all(np.abs(scaled) < model.clamp * (1.0 - 1e-9)))


def raced_result(
    choice: starts.Choice,
    candidates: Sequence[starts.Candidate],
    training: Training,
    status: Status,
    seconds: float,
) -> FitResult:
    """What a race found.

    Args:
        choice: The candidate chosen.
        candidates: All of them, for the attempts.
        training: How they were trained.
        status: How it ended.
        seconds: Wall time.

    Returns:
        The result.
    """
    chosen = choice.chosen
    curve = chosen.solution.curve
    scale = chosen.model.scaling.output_scale**2
    return FitResult(
        model=chosen.model,
        status=status,
        loop=training.loop,
        history={
            "iteration": np.array([entry.iteration for entry in curve], dtype=np.float64),
            "mse": np.array([entry.mse * scale for entry in curve]),
            "effective_parameters": np.array([entry.effective_parameters for entry in curve]),
            "elapsed_s": np.array([entry.elapsed_s for entry in curve]),
        },
        train_time_s=seconds,
        seed=chosen.seed,
        evidence=chosen.solution.evidence,
        attempts=_attempts(choice, candidates),
        notes=_notes(choice, candidates, training),
    )


def _attempts(choice: starts.Choice, candidates: Sequence[starts.Candidate]) -> tuple[Attempt, ...]:
    scale = choice.chosen.model.scaling.output_scale**2
    found = [
        Attempt(
            start=candidate.number + 1,
            seed=candidate.seed,
            iterations=candidate.solution.state.iteration,
            elapsed_s=candidate.solution.curve[-1].elapsed_s,
            estimation_mse=candidate.solution.curve[-1].mse * scale,
            selection_mse=candidate.score,
            log_evidence=candidate.log_evidence,
            effective_parameters=candidate.solution.curve[-1].effective_parameters,
            stable=stable,
            chosen=candidate is choice.chosen,
        )
        for candidate, stable in zip(candidates, choice.stable, strict=True)
    ]
    return tuple(sorted(found, key=lambda attempt: (attempt.start, attempt.iterations)))


def _notes(choice: starts.Choice, candidates: Sequence[starts.Candidate], training: Training) -> tuple[str, ...]:
    notes = []
    if training.starts > 1:
        by_selection = training.choose_by == "selection" and np.isfinite(choice.chosen.score)
        by_evidence = choice.chosen.solution.evidence is not None
        how = "the largest evidence" if by_evidence else "the least error on the estimation traces"
        how = "the least error on the selection traces (geometric mean)" if by_selection else how
        notes.append(f"Chosen by {how} among {training.starts} starts looked at {len(candidates)} times.")
    refused = sum(stable is False for stable in choice.stable)
    if refused and any(choice.stable):
        notes.append(f"{refused} that ranked higher were passed over: their free run is not stable.")
    return tuple(notes)
