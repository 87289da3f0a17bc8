"""Runs of the engine over the poles: tried, run a few steps, run to the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.clock import now
from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.state import Iteration
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.linear.pole_starts import PoleStart
from sysid.estimation.linear.transfer_function.training import TransferFunctionTraining
from sysid.estimation.linear.variable_projection import Sections, SeparableProvider
from sysid.estimation.results.result import Status

Delays = tuple[float, ...]
"""Dead time of each input in samples; those of a continuous transfer function may end between two."""
SIGNIFICANT = 6.6
"""Drop of twice the log-likelihood that one more free parameter has by chance in one case of a hundred."""
EXACT = 1e-20
"""Loss, as a part of the output's mean square, below which rounding is all that there is."""


@dataclass(frozen=True, kw_only=True)
class Watch:
    """When a fit began, and who watches.

    Args:
        began: By ``sysid.estimation.clock.now``.
        on_iteration: Called after every iteration of a long run.
    """

    began: float
    on_iteration: Callable[[Iteration], None]

    def unseen(self) -> Watch:
        """The same clock, watched by nobody."""
        return Watch(began=self.began, on_iteration=lambda _: None)


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """A start, and where the short run from it ended.

    Args:
        start: The start.
        delays: Dead time of each input in samples.
        provider: The least-squares problem.
        theta: Poles after the short run.
        loss: There; infinite where the model runs away.
    """

    start: PoleStart
    delays: Delays
    provider: SeparableProvider
    theta: NDArray[np.float64]
    loss: float


@dataclass(frozen=True, kw_only=True, eq=False)
class End:
    """Where a long run ended, or where it was cut short.

    Args:
        delays: Dead time of each input in samples.
        provider: The least-squares problem.
        theta: Poles.
        status: Why there.
        curve: Learning curve of the whole run.
        notes: What a reader should know.
    """

    delays: Delays
    provider: SeparableProvider
    theta: NDArray[np.float64]
    status: Status
    curve: tuple[Iteration, ...]
    notes: tuple[str, ...]

    @property
    def loss(self) -> float:
        """Per sample."""
        return self.provider.loss(self.theta) / max(self.provider.n_samples, 1)

    @property
    def sections(self) -> Sections:
        """The denominators."""
        return self.provider.poles.sections(self.theta)

    @property
    def power(self) -> float:
        """Weighted mean square of the output, which losses are small beside."""
        total = sum(float(np.sum((r.target * r.root_weights) ** 2)) for r in self.provider.records)
        return total / max(self.provider.n_samples, 1)

    @property
    def lengths(self) -> list[int]:
        """Samples of each record."""
        return [len(record.target) for record in self.provider.records]

    @property
    def errors(self) -> list[NDArray[np.float64]]:
        """Weighted, of each record, shape ``(n_rows, 1)``; none where the model runs away."""
        separated = self.provider.separated(self.theta)
        if separated is None:
            return []
        ends = np.cumsum(self.lengths)
        return [one[:, np.newaxis] for one in np.split(separated.residual, ends[:-1])]

    def worse_than(self, other: End, *, free: int = 0) -> bool:
        """Whether the loss is significantly larger.

        Args:
            other: Another end.
            free: Parameters that the other one was chosen among, beyond what chance would have one gain.

        Returns:
            Whether it is; below rounding all losses are one.
        """
        loss, than, n = self.loss, other.loss, other.provider.n_samples
        floor = EXACT * max(other.power, np.finfo(np.float64).tiny)
        if not np.isfinite(loss):
            return True
        left = max(n - 2 * free, 1)
        return bool(left * np.log((loss + floor) / (than + floor)) > SIGNIFICANT + free * np.log(n))


def tried(start: PoleStart, delays: Delays, provider: SeparableProvider) -> Candidate:
    """A start as it is.

    Args:
        start: The start.
        delays: Dead time of each input in samples.
        provider: The least-squares problem.

    Returns:
        Its loss.
    """
    theta = provider.poles.theta(start.sections)
    return Candidate(start=start, delays=delays, provider=provider, theta=theta, loss=provider.loss(theta))


def short_run(
    start: PoleStart, delays: Delays, provider: SeparableProvider, training: TransferFunctionTraining
) -> Candidate:
    """A few steps from a start.

    Args:
        start: The start.
        delays: Dead time of each input in samples.
        provider: The least-squares problem.
        training: How many.

    Returns:
        Where they lead.
    """
    begun = tried(start, delays, provider)
    iterations = min(training.short_iterations, training.max_iterations)
    if not (np.isfinite(begun.loss) and iterations):
        return begun
    limits = Termination(max_iterations=iterations, tolerance=1e-6, patience=4)
    engine = LevenbergMarquardt(termination=limits, evidence_after=None)
    solution = engine.minimise_within(provider, begun.theta, flat_prior(len(begun.theta)))
    return Candidate(start=start, delays=delays, provider=provider, theta=solution.theta, loss=solution.at.loss)


def long_run(candidate: Candidate, training: TransferFunctionTraining, watch: Watch) -> End:
    """Refine a candidate to a minimum.

    Args:
        candidate: Where to begin.
        training: How far.
        watch: Who watches.

    Returns:
        The minimum.
    """
    left = training.max_time_s - (now() - watch.began)
    limits = Termination(max_iterations=training.max_iterations, max_time_s=left, tolerance=1e-7, patience=6)
    engine = LevenbergMarquardt(termination=limits, evidence_after=None, on_iteration=watch.on_iteration)
    solution = engine.minimise(candidate.provider, candidate.theta, flat_prior(len(candidate.theta)))
    # A run that cannot improve on its start began at the minimum that the short run had reached already.
    ended = solution.status in {Status.NOT_IMPROVED, Status.STALLED}
    return End(
        delays=candidate.delays,
        provider=candidate.provider,
        theta=solution.theta,
        status=Status.CONVERGED if ended else solution.status,
        curve=solution.curve,
        notes=(),
    )


def flat_prior(n: int) -> Prior:
    """No prior: the loss alone is minimised.

    Args:
        n: Parameters.

    Returns:
        The prior.
    """
    group = Group(name="poles", members=np.arange(n))
    return Prior(centre=np.zeros(n), groups=(group,), alphas=np.zeros(1), beta=1.0)
