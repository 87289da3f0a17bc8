"""What is declared of a composite, and what cannot be."""

from __future__ import annotations

import pytest

from sysid.composite import ActiveLearning, Composite, RoundPlan, TrainingPlan
from sysid.errors import ConfigError
from sysid.models import ARX, NARX
from tests.composite.composites import fixed, member, pipe


def test_a_member_writes_one_channel_for_each_of_its_instances():
    valve = pipe().member("AR")
    assert valve.outputs == ["AR", "AR9"]
    assert [valve.channel("STP", "9"), valve.channel("BP", "9")] == ["STP", "BP9"]


@pytest.mark.parametrize(
    ("declare", "said"),
    [
        pytest.param(
            lambda: member("a -> b", structure=ARX(na=1, nb=[1], nk=[1])),
            "an ARX model cannot be a member",
            id="no network",
        ),
        pytest.param(
            lambda: member("a -> b", structure=NARX(input_delays=[[0], [0]], output_delays=1, neurons=1)),
            "input",
            id="lags of more inputs than there are",
        ),
        pytest.param(lambda: member("a -> b", traces=0), "traces of a -> b is too small", id="no traces"),
        pytest.param(lambda: member("a -> b", instances=()), "stands nowhere", id="no instance"),
        pytest.param(lambda: fixed("a -> b", gains={}), "gains of a -> b", id="no gain"),
        pytest.param(lambda: fixed("a -> b", gains={"a": {}}), "no such lags", id="no lag"),
        pytest.param(lambda: fixed("a -> b", gains={"a": {-1: 1.0}}), "no such lags", id="a lag to come"),
        pytest.param(lambda: fixed("a -> b", gains={"a": 1, "b": {1: 1}}), "own past", id="lags of its own"),
        pytest.param(lambda: fixed("a -> b", gains={"a": 1}, rest=2), "bounds of b", id="rest above high"),
        pytest.param(lambda: Composite(members=()), "no member is fitted", id="no member"),
        pytest.param(
            lambda: Composite(members=(member("a -> b"), member("c -> b"))), "two members write", id="a channel twice"
        ),
        pytest.param(lambda: pipe().member("STP"), "no member writes STP", id="a stranger"),
        pytest.param(lambda: RoundPlan(targets={}), "no targets", id="a round without targets"),
        pytest.param(
            lambda: ActiveLearning(outputs=("a",), within=1.0, additions=()), "additions is too small", id="no addition"
        ),
        pytest.param(lambda: ActiveLearning(outputs=("a",), within=1.0, pick="best"), "pick best", id="a pick"),
        pytest.param(lambda: ActiveLearning(outputs=("a",), within=0.0), "within 0", id="no limit"),
        pytest.param(
            lambda: TrainingPlan(outputs=("a",), active_learning=ActiveLearning(outputs=("a",), within=1.0)),
            "without training end to end",
            id="active learning alone",
        ),
    ],
)
def test_what_cannot_be_is_refused(declare, said):
    with pytest.raises(ConfigError, match=said):
        declare()
