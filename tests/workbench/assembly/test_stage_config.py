"""What each round of training end to end is asked for: what it names, and else what the round before was."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from sysid.workbench.assembly.stage_config import TogetherConfig, names_in


def together(**fields) -> TogetherConfig:
    given = {"targets": {"BC": 0.1}, "traces": 2, "training": {"max_iterations": 9, "stride": 3, "robust_scale": 2.0}}
    return TogetherConfig.model_validate(given | fields)


def test_without_again_there_is_one_round():
    (only,) = together().rounds
    assert only == together()


def test_a_round_keeps_what_it_does_not_name():
    first, second, third = together(again=[{"traces": 5}, {"max_iterations": 4, "robust_scale": 1.0}]).rounds
    assert (first.traces, second.traces, third.traces) == (2, 5, 5)
    assert second.targets == first.targets
    options = [one.plan().training for one in (first, second, third)]
    assert [(one.max_iterations, one.robust_scale) for one in options] == [(9, 2.0), (9, 2.0), (4, 1.0)]
    assert {one.stride for one in options} == {3}


def test_what_is_read_from_a_round_on_is_not_wired_again_in_the_next():
    rounds = together(reads={"BC": {"AR": (1,)}}, again=[{"traces": 3}, {"reads": {"AR": {"BC": (1,)}}}]).rounds
    assert [set(one.reads) for one in rounds] == [{"BC"}, set(), {"AR"}]


def test_a_channel_that_was_measured_in_one_round_may_be_trained_in_the_next():
    both = {"targets": {"BP": 0.2, "BC": 0.1}, "measured": []}
    one = together(measured=["BP"], again=[{"traces": 3}, both])
    assert [one.measured for one in one.rounds] == [("BP",), ("BP",), ()]
    named = names_in(one.rounds)
    assert (named["measured"], named["targets"]) == (("BP",), ("BC", "BP"))


def test_data_sets_that_a_round_has_beside_the_others_stay_for_the_next():
    one = together(again=[{"also": ["hard"]}, {"traces": 3}, {"also": []}])
    assert [each.also for each in one.rounds] == [(), ("hard",), ("hard",), ()]
    assert one.data == ("hard",)


def test_a_round_may_train_other_members():
    one = together(members=["BP"], again=[{"traces": 3}, {"members": ["BC"]}])
    assert [one.members for one in one.rounds] == [("BP",), ("BP",), ("BC",)]


def test_a_round_that_inherits_a_measured_channel_does_not_judge_it():
    with pytest.raises(ValidationError, match="BP is to be as measured"):
        together(measured=["BP"], again=[{"targets": {"BP": 0.2}}])


def test_without_a_robust_scale_squares_count():
    assert together(training={"max_iterations": 9}).plan().training.robust_scale == np.inf


def test_a_round_may_count_jumps_and_exploded_sensitivities_otherwise():
    rounds = together(again=[{"moves": 10}, {"leverage": 100}]).rounds
    options = [one.plan().training for one in rounds]
    assert [(one.moves, one.leverage) for one in options] == [(np.inf, np.inf), (10.0, np.inf), (10.0, 100.0)]


@pytest.mark.parametrize("name", ["robust_scale", "moves", "leverage"])
@pytest.mark.parametrize("value", [0, -1.0])
def test_a_limit_of_a_round_that_is_none_is_refused(name, value):
    with pytest.raises(ValidationError, match=name):
        together(again=[{name: value}])


def test_a_round_may_have_windows_of_its_own_and_by_default_those_that_it_needs():
    rounds = together(again=[{"windows": [50, 200]}, {"windows": []}, {"windows": "auto"}]).rounds
    assert [one.plan().training.windows for one in rounds] == ["auto", (50, 200), (), "auto"]
