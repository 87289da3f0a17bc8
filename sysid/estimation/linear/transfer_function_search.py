"""The search for the poles of a transfer function: dead times, several starts, the best one refined."""

from __future__ import annotations

import dataclasses
import itertools
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, FitDivergedError
from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.estimation.least_squares.levenberg_marquardt import Iteration, LevenbergMarquardt
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.linear.pole_starts import PoleStart
from sysid.estimation.linear.poles import sections_of
from sysid.estimation.linear.transfer_function_uncertainty import transfer_function_uncertainty
from sysid.estimation.linear.variable_projection import PoleParameters, Sections, SeparableProvider
from sysid.estimation.nonparametric.dead_time import AROUND, descend
from sysid.estimation.result import FitResult, Loop, Status
from sysid.estimation.uncertainty import Uncertainty
from sysid.models import AbstractModel, Mapping, Scaling, TransferFunction, TransferFunctionModel
from sysid.models.orthonormal_basis import Domain, section_poles

FEW = 4
"""Dead times up to which every combination is tried, whatever a correlation says."""
NEAR_BEST = 1.1
"""Loss, relative to the least, up to which a minimum may be chosen by selection traces."""
MOST_POLES_CONTAINED = 4
"""Poles of all inputs up to which the structures that one contains are fitted as starts for it."""
AT_EDGE = (
    "The slowest pole stands at the end of its range, a time constant of five records: the plant may integrate, and "
    "these records cannot tell."
)
FASTEST = 30.0
"""Rate, times the sample time, of a pole that is there for no sample to see."""
SIGNIFICANT = 6.6
"""Drop of twice the log-likelihood that one more free parameter has by chance in one case of a hundred."""
MOST_COMBINATIONS = 30
"""Combinations of dead times up to which all are tried; above, one input at a time."""
COMPARED = 2
"""Starts, the best as they are, from which a dead time is tried."""
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
        stable: Keep all poles stable, or let them be wherever they are; ``None`` lets the data decide: poles at or
            outside the edge of stability are taken where those within it are significantly worse.
        max_delay: Largest dead time that is tried where the structure leaves it open, in samples; by default a third of
            the longest record.
        max_time_s: Wall time in seconds.
        seed: Of the random starts.

    Raises:
        ConfigError: If a number is negative.
    """

    max_iterations: int = 200
    short_iterations: int = 12
    scattered_starts: int = 2
    stable: bool | None = None
    max_delay: int | None = None
    max_time_s: float = float("inf")
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("max_iterations", "short_iterations", "scattered_starts", "max_delay"):
            if (getattr(self, name) or 0) < 0:
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
        delays: Dead time of each input in samples.
        provider: The least-squares problem.
        theta: Poles.
        status: Why there.
        curve: Learning curve of the whole run.
        notes: What a reader should know.
    """

    delays: tuple[int, ...]
    provider: SeparableProvider
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

    def delay_range(self) -> tuple[int, int]:
        """Shortest and longest dead time that is tried."""
        most = FEW if self.training.max_delay is None else self.training.max_delay
        return 0 if self.orders.domain is Domain.CONTINUOUS else min(1, most), most

    def likely_delays(self, least: int, most: int) -> list[list[int]]:  # noqa: ARG002 - spectra do not show places
        """For each input the dead times about which to look.

        Args:
            least: The shortest.
            most: The longest.

        Returns:
            Likely ones, the likeliest first.
        """
        return [[least]] * len(self.orders.poles)

    def with_orders(self, orders: TransferFunction) -> Self:
        """The same data for another structure.

        Args:
            orders: The structure.

        Returns:
            The problem.
        """
        return dataclasses.replace(self, orders=orders)  # type: ignore[type-var]

    def unbounded(self) -> Self | None:
        """The same problem with poles anywhere; ``None`` where that means nothing."""
        return None

    def free_starts(self, provider: SeparableProvider) -> list[PoleStart]:  # noqa: ARG002 - see the base class
        """Starts whose poles need not be stable.

        Args:
            provider: The least-squares problem.

        Returns:
            The starts, that which the data suggest first.
        """
        return []

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
            stable=self.training.stable is not False,
            slowest=rate if discrete else rate / self.terms.sample_time,
        )

    def solve(
        self, began: float, on_iteration: Callable[[Iteration], None], score: Callable[[AbstractModel], float] | None
    ) -> FitResult:
        """Search dead times, run all starts to their minima, and take the best.

        Args:
            began: When the fit began, by ``time.perf_counter``.
            on_iteration: Called after every iteration of the final run.
            score: What chooses between the minima of all starts, smaller is better; ``None`` to choose by the loss.

        Returns:
            The fit.

        Raises:
            FitDivergedError: If no start gives a finite free run.
        """
        delays, told = (self.orders.delays, ()) if self.orders.delays is not None else self._searched_delays()
        provider = self.provider(delays)
        candidates = [self._short_run(start, delays, provider) for start in self.starts(provider, few=False)]
        candidates += self._contained(provider, delays)
        best = min(candidates, key=lambda candidate: candidate.loss)
        if not np.isfinite(best.loss):
            raise FitDivergedError(
                "no start gives a finite free run", last_state=best.theta, remedy="lower the number of poles"
            )
        if score is None:
            end = self._long_run(best, began, on_iteration)
        else:
            end = self._chosen(candidates, score, began, on_iteration)
        problem, end = self._free_poles(end, delays, (began, on_iteration), score)
        model, uncertainty = problem._model(end.provider, end.theta, end.delays)
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
            notes=(
                *_notes(candidates, best, unit),
                f"Dead times in samples: {', '.join(map(str, end.delays))}.",
                *(told if problem is self else ()),
                *end.notes,
                _stability(model),
            ),
        )

    def _contained(self, provider: SeparableProvider, delays: tuple[int, ...]) -> list[Candidate]:
        """The minima of the structures that this one contains, as starts: it may not fit worse than any of them."""
        found = []
        for orders in _next_smaller(self.orders):
            smaller = self.with_orders(orders)
            inner = smaller.provider(delays)
            runs = [smaller._unrun(start, delays, inner) for start in smaller.starts(inner, few=True)]
            runs += smaller._contained(inner, delays)
            run = min(runs, key=lambda one: one.loss)
            if np.isfinite(run.loss):
                end = smaller._long_run(run, time.perf_counter(), _ignore)
                sections = _filled_up(inner.poles.sections(end.theta), self.orders, self.terms.sample_time)
                found.append(self._short_run(PoleStart(name=f"{orders.label}", sections=sections), delays, provider))
        return found

    def _free_poles(
        self,
        end: _End,
        delays: tuple[int, ...],
        watched: tuple[float, Callable[[Iteration], None]],
        score: Callable[[AbstractModel], float] | None,
    ) -> tuple[AbstractProblem, _End]:
        """The same without bounds on the poles, where the data ask for it: plants that integrate, or are unstable.

        A pole beyond the edge is taken where the one within is significantly worse, and one at 1 where that is not.
        """
        free = self.unbounded() if self.training.stable is None else None
        if free is None:
            return self, end
        domain, sample_time, provider = self.orders.domain, self.terms.sample_time, free.provider(delays)
        edge = 1.0 - 1.0 / max(len(record.target) for record in provider.records)
        sections = end.provider.poles.sections(end.theta)
        slowest = _slowness(sections, domain, sample_time)
        if max(slowest, _slowness(free.free_starts(provider)[0].sections, domain, sample_time)) < edge:
            return self, end
        at_end = replace(end, notes=(*end.notes, AT_EDGE)) if slowest >= edge else end
        told: tuple[str, ...] = ()
        if self.orders.delays is None:  # those of a plant that cannot integrate need not be those of one that does
            delays, told = free._searched_delays()
            provider = free.provider(delays)
        starts = [*free.free_starts(provider), PoleStart(name="the best bounded one", sections=sections)]
        best = min((free._short_run(start, delays, provider) for start in starts), key=lambda run: run.loss)
        if not np.isfinite(best.loss):
            return self, at_end
        found = replace(free._long_run(best, *watched), notes=told)
        n, power = provider.n_samples, sum(float(np.sum((r.target * r.root_weights) ** 2)) for r in provider.records)
        inside, loss = end.provider.loss(end.theta) / end.provider.n_samples, provider.loss(found.theta) / n
        # Poles may be anywhere in a plant that few samples say much of, but not for the sake of their noise: beyond
        # chance, the gain must be one that as many parameters as there are, fitted to it, could not have.
        size = sum(self.orders.poles) + provider.n_taps
        if not _worse(inside, loss, n, power / n, free=size):
            return self, at_end
        if score is not None and not score(free._model(provider, found.theta, delays)[0]) < score(
            self._model(end.provider, end.theta, end.delays)[0]
        ):
            return self, at_end
        moved = _at_one(provider.poles.sections(found.theta), domain, sample_time, 5.0 * (1.0 - edge))
        theta = provider.poles.theta(moved)
        if not _worse(provider.loss(theta) / n, loss, n, power / n):
            found = replace(found, theta=theta)
        return free, found

    def _long_run(self, candidate: Candidate, began: float, on_iteration: Callable[[Iteration], None]) -> _End:
        """Refine a candidate to a minimum."""
        left = self.training.max_time_s - (time.perf_counter() - began)
        limits = Termination(max_iterations=self.training.max_iterations, max_time_s=left, tolerance=1e-7, patience=6)
        engine = LevenbergMarquardt(termination=limits, evidence_after=None, on_iteration=on_iteration)
        solution = engine.minimise(candidate.provider, candidate.theta, flat_prior(len(candidate.theta)))
        # A run that cannot improve on its start began at the minimum that the short run had reached already.
        ended = solution.status in {Status.NOT_IMPROVED, Status.STALLED}
        return _End(
            delays=candidate.delays,
            provider=candidate.provider,
            theta=solution.theta,
            status=Status.CONVERGED if ended else solution.status,
            curve=solution.curve,
            notes=(),
        )

    def _chosen(
        self,
        candidates: list[Candidate],
        score: Callable[[AbstractModel], float],
        began: float,
        on_iteration: Callable[[Iteration], None],
    ) -> _End:
        """The best by score of the minima that the starts lead to; one much worse than another is no fit."""
        ends = [(one, self._long_run(one, began, on_iteration)) for one in candidates if np.isfinite(one.loss)]
        losses = [one.provider.loss(end.theta) for one, end in ends]
        near = [pair for pair, loss in zip(ends, losses, strict=True) if loss <= NEAR_BEST * min(losses)]
        scores = [score(self._model(one.provider, end.theta, one.delays)[0]) for one, end in near]
        one, end = near[int(np.argmin(scores))]
        return replace(end, notes=(f"Chosen among {len(near)} minima by the selection traces: {one.start.name}.",))

    def _model(
        self, provider: SeparableProvider, theta: NDArray[np.float64], delays: tuple[int, ...]
    ) -> tuple[TransferFunctionModel, Uncertainty | None]:
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
        # Of errors through a mirrored predictor the derivatives at fixed numerators are not known.
        known = None if separated.mirrored else transfer_function_uncertainty(model, provider, separated)
        return model, known

    def _searched_delays(self) -> tuple[tuple[int, ...], tuple[str, ...]]:
        """Dead times with the least loss, and what is to be said of the search."""
        m = len(self.orders.poles)
        least, most = self.delay_range()
        few = range(least, min(FEW, most) + 1)
        known: dict[tuple[int, ...], float] = {}
        reach = [0]

        def loss(delays: tuple[int, ...]) -> float:
            if delays not in known:
                known[delays] = self._loss_at(delays, reach[0])
            return known[delays]

        # Losses are compared on the same samples: those whose inputs are in the record for the longest dead time.
        places = self.likely_delays(least, most)
        reach[0] = min(most, max(FEW, *(place for of in places for place in of)) + 2 * AROUND)
        if len(few) ** m <= MOST_COMBINATIONS:
            starts: list[tuple[int, ...]] = [tuple(k) for k in itertools.product(few, repeat=m)]
        else:
            starts = [(least,) * m, (few[-1],) * m]
        starts += [tuple(of[min(i, len(of) - 1)] for of in places) for i in range(max(len(of) for of in places))]
        ranked = sorted(dict.fromkeys(starts), key=loss)
        best = min((descend(start, least, reach[0], loss) for start in ranked[:2]), key=loss)
        while max(best) == reach[0] < most:  # at the end of what was compared: further
            reach[0] = min(most, 2 * reach[0])
            known.clear()
            best = descend(best, least, reach[0], loss)
        if max(best) < most:
            return best, ()
        return best, (
            f"The dead time of {max(best)} samples is the longest that was tried: the true one may be longer. Longer "
            "records, or max_delay, allow more.",
        )

    def _loss_at(self, delays: tuple[int, ...], unknown: int) -> float:
        provider = self.provider(delays, unknown=unknown)
        begun = [self._unrun(start, delays, provider) for start in self.starts(provider, few=True)]
        worth = sorted(begun, key=lambda one: one.loss)[:COMPARED]
        return min(self._short_run(one.start, delays, provider).loss for one in worth)

    @staticmethod
    def _unrun(start: PoleStart, delays: tuple[int, ...], provider: SeparableProvider) -> Candidate:
        theta = provider.poles.theta(start.sections)
        return Candidate(start=start, delays=delays, provider=provider, theta=theta, loss=provider.loss(theta))

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
    )


