"""Dead times that end between samples, as nearly every plant's do: found next to the best whole numbers of them.

About the best whole dead time the loss is a parabola, from where a plant's own lies: three points of it say whether the
record asks for another, which a search between two samples then finds. It is taken where it leaves significantly less.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.linear.delay_search import CHANCE
from sysid.estimation.linear.pole_starts import PoleStart
from sysid.estimation.linear.transfer_function.problem import AbstractProblem, Score
from sysid.estimation.linear.transfer_function.runs import (
    EXACT,
    Candidate,
    Delays,
    End,
    Watch,
    long_run,
    short_run,
    tried,
)
from sysid.estimation.linear.variable_projection import Sections
from sysid.models.converting.orthonormal_basis import Domain

APART = 0.25
"""Part of a sample from a whole dead time at which the loss is looked at first."""
ROUNDS, STEPS, CLOSE = 3, 12, 1e-4
"""Rounds over several inputs, losses that are looked at for each, and part of a sample within which it is found."""
QUICK = 6
"""Steps from the poles of the best dead time so far."""
WORTH = 1.0
"""Drop of twice the log-likelihood that a parabola has to promise."""
MOVED = 1e-2
"""Part of a sample below which a round has changed nothing."""


def between_samples(problem: AbstractProblem, end: End, watch: Watch, score: Score) -> End:
    """The end with dead times that end between samples, where the record asks for them.

    Args:
        problem: Data and structure.
        end: With whole dead times that were searched.
        watch: Who watches.
        score: What has to be no worse; ``None`` where the loss alone decides.

    Returns:
        The other end, or the same.
    """
    own = problem.orders
    if own.domain is Domain.DISCRETE or own.delays is not None or not problem.training.max_iterations:
        return end
    separated = end.provider.separated(end.theta)
    if separated is None or separated.mirrored:
        return end
    search = _Search.about(problem, end)
    if search is None or not search.run():
        return end
    begun = PoleStart(name="between samples", sections=search.sections)
    found = long_run(tried(begun, search.delays, problem.provider(search.delays)), problem.training, watch)
    if not np.isfinite(found.loss) or (score and not score(problem.model(found)[0]) <= score(problem.model(end)[0])):
        return end
    return replace(found, notes=end.notes)


@dataclass(kw_only=True, eq=False)
class _Search:
    """Dead times about whole ones, by the losses of short runs over the same samples.

    Args:
        problem: Data and structure.
        reach: First samples of each record that do not count: no dead time is longer.
        whole: Where it began.
        best: The best so far.
    """

    problem: AbstractProblem
    reach: int
    whole: Candidate
    best: Candidate

    @classmethod
    def about(cls, problem: AbstractProblem, end: End) -> _Search | None:
        reach = min(math.ceil(max(end.delays)) + 1, max(problem.delay_range()[1], math.ceil(max(end.delays))))
        provider = problem.provider(end.delays, unknown=reach)
        start = PoleStart(name="whole samples", sections=end.sections)
        begun = short_run(start, end.delays, provider, problem.training)
        return cls(problem=problem, reach=reach, whole=begun, best=begun) if np.isfinite(begun.loss) else None

    @property
    def delays(self) -> Delays:
        return self.best.delays

    @property
    def sections(self) -> Sections:
        return self.best.provider.poles.sections(self.best.theta)

    def run(self) -> bool:
        """Whether others than the whole ones leave significantly less."""
        for _ in range(ROUNDS):
            before = self.delays
            for j in range(len(before)):
                self._along(j)
            if len(before) == 1 or max(np.abs(np.subtract(before, self.delays))) < MOVED:
                break
        return self.delays != self.whole.delays

    def _along(self, j: int) -> None:
        """Move the dead time of one input to where the loss is least, if that is significantly less."""
        begun, here = self.best, self.delays[j]
        self._least_about(j, here)
        if self._drop(begun.loss, self.best.loss) < CHANCE:
            self.best = begun

    def _least_about(self, j: int, here: float) -> None:
        low, high = max(here - 1.0, 0.0), min(here + 1.0, float(self.reach))
        points = [one for one in (here - APART, here, here + APART) if low <= one <= high]
        losses = [self._at(j, one) for one in points]
        place, least = _vertex(np.array(points), np.array(losses))
        if place == here or self._drop(losses[points.index(here)], least) < WORTH:
            return
        first = math.floor(min(max(place, low), high - 1e-9))
        ends = max(low, first), min(first + 1.0, high)
        scipy.optimize.minimize_scalar(
            lambda delay: self._at(j, float(delay)), bounds=ends, method="bounded",
            options={"maxiter": STEPS, "xatol": CLOSE},
        )  # fmt: skip

    def _at(self, j: int, delay: float) -> float:
        delays = (*self.delays[:j], delay, *self.delays[j + 1 :])
        if delays == self.delays:
            return self.best.loss
        few = replace(self.problem.training, short_iterations=QUICK)
        start = PoleStart(name="next to it", sections=self.sections)
        found = short_run(start, delays, self.problem.provider(delays, unknown=self.reach), few)
        if found.loss < self.best.loss:
            self.best = found
        return found.loss

    def _drop(self, loss: float, other: float) -> float:
        """By how much twice the log-likelihood grows."""
        power = sum(float(np.sum((r.target * r.root_weights) ** 2)) for r in self.whole.provider.records)
        floor = 0.5 * EXACT * max(power, np.finfo(np.float64).tiny)
        return self.whole.provider.n_samples * float(np.log((loss + floor) / (max(other, 0.0) + floor)))


def _vertex(x: NDArray[np.float64], losses: NDArray[np.float64]) -> tuple[float, float]:
    """Place and height of the lowest point of a parabola; where it has none, the lowest of its points and no loss."""
    if len(x) == 3 and np.isfinite(losses).all():
        bend, slope, _ = np.polyfit(x - x[1], losses, 2)
        if bend > 0.0:
            return float(x[1] - 0.5 * slope / bend), float(losses[1] - 0.25 * slope**2 / bend)
    return float(x[int(np.argmin(losses))]), 0.0
