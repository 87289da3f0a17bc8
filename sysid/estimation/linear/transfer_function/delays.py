"""The dead times of a transfer function: those of the structure, or those whose short runs leave the least."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sysid.estimation.linear.delay_search import CHANCE, READ_BACKWARDS, searched_delays
from sysid.estimation.linear.pole_starts import PoleStart
from sysid.estimation.linear.poles import too_fast
from sysid.estimation.linear.transfer_function.problem import AbstractProblem
from sysid.estimation.linear.transfer_function.runs import EXACT, Candidate, Delays, short_run, tried
from sysid.estimation.nonparametric.dead_time import AROUND, around
from sysid.models.converting.orthonormal_basis import Domain, section_poles

COMPARED = 2
"""Starts, the best as they are, from which a dead time is tried."""


def found_delays(problem: AbstractProblem) -> tuple[Delays, tuple[str, ...]]:
    """Those of the structure, or those of least error.

    Args:
        problem: Data and structure.

    Returns:
        The dead times, and what is to be said of them.
    """
    return (problem.orders.delays, ()) if problem.orders.delays is not None else delays_of_least_error(problem)


def delays_of_least_error(problem: AbstractProblem) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Dead times with the least loss.

    A record whose inputs stand at first is taken to begin at rest: a step may be all that shows a long dead time. But
    an input that moved just before the record began shows no sooner. Where other dead times leave clearly less without
    these samples, all are looked for without them.

    Args:
        problem: Data and structure.

    Returns:
        The dead times, and what is to be said of the search.
    """
    least, most = problem.delay_range()
    found, told = DelaySearch(problem=problem).run(least, most)
    moved = problem.begun_in_motion()
    if moved is not None and DelaySearch(problem=moved).contradicts(found, least, most):
        found, told = DelaySearch(problem=moved).run(least, most)
    direct = problem.direct(found) if least > 0 else found
    return direct, told if direct == found else (*told, READ_BACKWARDS)


@dataclass(kw_only=True, eq=False)
class DelaySearch:
    """Dead times by the losses that short runs come to.

    Args:
        problem: Data and structure.
        reached: By dead times where the short runs ended.
    """

    problem: AbstractProblem
    reached: dict[Delays, Candidate] = field(default_factory=dict)

    def run(self, least: int, most: int) -> tuple[tuple[int, ...], tuple[str, ...]]:
        """Those of least loss, and what is to be said of the search.

        Args:
            least: The shortest that is tried.
            most: The longest.

        Returns:
            Both.
        """
        places = self.problem.likely_delays(least, most)
        gain = -float(np.expm1(-CHANCE / max(self.problem.provider((least,) * len(places)).n_samples, 1)))
        return searched_delays(places, least, most, self.loss_at, self.loss_near, gain=gain)

    def contradicts(self, delays: tuple[int, ...], least: int, most: int) -> bool:
        """Whether others next to some dead times clearly leave less.

        Args:
            delays: Those of another search.
            least: The shortest that is tried.
            most: The longest.

        Returns:
            Whether they do.
        """
        reach = min(most, max(delays) + 2 * AROUND)
        first = self.loss_at(delays, reach)
        if not 0.0 < first < np.inf:
            return False
        others = [other for j in range(len(delays)) for other in around(delays, j, least, reach)]
        lowest = min((self.loss_near(other, reach) for other in others), default=first)
        count = self.reached[delays].provider.n_samples
        return count * float(np.log(first / max(lowest, EXACT * first))) > CHANCE

    def loss_at(self, delays: tuple[int, ...], unknown: int) -> float:
        """After short runs from starts of their own.

        Args:
            delays: In samples.
            unknown: First samples of each record that do not count.

        Returns:
            The loss.
        """
        provider = self.problem.provider(delays, unknown=unknown)
        begun = [tried(start, delays, provider) for start in self.problem.starts(provider, few=True)]
        worth = sorted(begun, key=lambda one: one.loss)[:COMPARED]
        runs = [short_run(one.start, delays, provider, self.problem.training) for one in worth]
        self.reached[delays] = min(runs, key=lambda one: one.loss)
        return self.reached[delays].loss

    def loss_near(self, delays: tuple[int, ...], unknown: int) -> float:
        """After a short run from the poles of the best next to them: a sample more of an input hardly moves those.

        A dead time that is too long has poles run away to where they do nothing, from where no run comes back.

        Args:
            delays: In samples.
            unknown: First samples of each record that do not count.

        Returns:
            The loss.
        """
        near = [one for of, one in self.reached.items() if max(abs(np.subtract(of, delays))) <= AROUND]
        best = min(near, key=lambda one: one.loss, default=None)
        if best is None or not np.isfinite(best.loss) or self._run_away(best):
            return self.loss_at(delays, unknown)
        start = PoleStart(name="next to it", sections=best.provider.poles.sections(best.theta))
        provider = self.problem.provider(delays, unknown=unknown)
        self.reached[delays] = short_run(start, delays, provider, self.problem.training)
        return self.reached[delays].loss

    def _run_away(self, found: Candidate) -> bool:
        """Whether poles lie where a record shows nothing of them."""
        if self.problem.orders.domain is Domain.DISCRETE:
            return False
        each = [section_poles(d, Domain.CONTINUOUS) for of in found.provider.poles.sections(found.theta) for d in of]
        return bool(len(too_fast(np.concatenate(each), self.problem.terms.sample_time)))
