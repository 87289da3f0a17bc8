r"""Levenberg-Marquardt with Bayesian regularisation, put together from its seams.

With residuals :math:`e(\theta)` (weighted, in scaled numbers), prior centre :math:`\mu` and precisions :math:`\alpha`
and :math:`\beta` (``prior``), what is minimised is the negative logarithm of the posterior over :math:`\beta`,

.. math::
    F(\theta) = \tfrac12\|e(\theta)\|^2 + \tfrac12(\theta-\mu)^T\Lambda(\theta-\mu),
    \qquad \Lambda = \mathrm{diag}(\alpha/\beta) \quad (\text{``ridge``}),

the first term being ``at.loss`` and the second ``prior.penalty``. Linearising :math:`e(\theta + \delta) \approx e +
J\delta` gives the model

.. math::
    F(\theta + \delta) \approx F(\theta) + g^T\delta + \tfrac12\delta^T H\delta, \qquad
    g = J^T e + \Lambda(\theta - \mu), \qquad H = J^T J + \Lambda .

It is trusted near :math:`\theta` only. Minimising it over :math:`\|D^{1/2}\delta\| \le \Delta` leads to

.. math:: (H + \lambda D)\,\delta = -g, \qquad D = \mathrm{diag}(\text{``damping.scale``}),

with a :math:`\lambda \ge 0` that goes with :math:`\Delta` (Moré 1978, lemma 2.1): a trust region whose radius is
steered through :math:`\lambda` (``damping.factor``) by the gain ratio

.. math:: \rho = \frac{F(\theta) - F(\theta + \delta)}{-(g^T\delta + \frac12\delta^T H\delta)}

(``gain`` over ``promised``). An iteration is

1. the **provider** linearises the residuals: :math:`J^T e` and :math:`J^T J`;
2. the **damping** raises :math:`D` to the diagonal of :math:`H`;
3. the **linear solve** gives :math:`\delta`, by Cholesky of :math:`R(H + \lambda D)R` with :math:`R =
   \mathrm{diag}(H)^{-1/2}`, so that rounding does not see the parameters' units; where the provider has **bounds**,
   what would leave them is held there and the others are solved for again (an active set, Nocedal and Wright 2006,
   section 16.5);
4. the step is taken if :math:`\rho >` ``MIN_GAIN``, and :math:`\lambda` becomes the smaller the better the promise was
   kept, at least a third of itself; otherwise :math:`\lambda` grows, each time twice as fast (Nielsen 1999), and step 3
   is repeated at the price of one run over the records;
5. from ``evidence_after`` on, the **evidence** moves :math:`\alpha` and :math:`\beta` (``regularisation.py``);
6. the **termination** decides whether to go on: no improvement of ``at.loss`` over some iterations, no step that helps
   at any damping, or a limit.

Since the evidence moves :math:`F` itself, progress is judged by ``at.loss`` alone, and :math:`F` may rise from one
iteration to the next.

Geodesic acceleration (Transtrum and Sethna 2012, "Improvements to the Levenberg-Marquardt algorithm for nonlinear
least-squares minimization", section 4) was tried and left out: its second directional derivative costs another pass
over the sensitivities, 1.5 times the time of an iteration; at equal time it changed the error by a factor of 0.9
(geometric mean over four starts of a free-run fit with 20 neurons; two were better and two worse).

Limits: finds a local minimum, a different one from each start; at a minimum with large residuals convergence is linear,
for want of second derivatives; one dense :math:`p \times p` factorisation a step, so for networks of some thousand
parameters at most.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.clock import now
from sysid.estimation.least_squares.damping import DAMPINGS, DEFAULT
from sysid.estimation.least_squares.damping.base import AbstractDamping
from sysid.estimation.least_squares.evidence import Prior, update
from sysid.estimation.least_squares.minimum import at_minimum, stands
from sysid.estimation.least_squares.provider import AbstractProvider
from sysid.estimation.least_squares.small_matrices import add_to_diagonal, cholesky, solved
from sysid.estimation.least_squares.state import Iteration, Solution, State
from sysid.estimation.least_squares.termination import MAX_DAMPING, Termination
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.results.result import Status

MIN_GAIN = 1e-4
"""Smallest share of the promised decrease for which a step is taken (Nocedal and Wright 2006, algorithm 4.1)."""

MOST_OF_THE_WAY = 0.9
"""To a bound at which there is no run, in one step."""


def _ignore(_: Iteration) -> None:
    """The callback of those who do not watch."""


@dataclass(frozen=True, kw_only=True)
class LevenbergMarquardt:
    """The engine.

    Args:
        termination: When to stop.
        damping: Damping to begin with.
        evidence_after: Iterations before the precisions are first updated, if it does not come to a minimum sooner:
            while the fit is far from one, its residuals say nothing about noise. ``None`` keeps the prior as it is.
        on_iteration: Called after every iteration.
        on_state: Given where the fit stands after every iteration, before ``on_iteration``: who keeps it has kept what
            is announced.
        should_stop: Asked after every iteration; true ends the fit with the status ``INTERRUPTED``.
    """

    termination: Termination = field(default_factory=Termination)
    damping: AbstractDamping = field(default_factory=DAMPINGS[DEFAULT])
    evidence_after: int | None = 20
    on_iteration: Callable[[Iteration], None] = _ignore
    on_state: Callable[[State], None] = lambda _: None
    should_stop: Callable[[], bool] = lambda: False

    def minimise(self, provider: AbstractProvider, theta: NDArray[np.float64], prior: Prior) -> Solution:
        """Fit the parameters from a start.

        Args:
            provider: Residuals and Jacobians.
            theta: Start, shape ``(n_parameters,)``.
            prior: Centre and precisions to begin with.

        Returns:
            The solution; it is never worse than the start.
        """
        # BLAS threads that wake for matrices of this size cost more than they give (measured: 92 ms an epoch of
        # 20,000 x 281 with two threads, 45 ms with one); the second core is better spent on another start.
        with one_blas_thread():
            at = provider.linearise(theta, correlation=False)
        first = State(theta=theta, at=at, damping=self.damping, prior=prior)
        return self.resume(provider, self._record(first, provider, 0.0))

    def minimise_within(self, provider: AbstractProvider, theta: NDArray[np.float64], prior: Prior) -> Solution:
        """Fit the parameters as a part of a longer computation, which goes on from what is found.

        Args:
            provider: Residuals and Jacobians.
            theta: Start, shape ``(n_parameters,)``.
            prior: Centre and precisions to begin with.

        Returns:
            The solution.

        Raises:
            KeyboardInterrupt: If that came: half of a start is no start, and the rest would go on as if nothing had.
        """
        found = self.minimise(provider, theta, prior)
        if found.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        return found

    def resume(
        self, provider: AbstractProvider, state: State, *, first_loss: float | None = None, spent_s: float = 0.0
    ) -> Solution:
        """Go on with a fit.

        An interruption from the keyboard ends the fit, not the program: the best parameters so far come
        back with the status ``INTERRUPTED``.

        Args:
            provider: Residuals and Jacobians, as in the run before.
            state: Where that run stood.
            first_loss: Loss that has to be improved on: the state's by default; that of the run's start where a run
                that was cut off goes on.
            spent_s: Seconds of the time limit that such a run has spent already.

        Returns:
            The solution; it is never worse than the state.
        """
        first, before = state.at.loss if first_loss is None else first_loss, state.curve[-1].elapsed_s
        started = now()
        status: Status | None = None
        with one_blas_thread():
            try:
                while status is None:
                    elapsed = spent_s + now() - started
                    status = self.termination.check(
                        iteration=state.iteration, elapsed=elapsed, losses=state.losses, damping=state.damping.factor
                    )
                    if status is None and stands(state, provider):
                        status = Status.CONVERGED
                    if self._is_to_be_heard(status, state, provider):
                        state, status = self._heard(state, provider), None
                    if status is None:
                        state = self._step(state, provider)
                        state = self._record(state, provider, before + now() - started)
                    if self.should_stop():
                        status = Status.INTERRUPTED
            except KeyboardInterrupt:
                status = Status.INTERRUPTED
            if np.isnan(state.at.correlation_time):  # who makes something of the solution may ask the evidence
                state = replace(state, at=provider.linearise(state.theta))
        if status is Status.STALLED and at_minimum(state, provider):
            status = Status.CONVERGED
        if status is Status.STALLED and state.at.loss >= first:
            status = Status.NOT_IMPROVED
        return Solution(state=state, status=status)

    def _step(self, state: State, provider: AbstractProvider) -> State:
        ridge = state.prior.precision / state.prior.beta
        H = state.at.gauss_newton.copy()
        add_to_diagonal(H, ridge)
        g = state.at.gradient + ridge * (state.theta - state.prior.centre)
        now = state.at.loss + state.prior.penalty(state.theta)
        damping = state.damping.scaled_by(np.diag(H))
        bounds = box = provider.bounds
        while damping.factor <= MAX_DAMPING:
            step = _bounded(state.theta, box, (H, damping, g))
            trial = provider.nearest(state.theta + step)
            trial = trial if box is None else np.clip(trial, *box)  # a bound exactly
            with np.errstate(over="ignore", invalid="ignore"):  # what is promised is then no number, and nothing gained
                promised = -float(g @ step + 0.5 * step @ (H @ step))
            loss = provider.loss(trial)
            if bounds is not None and box is bounds and not np.isfinite(loss):
                box = _short_of(bounds, state.theta)
                if not np.array_equal(np.clip(trial, *box), trial):
                    continue
            gain = (now - loss - state.prior.penalty(trial)) / promised if promised > 0.0 else -1.0
            if gain > MIN_GAIN:
                at = provider.linearise(trial, correlation=self._asks(state, state.iteration + 1))
                if at.finite:
                    damping, further = damping.accepted(gain), state.iteration + 1
                    state = replace(state, theta=trial, at=at, damping=damping, iteration=further)
                    return self._with_evidence(state, provider)
            damping = damping.rejected()
        return replace(state, damping=damping, iteration=state.iteration + 1)

    def _asks(self, state: State, iteration: int) -> bool:
        """Whether the evidence is asked after an iteration: from the first time on always."""
        return self.evidence_after is not None and (iteration >= self.evidence_after or state.evidence is not None)

    def _is_to_be_heard(self, status: Status | None, state: State, provider: AbstractProvider) -> bool:
        """Whether a fit would end at a minimum of precisions that nobody has asked the evidence about."""
        if self.evidence_after is None or state.evidence is not None or not state.at.finite:
            return False
        return status is Status.CONVERGED or (status is Status.STALLED and at_minimum(state, provider))

    def _heard(self, state: State, provider: AbstractProvider) -> State:
        """The precisions by the evidence at a minimum, from which the fit goes on as if it began there."""
        at = provider.linearise(state.theta)
        prior, evidence = update(state.prior, state.theta, at, provider.n_samples)
        return replace(state, at=at, prior=prior, evidence=evidence, losses=(at.loss,), damping=self.damping)

    def _with_evidence(self, state: State, provider: AbstractProvider) -> State:
        if not self._asks(state, state.iteration):
            return state
        prior, evidence = update(state.prior, state.theta, state.at, provider.n_samples)
        return replace(state, prior=prior, evidence=evidence)

    def _record(self, state: State, provider: AbstractProvider, elapsed: float) -> State:
        entry = Iteration(
            iteration=state.iteration,
            mse=2.0 * state.at.loss / provider.n_samples,
            damping=state.damping.factor,
            effective_parameters=state.evidence.total_effective_parameters if state.evidence else float("nan"),
            elapsed_s=elapsed,
        )
        # The objective moves with the precisions, so progress is judged by the residuals' part alone.
        state = replace(state, losses=(*state.losses, state.at.loss), curve=(*state.curve, entry))
        self.on_state(state)
        self.on_iteration(entry)
        return state


def _short_of(
    bounds: tuple[NDArray[np.float64], NDArray[np.float64]], theta: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Bounds most of the way from where a fit stands: at the others there is no run, as of a volume of 0.

    More damping, in place of it, would hold all other parameters where they are.
    """
    low, high = (theta + MOST_OF_THE_WAY * (side - theta) for side in bounds)
    return low, high


