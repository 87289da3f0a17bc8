"""What a search may spend, what it has spent, and what still fits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sysid.estimation import Training
from sysid.estimation.clock import SLOWEST
from sysid.estimation.estimators import estimator_of
from sysid.estimation.networks.starts.halving import planned_iterations
from sysid.models import AbstractStructure
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.finish import MOST, MOST_KEPT, SPILL, slowness
from sysid.workbench.runner.screen import duration
from sysid.workbench.sweep.search_space import Point

REFIT, TRIAL = 0.2, 0.15
"""Shares of the time: what is kept for the last fit, and what one trial may take, that in processor time."""
GOING_ON, TRIAL_OF_MANY = 0.4, 0.1
"""The same where the chosen network is trained on from where its trial had ended. Trials then have to tell which one is
worth that, no more; what the others would have got is the chosen one's."""
RACE = (0.08, 0.12)
"""Shares of the same in which the best networks are trained on side by side before one is chosen: four, then two."""
TELLING_S, LATELY = 0.5, 8
"""Seconds of a trial from which on it says how slow the machine is, and trials by which that is judged."""
UNKNOWN = 0.5
"""Share of its limit that a trial is taken to last where no other of its kind has told."""
LINEAR = 0.5
"""Share of the time of all trials by whose end linear structures beyond the first of each kind have to be done."""
LARGER = 0.35
"""The same for those of more states than are tried unasked."""
LITTLE = 0.005
"""Share of the time that a linear trial may take whatever was spent before: one network takes longer than many."""
FINAL = 0.15
"""Share of either that is kept for trying the best once more."""


def price(point: Point, folds: int = 1) -> int:
    """Iterations of a trial, all starts together, if none converges early; 1 for what is no network.

    Args:
        point: What is tried.
        folds: Times that it is trained.

    Returns:
        Their number.
    """
    row = estimator_of(point.structure)
    if row.training is not Training:
        return folds
    training = Training(**dict(point.training)).with_starts(row.starts)
    return folds * round(planned_iterations(training, training.ensemble if row.unites else 1))


