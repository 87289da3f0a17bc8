"""What is told of how a search went: whether there was time for it, and how the last fit is made."""

from __future__ import annotations

import math

from sysid.models import LinearStateSpace
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.families import LINEAR_ORDERS
from sysid.workbench.auto.finish import MOST_KEPT, span
from sysid.workbench.auto.last_fit import SCATTER
from sysid.workbench.auto.plan import Plan

SPACES = LinearStateSpace.kind
BUSY = 1.5
"""Seconds by the clock that a second of training takes from which on it is said."""
LEAST_SHARE = 0.1
"""Share of the time of a search in which trials can be made at least."""


def last_fit(plan: Plan, chosen: Trial) -> str:
    """That what is fitted in the end is the mean of several starts, and why.

    Args:
        plan: What was tried.
        chosen: What is fitted.

    Returns:
        To follow the reason of the choice.
    """
    apart, mean = plan.scattered.get(chosen.number, 0.0), "is the mean of several starts"
    if apart <= SCATTER:
        return f" What is fitted to all of the record in the end {mean}."
    return (
        f" From other starts its errors on the same parts are {math.expm1(apart):.0%} apart: what is fitted to all of "
        f"the record in the end {mean}."
    )


def needs_s(plan: Plan, spent_s: float) -> float:
    """About how long a search takes, where the time was up before there was anything to compare.

    Args:
        plan: What was tried.
        spent_s: Seconds of the search so far.

    Returns:
        Seconds by the clock; 0 where there was time enough.
    """
    wall_s = plan.budget.wall_s
    if not plan.hurried or wall_s is None:
        return 0.0
    # What was seen on a busy machine says nothing of the same data on another day: it is reckoned as if it were quiet.
    slowed = plan.budget.slowed
    need = spent_s / slowed / max(1.0 - MOST_KEPT - plan.budget.refit, LEAST_SHARE)
    return max(need, 2.0 * wall_s / slowed)


def hurried(plan: Plan, chosen: Trial, spent_s: float, takes_s: float) -> str:
    """That the time was up before there was anything to compare, and about how long a search takes.

    Args:
        plan: What was tried.
        chosen: What was taken.
        spent_s: Seconds of the search so far.
        takes_s: As :func:`needs_s` has it.

    Returns:
        The sentence; empty where there was time enough.
    """
    if not plan.hurried:
        return ""
    wall_s, slowed = plan.budget.wall_s, plan.budget.slowed
    if wall_s is None:
        return f"The budget was spent before structures were compared: {chosen.label} is the least that there is."
    busy = f" on a quiet machine (a second of work takes {slowed:.1f} s now)" if slowed >= BUSY else ""
    return (
        f"The time was up before structures were compared: {chosen.label} is the least that there is, fitted once, "
        f"whatever it is worth. Of {span(wall_s)}, looking at the record and one fit took {span(spent_s)}, and scores, "
        f"export and report are still to come; a search that compares takes {span(takes_s)} at least{busy}."
    )


def busy(plan: Plan) -> list[str]:
    """What a machine that does other things meanwhile has to do with it.

    Args:
        plan: What was tried.

    Returns:
        A sentence, or none.
    """
    if plan.budget.wall_s is None or plan.budget.slowed < BUSY:
        return []
    return [
        f"The machine was busy: a second of training took {plan.budget.slowed:.1f} s. Fewer structures were tried for "
        "it, each as far as on a quiet one."
    ]


def left_out(plan: Plan) -> list[str]:
    """What was not tried, for want of time or as the search ends there.

    Args:
        plan: What was tried.

    Returns:
        A sentence or two, or none.
    """
    some = ", ".join(plan.left_out)
    found = [f"Linear models that would have taken the time of nonlinear ones were left out: {some}."] if some else []
    largest = max((int(t.structure["states"]) for t in plan.trials if t.structure["kind"] == SPACES), default=0)
    if largest > LINEAR_ORDERS[-1] and plan.looked.states == largest:
        found.append(
            f"The best linear state space, of {largest} states, is the largest that was tried: one of more may be "
            "better."
        )
    return found