def _stability(model: TransferFunctionModel) -> str:
    if model.stable:
        return "The transfer function is stable."
    poles = np.concatenate([model.poles(j) for j in range(len(model.sections))])
    discrete = model.orders.domain is Domain.DISCRETE
    away = np.abs(poles) - 1.0 if discrete else poles.real
    at_edge = int(np.count_nonzero(np.abs(away) <= 1e-9 * (1.0 if discrete else float(np.abs(poles).max()) or 1.0)))
    if float(away.max()) <= 1e-9 * (1.0 if discrete else float(np.abs(poles).max()) or 1.0):
        word = {1: "An integrator", 2: "A double integrator"}.get(at_edge, f"{at_edge} poles at the edge")
        return f"The transfer function is not stable: {word.lower()}; an error of its input adds up for ever."
    largest = poles[int(np.argmax(away))]
    return (
        f"The transfer function is not stable: the pole {complex(largest):.6g} lies outside; its free run grows "
        "without bound, and it is of use in a loop only."
    )


def _ignore(_: Iteration) -> None:
    """The callback of those who do not watch."""


def _next_smaller(orders: TransferFunction) -> list[TransferFunction]:
    """The structures with one zero or one pole less that are special cases of this one; none of large ones."""
    if sum(orders.poles) > MOST_POLES_CONTAINED:
        return []
    found = []
    for j, (poles, zeros) in enumerate(zip(orders.poles, orders.zeros, strict=True)):
        if zeros > 0:
            found.append(replace(orders, zeros=(*orders.zeros[:j], zeros - 1, *orders.zeros[j + 1 :])))
        elif poles > 1:
            found.append(replace(orders, poles=(*orders.poles[:j], poles - 1, *orders.poles[j + 1 :])))
    return found