@dataclass(kw_only=True, eq=False)
class Budget:
    """Time or iterations.

    Args:
        wall_s: Seconds; ``None`` where iterations are counted.
        iterations: Iterations; ``None`` where time is.
        clock: Seconds that the search has taken, over all its sessions.
        is_stored: Whether a trial is on disk and costs nothing.
        side_by_side: Trials that run at the same time.
        folds: Times that a point is trained.
        spent: Iterations so far.
        refit: Share that is kept for the last fit.
        trial: Share that one trial may take.
        kept: Share that is not spent yet.
        most: Share of the time of all trials that may be spent by the end of this round.
        finishing_s: Processor seconds of scores, export and report, which follow the last fit.
        unlimited: Points of the next round that are tried even so, as long as the time of the last fit is not reached.
        forced: Whether the next round is tried whatever there is: without a trial there is no model.
    """

    wall_s: float | None
    iterations: int | None
    clock: Callable[[], float]
    is_stored: Callable[[Point], bool]
    side_by_side: int = 1
    folds: int = 1
    spent: int = 0
    refit: float = REFIT
    trial: float = TRIAL
    kept: float = FINAL
    most: float = 1.0
    finishing_s: float = 0.0
    unlimited: int = 0
    forced: bool = False
    _worked: list[tuple[float, float]] = field(default_factory=list)
    _at_first: float = math.nan
    _rates: dict[str, float] = field(default_factory=dict)
    _open: list[Point] = field(default_factory=list)

    def take(self, points: Sequence[Point]) -> list[Point]:
        """Those of some points that fit, in their order; they are paid for.

        Args:
            points: What is wanted, the most wanted first.

        Returns:
            What may be tried.
        """
        taken: list[Point] = []
        seconds = 0.0
        for point in points:
            cost = 0.0 if self.wall_s is None or self.is_stored(point) else self._seconds(point) / self.side_by_side
            fits = self._fits(price(point, self.folds), seconds + cost, paid=cost == 0.0)
            little = cost <= LITTLE * (self.wall_s or 0.0) and estimator_of(point.structure).linear
            even_so = len(taken) < self.unlimited or little
            if not fits and not self.forced and not (even_so and self._before_the_last_fit()):
                continue
            seconds += cost
            self.spent += price(point, self.folds)
            taken.append(point)
        self._open = taken
        self.unlimited, self.forced = 0, False
        return taken

    def tell(self, trials: Sequence[Trial]) -> None:
        """Learn from the last trials how long others will take.

        Args:
            trials: In the order in which they were taken.
        """
        for point, trial in zip(self._open, trials, strict=True):
            kind = point.structure.kind
            rate = trial.seconds / (price(point, self.folds) * size_of(point.structure))
            if math.isfinite(rate):
                self._rates[kind] = max(rate, 0.5 * self._rates.get(kind, 0.0))
            if trial.seconds >= TELLING_S and math.isfinite(trial.cpu_s):
                self._worked.append((trial.seconds, trial.cpu_s))

    @property
    def slowed(self) -> float:
        """Seconds by the clock that a second of a trial takes, whose limits end it by the wall beyond some."""
        return min(self._busy, SLOWEST)

    @property
    def _busy(self) -> float:
        """Seconds by the clock that a second of work takes, as trials have shown lately; at first, as is seen now."""
        if not self._worked and not math.isfinite(self._at_first):
            self._at_first = slowness()
        wall, worked = np.sum(self._worked[-LATELY:] or [(self._at_first, 1.0)], axis=0)
        return float(np.clip(wall / worked, 1.0, MOST))

    @property
    def ends_s(self) -> float:
        """Seconds by the clock by which the last fit has to be over, so that the command ends within its time."""
        if self.wall_s is None:
            return math.inf
        kept = self._busy * self.finishing_s - SPILL * self.wall_s
        return self.wall_s - min(max(kept, 0.0), MOST_KEPT * self.wall_s)

    def is_late(self) -> bool:
        """Whether trials have taken half of what was left to the last fit: no more is waited for."""
        return self.wall_s is not None and self.clock() > (1.0 - 0.5 * self.refit) * self.ends_s

    def has_room(self, seconds: float) -> bool:
        """Whether trials that train for so long, all together, still end in time.

        Args:
            seconds: Of work.

        Returns:
            Whether they do; always where iterations are counted.
        """
        return self._fits(0, self.slowed * seconds / self.side_by_side, paid=self.wall_s is None)

    def fraction(self) -> float:
        """Share that is spent, 0 to 1."""
        if self.wall_s is not None:
            return min(1.0, self.clock() / self.wall_s)
        return min(1.0, self.spent / (self.iterations or 1))

    def left(self) -> str:
        """What is left, in words."""
        if self.wall_s is not None:
            return f"{duration(max(0.0, self.wall_s - self.clock()))} left"
        return f"{max(0, (self.iterations or 0) - self.spent):,} iterations left"

    def limits(self, share: float) -> dict[str, Any]:
        """Options of a training that may take a share of the time; none where iterations are counted.

        Args:
            share: Of all the time.

        Returns:
            The options.
        """
        return {} if self.wall_s is None else {"max_time_s": round(share * self.wall_s, 3)}

    def _fits(self, iterations: int, seconds: float, *, paid: bool) -> bool:
        if self.iterations is not None:
            return self.spent + iterations <= (1.0 - self.kept) * self.iterations
        return paid or self.wall_s is None or self.clock() + seconds <= self._until()

    def _before_the_last_fit(self) -> bool:
        return self.wall_s is not None and self.clock() < (1.0 - self.refit) * self.ends_s

    def _until(self) -> float:
        """Seconds by which a round of trials has to be over.

        What is kept is a share of the time before scores, export and report: where these take half of a short search,
        trials had none, and the last fit of what nobody had compared had all.
        """
        return min(self.most * (1.0 - self.refit), 1.0 - self.refit - self.kept) * self.ends_s

    def _seconds(self, point: Point) -> float:
        """How long a trial will take; of a kind that was not tried yet, a part of its limit, or at least something."""
        if self.wall_s is None:
            return 0.0
        limit = self.slowed * self.trial * self.wall_s if point.training else self.wall_s
        rate = self._rates.get(point.structure.kind)
        if rate is None:
            known = "max_time_s" in point.training and not estimator_of(point.structure).linear
            return UNKNOWN * limit if known else 1e-3
        return min(limit, max(1e-3, rate * price(point, self.folds) * size_of(point.structure)))


def size_of(structure: AbstractStructure) -> float:
    """About how many parameters, from the fields that count something: enough to compare two of a kind.

    Args:
        structure: What is tried.

    Returns:
        The product of its counts; a list, such as poles for each input, counts as its sum.
    """
    counted = [sum(v) if _counts(v) else v for v in structure.to_dict().values()]
    numbers = [v for v in counted if isinstance(v, int) and not isinstance(v, bool)]
    return float(math.prod(max(1, number) for number in numbers))


def _counts(value: Any) -> bool:
    return isinstance(value, list | tuple) and all(isinstance(one, int) for one in value)
