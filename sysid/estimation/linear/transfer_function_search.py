"""The search for the poles of a transfer function: dead times, several starts, the best one refined."""

from __future__ import annotations

import itertools
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, FitDivergedError
from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.estimation.least_squares.levenberg_marquardt import Iteration, LevenbergMarquardt
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.linear.pole_starts import PoleStart
from sysid.estimation.linear.transfer_function_uncertainty import transfer_function_uncertainty
from sysid.estimation.linear.uncertainty import Uncertainty
from sysid.estimation.linear.variable_projection import PoleParameters, SeparableProvider
from sysid.estimation.result import FitResult, Loop, Status
from sysid.models import AbstractModel, Mapping, Scaling, TransferFunction, TransferFunctionModel
from sysid.models.orthonormal_basis import Domain

MOST_COMBINATIONS = 30
"""Combinations of dead times up to which all are tried; above, one input at a time."""
SLOWEST = 5.0
"""Longest time constant of a stable pole, in lengths of the longest record."""


@dataclass(frozen=True, kw_only=True)
class TransferFunctionTraining:
    """How a transfer function is fitted.

    Args:
        max_iterations: Steps from the best start; 0 keeps the poles of the best start, such as those of the refined
            instrumental variables.
        short_iterations: Steps from every start, before the best one goes on.
        scattered_starts: Random starts beside the informed ones.
        stable: Keep all poles stable.
        max_delay: Largest dead time that is tried where the structure leaves it open, in samples.
        max_time_s: Wall time in seconds.
        seed: Of the random starts.

    Raises:
        ConfigError: If a number is negative.
    """

    max_iterations: int = 200
    short_iterations: int = 12
    scattered_starts: int = 2
    stable: bool = True
    max_delay: int = 4
    max_time_s: float = float("inf")
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("max_iterations", "short_iterations", "scattered_starts", "max_delay"):
            if getattr(self, name) < 0:
                raise ConfigError(
                    f"{name} is negative", expected="0 or more", got=getattr(self, name), remedy="correct it"
                )


@dataclass(frozen=True, kw_only=True)
class Terms:
    """What a model says about its channels.

    Args:
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        rest_output: Output at rest, in its unit.
    """

    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_unit: str
    rest_output: float


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
    delays: tuple[int, ...]
    provider: SeparableProvider
    theta: NDArray[np.float64]
    loss: float


@dataclass(frozen=True, kw_only=True, eq=False)
class _End:
    """Where a long run ended, or where it was cut short.

    Args:
        theta: Poles.
        status: Why there.
        curve: Learning curve of the whole run.
        notes: What a reader should know.
    """

    theta: NDArray[np.float64]
    status: Status
    curve: tuple[Iteration, ...]
    notes: tuple[str, ...]