def _filled_up(sections: Sections, orders: TransferFunction, sample_time: float) -> Sections:
    """The same poles, and fast ones where some are missing."""
    filled = []
    for part, n in zip(sections, orders.poles, strict=True):
        poles = np.concatenate([section_poles(d, orders.domain) for d in part])
        extra = np.full(n - len(poles), 0.01)
        if orders.domain is Domain.CONTINUOUS:
            # Faster than any sample shows, and one that has run away is brought back to there.
            limit = FASTEST / sample_time
            poles = np.where(np.abs(poles) < limit, poles, -limit)
            extra = np.full(n - len(poles), -limit)
        filled.append(sections_of(np.concatenate([poles, extra]).astype(np.complex128), orders.domain))
    return tuple(filled)


def _poles(sections: Sections, domain: Domain, sample_time: float) -> NDArray[np.complex128]:
    """All poles in the z plane."""
    poles = np.concatenate([section_poles(d, domain) for part in sections for d in part])
    return poles if domain is Domain.DISCRETE else np.asarray(np.exp(poles * sample_time), dtype=np.complex128)


def _slowness(sections: Sections, domain: Domain, sample_time: float) -> float:
    return float(np.abs(_poles(sections, domain, sample_time)).max())


def _worse(loss: float, than: float, n: int, scale: float, *, free: int = 0) -> bool:
    """Whether a loss is significantly worse than another; below rounding all losses are one."""
    floor = 1e-20 * max(scale, np.finfo(np.float64).tiny)
    if not np.isfinite(loss):
        return True
    left = max(n - 2 * free, 1)
    return bool(left * np.log((loss + floor) / (than + floor)) > SIGNIFICANT + free * np.log(n))


def _at_one(sections: Sections, domain: Domain, sample_time: float, near: float) -> Sections:
    """Poles that are no further from 1 than records can tell, put at 1."""
    snapped = []
    for part in sections:
        poles = np.concatenate([section_poles(d, domain) for d in part])
        if domain is Domain.DISCRETE:
            poles = np.where(np.abs(poles - 1.0) < near, 1.0, poles)
        else:
            poles = np.where(np.abs(poles) * sample_time < near, 0.0, poles)
        snapped.append(sections_of(poles.astype(np.complex128), domain))
    return tuple(snapped)
