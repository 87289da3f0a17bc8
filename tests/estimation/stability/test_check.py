"""The check of a free run: who is asked, what is said, where the sequences come from."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.estimation import FitResult, Loop, Status
from sysid.estimation.results.result import NOT_STABLE
from sysid.estimation.stability import FreeRunCheck, PoleCheck, StabilityOptions, check_stability
from sysid.estimation.stability.sequences import InputSequence
from sysid.models import ARX, ARXModel, Mapping
from sysid.traces import Channel, Trace

MAPPING = Mapping.parse("u -> y")


def model(pole: float = 0.9) -> ARXModel:
    return ARXModel(
        orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.array([abs(1.0 - pole), pole]), intercept=0.0,
        mapping=MAPPING, sample_time=0.5, input_units=("V",), output_unit="V", rest_output=0.0,
    )  # fmt: skip


def trace(seed: int = 0) -> Trace:
    u = np.repeat(np.random.default_rng(seed).choice([0.0, 0.5, 1.0], 10), 200)
    u[:200] = 0.0
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
    values = np.column_stack([u, model().simulate(u[:, None])])
    return Trace(name=f"trace {seed}", sample_time=0.5, channels=channels, values=values)


def fit(of: ARXModel, status: Status = Status.CONVERGED) -> FitResult:
    return FitResult(model=of, status=status, loop=Loop.CLOSED, history={}, train_time_s=0.0)


def check(**fields) -> FreeRunCheck:
    return FreeRunCheck.of(StabilityOptions(count=20, **fields), MAPPING, [trace()])


def test_a_stable_fit_keeps_its_status_and_says_what_was_found():
    found = check().applied(fit(model()))
    assert found.status is Status.CONVERGED
    assert found.stability is not None
    assert found.stability["sequences"] == 20
    assert found.notes[-1] == found.stability["text"]
    assert FitResult.from_dict(found.to_dict()).stability == found.stability


def test_a_check_takes_no_longer_than_its_fit_and_a_minute_in_any_case(monkeypatch):
    assert check().applied(fit(model())).stability["sequences"] == 20  # a fit of no time has its minute
    monkeypatch.setattr("sysid.estimation.stability.check.LEAST_S", 0.0)
    found = check().applied(fit(model()))
    assert (found.stability["sequences"], found.stability["asked"]) == (10, 20)
    assert "10 of 20 sequences were checked in the time" in found.notes[-1]
    longer = check().applied(replace(fit(model()), train_time_s=100.0))
    assert "asked" not in longer.stability
    assert "asked" not in check(time_share=float("inf")).applied(fit(model())).stability


def test_an_unstable_fit_says_so_in_its_status():
    found = check().applied(fit(model(1.05)))
    assert found.status is Status.UNSTABLE
    assert found.stability is not None
    assert found.stability["unbounded"] == 20


def test_an_interrupted_fit_stays_interrupted_so_that_it_is_done_again():
    assert check().applied(fit(model(1.05), Status.INTERRUPTED)).status is Status.INTERRUPTED


def test_each_model_is_run_once():
    one = check()
    first, again = model(), model(1.05)
    assert (one(first), one(first), one(again)) == (True, True, False)
    assert len(one.found) == 2
    assert one.applied(fit(again)).status is Status.UNSTABLE
    assert len(one.found) == 2


def test_candidates_are_asked_what_else_is_wanted_of_them_and_the_fit_is_not_called_unstable_for_it():
    slow = model(0.95)
    one = check(also=lambda candidate: candidate is not slow, unless="they are slow")
    assert one.refusal == NOT_STABLE
    assert (one(model()), one(slow)) == (True, False)
    assert one.refusal == "they are slow"
    assert not one(model(1.05))
    assert one.refusal == f"their free run is not stable, or {one.options.unless}"
    assert one.applied(fit(slow)).status is Status.CONVERGED
    assert "also" not in one.options.terms


def test_a_count_of_zero_asks_nothing():
    nothing = FreeRunCheck.of(StabilityOptions(count=0), MAPPING, [trace()])
    assert nothing(model(1.05))
    assert nothing.applied(fit(model(1.05))).stability is None


def test_declared_traces_are_run_as_they_are():
    declared = check(sequences=[trace(seed) for seed in (1, 2, 3)], source="The random commands.")
    found = declared.applied(fit(model()))
    assert found.stability is not None
    assert (found.stability["sequences"], found.stability["largest_plateau_error"]) == (3, pytest.approx(0.0, abs=1e-9))
    assert found.stability["source"] == "The random commands."


def test_traces_too_short_for_excursions_are_not_checked():
    short = replace(trace(), values=trace().values[:10])
    nothing = FreeRunCheck.of(StabilityOptions(), MAPPING, [short])
    assert nothing.applied(fit(model())).stability is None


@pytest.mark.parametrize(
    ("choose", "loop", "asked"),
    [
        pytest.param(True, Loop.CLOSED, True, id="a closed loop gives way to a stable one"),
        pytest.param(True, Loop.OPEN, False, id="an open loop is not made to run free"),
        pytest.param(False, Loop.CLOSED, False, id="the fit takes the best as it is"),
    ],
)
def test_who_is_asked_to_be_stable(choose: bool, loop: Loop, asked: bool) -> None:
    check = FreeRunCheck(options=StabilityOptions(choose=choose), source=None)
    assert (check.vet(loop) is not None) == asked


@pytest.mark.parametrize(
    ("pole", "status"),
    [
        pytest.param(0.9, Status.EXACT, id="inside the unit circle"),
        pytest.param(1.0 + 1e-9, Status.EXACT, id="an integrator but for rounding"),
        pytest.param(1.01, Status.UNSTABLE, id="outside"),
    ],
)
def test_a_linear_model_is_judged_by_its_largest_pole(pole: float, status: Status) -> None:
    assert PoleCheck().applied(fit(model(pole), Status.EXACT)).status is status


@pytest.mark.parametrize("wrong", [{"count": -1}, {"tolerance": 0.0}, {"tolerance": float("nan")}, {"seed": -1}])
def test_numbers_that_cannot_be_used_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        StabilityOptions(**wrong)  # type: ignore[arg-type]


def slow_trace(seed: int, *, outputs: tuple[float, ...] = (0.9995,)) -> Trace:
    """Steps of 30 samples into plants that take thousands: the record stands at rest once, and settles nowhere."""
    u = np.concatenate([np.zeros(20), np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, 8), 30)])
    names = ("u", "y", "z")[: 1 + len(outputs)]
    values = np.column_stack([u, *(model(pole).simulate(u[:, None]) for pole in outputs)])
    return Trace(
        name=f"slow {seed}", sample_time=0.5, channels=tuple(Channel(name=n, unit="V") for n in names), values=values
    )


def test_the_true_model_of_a_slow_plant_is_stable_though_it_is_nowhere_back_at_rest():
    records = [slow_trace(seed) for seed in range(3)]
    asked = FreeRunCheck.of(StabilityOptions(count=100), MAPPING, records)
    found = asked.finding(model(0.9995))
    assert found is not None
    assert found.stable
    assert 0 < found.beyond < 100
    assert f"{found.beyond} more say nothing" in found.sentence
    json.dumps(found.to_dict())  # it is stored with the fit
    wrong = asked.finding(replace(model(0.9995), coefficients=np.array([5e-4, 1.01])))
    assert wrong is not None
    assert wrong.stable is False
    assert json.loads(json.dumps(wrong.to_dict()))["stable"] is False


def test_several_outputs_have_a_linear_yardstick_each():
    poles = (0.9995, 0.999)
    records = [slow_trace(seed, outputs=poles) for seed in range(3)]
    asked = FreeRunCheck.of(StabilityOptions(count=100), Mapping.parse("u -> y+z"), records)
    assert asked.reference is not None

    def plant(sequence: InputSequence) -> np.ndarray:
        past = [sequence.history(several=False, output=j) for j in range(2)]
        return np.column_stack([model(pole).simulate(sequence.inputs, h) for pole, h in zip(poles, past, strict=True)])

    sequence = next(iter(asked.source.draw(1, 0)))
    np.testing.assert_allclose(asked.reference(sequence), plant(sequence), atol=1e-6)
    found = check_stability(plant, asked.source, count=100, reference=lambda: asked.reference)
    assert found.stable
    assert not check_stability(plant, asked.source, count=100).stable


@pytest.mark.parametrize(
    ("options", "field"),
    [({"count": -1}, "count"), ({"count": "10"}, "count"), ({"seed": 1.5}, "seed"), ({"tolerance": 0.0}, "tolerance"),
     ({"tolerance": "small"}, "tolerance"), ({"sequences": 10}, "sequences")],
    ids=str,
)  # fmt: skip
def test_options_that_cannot_be_used_are_refused_in_words(options: dict[str, Any], field: str) -> None:
    with pytest.raises(ConfigError) as refused:
        StabilityOptions(**options)
    assert refused.value.where == field
    assert refused.value.remedy


def runaway(sequence: InputSequence) -> np.ndarray:
    """A level that runs away where its input goes beyond what was recorded."""
    u, y = sequence.inputs[:, 0], np.zeros(len(sequence.inputs))
    for t in range(1, len(y)):
        y[t] = 0.9 * y[t - 1] + 0.1 * u[t - 1] + 5.0 * max(u[t - 1] - 1.05, 0.0)
    return y


def test_a_run_can_be_asked_for_more_than_was_recorded():
    further = check(amplitude=1.5)
    assert check().finding(runaway).unbounded == 0
    assert not further(runaway)
    assert further(model())
    assert "inputs 1.5 times as far from their middle" in further.finding(model()).source
    with pytest.raises(ConfigError, match="amplitude"):
        StabilityOptions(amplitude=0.0)


def test_the_terms_of_a_usual_check_are_those_of_older_files():
    assert "amplitude" not in StabilityOptions().terms
    assert StabilityOptions(amplitude=1.25).terms["amplitude"] == 1.25
