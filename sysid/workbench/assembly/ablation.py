"""Ablation: what the stages of an assembly say of each step of modelling by parts.

Each compares what comes before with what comes after, on scored cases that nothing was fitted to. A step that the
pipeline has no stage for is not put to the test, and not mentioned.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sysid.composite.members import geometric_mean
from sysid.composite.training import ALONE, CHOSEN, ONE_STEP, RETRAINED, TOGETHER
from sysid.traces import Role, TraceSet
from sysid.workbench.assembly.member_scores import MemberScores
from sysid.workbench.assembly.stage_config import AblationConfig

Scores = Mapping[str, Mapping[str, float]]
Step = Literal["close_loop", "choose_together", "retrain", "train_together"]


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """What something came to, before and after.

    Args:
        what: A member, or the whole.
        before: Geometric mean of its mean squared errors over the cases, infinite where a free run diverges.
        after: The same after.
        one_step: The same one step ahead of what comes before, where that is what deceives; NaN elsewhere.
    """

    what: str
    before: float
    after: float
    one_step: float = math.nan


@dataclass(frozen=True, kw_only=True)
class Ablation:
    """A step of modelling by parts, put to the test.

    Args:
        step: Which, as :class:`sysid.reporting.assembly.results.AblationRecord` has it.
        comparisons: Where it was put to the test.
        published: What was published on it.
    """

    step: Step
    comparisons: tuple[Comparison, ...]
    published: str


def ablations_of(
    stages: Mapping[str, Scores], members: Sequence[MemberScores], cases: TraceSet, published: AblationConfig
) -> list[Ablation]:
    """What the stages of a run say of each step.

    Args:
        stages: Scores of the whole by stage.
        members: Scores of the members by themselves.
        cases: The scored cases; those that were fitted do not count, unless there are no others.
        published: What was published.

    Returns:
        The steps that can be told apart.
    """
    counted = [name for name, role in cases.roles.items() if role is not Role.ESTIMATION] or list(cases.roles)

    def whole(stage: str) -> float:
        return _mean(value for by_case in stages[stage].values() for case, value in by_case.items() if case in counted)

    def compared(before: str | None, after: str | None) -> tuple[Comparison, ...]:
        if before is None or after is None or not {before, after} <= {*stages}:
            return ()
        return (Comparison(what="the whole", before=whole(before), after=whole(after)),)

    alone = tuple(
        Comparison(
            what=one.mapping,
            before=_of(one.best.closed, counted),
            after=_of(one.best.free_run, counted),
            one_step=_of(one.best.one_step, counted),
        )
        for one in members
        if one.best.closed is not None and one.best.one_step is not None
    )
    trained = [stage for stage in stages if stage.startswith(TOGETHER)]
    parts = [stage for stage in stages if stage in {ALONE, CHOSEN, RETRAINED}]
    found = [
        Ablation(
            step="close_loop",
            comparisons=(*alone, *compared(ONE_STEP, ALONE)),
            published=published.closing,
        ),
        Ablation(step="choose_together", comparisons=compared(ALONE, CHOSEN), published=published.together),
        Ablation(
            step="retrain",
            comparisons=compared(CHOSEN if CHOSEN in stages else ALONE, RETRAINED),
            published=published.retraining,
        ),
        Ablation(
            step="train_together",
            comparisons=compared(parts[-1] if parts else None, trained[-1] if trained else None),
            published=published.end_to_end,
        ),
    ]
    return [one for one in found if one.comparisons]


def _of(errors: Mapping[str, float], counted: Sequence[str]) -> float:
    return _mean(value for case, value in errors.items() if case in counted)


def _mean(errors: Iterable[float]) -> float:
    """Geometric mean, infinite where one is no number."""
    values = list(errors)
    return geometric_mean(values) if np.all(np.isfinite(values)) else float("inf")
