"""Two runs over the same inputs come together, or it is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid.estimation.results.result import FitResult, Loop, Status
from sysid.estimation.stability import StabilityOptions
from sysid.estimation.stability.beginnings import Beginnings, compare_beginnings
from sysid.estimation.stability.check import FreeRunCheck
from sysid.estimation.stability.excursions import Excursions
from sysid.estimation.stability.free_run import Run, check_stability
from sysid.estimation.stability.other_commands import OtherCommands
from sysid.estimation.stability.sequences import InputSequence
from sysid.models import ARX, ARXModel, Mapping
from sysid.traces import Trace
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")


def model(pole: float = 0.9) -> ARXModel:
    return ARXModel(
        orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.array([1.0 - pole, pole]), intercept=0.0,
        mapping=MAPPING, sample_time=0.5, input_units=("V",), output_unit="V", rest_output=0.0,
    )  # fmt: skip


def record() -> Trace:
    """Always in motion, so that there is no plateau on which it would be seen where a run settles."""
    u = np.random.default_rng(0).uniform(0.0, 1.0, 2000)
    return trace_of({"u": u, "y": model().simulate(u[:, None])}, sample_time=0.5)


def swinging(share: float) -> Run:
    """A run that swings by itself from where it begins on, within its bounds, on a share of the sequences."""
    rng = np.random.default_rng(1)

    def run(sequence: InputSequence) -> np.ndarray:
        steady = model().simulate(sequence.inputs, sequence.history(several=False))
        swings = rng.random() < share
        return steady + swings * 0.3 * np.sin(0.7 * np.arange(len(steady)) + rng.uniform(0.0, 6.0))

    return run


@pytest.mark.parametrize(
    ("run", "forgets"), [(model(), True), (model(0.99), True), (swinging(0.01), True), (swinging(0.2), False)]
)
def test_a_run_that_swings_by_itself_does_not_forget_where_it_began(run: Run | ARXModel, forgets: bool) -> None:
    found = check_stability(run, Excursions.of([record()], ["u"], ["y"]), count=150)
    assert found.stable  # it stays within its bounds
    assert found.beginnings is not None
    assert found.beginnings.sequences == 100
    assert found.forgets is forgets
    assert found.to_dict().get("apart", 0) == (0 if forgets else found.beginnings.apart)


def test_a_run_is_asked_over_commands_in_another_order_than_the_record_had() -> None:
    """Passages that match where the one before ended pass by what the record does not: a run had a second place to
    stand, and was far off on new commands, with one excursion in a hundred that showed it."""
    record = trace_of({"u": np.repeat([0.0, 1.0, 2.0, 1.0], 100), "y": np.zeros(400)}, sample_time=0.5)

    def latched(sequence: InputSequence) -> np.ndarray:
        """Follows what is recorded, and stays wherever it once goes up by two at once."""
        up = np.diff(sequence.inputs[:, 0], prepend=sequence.inputs[0, 0]) > 1.5
        return np.maximum.accumulate(up).astype(np.float64)

    excursions, commands = Excursions.of([record], ["u"], ["y"]), OtherCommands.of([record], ["u"], ["y"])
    assert check_stability(latched, excursions, count=100).forgets
    found = check_stability(latched, excursions, count=100, commands=commands)
    assert not found.forgets
    assert found.beginnings is not None
    assert found.beginnings.sequences == 100


def test_a_check_of_records_asks_commands_of_them() -> None:
    found = FreeRunCheck.of(StabilityOptions(count=20), MAPPING, [record()])
    assert found.commands is not None
    assert found.apart(model()) == 0
    assert FreeRunCheck.of(StabilityOptions(sequences=(record(),)), MAPPING, []).commands is None


@pytest.mark.parametrize("far", [1e200, np.inf, np.nan])
def test_a_second_run_that_explodes_is_apart_and_warns_of_nothing(far: float) -> None:
    sequence = InputSequence(name="a", inputs=np.zeros((30, 1)), targets=np.zeros(30), judged=np.ones(30, dtype=bool))
    found = compare_beginnings(
        lambda some: ((one, np.full((len(one.inputs), 1), far)) for one in some), [(sequence, np.zeros((30, 1)))],
        np.ones(1),
    )  # fmt: skip
    assert (found.sequences, found.apart) == (1, 1)


def test_what_leaves_its_bounds_is_not_asked() -> None:
    found = check_stability(model(1.05), Excursions.of([record()], ["u"], ["y"]), count=20)
    assert found.unbounded
    assert found.beginnings is None


def test_a_fit_that_does_not_forget_says_so_and_keeps_its_status(monkeypatch: pytest.MonkeyPatch) -> None:
    check = FreeRunCheck.of(StabilityOptions(count=20), MAPPING, [record()])
    fit = FitResult(model=model(), status=Status.CONVERGED, loop=Loop.CLOSED, history={}, train_time_s=0.0)
    assert not check.applied(fit).warnings
    asked = check.finding(model())
    assert asked is not None
    swings = replace(asked, beginnings=Beginnings(sequences=20, apart=9))
    monkeypatch.setattr(FreeRunCheck, "finding", lambda *_, **__: swings)
    told = check.applied(fit)
    assert told.status is Status.CONVERGED
    assert told.stability is not None
    assert told.stability["apart"] == 9
    assert len(told.warnings) == 1
    assert "hangs on where it began, on 9 of 20 random sequences" in told.warnings[0]
    assert set(told.warnings) <= set(told.notes)


def test_a_check_takes_the_place_of_what_one_before_it_said(monkeypatch: pytest.MonkeyPatch) -> None:
    check = FreeRunCheck.of(StabilityOptions(count=20), MAPPING, [record()])
    fit = FitResult(model=model(), status=Status.CONVERGED, loop=Loop.CLOSED, history={}, train_time_s=0.0)
    asked = check.finding(model())
    assert asked is not None
    swings = replace(asked, beginnings=Beginnings(sequences=20, apart=9))
    with monkeypatch.context() as patched:
        patched.setattr(FreeRunCheck, "finding", lambda *_, **__: swings)
        told = check.applied(replace(fit, notes=("kept",), warnings=("kept",)))
    again = check.applied(told)
    assert again.notes == ("kept", asked.sentence)
    assert again.warnings == ("kept",)
