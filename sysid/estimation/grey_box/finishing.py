"""How the fit of a grey box ends: outputs weighed, switches sharpened, and steps as short as its parameters need."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.clock import now
from sysid.estimation.grey_box.preparing import ROUNDS, SHARPER, seen_terms
from sysid.estimation.grey_box.provider import EquationProvider
from sysid.estimation.grey_box.stepping import ACCURACY, Stepping, substeps_for
from sysid.estimation.least_squares.damping import DAMPINGS
from sysid.estimation.least_squares.evidence import update
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.minimum import at_minimum
from sysid.estimation.least_squares.state import Solution
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.networks.starts import multistart as starts
from sysid.estimation.networks.training import Training
from sysid.estimation.parameters.findings import with_evidence
from sysid.estimation.parameters.named import Named, named_of
from sysid.estimation.results.result import Status
from sysid.models.grey_box.grey_box_model import EquationModel, GreyBoxModel, VectorGreyBoxModel

Array = NDArray[np.float64]

SAME = 1e-4
"""By how much the loss of exact switches may differ from that of soft ones and be the same."""

NOISE_ROUNDS, WIDEST, ALIKE = 3, 1e4, 0.05
"""Times that outputs are weighed anew; by how much their errors may differ; and below which difference they are alike,
as a natural logarithm."""

BY_CHANCE, SHOWN_AT_KINKS = 0.1, 1e-6
"""What a step that does not improve may promise at a kink, for each parameter, in losses of one sample, where chance
takes one; and the part of the strongest curvature that a direction must have there."""

PRIOR_ROUNDS = 10
"""Times that declared priors are weighed anew."""

SHARE_OF_ERROR, FINEST = 0.03, 1e-8
"""What a step may add to the errors that remain, as a share of them; and the least that is asked of it."""

STEP_ROUNDS = 2
"""Times that a fit goes on with shorter steps because its parameters turned out to need them."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ready:
    """A fit that can begin: the model but for its parameters, the records, and where the parameters start.

    Whether a free run there tells something of the records (``runs``), or windows had to, says how starts begin.
    """

    template: GreyBoxModel | VectorGreyBoxModel
    provider: EquationProvider
    theta: Array
    stepping: Stepping
    runs: bool = True

    @property
    def named(self) -> tuple[Named, ...]:
        """The parameters with a name, as they are trained."""
        return named_of(self.template.grey, self.template.cases, self.template.lowered.n_weights)

    @property
    def to_plain(self) -> Array:
        """From what is trained to the model's parameters."""
        return np.eye(len(self.provider.scale), self.provider.n_parameters) * self.provider.scale[:, None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Done:
    """A fit that has ended: the candidate, over the records as they were run last, and what was seen on the way."""

    candidate: starts.Candidate
    provider: EquationProvider
    stepping: Stepping
    softened: float

    @property
    def model(self) -> EquationModel:
        """The model."""
        found = self.candidate.model
        assert isinstance(found, EquationModel)  # noqa: S101 - the template's class
        return found


def settled(candidate: starts.Candidate, provider: EquationProvider) -> starts.Candidate:
    """A candidate with its evidence, and the status of one whose gradient is zero to rounding, or nearly so at a kink.

    Where a bend of a curve passes over a sample, the loss has a kink: a minimum there has a gradient on either side,
    and no step improves it. What such a fit has still been promised is then less than chance decides.

    Args:
        candidate: A start at its last checkpoint.
        provider: The records.

    Returns:
        The candidate.
    """
    solution = with_evidence(candidate.solution, provider.n_samples)
    kinked = BY_CHANCE * provider.n_parameters / provider.n_samples
    if solution.status in {Status.STALLED, Status.NOT_IMPROVED} and (
        at_minimum(solution.state, provider)
        or (solution.status is Status.STALLED and at_minimum(solution.state, provider, kinked, shown=SHOWN_AT_KINKS))
    ):
        solution = replace(solution, status=Status.CONVERGED)
    return replace(candidate, solution=solution)


def finished(ready: Ready, chosen: starts.Candidate, training: Training, *, until: float, stopped: bool) -> Done:
    """The chosen candidate with switches as they are, and with steps that its parameters need.

    Args:
        ready: What the fit began with.
        chosen: The candidate.
        training: How it was trained.
        until: When it has to have ended, on the clock of ``sysid.estimation.clock.now``.
        stopped: Whether somebody asked it to stop: then nothing is trained any more.

    Returns:
        The fit.
    """
    provider, solution, stepping = ready.provider, chosen.solution, ready.stepping
    softened = float("nan")
    scored = None if stopped else _as_scored(provider, solution)
    if scored is not None:
        provider, solution = scored
        solution = _gone_on(provider, solution, training, until, iterations=training.max_iterations)
    if provider.form.n_outputs > 1 and not stopped:
        provider, solution = _weighed(provider, solution, training, until)
    if any(one.parameter.prior is not None for one in ready.named) and training.regularisation is None and not stopped:
        solution = _balanced(provider, solution, training, until)
    if provider.form.lowered.switches and not stopped:
        provider, solution, softened = _sharpened(provider, solution, training, until)
    exact = provider.with_form(replace(provider.form, widths=np.zeros(len(provider.form.widths))))
    if ready.template.grey.substeps is None and not stopped:
        for _ in range(STEP_ROUNDS):
            stepping = replace(
                substeps_for(exact, solution.theta, _accuracy(solution, exact)), explicit=stepping.explicit
            )
            if stepping.substeps <= provider.form.substeps or np.isnan(stepping.change):
                stepping = replace(stepping, substeps=provider.form.substeps)
                break
            provider, exact = (
                one.with_form(replace(one.form, substeps=stepping.substeps)) for one in (provider, exact)
            )
            solution = _gone_on(provider, solution, training, until)
    seen, _ = seen_terms(exact, solution.theta)
    model = replace(
        ready.template,
        theta=ready.to_plain @ solution.theta,
        levels=tuple(map(float, seen.terms.level)),
        spans=tuple(map(float, seen.terms.scale)),
        substeps=provider.form.substeps,
    )
    candidate = settled(replace(chosen, solution=solution, model=model), provider)
    return Done(candidate=candidate, provider=provider, stepping=stepping, softened=softened)


def _as_scored(provider: EquationProvider, solution: Solution) -> tuple[EquationProvider, Solution] | None:
    """Records begun as where runs are scored, where these would be others; and the fit, its states in their terms.

    What first samples show of a state depends on what it ranges over: at the parameters that were found, as the model
    will have it, which may be far from where it ranged at the declared start.
    """
    if not any(record.n_first for record in provider.records):
        return None
    seen, begun = seen_terms(provider, solution.theta)
    state, ranged = solution.state, provider.with_form(seen)
    theta = ranged.with_states(state.theta, begun)
    scored = ranged.as_scored(theta)
    if scored is None:
        return None
    prior = replace(state.prior, centre=ranged.with_states(state.prior.centre, begun))
    return scored, replace(solution, state=replace(state, theta=theta, prior=prior))


def _weighed(
    provider: EquationProvider, solution: Solution, training: Training, until: float
) -> tuple[EquationProvider, Solution]:
    """Outputs over what is left of each: a noisy one does not blur what a clean one shows of the states they share."""
    for _ in range(NOISE_ROUNDS):
        noise = noise_of(provider, solution.theta)
        before = np.ones(len(noise)) if provider.noise is None else provider.noise
        if np.abs(np.log(noise / before)).max() < ALIKE:
            break
        provider = replace(provider, noise=noise)
        solution = _gone_on(provider, solution, training, until)
    return provider, solution


def noise_of(provider: EquationProvider, theta: Array) -> Array:
    """How much is left of each output, relative to the others.

    Args:
        provider: The records.
        theta: What is trained.

    Returns:
        Shape ``(n_outputs,)``, its geometric mean 1.
    """
    left = provider.left(theta)
    left = np.maximum(left, max(float(left.max()) / WIDEST, np.finfo(np.float64).eps))
    return np.asarray(left / np.exp(np.mean(np.log(left))))


def _balanced(provider: EquationProvider, solution: Solution, training: Training, until: float) -> Solution:
    """Declared priors weighed against the noise that is left: a fit may converge before its evidence has spoken."""
    for _ in range(PRIOR_ROUNDS):
        state, before = solution.state, solution.at.loss
        prior, _ = update(state.prior, state.theta, state.at, provider.n_samples)
        solution = _gone_on(provider, replace(solution, state=replace(state, prior=prior)), training, until)
        if not solution.at.loss < (1.0 - ALIKE) * before:  # what is left says what the noise is
            break
    return solution


def _accuracy(solution: Solution, provider: EquationProvider) -> float:
    """How exact a step has to be so that what the records leave is not the step's doing."""
    left = (2.0 * solution.at.loss / max(provider.n_samples, 1)) ** 0.5
    return float(np.clip(SHARE_OF_ERROR * left, FINEST, ACCURACY))


def _sharpened(
    provider: EquationProvider, solution: Solution, training: Training, until: float
) -> tuple[EquationProvider, Solution, float]:
    """Switches sharper and sharper, as long as the run with exact ones gains by it.

    Returns:
        The records with the switches of the best, the best, and its exact loss over the soft one.
    """
    exact = provider.with_form(replace(provider.form, widths=np.zeros(len(provider.form.widths))))
    best, tried = (exact.loss(solution.theta), provider, solution), list[float]()
    now, at = provider, solution
    while len(tried) < ROUNDS and not abs(best[0] - best[2].at.loss) <= SAME * best[2].at.loss:
        tried.append(best[0])
        now = now.with_form(replace(now.form, widths=SHARPER * now.form.widths))
        at = _gone_on(now, at, training, until)
        loss = exact.loss(at.theta)
        if loss < best[0]:
            best = (loss, now, at)
    soft = best[2].at.loss
    return best[1], best[2], best[0] / soft if soft > 1e-200 else 1.0


def _gone_on(
    provider: EquationProvider, solution: Solution, training: Training, until: float, *, iterations: int = 0
) -> Solution:
    """The same fit under records that are run otherwise."""
    seconds = max(until - now(), 0.0)
    iterations = iterations or max(20, training.max_iterations // 5)
    engine = LevenbergMarquardt(
        termination=Termination(
            max_iterations=iterations, max_time_s=seconds, tolerance=training.tolerance, patience=10
        ),
        damping=DAMPINGS[training.damping](),
        evidence_after=5 if training.regularisation is None else None,
    )
    found = engine.minimise(provider, solution.theta, solution.state.prior)
    done, spent = solution.state.iteration, solution.curve[-1].elapsed_s
    further = [replace(one, iteration=done + one.iteration, elapsed_s=spent + one.elapsed_s) for one in found.curve[1:]]
    state = replace(found.state, curve=(*solution.curve, *further), iteration=done + found.state.iteration)
    return replace(found, state=state)