class AbstractProblem(ABC):
    """Data and structure, for any dead times."""

    orders: TransferFunction
    training: TransferFunctionTraining
    scaling: Scaling
    terms: Terms

    @abstractmethod
    def provider(self, delays: tuple[int, ...], *, unknown: int | None = None) -> SeparableProvider:
        """The least-squares problem with these dead times.

        Args:
            delays: In samples, one per input.
            unknown: First samples of each record that do not count because an input came before it; by default the
                longest dead time. Dead times are compared on the same samples.

        Returns:
            The problem.
        """

    @abstractmethod
    def starts(self, provider: SeparableProvider, *, few: bool) -> list[PoleStart]:
        """Where to begin.

        Args:
            provider: The least-squares problem.
            few: Only what is needed to compare dead times.

        Returns:
            The starts.
        """

    def pole_parameters(self, longest: float) -> PoleParameters:
        """How the poles are described.

        Args:
            longest: Length of the longest record in samples.

        Returns:
            Poles whose time constants stay below ``SLOWEST`` records.
        """
        rate = 1.0 / (SLOWEST * longest)
        discrete = self.orders.domain is Domain.DISCRETE
        return PoleParameters(
            n_poles=self.orders.poles,
            domain=self.orders.domain,
            stable=self.training.stable,
            slowest=rate if discrete else rate / self.terms.sample_time,
        )

    def solve(
        self, began: float, on_iteration: Callable[[Iteration], None], score: Callable[[AbstractModel], float] | None
    ) -> FitResult:
        """Search dead times, run all starts shortly, and refine the best.

        Args:
            began: When the fit began, by ``time.perf_counter``.
            on_iteration: Called after every iteration of the final run.
            score: What chooses, smaller is better: every start is then refined, and the best of all models on the way
                (the start itself, after the short run, at the end) is kept. ``None`` to choose by the loss.

        Returns:
            The fit.

        Raises:
            FitDivergedError: If no start gives a finite free run.
        """
        delays = self._searched_delays() if self.orders.delays is None else self.orders.delays
        provider = self.provider(delays)
        candidates = [self._short_run(start, delays, provider) for start in self.starts(provider, few=False)]
        best = min(candidates, key=lambda candidate: candidate.loss)
        if not np.isfinite(best.loss):
            raise FitDivergedError(
                "no start gives a finite free run", last_state=best.theta, remedy="lower the number of poles"
            )
        if score is None:
            end = self._long_run(best, began, on_iteration)
        else:
            end = self._chosen(candidates, score, began, on_iteration)
        model, uncertainty = self._model(provider, end.theta, delays)
        unit = self.scaling.output_scale**2
        return FitResult(
            model=model,
            status=end.status,
            loop=Loop.CLOSED,
            history={
                "iteration": np.array([float(entry.iteration) for entry in end.curve]),
                "mse": np.array([entry.mse * unit for entry in end.curve]),
            },
            train_time_s=time.perf_counter() - began,
            seed=self.training.seed,
            uncertainty=uncertainty,
            notes=(*_notes(candidates, best, unit), *end.notes, _stability(model)),
        )

    def _long_run(self, candidate: Candidate, began: float, on_iteration: Callable[[Iteration], None]) -> _End:
        """Refine a candidate to a minimum."""
        left = self.training.max_time_s - (time.perf_counter() - began)
        limits = Termination(max_iterations=self.training.max_iterations, max_time_s=left, tolerance=1e-7, patience=6)
        engine = LevenbergMarquardt(termination=limits, evidence_after=None, on_iteration=on_iteration)
        solution = engine.minimise(candidate.provider, candidate.theta, flat_prior(len(candidate.theta)))
        # A run that cannot improve on its start began at the minimum that the short run had reached already.
        ended = solution.status in {Status.NOT_IMPROVED, Status.STALLED}
        return _End(
            theta=solution.theta, status=Status.CONVERGED if ended else solution.status, curve=solution.curve, notes=()
        )

    def _chosen(
        self,
        candidates: list[Candidate],
        score: Callable[[AbstractModel], float],
        began: float,
        on_iteration: Callable[[Iteration], None],
    ) -> _End:
        """The best by score of every start, as it is, after its short run, and at its minimum."""
        best, least = None, np.inf
        for candidate in candidates:
            if not np.isfinite(candidate.loss):
                continue
            end = self._long_run(candidate, began, on_iteration)
            first = candidate.provider.poles.theta(candidate.start.sections)
            early = Status.STOPPED_EARLY if self.training.max_iterations else end.status
            for theta, status, how in (
                (end.theta, end.status, "at its minimum"),
                (candidate.theta, early, "after a short run"),
                (first, early, "as it is"),
            ):
                value = score(self._model(candidate.provider, theta, candidate.delays)[0])
                if value < least or best is None:
                    note = f"Chosen by the selection traces: {candidate.start.name}, {how}."
                    best, least = replace(end, theta=theta, status=status, notes=(note,)), value
        if best is None:  # the caller has seen a finite loss
            raise FitDivergedError("no start gives a finite free run", remedy="lower the number of poles")
        return best

    def _model(
        self, provider: SeparableProvider, theta: NDArray[np.float64], delays: tuple[int, ...]
    ) -> tuple[TransferFunctionModel, Uncertainty]:
        separated = provider.separated(theta)
        if separated is None:
            raise FitDivergedError(
                "the free run at the end of the fit is not finite", last_state=theta, remedy="lower the number of poles"
            )
        model = TransferFunctionModel(
            orders=replace(self.orders, delays=delays),
            sections=provider.poles.sections(theta),
            taps=_split(separated.weights, self.orders.zeros),
            constant=float(separated.weights[provider.n_taps]) if provider.constant else 0.0,
            scaling=self.scaling,
            mapping=self.terms.mapping,
            sample_time=self.terms.sample_time,
            input_units=self.terms.input_units,
            output_unit=self.terms.output_unit,
            rest_output=self.terms.rest_output,
        )
        return model, transfer_function_uncertainty(model, provider, separated)

    def _searched_delays(self) -> tuple[int, ...]:
        """Dead times with the least loss: all combinations, or one input at a time where they are many."""
        m, most = len(self.orders.poles), self.training.max_delay
        least = 0 if self.orders.domain is Domain.CONTINUOUS else min(1, most)
        every = range(least, most + 1)
        if len(every) ** m <= MOST_COMBINATIONS:
            grid: list[tuple[int, ...]] = [tuple(k) for k in itertools.product(every, repeat=m)]
            return min(grid, key=self._loss_at)
        current: tuple[int, ...] = (least,) * m
        for _ in range(2):
            for j in range(m):
                trials = [(*current[:j], k, *current[j + 1 :]) for k in every]
                current = min(trials, key=self._loss_at)
        return current

    def _loss_at(self, delays: tuple[int, ...]) -> float:
        provider = self.provider(delays)
        return min(self._short_run(start, delays, provider).loss for start in self.starts(provider, few=True))

    def _short_run(self, start: PoleStart, delays: tuple[int, ...], provider: SeparableProvider) -> Candidate:
        theta = provider.poles.theta(start.sections)
        loss = provider.loss(theta)
        iterations = min(self.training.short_iterations, self.training.max_iterations)
        if np.isfinite(loss) and iterations:
            limits = Termination(max_iterations=iterations, tolerance=1e-6, patience=4)
            engine = LevenbergMarquardt(termination=limits, evidence_after=None)
            solution = engine.minimise(provider, theta, flat_prior(len(theta)))
            theta, loss = solution.theta, solution.at.loss
        return Candidate(start=start, delays=delays, provider=provider, theta=theta, loss=loss)


