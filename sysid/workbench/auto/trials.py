"""Trials of a search: a point trained on every fold, and what it is worth over all of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from sysid.estimation import FitResult
from sysid.models import AbstractModel
from sysid.reporting.sweep_record import Trial
from sysid.workbench.runner.store import digest
from sysid.workbench.sweep.driver import Driver
from sysid.workbench.sweep.search_space import Point
from sysid.workbench.sweep.trial import NOT_DONE, stored_models

HOPELESS, SEEN = 2.0, 2
"""Times the error of the best so far on the same folds, from so many on, beyond which a point is dropped."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trials:
    """Tries points, fold by fold.

    Args:
        drivers: One a fold.
        best: The best so far, fold by fold.
    """

    drivers: tuple[Driver, ...]
    best: list[Trial] = field(default_factory=list)

    @classmethod
    def of(cls, driver: Driver) -> Trials:
        """For the folds of a driver's bench.

        Args:
            driver: The driver of the first.

        Returns:
            The trials.
        """
        return cls(drivers=tuple(replace(driver, fold=k, last={}) for k in range(len(driver.bench.folds))))

    @property
    def done_now(self) -> int:
        """Jobs that this session has done itself."""
        return sum(driver.done_now for driver in self.drivers)

    def is_stored(self, point: Point) -> bool:
        """Whether a point's trials are on disk, as far as they are asked for."""
        return all(driver.is_stored(point) for driver in self.drivers)

    def fitted(self, number: int) -> list[list[AbstractModel]]:
        """What a point was fitted to.

        Args:
            number: Of the point.

        Returns:
            For each fold on which it can be used its models: one of all outputs, or one an output.
        """
        stored = [_usable(number, driver) for driver in self.drivers]
        return [
            [FitResult.from_dict(one["fit"]).model for one in stored_models(outcome)] for outcome in stored if outcome
        ]

    def folds_of(self, number: int) -> list[int]:
        """On which folds a point can be used.

        Args:
            number: Of the point.

        Returns:
            Their numbers, from 0 on.
        """
        return [k for k, driver in enumerate(self.drivers) if _usable(number, driver)]

    def run(self, points: Sequence[Point]) -> list[Trial]:
        """Try some points on every fold; what is far behind the best on the same folds is dropped on the way.

        What the end of the time finds with folds enough behind it is set against the best on these.

        Args:
            points: The points.

        Returns:
            A trial for each, in their order.
        """
        found: dict[int, list[Trial]] = {point.number: [] for point in points}
        alive = list(points)
        for done, driver in enumerate(self.drivers, start=1):
            if done % SEEN == 1:
                # Part by part, one worker would wait for the other at the end of each.
                ahead = self.drivers[done - 1 : done - 1 + SEEN]
                driver.do_ahead([(one, alive) for one in ahead])
            for point, trial in zip(alive, driver.run(alive) if alive else (), strict=True):
                found[point.number].append(trial)
            limit = HOPELESS**2 * _mean(self.best[:done]) if self.best and done >= SEEN else math.inf
            alive = [point for point in alive if _mean(found[point.number]) <= limit]
        whole = [trials for trials in found.values() if len(trials) == len(self.drivers)]
        contenders = [*([list(self.best)] if self.best else []), *whole]
        self.best[:] = min(contenders, key=_mean, default=[])
        return [self._judged(found[point.number]) for point in points]

    def _judged(self, trials: Sequence[Trial]) -> Trial:
        of, done = len(self.drivers), [trial for trial in trials if trial.reason != NOT_DONE]
        if len(done) == len(trials) or len(done) < SEEN or not self.best or not math.isfinite(_mean(done)):
            return together(trials, of=of)
        by = _mean(self.best) / max(_mean(self.best[: len(done)]), 1e-300)
        error, told = by * _mean(done), f"scored on {len(done)} of {of} parts, against the best on the same"
        one = together(done, of=len(done))
        return one.model_copy(update={"selection_free_run_mse": error, "reason": f"{told}: the time was up"})


def _usable(number: int, driver: Driver) -> Mapping[str, Any] | None:
    """What came of a point on a fold; ``None`` where it was not tried, or cannot be used."""
    outcome = driver.store.read(driver.last[number].key) if number in driver.last else None
    return outcome if outcome is not None and outcome["usable"] else None


def _mean(trials: Iterable[Trial]) -> float:
    """Geometric mean of the errors, as mean squares; infinite where one cannot be used."""
    errors = [trial.selection_free_run_mse if trial.usable else math.inf for trial in trials]
    if not all(map(math.isfinite, errors)):
        return math.inf
    return math.exp(sum(math.log(max(error, 1e-300)) for error in errors) / len(errors))


def together(trials: Sequence[Trial], *, of: int) -> Trial:
    """One point's trials on the folds as one.

    Args:
        trials: At least one.
        of: Folds that there are; a point that was not tried on all of them was dropped.

    Returns:
        The trial: errors as geometric means, times as sums, the rest as of the first fold.
    """
    first = trials[0]
    if of == 1:
        return first
    whole = len(trials) == of and all(trial.usable for trial in trials)
    worst = next((trial for trial in trials if not trial.usable), first)
    return first.model_copy(
        update={
            "key": digest([trial.key for trial in trials]),
            "status": worst.status,
            "usable": worst.usable,
            "reason": worst.reason,
            "dropped_at": None if whole or not worst.usable else len(trials),
            "seconds": sum(trial.seconds for trial in trials),
            "cpu_s": sum(trial.cpu_s for trial in trials),
            "iterations": sum(trial.iterations for trial in trials),
            "parameters": max(trial.parameters for trial in trials),
            "selection_free_run_mse": _mean(trials) if worst.usable else math.nan,
            "selection_rms_shares": [share for trial in trials for share in trial.selection_rms_shares],
            "selection_errors": [error for trial in trials for error in trial.selection_errors],
        }
    )
