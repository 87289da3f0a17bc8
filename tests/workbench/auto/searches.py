"""Searches in which a point is worth what is said of it, without a fit."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from sysid.estimation.estimators import ESTIMATORS
from sysid.models import ARX, NeuralStateSpace
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.budget import Budget
from sysid.workbench.auto.look import Looked
from sysid.workbench.auto.plan import Plan
from sysid.workbench.auto.worth import error
from sysid.workbench.sweep.search_space import Point

LOOKED = Looked(n_inputs=1, n_outputs=1, orders=(ARX(na=2, nb=(2,), nk=(1,)),))
Worth = Callable[[Point], float]


def trial(point: Point, mse: float) -> Trial:
    return Trial(
        number=point.number,
        key=str(point.number),
        label=point.structure.label,
        structure=point.structure.to_dict(),
        status="CONVERGED",
        usable=math.isfinite(mse),
        seconds=0.1,
        parameters=10,
        operations=10,
        selection_free_run_mse=mse,
    )


def planned(
    wall_s: float | None = None, *, iterations: int | None = None, clock: Sequence[float] = (0.0,), workers: int = 1,
    looked: Looked = LOOKED, **given: Any,
) -> Plan:  # fmt: skip
    """A plan of which nothing was tried yet; the first number of the clock is the time."""
    budget = Budget(
        wall_s=wall_s, iterations=iterations, clock=lambda: clock[0], is_stored=lambda _: False, side_by_side=workers
    )
    return Plan(looked=looked, budget=budget, error=error, **given)


def searched(
    worth: Worth, *, iterations: int = 10**9, looked: Looked = LOOKED, again: int = 0
) -> tuple[Plan, list[list[Point]]]:
    """A search in which a point is worth what is said of it, without a fit."""
    training = {"max_iterations": 50}
    plan, rounds = planned(iterations=iterations, looked=looked, training=training, again=again), []
    while points := plan.ask():
        rounds.append(points)
        plan.tell([trial(point, worth(point)) for point in points])
    return plan, rounds


def linear(point: Point) -> bool:
    return ESTIMATORS[point.structure.kind].linear


def by_size(point: Point) -> float:
    """The more states and neurons up to 3/20, the better."""
    one = point.structure
    return 1.0 if not isinstance(one, NeuralStateSpace) else 1.0 / (min(one.states, 3) * min(one.neurons, 20))
