"""The best networks of a search trained on side by side, the worse dropped at each look: successive halving.

A trial is short, and under load it comes to a few iterations: who is ahead after it need not be ahead later. What a
look is by is what chooses in the end; nothing here depends on when a result comes in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from sysid.estimation import Status, Training
from sysid.estimation.estimators import estimator_of
from sysid.estimation.networks.starts.halving import better_half
from sysid.models import AbstractStructure
from sysid.models.store import structure_from_dict
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.budget import RACE
from sysid.workbench.auto.parts import FURTHER
from sysid.workbench.auto.ripe import gone_on
from sysid.workbench.auto.worth import Rank, error
from sysid.workbench.sweep.driver import Driver
from sysid.workbench.sweep.search_space import Point

FINALISTS = 4
"""Networks that are trained on, at most."""
BEHIND = 2.0
"""Standard errors of the mean difference over the traces that choose by which one has to be ahead to be alone."""
AHEAD = 2.0
"""Times less the error of a network has to be that is not stable yet, to be trained on before one that is."""
FEWEST = 4
"""Traces that choose without which no difference is told from chance."""


def trains_on(structure: AbstractStructure) -> bool:
    """Whether a trial of a structure, which ends early, can be trained on from where it is.

    Args:
        structure: What was chosen.

    Returns:
        True for networks.
    """
    row = estimator_of(structure)
    return row.training is Training and row.initial is not None


def as_far(trial: Trial) -> float:
    """The error of a trial, also of a network that is not stable as far as it was trained.

    Of a heat exchanger networks at 1 % after twelve seconds settled elsewhere on seven of 115 random sequences. They
    had no error, nobody trained them on, and a linear model at 4 % was taken.

    Args:
        trial: The trial.

    Returns:
        The mean square; infinite for what cannot be used and is not trained on.
    """
    value = trial.selection_free_run_mse
    unstable = trial.status == Status.UNSTABLE.name and trial.dropped_at is None and math.isfinite(value)
    return float(value) if unstable and trains_on(structure_from_dict(trial.structure)) else error(trial)


def as_rival(trial: Trial) -> float:
    """The same to search by: what is not stable yet has to be far ahead of what is.

    Args:
        trial: The trial.

    Returns:
        The mean square, :data:`AHEAD` squared times as large of what is not stable.
    """
    return as_far(trial) * (1.0 if trial.usable else AHEAD**2)


@dataclass(frozen=True, kw_only=True, eq=False)
class Race:
    """Trains the best on.

    Args:
        driver: Has their trials, and trains them.
        points: What was tried, by number.
        rank: What chooses; the least is the best.
        n_outputs: Of the mapping.
        wall_s: Seconds of the search; ``None`` where iterations are counted.
        iterations: Of the search; ``None`` where time is.
        workers: Who train side by side.
        clock: Seconds that the search has taken, over all its sessions.
        kept: Share of the time by whose beginning a look at more than two has to be over.
        ends_s: Seconds by the clock by which the last fit has to be over.
        slowed: Seconds by the clock that a second of training takes.
        in_it: Numbers of those that were trained on.
    """

    driver: Driver
    points: Mapping[int, Point]
    rank: Rank
    n_outputs: int
    wall_s: float | None
    iterations: int | None
    workers: int
    clock: Callable[[], float]
    kept: float
    ends_s: float = math.inf
    slowed: float = 1.0
    in_it: set[int] = field(default_factory=set)

    def run(self, trials: Sequence[Trial]) -> tuple[list[Trial], float]:
        """Train the best on until one is left.

        Args:
            trials: All of the search.

        Returns:
            They in their order, those that have become better as they now are; and the share of the budget that it
            took.
        """
        best, spent = {trial.number: trial for trial in trials}, 0.0
        rungs: tuple[float, ...] = RACE
        alive = self._finalists(trials)
        if len(alive) <= 2 or not self._in_time([self.points[number] for number in alive], RACE[0]):
            # Trials that have overrun, as under load, are those whose order says least: two go on in any case.
            alive, rungs = alive[:2], RACE[1:]
        for share in rungs:
            points = [self.points[number] for number in alive]
            if len(points) < 2:
                break
            spent += share
            self.in_it.update(alive)
            better = gone_on(self.driver, points, best, partial(self._options, share, len(points)), self.rank)
            alive = [number for number in alive if number in better]  # the others have nothing more to give
            alive = self._left([best[number] for number in alive], least=min(map(self.rank, best.values())))
        return [best[trial.number] for trial in trials], spent

    def _finalists(self, trials: Sequence[Trial]) -> list[int]:
        """Those that may come to be the best: no network that has converged behind another."""
        usable = [one for one in sorted(trials, key=self.rank) if math.isfinite(self.rank(one)[1])]
        open_ = [one for one in usable if trains_on(self.points[one.number].structure)]
        done = {Status.CONVERGED.name, Status.STALLED.name}
        return [one.number for k, one in enumerate(open_) if k == 0 or one.status not in done][:FINALISTS]

    def _left(self, trials: Sequence[Trial], *, least: tuple[float, float, int]) -> list[int]:
        """Who goes on: the better half; the first of them alone where it is ahead by more than chance."""
        half = better_half(sorted(trials, key=self.rank))
        alone = half and self.rank(half[0]) == least and all(behind(half[0], one) for one in half[1:])
        return [one.number for one in (half[:1] if alone else half)]

    def _options(self, share: float, count: int, point: Point) -> dict[str, Any]:
        """How one of so many is trained on in a share of the budget."""
        if self.wall_s is None:
            most = round(share * (self.iterations or 0) / count)
            return {**FURTHER, "max_iterations": max(1, min(FURTHER["max_iterations"], most))}
        models = 1 if point.structure.for_outputs(self.n_outputs).several_outputs else self.n_outputs
        seconds = share * self.wall_s / math.ceil(count / self.workers) / models
        return {**FURTHER, "max_time_s": round(seconds, 3)}

    def _in_time(self, points: Sequence[Point], share: float) -> bool:
        """Whether there is time for a look at all; what was done by an earlier session takes none."""
        if self.wall_s is None:
            return True
        until = min(self.ends_s, self.wall_s) - self.kept * self.wall_s
        if self.clock() + self.slowed * share * self.wall_s <= until:
            return True
        return self.driver.is_stored_on(points, partial(self._options, share, len(points)))


def behind(ahead: Trial, other: Trial) -> bool:
    """Whether one network is behind another by more than chance: paired over the traces that choose, by logarithms.

    Args:
        ahead: The better one.
        other: The other.

    Returns:
        Whether it is; never where too few traces choose.
    """
    ours, theirs = (np.array(one.selection_rms_shares, dtype=np.float64) for one in (ahead, other))
    shares = np.concatenate([ours, theirs])
    if len(ours) != len(theirs) or len(ours) < FEWEST or not (np.isfinite(shares) & (shares > 0.0)).all():
        return False
    by = np.log(theirs / ours)
    return bool(by.mean() > BEHIND * by.std(ddof=1) / math.sqrt(len(by)))
