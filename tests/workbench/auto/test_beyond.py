"""Models that did alike on a record are compared on other commands, where nobody knows what the plant would do."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from sysid.models import ARX, ARXModel, Mapping, NeuralStateSpace
from sysid.reporting.sweep_record import Trial
from sysid.traces import Channel, Trace
from sysid.workbench.auto.beyond import FEWEST, TOLD, Beyond, Models, look_beyond
from sysid.workbench.auto.words import choose, sentence, shown_in
from sysid.workbench.auto.worth import error
from sysid.workbench.sweep.search_space import Point
from tests.workbench.auto.searches import trial

CHANNELS = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
U = np.repeat([0.0, 1.0, 0.0, 1.0], 100)
RECORD = Trace(name="steps", sample_time=1.0, channels=CHANNELS, values=np.column_stack([U, U]))


def model(pole: float) -> ARXModel:
    """All of them come to rest at the input, sooner or later: long steps tell them apart the least."""
    return ARXModel(
        orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.array([1.0 - pole, pole]), intercept=0.0,
        mapping=Mapping.parse("u -> y"), sample_time=1.0, input_units=("V",), output_unit="V", rest_output=0.0,
    )  # fmt: skip


def network(number: int, rms: float) -> Trial:
    point = Point(number=number, structure=NeuralStateSpace(states=2, neurons=number), training={}, values={})
    return trial(point, rms**2).model_copy(update={"operations": 10 * number})


def looked(poles: dict[int, Sequence[float]], trials: Sequence[Trial]) -> Beyond:
    def fitted(one: Trial) -> list[Models]:
        return [[model(pole)] for pole in poles[one.number]]

    return look_beyond(trials, error, fitted, [RECORD], [1.0], seed=0)


ALIKE = [0.8, 0.8, 0.8, 0.8]
TRIALS = [network(1, 0.102), network(2, 0.100)]


def test_models_that_are_one_are_not_apart() -> None:
    found = looked({1: ALIKE, 2: ALIKE}, TRIALS)
    assert not found.tells(0.0)
    assert found.sentence(0.0, str) == ""


def test_what_rounding_leaves_of_exact_models_is_not_told() -> None:
    found = looked({1: [0.8, 0.8 + 1e-12, 0.8 - 1e-12], 2: [0.8 + 2e-12] * 3}, [network(1, 1e-15), network(2, 1e-15)])
    assert (found.models, found.spread, found.of(TRIALS[1])) == (6, 0.0, 0.0)
    assert found.sentence(1e-30, str) == ""


def test_of_those_that_did_alike_the_one_that_stands_alone_is_not_chosen() -> None:
    found = looked({1: ALIKE, 2: [0.99, 0.5, 0.98, 0.8]}, TRIALS)
    assert found.of(TRIALS[0]) == 0.0 < found.of(TRIALS[1])
    assert choose(TRIALS[::-1], error, lambda some: (some[0], 0)).chosen.number == 1  # the smaller within 3 %
    far = [network(1, 0.110), network(2, 0.100)]
    assert choose(far, error, lambda some: (some[0], 0)).chosen.number == 2
    choice = choose(far, error, lambda some: (some[0], 0), beyond=found.of)
    assert choice.chosen.number == 1
    said = sentence(choice, 2, unit="V", ended="the end", error=error, beyond=found.away)
    assert f"of {shown_in('V', 0.11)} on what chose and {shown_in('V', 0.0)} from the middle of all on other" in said
    assert f"NSS 2/2, of the least error, has {shown_in('V', 0.1)}" in said


def test_what_the_record_does_not_show_is_told_with_its_size() -> None:
    found = looked({1: [0.5, 0.9, 0.99, 0.8], 2: [0.6, 0.95, 0.3, 0.98]}, TRIALS)
    size = math.sqrt(found.spread)
    assert found.tells((size / (1.01 * TOLD)) ** 2)
    assert not found.tells((size / (0.99 * TOLD)) ** 2)
    said = found.sentence((size / 3.0) ** 2, lambda value: shown_in("V", value))
    assert said.startswith("Not shown by the record: on other commands")
    assert f"8 models that did alike are {shown_in('V', size)}" in said
    assert "3 times its error" in said


def test_the_middle_is_that_of_those_that_did_alike_and_no_merit_of_others() -> None:
    trials = [*TRIALS, network(3, 0.19)]
    found = looked({1: ALIKE, 2: [0.99] * 4, 3: [0.8] * 20}, trials)
    assert found.models == 8
    assert (found.of(trials[2]), found.away(trials[2])) == (0.0, 0.0)
    assert min(map(found.away, TRIALS)) > 0.0


def test_a_run_that_is_lost_is_far_away_and_bounded() -> None:
    found = looked({1: ALIKE, 2: [0.8, 0.8, 0.8, 1.5]}, TRIALS)
    assert found.spread == 0.0
    only = looked({1: ALIKE, 2: [1.5] * 3}, TRIALS)
    assert math.isfinite(only.of(TRIALS[1]))
    assert only.of(TRIALS[1]) > 1.0


def test_a_model_that_is_fitted_later_stands_alone_where_those_before_do_not_go() -> None:
    found = looked({1: [0.79, 0.8, 0.81], 2: [0.78, 0.8, 0.82]}, TRIALS)
    least = found.spread
    assert not found.alone(model(0.8), least)
    assert not found.alone(model(0.79), least)
    assert found.alone(model(0.99), least)
    assert not found.alone(model(0.99), 10.0)  # within what its error lets expect
    assert not Beyond().alone(model(0.99), 0.0)


def test_one_that_stands_alone_is_told_though_all_others_are_near_each_other() -> None:
    found = looked({1: [0.79, 0.8, 0.81], 2: [0.78, 0.8, 0.82]}, TRIALS)
    assert not found.tells(found.spread)
    assert found.sentence_of(model(0.8), found.spread, str) == ""
    assert found.middle is not None
    own = math.sqrt(found.middle.away([model(0.99)]))
    said = found.sentence_of(model(0.99), found.spread, lambda value: shown_in("V", value))
    assert said.startswith("Not shown by the record: on other commands")
    assert f"this one is {shown_in('V', own)} (root mean square) from the middle of 6 models" in said
    # what is told of all of them is not told twice
    assert found.sentence_of(model(0.99), 0.0, str) == found.sentence(0.0, str) != ""


def test_models_of_one_output_each_are_compared_with_their_own_column() -> None:
    u = RECORD["u"]
    channels = (*CHANNELS, Channel(name="z", unit="V"))
    record = Trace(name="steps", sample_time=1.0, channels=channels, values=np.column_stack([u, u, u]))

    def both(pole: float, other: float) -> list[ARXModel]:
        return [model(pole), replace(model(other), mapping=Mapping.parse("u -> z"))]

    poles = [(0.79, 0.2), (0.8, 0.3), (0.81, 0.4)]
    found = look_beyond(TRIALS, error, lambda _: [both(*one) for one in poles], [record], [1.0, 1.0], seed=0)
    first, second = both(0.3, 0.3)
    assert found.alone(first, 0.0)
    assert not found.alone(second, 0.0)


def test_what_a_verdict_depends_on_is_in_its_digest() -> None:
    one, same, other = (looked({1: [0.7, 0.8, last], 2: [0.9] * 3}, TRIALS) for last in (0.81, 0.81, 0.85))
    assert one.digest == same.digest != other.digest
    assert Beyond().digest == ""


def test_the_models_of_one_trial_have_a_middle() -> None:
    """On a busy machine a search of a minute has no others: nothing was compared, and nothing said."""
    found = looked({1: [0.5, 0.9, 0.99, 0.8]}, TRIALS[:1])
    assert found.models == 4
    assert found.tells(0.0)
    assert found.of(TRIALS[0]) == 0.0
    assert found.alone(model(0.999), 0.0)


@pytest.mark.parametrize("count", [0, FEWEST // 2 - 1])
def test_a_few_models_have_no_middle(count: int) -> None:
    found = looked({1: [0.8] * count, 2: [0.9] * count}, TRIALS)
    assert found == Beyond()


def test_records_without_twenty_samples_in_a_row_are_not_asked() -> None:
    short = Trace(name="short", sample_time=1.0, channels=CHANNELS, values=RECORD.values[:10])
    assert look_beyond(TRIALS, error, lambda _: [[model(0.8)]] * 6, [short], [1.0], seed=0) == Beyond()


def test_of_several_outputs_errors_count_over_what_was_given() -> None:
    one = looked({1: [0.5, 0.9, 0.99], 2: [0.6, 0.95, 0.3]}, TRIALS)

    def fitted(some: Trial) -> list[Models]:
        return [[model(pole)] for pole in ([0.5, 0.9, 0.99] if some.number == 1 else [0.6, 0.95, 0.3])]

    assert look_beyond(TRIALS, error, fitted, [RECORD], [4.0], seed=0).spread == pytest.approx(one.spread / 4.0)