def _bounded(
    theta: NDArray[np.float64],
    bounds: tuple[NDArray[np.float64], NDArray[np.float64]] | None,
    terms: tuple[NDArray[np.float64], AbstractDamping, NDArray[np.float64]],
) -> NDArray[np.float64]:
    """The damped step that stays within bounds: what would leave them goes as far as it may, the others adapt to it.

    A parameter that stands at a bound, and that the gradient draws out of it, stays.
    """
    if bounds is None:
        return _solve(*terms)
    H, damping, g = terms
    low, high = bounds[0] - theta, bounds[1] - theta
    step = np.zeros(len(theta))
    free = ~(((low >= 0.0) & (g > 0.0)) | ((high <= 0.0) & (g < 0.0)))
    while free.any():
        rest = g[free] + H[np.ix_(free, ~free)] @ step[~free]
        scale = None if damping.scale is None else damping.scale[free]
        step[free] = _solve(H[np.ix_(free, free)], replace(damping, scale=scale), rest)
        out = free & ((step < low) | (step > high))
        if not out.any():
            break
        step[out] = np.clip(step, low, high)[out]
        free &= ~out
    return np.clip(step, low, high)


def _solve(H: NDArray[np.float64], damping: AbstractDamping, g: NDArray[np.float64]) -> NDArray[np.float64]:
    """The damped step; scaled by its diagonal first, so that the factorisation does not see the units."""
    scale = damping.scale if damping.scale is not None else np.ones(len(g))
    root = 1.0 / np.sqrt(np.maximum(np.diag(H), np.finfo(np.float64).tiny))
    # A start whose free run explodes may have sensitivities near the largest number; its step is then not a number.
    with np.errstate(over="ignore", invalid="ignore"):
        A = H * root[:, None] * root[None, :]
        add_to_diagonal(A, damping.factor * scale * root**2)
        rescaled = root * g
    factor = cholesky(A) if np.isfinite(rescaled).all() else None
    # Not positive definite to working precision, or not finite: no step, and the caller damps more.
    return np.zeros(len(g)) if factor is None else -root * solved(factor, rescaled)
