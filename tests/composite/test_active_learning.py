"""Active learning: the worst sequences are added, each round is a stage, and it ends when it should."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid.composite.active_learning import ActiveLearned, Assessment, learn_actively, sequence_errors
from sysid.composite.members import assembled
from sysid.composite.plan import ActiveLearning
from sysid.models import Cascade
from sysid.traces import Trace
from tests.composite.composites import models, pipe, trace

ASKED = ActiveLearning(outputs=("AR", "BP"), within=0.1, additions=(3, 3, 3, 3))
SEQUENCES = 28


def truth(whole: Cascade, seed: int) -> Trace:
    one = trace(n=60, seed=seed)
    out = whole.simulate_trace(one)
    return replace(one, name=f"T{seed}", values=np.column_stack([out[name] for name in one.channel_names]))


class Trained:
    """Active learning whose whole is right after some rounds and wrong after others,
    and what its training was given."""

    def __init__(self, asked: ActiveLearning = ASKED, *, right_after: tuple[int, ...] = (), pool: int = 20) -> None:
        right = assembled(pipe(), models())
        self.wrong = assembled(pipe(), {name: replace(one, theta=one.theta * 1.05) for name, one in models().items()})
        sequences = [truth(right, seed) for seed in range(8 + pool)]
        self.pool, self.told, self.calls, self.gave = sequences[8:], [], [], [self.wrong]

        def train(now: Cascade, traces, number: int) -> tuple[Cascade, float]:
            self.calls.append((now, [one.name for one in traces], number))
            self.gave.append(replace(right if number in right_after else self.wrong))
            return self.gave[-1], 2.5

        self.found: ActiveLearned = learn_actively(
            asked, self.wrong, train, begins="trained end to end", estimation=sequences[:2], pool=self.pool,
            held_out=sequences[4:8], score=lambda one: float(self.gave.index(one)), report=self.told.append,
        )  # fmt: skip


def test_the_worst_sequences_of_the_pool_are_added_and_none_twice():
    one = Trained()
    errors = sequence_errors(one.wrong, one.pool, ("AR", "BP"))
    order = [one.pool[i].name for i in np.argsort(-errors)]
    assert [each.added for each in one.found.rounds] == [(), tuple(order[:3]), tuple(order[3:6])]
    assert [(each.traces, each.samples) for each in one.found.rounds] == [(2, 120), (5, 300), (8, 480)]
    # What was there before stays, each trace where it stood, and all that has been added comes behind.
    assert [(names, number) for _, names, number in one.calls] == [
        (["T0", "T1", *order[:3]], 1),
        (["T0", "T1", *order[:6]], 2),
    ]
    assert one.told == list(one.found.rounds)


def test_the_control_adds_what_comes_next_in_the_pool():
    one = Trained(replace(ASKED, pick="next"))
    names = [each.name for each in one.pool]
    assert [each.added for each in one.found.rounds] == [(), tuple(names[:3]), tuple(names[3:6])]
    assert "6 sequences, in the order of the pool" in one.found.sentence


def test_each_round_goes_on_from_the_one_before_and_is_a_stage_of_its_own():
    one = Trained()
    assert [now is before for (now, _, _), before in zip(one.calls, one.gave, strict=False)] == [True, True]
    assert [each.stage for each in one.found.rounds] == [
        "trained end to end",
        "active learning, round 1",
        "active learning, round 2",
    ]
    assert [each.number for each in one.found.rounds] == [0, 1, 2]
    assert [(each.seconds, each.score) for each in one.found.rounds] == [(0.0, 0.0), (2.5, 1.0), (2.5, 2.0)]


@pytest.mark.parametrize(
    ("asked", "right_after", "pool", "rounds", "why"),
    [
        pytest.param({}, (2,), 20, 2, "it ended with 99 % under the limit, as aimed at", id="the figure holds"),
        pytest.param({}, (), 20, 2, "it ended after 2 rounds that brought no improvement", id="nothing improves"),
        pytest.param({"patience": 9}, (), 20, 4, "it ended with the last round that was asked for", id="rounds"),
        pytest.param({"patience": 9}, (), 4, 2, "it ended with the pool", id="the pool is empty"),
        pytest.param({"additions": (1, 2), "patience": 9}, (), 20, 2, "last round", id="a number for each"),
    ],
)
def test_it_ends_when(asked: dict, right_after: tuple[int, ...], pool: int, rounds: int, why: str) -> None:
    one = Trained(replace(ASKED, **asked), right_after=right_after, pool=pool)
    assert len(one.calls) == len(one.found.rounds) - 1 == rounds
    assert why in one.found.ended
    assert one.found.ended in one.found.sentence


def test_a_round_may_add_as_many_as_it_names():
    one = Trained(replace(ASKED, additions=(1, 4), patience=9))
    assert [len(each.added) for each in one.found.rounds] == [0, 1, 4]


def test_a_callable_makes_the_sequences_that_each_round_adds_from():
    asked: list[int] = []

    def make(number: int) -> list[Trace]:
        asked.append(number)
        return [replace(each, name=f"{each.name} of {number}") for each in whole.pool[:5]]

    whole = Trained()
    found = learn_actively(
        replace(ASKED, additions=(2, 2), patience=9), whole.wrong, lambda now, *_: (now, 0.0), begins="before",
        estimation=[], pool=make, held_out=whole.pool[5:8], score=lambda _: 1.0,
    )  # fmt: skip
    assert asked == [1, 2]
    assert [[name.split(" of ")[1] for name in each.added] for each in found.rounds] == [[], ["1", "1"], ["2", "2"]]


def test_of_an_error_per_sequence_the_largest_output_counts():
    whole = assembled(pipe(), models())
    sequence = trace(seed=3)
    run = whole.simulate_trace(sequence)
    errors = {name: np.sqrt(np.mean((run[name] - sequence[name]) ** 2)) for name in ("BP", "AR")}
    assert sequence_errors(whole, [sequence], ("BP", "AR"))[0] == pytest.approx(max(errors.values()))
    assert sequence_errors(whole, [sequence], ("AR",))[0] == pytest.approx(errors["AR"])


def test_more_sequences_within_the_limit_are_better_and_else_smaller_rare_errors():
    few, many = Assessment(within=0.5, median=0.0, rare=0.0), Assessment(within=0.6, median=1.0, rare=9.0)
    assert many.better_than(few)
    assert not few.better_than(many)
    assert Assessment(within=0.6, median=1.0, rare=8.0).better_than(many)
    assert Assessment.at(np.array([0.0, 1.0, 2.0, 3.0]), limit=1.5) == Assessment(
        within=0.5, median=1.5, rare=pytest.approx(2.97)
    )
