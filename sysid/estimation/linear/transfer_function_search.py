"""The search for the poles of a transfer function: dead times, several starts, the best one refined.

A structure may not fit the estimation record worse than one that it contains. So the structures with one zero or one
pole less are fitted first, each as it would be alone; their minima are starts, and where the search ends above one of
them all the same, it goes on from there.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sysid.errors import FitDivergedError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.levenberg_marquardt import Iteration
from sysid.estimation.linear.delay_search import FEW, READ_BACKWARDS, searched_delays
from sysid.estimation.linear.pole_moves import at_one, filled_up, next_smaller, slowness
from sysid.estimation.linear.pole_starts import PoleStart
from sysid.estimation.linear.transfer_function_runs import EXACT, Candidate, End, Watch, long_run, short_run, tried
from sysid.estimation.linear.transfer_function_training import Terms, TransferFunctionTraining
from sysid.estimation.linear.transfer_function_uncertainty import transfer_function_uncertainty
from sysid.estimation.linear.transfer_function_words import AT_EDGE, of_speed, of_stability, of_starts
from sysid.estimation.linear.variable_projection import PoleParameters, Sections, SeparableProvider
from sysid.estimation.nonparametric.dead_time import descend
from sysid.estimation.results.result import FitResult, Loop
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import AbstractModel, Scaling, TransferFunction, TransferFunctionModel
from sysid.models.converting.orthonormal_basis import Domain
from sysid.models.orders import intersample

NEAR_BEST = 1.1
"""Loss, relative to the least, up to which a minimum may be chosen by selection traces."""
COMPARED = 2
"""Starts, the best as they are, from which a dead time is tried."""
SLOWEST = 5.0
"""Longest time constant of a stable pole, in lengths of the longest record."""
SAME, NEAR = 1e-9, 1e-6
"""Relative difference of two losses that is none; and of one that was not run to its end."""
QUICK = 4
"""Steps over all samples by which a dead time is compared with its neighbours."""

Score = Callable[[AbstractModel], float] | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Reached:
    """Where the search in one structure ended.

    Args:
        problem: In which: with poles anywhere where the data ask for it.
        end: The minimum.
        notes: What a reader should know.
    """

    problem: AbstractProblem
    end: End
    notes: tuple[str, ...]


class AbstractProblem(ABC):
    """Data and structure, for any dead times."""

    orders: TransferFunction
    training: TransferFunctionTraining
    scaling: Scaling
    terms: Terms
    as_scored: Score = None
    """Of a model its error over the records from the start that was declared, where one was."""

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
    def starts(self, provider: SeparableProvider, *, few: bool, alone: bool = True) -> list[PoleStart]:
        """Where to begin.

        Args:
            provider: The least-squares problem.
            few: Only what is needed to compare dead times.
            alone: Whether no minimum of a smaller structure stands beside them; what takes long may stay away then.

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

    def told(self, end: End) -> tuple[str, ...]:  # noqa: ARG002 - points of a spectrum have no order in time
        """What a reader should know of the errors at an end.

        Args:
            end: The end.

        Returns:
            Notes.
        """
        return ()

    def part(self) -> Self | None:
        """The same problem on some samples of long records; ``None`` where all are looked at throughout."""
        return None

    def about_part(self) -> str:
        """What is told of a fit whose starts were compared on this part."""
        return ""

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

    def solve(self, began: float, on_iteration: Callable[[Iteration], None], score: Score) -> FitResult:
        """Search dead times, run all starts to their minima, and take the best.

        Args:
            began: When the fit began, by ``sysid.estimation.clock.now``.
            on_iteration: Called after every iteration of the final run.
            score: What chooses between the minima of all starts, smaller is better; ``None`` to choose by the loss.

        Returns:
            The fit.

        Raises:
            FitDivergedError: If no start gives a finite free run.
        """
        watch = Watch(began=began, on_iteration=on_iteration)
        part = self.part() if self.training.max_iterations else None
        from_part = None if part is None else self._from_part(part, watch, score)
        if from_part is None:
            delays, told = self._delays()
            reached = self._reached(delays, watch, score, {})
        else:
            reached, told = from_part
        if reached is None:
            raise FitDivergedError("no start gives a finite free run", remedy="lower the number of poles")
        end, unit = reached.end, self.scaling.output_scale**2
        model, uncertainty = reached.problem._model(end)
        fast = of_speed(model)
        return FitResult(
            model=model,
            status=end.status,
            loop=Loop.CLOSED,
            history={
                "iteration": np.array([float(entry.iteration) for entry in end.curve]),
                "mse": np.array([entry.mse * unit for entry in end.curve]),
            },
            train_time_s=now() - began,
            seed=self.training.seed,
            uncertainty=uncertainty,
            notes=(
                *reached.notes,
                f"Dead times in samples: {', '.join(map(str, end.delays))}."
                + intersample.told(self.orders.moving(self.terms.mapping.inputs), self.terms.mapping.inputs),
                *(told if reached.problem is self else ()),
                *end.notes,
                *self.told(end),
                of_stability(model),
                *fast,
            ),
            warnings=(*fast, *(one for one in told if one == READ_BACKWARDS)),
        )

    def _delays(self) -> tuple[tuple[int, ...], tuple[str, ...]]:
        """Those of the structure, or those of least error, and what is to be said of them."""
        return (self.orders.delays, ()) if self.orders.delays is not None else self._searched_delays()

    def _from_part(self, part: AbstractProblem, watch: Watch, score: Score) -> tuple[Reached, tuple[str, ...]] | None:
        """The minimum over all samples next to that of a part of them, and what is to be said of its dead times.

        Returns:
            Both; ``None`` where the part misleads: poles or dead times stand at its edge, or a start that was found
            over all samples leads further down.
        """
        delays, told = part._delays()
        if self.orders.delays is None and max(delays) + FEW >= part.delay_range()[1]:
            return None
        found = part._reached(delays, watch.unseen(), score, {})
        if found is None or found.problem is not part or AT_EDGE in found.end.notes:
            return None
        sections = found.end.sections
        if self.orders.delays is None:
            delays = self._delays_near(delays, sections)
        provider = self.provider(delays)
        begun = tried(PoleStart(name="stretches", sections=sections), delays, provider)
        end = long_run(begun, self.training, watch)
        rivals = [tried(start, delays, provider) for start in self.starts(provider, few=True)]
        rival = short_run(min(rivals, key=lambda one: one.loss).start, delays, provider, self.training)
        if not end.loss * provider.n_samples * (1.0 - NEAR) <= rival.loss:
            return None
        problem, end = self._free_poles(end, delays, watch, score)
        end = end if problem.training.stable is self.training.stable else problem._snapped(end, np.inf)
        return Reached(problem=problem, end=end, notes=(*found.notes, part.about_part())), told

    def _delays_near(self, delays: tuple[int, ...], sections: Sections) -> tuple[int, ...]:
        """Dead times of least error over all samples, by descent from those of a part of them and its poles."""
        least, most = self.delay_range()
        reach, quick = min(most, max(delays) + FEW), replace(self.training, short_iterations=QUICK)
        start, known = PoleStart(name="stretches", sections=sections), dict[tuple[int, ...], float]()

        def loss(of: tuple[int, ...]) -> float:
            if of not in known:
                known[of] = short_run(start, of, self.provider(of, unknown=reach), quick).loss
            return known[of]

        return descend(delays, least, reach, loss)

    def _reached(
        self, delays: tuple[int, ...], watch: Watch, score: Score, known: dict[TransferFunction, Reached | None]
    ) -> Reached | None:
        """The minimum in this structure, not above that of any which it contains; ``None`` where none is finite."""
        smaller = self._smaller(delays, watch, known)
        least = min(smaller, key=lambda one: one.end.loss, default=None)
        provider = self.provider(delays)
        starts = self.starts(provider, few=False, alone=least is None)
        if least is not None:
            sections = filled_up(least.end.sections, self.orders, self.terms.sample_time)
            starts.append(PoleStart(name=least.problem.orders.label, sections=sections))
        candidates = [short_run(start, delays, provider, self.training) for start in starts]
        best = min(candidates, key=lambda candidate: candidate.loss)
        if not np.isfinite(best.loss):
            return None
        end = self._chosen(candidates, score, watch) if score else long_run(best, self.training, watch)
        problem, end = self._free_poles(end, delays, watch, score)
        if least is not None:
            problem, end = self._not_above(least, problem, end, watch, slack=1.0 if score is None else NEAR_BEST)
        ceiling = np.inf if least is None or least.end.loss < end.loss else least.end.loss
        end = end if problem.training.stable is self.training.stable else problem._snapped(end, ceiling)
        notes = of_starts(candidates, best, self.scaling.output_scale**2)
        return Reached(problem=problem, end=end, notes=notes)

    def _smaller(
        self, delays: tuple[int, ...], watch: Watch, known: dict[TransferFunction, Reached | None]
    ) -> list[Reached]:
        """What the structures that this one contains reach, each as it would alone."""
        found = []
        for orders in next_smaller(replace(self.orders, delays=delays)) if self.training.max_iterations else []:
            if orders not in known and now() - watch.began < self.training.max_time_s:
                known[orders] = self.with_orders(orders)._reached(delays, watch.unseen(), None, known)
            reached = known.get(orders)
            if reached is not None:
                found.append(reached)
        return found

    def _not_above(
        self, least: Reached, problem: AbstractProblem, end: End, watch: Watch, *, slack: float
    ) -> tuple[AbstractProblem, End]:
        """The end, or where a run from the minimum of a smaller structure ends if it lies above that."""
        ceiling = least.end.loss * slack * (1.0 + SAME) + EXACT * least.end.power
        if end.loss <= ceiling:
            return problem, end
        other = least.problem.with_orders(replace(self.orders, delays=least.end.delays))
        provider = other.provider(least.end.delays)
        sections = filled_up(least.end.sections, self.orders, self.terms.sample_time)
        begun = tried(PoleStart(name=least.problem.orders.label, sections=sections), least.end.delays, provider)
        if not np.isfinite(begun.loss):
            return problem, end
        found = long_run(begun, self.training, watch)
        if not found.loss < end.loss:
            return problem, end
        same = other.training.stable is self.training.stable
        return self if same else other, replace(found, notes=least.end.notes)

    def _snapped(self, end: End, ceiling: float) -> End:
        """The end with poles at 1 that are no further from there than the records can tell."""
        snapped = self._at_one(end)
        above = snapped.loss > ceiling * (1.0 + SAME) + EXACT * end.power
        if above or snapped.worse_than(end):
            return end
        return snapped

    def _at_one(self, end: End) -> End:
        """The end with all poles at 1 that records of this length do not tell from there."""
        near = 5.0 / max(len(record.target) for record in end.provider.records)
        moved = at_one(end.sections, self.orders.domain, self.terms.sample_time, near)
        snapped = replace(end, theta=end.provider.poles.theta(moved))
        return replace(snapped, curve=(*end.curve[:-1], replace(end.curve[-1], mse=2.0 * snapped.loss)))

    def _free_poles(self, end: End, delays: tuple[int, ...], watch: Watch, score: Score) -> tuple[AbstractProblem, End]:
        """The same without bounds on the poles, where the data ask for it: plants that integrate, or are unstable.

        A pole beyond the edge is taken where the one within is significantly worse, and one at 1 where that is not.
        """
        free = self.unbounded() if self.training.stable is None else None
        if free is None:
            return self, end
        domain, sample_time, provider = self.orders.domain, self.terms.sample_time, free.provider(delays)
        edge = 1.0 - 1.0 / max(len(record.target) for record in provider.records)
        slowest = slowness(end.sections, domain, sample_time)
        # A search among stable poles may put a dead time in place of an integrator: the shortest is asked, too.
        asked = {delays} if self.orders.delays is not None else {delays, (self.delay_range()[0],) * len(delays)}
        suggested = [free.free_starts(free.provider(one))[0].sections for one in sorted(asked)]
        if max(slowest, *(slowness(sections, domain, sample_time) for sections in suggested)) < edge:
            return self, end
        at_end = replace(end, notes=(*end.notes, AT_EDGE)) if slowest >= edge else end
        told: tuple[str, ...] = ()
        if self.orders.delays is None:  # those of a plant that cannot integrate need not be those of one that does
            delays, told = free._searched_delays()
            provider = free.provider(delays)
        starts = [*free.free_starts(provider), PoleStart(name="the best bounded one", sections=end.sections)]
        runs = (short_run(start, delays, provider, free.training) for start in starts)
        best = min(runs, key=lambda run: run.loss)
        if not np.isfinite(best.loss):
            return self, at_end
        found = replace(long_run(best, free.training, watch), notes=told)
        # Poles may be anywhere in a plant that few samples say much of, but not for the sake of their noise: beyond
        # chance, the gain must be one that as many parameters as there are, fitted to it, could not have.
        if not at_end.worse_than(found, free=sum(self.orders.poles) + provider.n_taps):
            return self, at_end
        # Free poles are fitted from a free state. What begins where a start says has to follow from there as well: a
        # pole that is off 1 by little has an equilibrium where no plant ever was.
        judge = score or self.as_scored
        if judge is not None:
            found = min((found, free._at_one(found)), key=lambda one: judge(free._model(one)[0]))
            if not judge(free._model(found)[0]) < judge(self._model(end)[0]):
                return self, at_end
        return free, found

    def _chosen(self, candidates: list[Candidate], score: Callable[[AbstractModel], float], watch: Watch) -> End:
        """The best by score of the minima that the starts lead to; one much worse than another is no fit."""
        ends = [(one, long_run(one, self.training, watch)) for one in candidates if np.isfinite(one.loss)]
        least = min(end.loss for _, end in ends)
        near = [(one, end) for one, end in ends if end.loss <= NEAR_BEST * least]
        scores = [score(self._model(end)[0]) for _, end in near]
        one, end = near[int(np.argmin(scores))]
        return replace(end, notes=(f"Chosen among {len(near)} minima by the selection traces: {one.start.name}.",))

    def _model(self, end: End) -> tuple[TransferFunctionModel, Uncertainty | None]:
        provider = end.provider
        separated = provider.separated(end.theta)
        if separated is None:
            raise FitDivergedError(
                "the free run at the end of the fit is not finite",
                last_state=end.theta,
                remedy="lower the number of poles",
            )
        model = TransferFunctionModel(
            orders=replace(self.orders, delays=end.delays),
            sections=end.sections,
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
        least, most = self.delay_range()
        found, told = searched_delays(self.likely_delays(least, most), least, most, self.loss_at)
        direct = self.direct(found) if least > 0 else found
        return direct, told if direct == found else (*told, READ_BACKWARDS)

    def direct(self, delays: tuple[int, ...]) -> tuple[int, ...]:
        """Dead times, none where an input clearly acts within the sample; of spectra they stay.

        Args:
            delays: Those that were found, from 1 on.

        Returns:
            The dead times.
        """
        return delays

    def loss_at(self, delays: tuple[int, ...], unknown: int) -> float:
        """The loss of some dead times after a short search, where so many first samples of a record do not count."""
        provider = self.provider(delays, unknown=unknown)
        begun = [tried(start, delays, provider) for start in self.starts(provider, few=True)]
        worth = sorted(begun, key=lambda one: one.loss)[:COMPARED]
        return min(short_run(one.start, delays, provider, self.training).loss for one in worth)


def _split(weights: NDArray[np.float64], n_zeros: tuple[int, ...]) -> tuple[NDArray[np.float64], ...]:
    """The taps of each input from the solution of the linear part."""
    ends = np.cumsum([zeros + 1 for zeros in n_zeros])
    return tuple(np.split(weights[: ends[-1]], ends[:-1]))
