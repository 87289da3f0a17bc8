"""Which trial is chosen, and why."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid.models import ARX, NeuralStateSpace
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.words import choose, sentence
from sysid.workbench.auto.worth import error
from sysid.workbench.sweep.search_space import Point
from tests.workbench.auto.searches import trial


def network(number: int, rms: float, operations: int) -> Trial:
    point = Point(number=number, structure=NeuralStateSpace(states=2, neurons=number), training={}, values={})
    return trial(point, rms**2).model_copy(update={"operations": operations})


def arx(number: int, rms: float) -> Trial:
    point = Point(number=number, structure=ARX(na=1, nb=(1,), nk=(1,)), training={}, values={})
    return trial(point, rms**2).model_copy(update={"operations": 2})


def stable(trials: Sequence[Trial]) -> tuple[Trial, int]:
    return trials[0], 0


TRIALS = [arx(1, 2.0), network(2, 1.02, 20), network(3, 1.0, 60), network(4, 1.2, 10)]


def test_the_smallest_of_those_that_are_as_good_is_chosen() -> None:
    found = choose(TRIALS, error, stable)
    assert (found.chosen.number, found.least.number) == (2, 3)
    assert found.linear is not None
    assert found.linear.number == 1


def test_an_ensemble_is_chosen_where_it_gains_and_says_its_price() -> None:
    one = network(2, 1.0, 20)

    def ensemble(rms: float) -> Trial:
        return network(9, rms, 100).model_copy(update={"structure": one.structure, "values": {"ensemble": 5}})

    assert choose([one, ensemble(0.98)], error, stable).chosen.number == 2
    found = choose([one, ensemble(0.8)], error, stable)
    assert found.chosen.number == 9
    said = sentence(found, 2, unit="V", ended="", error=error)
    assert "20% less than one start of it, for 5 times the multiplications a step" in said


def test_a_linear_model_that_is_as_good_is_chosen() -> None:
    found = choose([arx(1, 1.01), network(2, 1.0, 60)], error, stable)
    assert found.chosen.number == 1
    assert "and no nonlinear model does better" in sentence(found, 2, unit="V", ended="", error=error)


def test_one_that_is_chosen_for_its_size_is_not_said_to_be_closer() -> None:
    larger = arx(1, 1.001).model_copy(update={"operations": 80})
    found = choose([larger, network(2, 1.0, 20)], error, stable)
    assert found.chosen.number == 2
    assert "; as much as the best linear model, ARX [1; 1; 1]" in sentence(found, 2, unit="V", ended="", error=error)
    closer = choose([larger, network(2, 0.9, 20)], error, stable)
    assert "; 10% less than the best linear model" in sentence(closer, 2, unit="V", ended="", error=error)


def test_where_no_network_can_be_used_none_is_said_to_be_worse() -> None:
    lost = network(2, 1.0, 60).model_copy(update={"usable": False, "status": "UNSTABLE"})
    said = sentence(choose([arx(1, 1.0), lost], error, stable), 2, unit="V", ended="", error=error)
    assert "the one nonlinear model cannot be used (unstable)" in said
    assert "no nonlinear model does better" not in said


def test_what_came_to_no_result_is_not_said_to_be_worse() -> None:
    late = network(2, float("nan"), 20).model_copy(update={"status": "FAILED", "usable": False})
    said = sentence(choose([arx(1, 1.0), late], error, stable), 2, unit="V", ended="", error=error)
    assert "no nonlinear model came to a result (1 begun)" in said
    assert "does better" not in said
    both = sentence(choose([arx(1, 1.0), late, network(3, 2.0, 60)], error, stable), 3, unit="V", ended="", error=error)
    assert "and no nonlinear model does better (1 more came to no result)" in both


def test_two_models_that_are_exact_are_no_better_than_each_other() -> None:
    smaller = arx(1, 0.0).model_copy(update={"operations": 5})
    found = choose([smaller, arx(2, 0.0), network(3, 1.0, 60)], error, stable)
    assert (found.chosen.number, found.linear.number if found.linear else 0) == (2, 1)
    assert "no nonlinear model does better" in sentence(found, 3, unit="V", ended="", error=error)


def test_a_linear_model_that_what_chose_cannot_tell_from_a_network_is_chosen() -> None:
    scatter = np.tile([0.5, 1.5], 8)
    alike, worse = scatter + 0.1 * np.tile([0.0, 0.0, 3.0, -2.0], 4), scatter + 0.1
    best = network(2, 1.0, 60).model_copy(update={"selection_errors": list(scatter)})
    for errors, number in ((alike, 1), (worse, 2)):
        other = arx(1, 1.05).model_copy(update={"selection_errors": list(errors)})
        found = choose([other, best], error, stable)
        assert found.chosen.number == number
        said = sentence(found, 2, unit="V", ended="", error=error)
        assert ("of those that what chose cannot tell from the least" in said) is (number == 1)


def test_errors_of_rounding_are_alike_and_the_smallest_is_chosen() -> None:
    exact = {"selection_rms_shares": [1e-15]}
    trials = [
        arx(1, 1e-16).model_copy(update={**exact, "operations": 20}),
        arx(2, 5e-15).model_copy(update={**exact, "operations": 3}),
    ]
    assert choose(trials, error, stable).chosen.number == 2


def test_that_no_network_was_tried_is_said() -> None:
    found = choose([arx(1, 1.01)], error, stable)
    said = sentence(found, 1, unit="V", ended="the budget is spent", error=error)
    assert "no nonlinear model was tried; the budget is spent" in said
    assert "no nonlinear model does better" not in said


def test_what_stays_within_the_tolerance_on_more_traces_comes_before_what_has_the_least_mean() -> None:
    """A mean hides a trace that fails behind others that are better than they need to be."""
    shares = {2: [0.009, 0.008, 0.009], 3: [0.001, 0.001, 0.02], 4: [0.03, 0.03, 0.03]}
    trials = [one.model_copy(update={"selection_rms_shares": shares.get(one.number, [])}) for one in TRIALS]
    found = choose(trials, error, stable, tolerance=0.01)
    assert (found.chosen.number, found.least.number) == (2, 2)
    said = sentence(found, 4, unit="V", ended="", error=error)
    assert said.startswith("NSS 2/2 has 100% of what chose within 1% of its range, more than any of less error")
    # Where none stays within it, the error alone chooses, and says so.
    far = choose(trials, error, stable, tolerance=1e-4)
    assert (far.chosen.number, far.least.number) == (2, 3)
    assert "is the smallest within 3%" in sentence(far, 4, unit="V", ended="", error=error)


def test_unstable_ones_are_passed_over_and_counted() -> None:
    def not_three(trials: Sequence[Trial]) -> tuple[Trial, int]:
        n = next(place for place, one in enumerate(trials) if one.number not in {2, 3})
        return trials[n], n

    found = choose(TRIALS, error, not_three)
    assert (found.chosen.number, found.refused) == (4, 2)


def test_dropped_and_failed_trials_are_not_chosen() -> None:
    dropped = network(5, 0.1, 5).model_copy(update={"dropped_at": 2})
    failed = network(6, 0.1, 5).model_copy(update={"usable": False})
    assert choose([*TRIALS, dropped, failed], error, stable).chosen.number == 2


def test_the_sentence_says_what_against_what_and_why_it_ended() -> None:
    found = choose(TRIALS, error, stable)
    said = sentence(found, len(TRIALS), again=3, unit="V", ended="the budget is spent", error=error)
    tried = "4 tried, the 3 best nonlinear models again"
    for words in ("NSS 2/2", "NSS 2/3", "1.02\u00a0V", tried, "49% less", "ARX [1; 1; 1]", "the budget is spent"):
        assert words in said


def test_a_pure_number_has_no_unit_in_the_sentence() -> None:
    said = sentence(choose(TRIALS, error, stable), len(TRIALS), unit="1", ended="", error=error)
    assert "1.02 (root mean square)" in said


def test_a_network_far_ahead_whose_training_goes_on_is_not_passed_over_for_not_being_stable_yet() -> None:
    def third(trials: Sequence[Trial]) -> tuple[Trial, int]:
        return next((one, k) for k, one in enumerate(trials) if one.number == 3)

    trials = [network(1, 0.4, 20), network(2, 0.9, 60), network(3, 1.0, 10)]
    found = choose(trials, error, third, goes_on=lambda _: True)
    assert (found.chosen.number, found.stable) == (1, trials[2])
    said = sentence(found, 3, unit="V", ended="", error=error)
    assert "Its free run was not stable yet: its error is less than half of that of NSS 2/3" in said
    # Where training ends with the choice, or what is stable is nearly as good, the stable one is taken.
    assert choose(trials, error, third).chosen.number == 3
    assert choose([network(1, 0.6, 20), *trials[1:]], error, third, goes_on=lambda _: True).chosen.number == 3
