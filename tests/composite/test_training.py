"""Training a composite from Python: stage after stage, kept by whoever wants to, refused before anything is fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sysid.composite import (
    ActiveLearning,
    Composite,
    MakeAll,
    OneStep,
    Retraining,
    RoundPlan,
    TrainingData,
    TrainingPlan,
    train,
    whole_score,
)
from sysid.errors import ChannelError, ConfigError
from sysid.estimation import CascadeFit, FitResult, JointTraining
from sysid.models import NARX
from tests.composite.composites import fixed, member, tank_trace, tanks

QUICK = JointTraining(max_iterations=3, stride=2, checkpoints=2, workers=1)
ROUND = RoundPlan(targets={"upper": 0.1, "lower": 0.1}, training=QUICK)
PLAN = TrainingPlan(
    outputs=("upper", "lower"),
    one_step=OneStep(max_iterations=10, starts=1),
    retrain=Retraining(members=("lower",), max_iterations=3),
    rounds=(ROUND,),
    active_learning=ActiveLearning(
        outputs=("lower",), within=0.001, additions=(1,), rounds=(replace(ROUND, training=replace(QUICK, stride=3)),)
    ),
)


def data() -> TrainingData:
    return TrainingData(
        estimation=[tank_trace(0), tank_trace(1)],
        selection=[tank_trace(2)],
        pool=lambda number: [tank_trace(10 * number), tank_trace(10 * number + 1)],
        held_out=[tank_trace(5)],
    )


class Shelf(MakeAll):
    """A keeper that keeps everything in memory, by name and terms."""

    def __init__(self) -> None:
        super().__init__()
        self.kept: dict[str, tuple[dict, FitResult | CascadeFit]] = {}
        self.made: list[str] = []
        self.heard: list[str] = []

    def keep(self, task):
        before = self.kept.get(task.name)
        if before is not None and before[0] == task.terms:
            return task.put(before[1])
        self.made.append(task.name)
        fit = task.make(lambda _: None)
        assert isinstance(fit, task.kind)
        self.kept[task.name] = (dict(task.terms), fit)
        return fit

    def decide(self, decision):
        found = super().decide(decision)
        self.heard.append(f"{decision.title}: {decision.outcome(found)}")
        return found


def test_every_stage_goes_on_from_the_one_before_and_the_best_is_chosen():
    shelf = Shelf()
    found = train(tanks(), PLAN, data(), keeper=shelf)
    assert list(found.stages) == [
        "each alone, one step ahead", "each alone", "chosen together", "retrained", "trained end to end",
        "active learning, round 1",
    ]  # fmt: skip
    assert shelf.made == [
        "pump+lower -> upper 0", "pump+lower -> upper 0 one step", "pump+lower -> upper 1",
        "pump+lower -> upper 1 one step", "upper -> lower 0", "upper -> lower 0 one step",
        "upper -> lower retrained 0", "together", "active-learning-1",
    ]  # fmt: skip
    assert [one.name for one in found.rounds] == ["1", "1 of active learning"]
    assert [one.traces for one in found.rounds] == [2, 3]
    assert found.active_learning is not None
    assert found.active_learning.rounds[1].added[0] in {"tank 10", "tank 11"}
    assert found.selection[found.chosen] == min(found.selection.values())
    assert found.model is found.stages[found.chosen]
    choosing = [tank_trace(2), tank_trace(5)]
    assert found.selection["each alone"] == whole_score(found.stages["each alone"], choosing, ("upper", "lower"))
    assert found.model.inputs == ("pump",)
    assert shelf.heard[0].startswith("Choosing the members by the error of the whole: 2 wholes, best ")

    # What is kept under the same terms is found again, and gives the same whole.
    shelf.made.clear()
    again = train(tanks(), PLAN, data(), keeper=shelf)
    assert shelf.made == []
    assert again.model.to_dict() == found.model.to_dict()
    train(tanks(), replace(PLAN, rounds=(replace(ROUND, targets={"lower": 0.1}),)), data(), keeper=shelf)
    assert shelf.made == ["together", "active-learning-1"], "what comes before a changed round is found again"


def test_a_whole_goes_on_from_a_trained_one():
    short = TrainingPlan(outputs=("lower",), rounds=(ROUND,))
    first = train(tanks(), TrainingPlan(outputs=("lower",)), data()).model
    found = train(tanks(), short, data(), begin=first)
    assert list(found.stages) == ["as it was begun from", "trained end to end"]
    assert found.candidates is None
    assert_array_equal(found.stages["as it was begun from"].member("upper").theta, first.member("upper").theta)
    with pytest.raises(ConfigError, match="no such lower"):
        wide = member("upper -> lower", 0.0, structure=NARX(input_delays=[0], output_delays=1, neurons=9))
        train(Composite(members=(tanks().members[0], wide)), short, data(), begin=first)


def test_fits_that_are_given_are_candidates_as_they_are():
    shelf, plan = Shelf(), TrainingPlan(outputs=("upper", "lower"))
    train(tanks(), plan, data(), keeper=shelf)
    given = shelf.kept["upper -> lower 0"][1]
    assert isinstance(given, FitResult)
    upper, lower = tanks().members
    bare = Composite(members=(upper, replace(lower, candidates=0)))
    found = train(bare, plan, data(), given={"lower": [given]}, keeper=shelf)
    assert found.candidates is not None
    assert [one.model for one in found.candidates.fits["lower"]] == [given.model]
    with pytest.raises(ConfigError, match="has no candidates"):
        train(bare, plan, data())
    with pytest.raises(ConfigError, match="no network pump\\+lower -> upper"):
        train(tanks(), plan, data(), given={"upper": [given]})


def test_candidates_have_seeds_of_their_own_from_that_of_the_training_on():
    upper, lower = tanks().members
    composite = Composite(members=(replace(upper.trained(seed=7), candidates=2), lower))
    found = train(composite, TrainingPlan(outputs=("lower",)), data())
    assert found.candidates is not None
    one, two = found.candidates.fits["upper"]
    assert [one.member.training.seed, two.member.training.seed] == [7, 1007]
    assert not np.array_equal(one.model.theta, two.model.theta)


@pytest.mark.parametrize(
    ("plan", "said"),
    [
        pytest.param({"outputs": ("level",)}, "outputs names level", id="an output that chooses"),
        pytest.param({"retrain": Retraining(members=("pump",))}, "no member writes pump", id="a member to retrain"),
        pytest.param({"rounds": (replace(ROUND, members=("pump",)),)}, "no member writes pump", id="of a round"),
        pytest.param({"rounds": (RoundPlan(targets={"level": 1.0}),)}, "targets names level", id="a target"),
        pytest.param({"rounds": (replace(ROUND, measured=("level",)),)}, "measured names level", id="as measured"),
        pytest.param(
            {"rounds": (replace(ROUND, reads={"upper": {"lower": (1,)}}),)}, "reads some of these lags", id="lags"
        ),
        pytest.param({"rounds": (replace(ROUND, also=("rare",)),)}, "also names rare", id="traces"),
    ],
)
def test_a_stage_that_cannot_be_is_refused_before_anything_is_fitted(plan, said):
    shelf = Shelf()
    with pytest.raises(ConfigError, match=said):
        train(tanks(), replace(PLAN, active_learning=None, **plan), data(), keeper=shelf)
    assert shelf.made == []


def test_members_that_need_each_other_within_a_sample_are_refused_before_anything_is_fitted():
    at_once = NARX(input_delays=[[0, 1], [0]], output_delays=1, neurons=3)
    upper, lower = tanks().members
    with pytest.raises(ConfigError, match="lower needs upper"):
        train(Composite(members=(replace(upper, structure=at_once), lower)), PLAN, data(), keeper=MakeAll())


def test_traces_without_a_channel_or_without_any_that_choose_are_refused():
    lid = fixed("lid -> open", gains={"lid": 1})
    with pytest.raises(ChannelError, match="lid"):
        train(tanks(fixed=(lid,)), PLAN, data())
    with pytest.raises(ConfigError, match="trained on traces to fit, and chosen by others"):
        TrainingData(estimation=[tank_trace(0)], selection=[])
    with pytest.raises(ConfigError, match="nothing says what a round"):
        TrainingData(estimation=[tank_trace(0)], selection=[tank_trace(1)], pool=[tank_trace(2)])
    with pytest.raises(ConfigError, match="nothing to add from"):
        train(tanks(), PLAN, replace(data(), pool=None))
