"""A start of a multistart is trained on, and judged where it stands then."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.damping import DAMPINGS
from sysid.estimation.least_squares.evidence import Prior, settled
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.provider import AbstractProvider
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.networks.initialise import AbstractLayout
from sysid.estimation.networks.pretraining import StepSamples
from sysid.estimation.networks.starts.multistart import INITIAL_ALPHA, SETTLED, Candidate, Multistart, Network
from sysid.estimation.networks.training import Training
from sysid.estimation.results.result import Loop, Status
from sysid.estimation.results.tolerance import outside, spans_of
from sysid.models import beginning
from sysid.models.contract import gaps

PRETRAINED = 0.4
"""Share of a fit's time that its starts may take one step ahead."""

FAR = 100.0
"""How many times as large as the loss of a prepared start that of the noise is taken to be at first: ten times the
error, with which the weights are held back until the evidence speaks."""


def advance(multistart: Multistart, number: int, before: Candidate | None, share: float, seconds: float) -> Candidate:
    """Train one start on, to a share of its iterations.

    Args:
        multistart: What the starts have in common.
        number: Which start.
        before: As it stood when it was looked at last; ``None`` to begin it.
        share: Of the iterations, from the first on.
        seconds: That it may take.

    Returns:
        The start as it stands then; as before where it had come to its end.
    """
    training = multistart.training
    iterations = max(1, round(share * training.max_iterations))
    run, keep = f"{multistart.name}start {number + 1}, to {iterations}", multistart.checkpoints

    def in_time() -> LevenbergMarquardt:
        return multistart.trained(number, iterations, min(seconds, multistart.left(run)))

    if before is None and number == 0 and multistart.resume is not None:
        prior = multistart.layout.prior(
            _in_basis(multistart, multistart.layout.centre()), alpha=INITIAL_ALPHA, beta=1.0
        )
        seed: int | None = training.seed
        solution = keep.resume(run, in_time(), multistart.provider, multistart.resume.state(multistart.provider, prior))
    elif before is None:
        seed, theta, centre = _begin(multistart, number)
        if multistart.pretraining is not None and seed is not None:
            theta = _pretraining(multistart, multistart.pretraining, number, seed, centre)
        drawn, theta = theta, multistart.prepared(multistart, number, theta)
        prior = first_prior(training, multistart.layout, multistart.provider, theta, centre, drawn=drawn)
        prior = replace(prior, cautious=multistart.cautious)
        solution = keep.minimise(run, in_time(), multistart.provider, theta, prior)
    elif before.solution.status is Status.MAX_ITERATIONS or before.solution.status is Status.TIME_LIMIT:
        seed, solution = before.seed, keep.resume(run, in_time(), multistart.provider, before.solution.state)
    else:
        return before
    multistart.iterations[number] = solution.state.iteration  # one that was taken as it was kept has told nobody
    model = multistart.model(solution.theta)
    mean, outside = judged(multistart, model)
    return Candidate(number=number, seed=seed, solution=solution, model=model, score=mean, outside=outside)


def advanced(
    multistart: Multistart,
    provider: AbstractProvider,
    before: Candidate,
    *,
    name: str,
    iterations: int,
    begun: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
) -> Candidate:
    """A candidate that is trained on with other residuals: other weights of them, or those of other records.

    Args:
        multistart: What the candidates have in common.
        provider: The residuals.
        before: The candidate.
        name: Of this run among those that are kept.
        iterations: At most.
        begun: The parameters, and what they are drawn to, where those of the records' initial states are others; the
            candidate's by default.

    Returns:
        The candidate that it becomes; its iterations go on from those before.
    """
    keep, state, name = multistart.checkpoints, before.solution.state, f"{multistart.name}{name}"
    theta, centre = begun or (state.theta, state.prior.centre)
    with one_blas_thread():
        at = provider.linearise(theta)
        # Precisions that suited the residuals as they were may hold the weights where they are.
        prior = first_prior(multistart.training, multistart.layout, provider, theta, centre)
        prior = replace(prior, cautious=state.prior.cautious)
        damping = DAMPINGS[multistart.training.damping]()
        first = replace(state, theta=theta, at=at, prior=prior, losses=(at.loss,), damping=damping)
        engine = multistart.trained(before.number, state.iteration + iterations, multistart.left(name))
        if engine.evidence_after is not None:
            engine = replace(engine, evidence_after=state.iteration + SETTLED)
        solution = keep.resume(name, engine, provider, first)
    model = multistart.model(solution.theta)
    mean, outside = judged(multistart, model)
    return replace(before, solution=solution, model=model, score=mean, outside=outside)


def with_evidence(before: Candidate, provider: AbstractProvider) -> Candidate:
    """A candidate that was looked at before the evidence spoke, with what it says of it.

    Args:
        before: The candidate.
        provider: Its residuals.

    Returns:
        The same, with the precisions that the evidence finds where it stands.
    """
    state = before.solution.state
    at = provider.linearise(state.theta)
    prior, evidence = settled(state.prior, state.theta, at, provider.n_samples)
    last = replace(state.curve[-1], effective_parameters=evidence.total_effective_parameters)
    state = replace(state, at=at, prior=prior, evidence=evidence, curve=(*state.curve[:-1], last))
    return replace(before, solution=replace(before.solution, state=state))


