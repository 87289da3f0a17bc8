"""Lessons of modelling by parts, put to the test by the stages of an assembly: whether each held, in words and figures.

Each compares what comes before with what comes after, on scored cases that nothing was fitted to. A lesson that the
pipeline has no stage for is not put to the test, and not mentioned.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sysid.composite.members import geometric_mean
from sysid.composite.training import ALONE, CHOSEN, ONE_STEP, RETRAINED, TOGETHER
from sysid.reporting.numbers import number, times
from sysid.traces import Role, TraceSet
from sysid.workbench.assembly.member_scores import MemberScores
from sysid.workbench.assembly.stage_config import LessonsConfig

Scores = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """What something came to, before and after.

    Args:
        what: A member, or the whole.
        before: Geometric mean of its mean squared errors over the cases, infinite where a free run diverges.
        after: The same after.
        one_step: The same one step ahead of what comes before, where that is what deceives; ``None`` elsewhere.
    """

    what: str
    before: float
    after: float
    one_step: float | None = None

    @property
    def better(self) -> bool:
        """Whether it is better after."""
        return self.after < self.before


@dataclass(frozen=True, kw_only=True)
class Lesson:
    """A lesson and what came of it.

    Args:
        claim: What it says.
        before: What stands before, in a few words.
        after: What stands after.
        comparisons: Where it was put to the test.
        published: What was published on it.
    """

    claim: str
    before: str
    after: str
    comparisons: tuple[Comparison, ...]
    published: str

    @property
    def verdict(self) -> str:
        """Whether it held."""
        held = [one.what for one in self.comparisons if one.better]
        if len(held) == len(self.comparisons):
            return "held"
        return f"held for {', '.join(held)} only" if held else "did not hold"


def lessons_of(
    stages: Mapping[str, Scores], members: Sequence[MemberScores], cases: TraceSet, published: LessonsConfig
) -> list[Lesson]:
    """What the stages of a run say of each lesson.

    Args:
        stages: Scores of the whole by stage.
        members: Scores of the members by themselves.
        cases: The scored cases; those that were fitted do not count, unless there are no others.
        published: What was published.

    Returns:
        The lessons that were put to the test.
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
        Lesson(
            claim="A network that was fitted one step ahead fails once its loop is closed",
            before="fitted one step ahead",
            after="fitted in free run",
            comparisons=(*alone, *compared(ONE_STEP, ALONE)),
            published=published.closing,
        ),
        Lesson(
            claim="The members that are best alone are not the best together",
            before="of the best alone",
            after="of the best together",
            comparisons=compared(ALONE, CHOSEN),
            published=published.together,
        ),
        Lesson(
            claim="Training members again on what the others put out helps",
            before="before",
            after="retrained",
            comparisons=compared(CHOSEN if CHOSEN in stages else ALONE, RETRAINED),
            published=published.retraining,
        ),
        Lesson(
            claim="Training the whole as one goes further than its parts",
            before="in parts",
            after="end to end",
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


def lessons_table(lessons: Sequence[Lesson]) -> dict[str, Any]:
    """The lessons with their figures.

    Args:
        lessons: The lessons.

    Returns:
        A table, as :class:`sysid.reporting.judging.tables.TableRecord` has it.
    """
    rows = [
        [
            one.claim if index == 0 else "",
            f"{part.what}: {one.before}{_deceptive(part)}, then {one.after}",
            *(value if np.isfinite(value) else "diverges" for value in (part.before, part.after)),
            times(part.before / part.after) if np.isfinite(part.before / part.after) else "",
            one.verdict if index == 0 else "",
            one.published if index == 0 else "",
        ]
        for one in lessons
        for index, part in enumerate(one.comparisons)
    ]
    return {
        "caption": "The lessons, and whether each held",
        "head": [
            ("Lesson", ""), ("Put to the test", ""), ("Before", "mse"), ("After", "mse"), ("Less by", ""),
            ("Verdict", ""), ("Published", ""),
        ],
        "rows": rows,
        "note": "Mean squared error of the free run, the geometric mean over outputs and over the cases that nothing "
        "was fitted to.",
    }  # fmt: skip


def _deceptive(part: Comparison) -> str:
    """The error one step ahead, where it is what one would have gone by."""
    return "" if part.one_step is None else f" (where it has {number(part.one_step)})"


def lessons_point(lessons: Sequence[Lesson]) -> tuple[str, str]:
    """For the verdict.

    Args:
        lessons: The lessons.

    Returns:
        Keyword and sentence.
    """
    return "Lessons", " ".join(f"{one.claim}: {one.verdict}." for one in lessons)
