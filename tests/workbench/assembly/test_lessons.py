"""Lessons: what the stages say of each, and what they do not say."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.composite.training import ALONE, CHOSEN, ONE_STEP, RETRAINED, TOGETHER
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.workbench.assembly.lessons import Comparison, Lesson, lessons_of, lessons_point, lessons_table
from sysid.workbench.assembly.stage_config import LessonsConfig

NOTHING = LessonsConfig()


def cases(*roles: Role) -> TraceSet:
    """A case ``A``, ``B``, ... in each role."""
    traces = [
        Trace(name="ABC"[i], sample_time=1.0, channels=(Channel(name="y", unit="psi"),), values=np.zeros((3, 1)))
        for i in range(len(roles))
    ]
    return TraceSet(name="few", traces=tuple(traces), roles={t.name: r for t, r in zip(traces, roles, strict=True)})


TWO = cases(Role.ESTIMATION, Role.VALIDATION)


def stages(**errors: float) -> dict[str, dict[str, dict[str, float]]]:
    """Stages whose error is one number on every case that counts."""
    return {name.replace("_", " "): {"y": {"A": 1e-9, "B": error}} for name, error in errors.items()}


def said(scores: dict[str, dict[str, dict[str, float]]]) -> dict[str, str]:
    """The verdict by the first words of the claim."""
    return {" ".join(one.claim.split()[:2]): one.verdict for one in lessons_of(scores, [], TWO, NOTHING)}


def test_a_lesson_without_its_stages_is_not_mentioned():
    assert lessons_of(stages(each_alone=1.0), [], TWO, NOTHING) == []


def test_each_lesson_compares_a_stage_with_the_one_before_it():
    found = {ONE_STEP: 9.0, ALONE: 4.0, CHOSEN: 2.0, RETRAINED: 3.0, TOGETHER: 2.5, f"{TOGETHER}, round 2": 1.0}
    scores = {name: {"y": {"A": 1e-9, "B": error}} for name, error in found.items()}
    figures = [(c.before, c.after) for one in lessons_of(scores, [], TWO, NOTHING) for c in one.comparisons]
    np.testing.assert_allclose(figures, [(9.0, 4.0), (4.0, 2.0), (2.0, 3.0), (3.0, 1.0)])
    assert said(scores) == {
        "A network": "held",
        "The members": "held",
        "Training members": "did not hold",
        "Training the": "held",
    }


def test_retraining_is_held_against_the_members_alone_where_there_was_nothing_to_choose():
    (found,) = lessons_of(stages(each_alone=4.0, retrained=1.0), [], TWO, NOTHING)
    np.testing.assert_allclose([(c.before, c.after) for c in found.comparisons], [(4.0, 1.0)])


def test_the_best_alone_that_are_the_best_together_did_not_teach_the_lesson():
    assert said(stages(each_alone=2.0, chosen_together=2.0)) == {"The members": "did not hold"}


def test_what_was_fitted_does_not_count_unless_there_is_nothing_else():
    scores = {ALONE: {"y": {"A": 1.0, "B": 8.0}}, CHOSEN: {"y": {"A": 2.0, "B": 4.0}}}
    (found,) = lessons_of(scores, [], TWO, NOTHING)
    np.testing.assert_allclose((found.comparisons[0].before, found.comparisons[0].after), (8.0, 4.0))
    (found,) = lessons_of(scores, [], cases(Role.ESTIMATION, Role.ESTIMATION), NOTHING)
    np.testing.assert_allclose((found.comparisons[0].before, found.comparisons[0].after), np.sqrt((8.0, 8.0)))


@pytest.mark.parametrize(
    ("pairs", "verdict"),
    [
        ([(2.0, 1.0), (3.0, 1.0)], "held"),
        ([(2.0, 1.0), (1.0, 3.0)], "held for a only"),
        ([(1.0, 1.0), (1.0, 3.0)], "did not hold"),
        ([(float("inf"), 1.0)], "held"),
        ([(float("inf"), float("inf"))], "did not hold"),
    ],
)
def test_a_lesson_holds_as_far_as_its_comparisons_do(pairs: list[tuple[float, float]], verdict: str):
    parts = tuple(Comparison(what="ab"[i], before=b, after=a) for i, (b, a) in enumerate(pairs))
    lesson = Lesson(claim="It does", before="x", after="y", comparisons=parts, published="Table 1")
    assert lesson.verdict == verdict
    assert lessons_point([lesson]) == ("Lessons", f"It does: {verdict}.")


def test_the_table_has_figures_and_says_what_diverges():
    parts = (
        Comparison(what="a", before=4.0, after=2.0, one_step=1e-6),
        Comparison(what="b", before=float("inf"), after=1.0),
    )
    table = lessons_table([Lesson(claim="It does", before="so", after="thus", comparisons=parts, published="Table 1")])
    assert table["rows"] == [
        ["It does", "a: so (where it has 1.00\u00a0×\u00a010⁻⁶), then thus", 4.0, 2.0, "2.0\u00a0×", "held", "Table 1"],
        ["", "b: so, then thus", "diverges", 1.0, "", "", ""],
    ]
    assert all(len(row) == len(table["head"]) for row in table["rows"])


def test_what_was_published_stands_beside_its_lesson():
    words = LessonsConfig(together="Table 6.1")
    (found,) = lessons_of(stages(each_alone=2.0, chosen_together=1.0), [], TWO, words)
    assert found.published == "Table 6.1"


def test_a_case_that_is_no_number_diverges():
    found = lessons_of(stages(each_alone=float("nan"), chosen_together=1.0), [], TWO, NOTHING)
    assert found[0].comparisons[0].before == float("inf")
    assert found[0].verdict == "held"