def _pretraining(
    multistart: Multistart, pretraining: StepSamples, number: int, seed: int, centre: NDArray[np.float64]
) -> NDArray[np.float64]:
    """A random start after its pretraining."""
    training, name = multistart.training, f"{multistart.name}start {number + 1}, one step ahead"
    rounds = math.ceil(training.n_starts / training.workers)
    limits = Termination(
        max_iterations=training.pretraining_iterations,
        max_time_s=min(PRETRAINED * training.max_time_s / rounds, multistart.left(name)),
        tolerance=training.tolerance,
        patience=training.patience,
    )
    engine = multistart.engine(
        number, limits, stage=lambda entry: f"pretraining {entry.iteration} of {training.pretraining_iterations}"
    )
    theta = pretraining.draw(np.random.default_rng(seed), centre)
    prior = first_prior(training, multistart.layout, pretraining, theta, centre)
    return multistart.checkpoints.minimise(name, engine, pretraining, theta, prior).theta


def first_prior(
    training: Training,
    layout: AbstractLayout,
    provider: AbstractProvider,
    theta: NDArray[np.float64],
    centre: NDArray[np.float64],
    *,
    drawn: NDArray[np.float64] | None = None,
) -> Prior:
    """The prior that a fit begins with.

    Args:
        training: How to train.
        layout: Where the parameters stand.
        provider: Residuals.
        theta: Where the fit begins, in the provider's parameters.
        centre: What they are drawn to.
        drawn: The start before it was prepared, whose error is not all noise.

    Returns:
        The prior.
    """
    # The noise is taken to be as large as the start's error: a prior weighed against residuals of size 1 would hold
    # an open-loop fit, whose residuals are a thousand times smaller, at its start.
    # None is known better than the rounding of scaled numbers, also where a start leaves no error at all.
    rounding = 0.5 * provider.n_samples * np.finfo(np.float64).eps ** 2
    loss = provider.loss(theta)
    if drawn is not None and drawn is not theta:
        # Weighed against the little that least squares leave, fits of play, stops and overflows stall.
        loss = min(FAR * loss, provider.loss(drawn))
    beta = 0.5 * provider.n_samples / max(loss, rounding)
    # A precision given from outside is relative to that of the residuals, and stays.
    given = training.regularisation
    return layout.prior(centre, alpha=INITIAL_ALPHA if given is None else given * beta, beta=beta)


def _begin(multistart: Multistart, number: int) -> tuple[int | None, NDArray[np.float64], NDArray[np.float64]]:
    centre = _in_basis(multistart, multistart.layout.centre())
    if number == 0 and multistart.initial is not None:
        return None, _in_basis(multistart, multistart.initial), centre
    seed = multistart.training.seed + number
    return seed, *multistart.layout.start(number, np.random.default_rng(seed), centre)


def _in_basis(multistart: Multistart, theta: NDArray[np.float64]) -> NDArray[np.float64]:
    if multistart.to_plain.shape[0] == multistart.to_plain.shape[1]:
        return np.asarray(np.linalg.solve(multistart.to_plain, theta), dtype=np.float64)
    return np.asarray(np.linalg.lstsq(multistart.to_plain, theta, rcond=None)[0], dtype=np.float64)


def judged(multistart: Multistart, model: Network) -> tuple[float, int]:
    """Geometric mean over the selection traces: one trace on which every start fails must not choose alone.

    Args:
        multistart: The multistart, for its selection traces.
        model: A model.

    Returns:
        Of the mean squared errors, in the output's unit squared, or of several outputs in scaled numbers; NaN without
        selection traces. And on how many of these it leaves the tolerance of the training.
    """
    errors, unit = list[float](), model.scaling.error_unit / np.square(model.scaling.output_scale)
    shares, traces = list[NDArray[np.float64]](), multistart.selection
    spans = spans_of(traces, model.mapping.outputs) if traces else np.ones(1)
    for trace in traces:
        inputs, target = trace.columns(model.mapping.inputs), model.measured(trace)
        begun = beginning(model, inputs, target, multistart.start, trace.usable_samples, case=trace.name)
        n, history = begun.first, begun.history
        if multistart.training.loop is Loop.CLOSED:
            output = model.simulate(inputs[n:], history)
        else:
            output = gaps.predicted(model, inputs[n:], target[n:], history, trace.usable_samples[n:])
        off = (output - target[n:]).reshape(len(output), -1)
        counts = trace.counted(model.mapping.inputs, model.mapping.outputs)[n:]
        known = counts.any(axis=0)  # of an output that is masked throughout nothing can be told
        squared = np.array([np.mean(o[own] ** 2) if own.any() else 0.0 for o, own in zip(off.T, counts.T, strict=True)])
        errors += list((squared * unit)[known])
        shares.append(np.sqrt(squared) / spans)
    with np.errstate(divide="ignore"):  # a trace that is met exactly, such as a constant: the mean is 0
        mean = float(np.exp(np.mean(np.log(errors)))) if errors else float("nan")
    return mean, outside(shares, multistart.training.within)
