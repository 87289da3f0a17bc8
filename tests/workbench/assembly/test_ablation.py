"""Ablation: what the stages say of each step of modelling by parts, and what they do not say."""

from __future__ import annotations

import numpy as np

from sysid.composite.training import ALONE, CHOSEN, ONE_STEP, RETRAINED, TOGETHER
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.workbench.assembly.ablation import ablations_of
from sysid.workbench.assembly.stage_config import AblationConfig

NOTHING = AblationConfig()


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


def better(scores: dict[str, dict[str, dict[str, float]]]) -> dict[str, bool]:
    """Whether the whole is better after a step."""
    return {
        one.step: one.comparisons[-1].after < one.comparisons[-1].before
        for one in ablations_of(scores, [], TWO, NOTHING)
    }


def test_a_lesson_without_its_stages_is_not_mentioned():
    assert ablations_of(stages(each_alone=1.0), [], TWO, NOTHING) == []


def test_each_lesson_compares_a_stage_with_the_one_before_it():
    found = {ONE_STEP: 9.0, ALONE: 4.0, CHOSEN: 2.0, RETRAINED: 3.0, TOGETHER: 2.5, f"{TOGETHER}, round 2": 1.0}
    scores = {name: {"y": {"A": 1e-9, "B": error}} for name, error in found.items()}
    figures = [(c.before, c.after) for one in ablations_of(scores, [], TWO, NOTHING) for c in one.comparisons]
    np.testing.assert_allclose(figures, [(9.0, 4.0), (4.0, 2.0), (2.0, 3.0), (3.0, 1.0)])
    assert better(scores) == {
        "close_loop": True,
        "choose_together": True,
        "retrain": False,
        "train_together": True,
    }


def test_retraining_is_held_against_the_members_alone_where_there_was_nothing_to_choose():
    (found,) = ablations_of(stages(each_alone=4.0, retrained=1.0), [], TWO, NOTHING)
    np.testing.assert_allclose([(c.before, c.after) for c in found.comparisons], [(4.0, 1.0)])


def test_the_best_alone_that_are_the_best_together_did_not_teach_the_lesson():
    assert better(stages(each_alone=2.0, chosen_together=2.0)) == {"choose_together": False}


def test_what_was_fitted_does_not_count_unless_there_is_nothing_else():
    scores = {ALONE: {"y": {"A": 1.0, "B": 8.0}}, CHOSEN: {"y": {"A": 2.0, "B": 4.0}}}
    (found,) = ablations_of(scores, [], TWO, NOTHING)
    np.testing.assert_allclose((found.comparisons[0].before, found.comparisons[0].after), (8.0, 4.0))
    (found,) = ablations_of(scores, [], cases(Role.ESTIMATION, Role.ESTIMATION), NOTHING)
    np.testing.assert_allclose((found.comparisons[0].before, found.comparisons[0].after), np.sqrt((8.0, 8.0)))


def test_what_was_published_stands_beside_its_lesson():
    words = AblationConfig(together="Table 6.1")
    (found,) = ablations_of(stages(each_alone=2.0, chosen_together=1.0), [], TWO, words)
    assert found.published == "Table 6.1"


def test_a_case_that_is_no_number_diverges():
    found = ablations_of(stages(each_alone=float("nan"), chosen_together=1.0), [], TWO, NOTHING)
    assert found[0].comparisons[0].before == float("inf")
