"""How a sweep stands: how much of its work is done, how long it takes still, the best so far."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from sysid.reporting.sweep_record import Trial
from sysid.workbench.runner.screen import duration
from sysid.workbench.sweep.search_space import Point
from sysid.workbench.sweep.trial import FAILED, Job


@dataclass(frozen=True, kw_only=True)
class Rung:
    """How far trials are trained before they are looked at.

    Args:
        iterations: Of the training.
        record: Share of the estimation traces.
        keep: Share of the trials that goes on; 1 for the last rung.
    """

    iterations: int
    record: float
    keep: float


@dataclass(kw_only=True, eq=False)
class Progress:
    """Counts work, and says how it stands.

    Args:
        cost: Work of so many iterations of a point.
        rank: Who of two trials is better.
        by: Name of what the rank is last.
        session_s: Seconds that this session has taken.
        show_at: Told the share that is done, and a line for people.
    """

    cost: Callable[[Point, float], float]
    rank: Callable[[Trial], tuple[float, ...]]
    by: str
    session_s: Callable[[], float]
    show_at: Callable[[float, str], None]
    expected: float = 0.0
    finished: float = 0.0
    worked: float = 0.0
    n_done: int = 0
    n_fresh: int = 0
    n_expected: int = 0
    best: Trial | None = None
    mean_cost: Callable[[float], float] = lambda _: 0.0

    def expect(self, points: Sequence[Point], rungs: Sequence[Rung]) -> None:
        """Count on these points."""
        self.mean_cost = lambda iterations: sum(self.cost(p, iterations) for p in points) / max(1, len(points))
        self._plan(len(points), rungs, 0)

    def dropped(self, n_left: int, rungs: Sequence[Rung]) -> None:
        """Count again: so many go on."""
        self.expected, self.n_expected = self.finished, self.n_done
        if rungs:
            self._plan(n_left, rungs, 0)

    def _plan(self, n: int, rungs: Sequence[Rung], done: int) -> None:
        for rung in rungs:
            self.expected += n * self.mean_cost((rung.iterations - done) * rung.record)
            self.n_expected += n
            n, done = max(1, math.ceil(rung.keep * n)), rung.iterations

    def done(self, job: Job, trial: Trial, *, fresh: bool) -> None:
        """A job is done, now or earlier."""
        self.finished += job.cost
        self.n_done += 1 if job.number else 0
        self.worked += job.cost if fresh else 0.0
        self.n_fresh += fresh
        counts = job.number > 0 and trial.status != FAILED and job.record == 1.0
        if counts and (self.best is None or self.rank(trial) < self.rank(self.best)):
            self.best = trial

    def show(self) -> None:
        """Tell the screen: how many, how long still, the best so far."""
        best = ""
        if self.best is not None:
            value = self.rank(self.best)[-1]
            best = f", best so far {self.best.label}: {self.by} {value:.3g}"
        left = self.left()
        ahead = "" if left is None else f", {duration(left)} left"
        total = max(self.expected, self.finished, 1.0)
        detail = f"{self.n_done} of {max(self.n_expected, self.n_done)}{ahead}{best}"
        self.show_at(min(1.0, self.finished / total), detail)

    def left(self) -> float | None:
        """Seconds to go, from the work of this session; ``None`` before its first result."""
        if self.worked <= 0.0:
            return None
        return max(0.0, self.expected - self.finished) * self.session_s() / self.worked
