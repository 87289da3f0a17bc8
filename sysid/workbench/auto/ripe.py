"""Networks that their time limit ended before they had come anywhere: trained on until their error says something."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from sysid.estimation import Status
from sysid.models.store import structure_from_dict
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.budget import Budget
from sysid.workbench.auto.parts import FURTHER
from sysid.workbench.auto.worth import Rank
from sysid.workbench.sweep.driver import Driver
from sysid.workbench.sweep.search_space import Point

RIPE = 20
"""Iterations of a network, from all that it was trained, without which its error says little of what it may come to."""
LONGEST = 2.0
"""Times the limit of a trial that a network may be trained on for them."""
BEGINNING = 0.1
"""Share of a training from a given start that its linear part may take."""
NAMED = 3
"""Networks that are named where some have not come so far."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ripening:
    """Trains young networks on.

    Args:
        driver: Has their trials, and trains them.
        budget: What there is time for.
        rank: Who comes first where there is not time for all.
        n_outputs: Of the mapping.
    """

    driver: Driver
    budget: Budget
    rank: Rank
    n_outputs: int

    def __call__(self, points: Sequence[Point], trials: Sequence[Trial]) -> list[Trial]:
        """Train on those of some that are young, as far as there is time.

        Args:
            points: What was tried.
            trials: What came of each.

        Returns:
            The trials in their order, those that were trained on as they now are.
        """
        found = {trial.number: trial for trial in trials}
        by_number = {point.number: point for point in points}
        seconds = {
            one.number: self._seconds(one)
            for one in sorted(trials, key=self.rank)
            if is_young(one, self.n_outputs) and math.isfinite(one.iteration_s)
        }
        options = partial(_options, seconds)
        wanted = [by_number[number] for number in seconds]
        stored = [point for point in wanted if self.driver.is_stored_on([point], options)]
        old, spent = list[Point](), 0.0
        for point in wanted:
            if point in stored or self.budget.has_room(spent + seconds[point.number]):
                spent += 0.0 if point in stored else seconds[point.number]
                old.append(point)
        gone_on(self.driver, old, found, options, self.rank)
        return [found[trial.number] for trial in trials]

    def _seconds(self, trial: Trial) -> float:
        """Processor time until a network is ripe, with some for its beginning, as far as it may have it."""
        wall_s = self.budget.wall_s or math.inf
        need = (RIPE + 1 - _iterations_each(trial, self.n_outputs)) * trial.iteration_s
        return round(min(need / (1.0 - BEGINNING), LONGEST * self.budget.trial * wall_s), 3)


def gone_on(
    driver: Driver,
    points: Sequence[Point],
    best: dict[int, Trial],
    options: Callable[[Point], Mapping[str, Any]],
    rank: Rank,
) -> set[int]:
    """Train networks on; one that has not become better is kept as it was, and its training goes on from there.

    Args:
        driver: Trains them.
        points: The networks.
        best: Their trials so far, by number, which are replaced by better ones.
        options: How each is trained on.
        rank: What says which is better.

    Returns:
        The numbers of those that have become better.
    """
    before, better = dict(driver.last), set[int]()
    for trial in driver.run_on(points, best, options) if points else ():
        was = best[trial.number]
        if math.isfinite(rank(trial)[1]) and rank(trial) < rank(was):
            best[trial.number] = trial
            better.add(trial.number)
        else:
            best[trial.number] = was.model_copy(update={"iterations": trial.iterations})
            driver.last[trial.number] = before[trial.number]
    return better


def _options(seconds: Mapping[int, float], point: Point) -> dict[str, Any]:
    return {**FURTHER, "max_iterations": RIPE, "max_time_s": seconds[point.number]}


def _iterations_each(trial: Trial, n_outputs: int) -> float:
    """Iterations of each model of a trial, the mean where it has one an output."""
    whole = structure_from_dict(trial.structure).for_outputs(n_outputs).several_outputs
    return trial.iterations / (1 if whole else n_outputs)


def is_young(trial: Trial, n_outputs: int, folds: int = 1) -> bool:
    """Whether a time limit ended a network before its error says something.

    Args:
        trial: The trial.
        n_outputs: Of the mapping.
        folds: That it was trained on.

    Returns:
        Whether it did.
    """
    return trial.status == Status.TIME_LIMIT.name and _iterations_each(trial, n_outputs) < RIPE * folds


def young_told(trials: Sequence[Trial], rank: Rank, n_outputs: int, folds: int = 1) -> str:
    """What of a search says little for want of time.

    Args:
        trials: All of them.
        rank: The best is named first.
        n_outputs: Of the mapping.
        folds: That each was trained on.

    Returns:
        A sentence; empty where there is nothing to say.
    """
    young = sorted((one for one in trials if is_young(one, n_outputs, folds)), key=rank)
    if not young:
        return ""
    named = [f"{one.label} ({_count(_iterations_each(one, n_outputs) / folds)})" for one in young[:NAMED]]
    more = f" and {len(young) - NAMED} more" if len(young) > NAMED else ""
    return (
        f"In the time that there was, {', '.join(named)}{more} came to fewer than {RIPE}, too few to tell "
        "what they are worth: allow more minutes, or fit fewer samples."
    )


def _count(iterations: float) -> str:
    """Iterations of each training, as a reader counts; the starts of some structures take what time there is."""
    if iterations < 1.0:
        return "less than one iteration" if iterations else "no iteration"
    whole = math.floor(iterations)  # 19.75 of 20 are fewer than 20, and are not shown as 20
    return "1 iteration" if whole == 1 else f"{whole} iterations"