def flat_prior(n: int) -> Prior:
    """No prior: the loss alone is minimised.

    Args:
        n: Number of parameters.

    Returns:
        A prior of precision 0.
    """
    group = Group(name="poles", members=np.arange(n))
    return Prior(centre=np.zeros(n), groups=(group,), alphas=np.zeros(1), beta=1.0)


def _split(weights: NDArray[np.float64], n_zeros: tuple[int, ...]) -> tuple[NDArray[np.float64], ...]:
    """The taps of each input from the solution of the linear part."""
    ends = np.cumsum([zeros + 1 for zeros in n_zeros])
    return tuple(np.split(weights[: ends[-1]], ends[:-1]))


def _notes(candidates: list[Candidate], best: Candidate, unit: float) -> tuple[str, ...]:
    finite = [c for c in candidates if np.isfinite(c.loss)]
    mse = [2.0 * c.loss / c.provider.n_samples * unit for c in finite]
    return (
        f"Best of {len(candidates)} starts: {best.start.name}. After the short runs their mean squared errors lie "
        f"between {min(mse):.4g} and {max(mse):.4g}, median {float(np.median(mse)):.4g}.",
        f"Dead times in samples: {', '.join(map(str, best.delays))}.",
    )


def _stability(model: TransferFunctionModel) -> str:
    return f"The transfer function is {'stable' if model.stable else 'not stable'}."
