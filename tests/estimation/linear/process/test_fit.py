"""Process models of records whose plants are known: intervals that hold the truth, bounds, starts and refusals."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from typing import Any

import numpy as np
import pytest

import sysid
from sysid.errors import TraceError
from sysid.models import FittedProcess
from sysid.models.process.process_run import run
from sysid.models.process.process_type import ProcessType
from sysid.traces import TraceSet
from sysid.validation import predict_interval

T = 2.0
STEP = np.concatenate([np.full(15, 3.0), np.full(135, 4.5)])


def steps(seed: int, n: int = 300) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.repeat(rng.choice([-1.0, 1.0], size=n), rng.integers(4, 25, size=n))[:n]


def output(kind: str, values: list[float], u: np.ndarray, *, seed: int, noise: float = 0.05, **more: Any) -> np.ndarray:
    y = run(ProcessType.parse(kind), np.array(values), u, u[0], T, **more).output
    return 20.0 + y + noise * y.std() * np.random.default_rng(seed).normal(size=len(y))


def fitted(kind: Any, records: Any, *, mapping: str = "u -> y", start: str = "estimated", **known: Any) -> Any:
    inputs = mapping.partition(" -> ")[0].split("+")
    traces = records if isinstance(records, TraceSet) else sysid.data(
        records, inputs=inputs, outputs="y", sample_time=T)  # fmt: skip
    return sysid.fit(traces, mapping, sysid.ProcessModel(type=kind, **known), start=start)


def off(fit: Any, truth: Dict[str, float]) -> dict[str, float]:
    """How many standard deviations each parameter lies from the truth."""
    deviations = dict(zip(fit.uncertainty.names, fit.uncertainty.standard_deviations, strict=True))
    return {name: abs(fit.model.parameters[name] - value) / deviations[name] for name, value in truth.items()}


PLANTS: dict[str, list[float]] = {
    "P1D": [2.0, 24.0, 8.74],
    "P2D": [-0.7, 30.0, 10.0, 7.24],
    "P2DU": [3.0, 10.0, 0.35, 5.46],
    "P2DZ": [1.5, 30.0, 12.0, -8.0, 4.82],
    "P1DI": [0.02, 16.0, 6.36],
}


@pytest.mark.parametrize(("kind", "values"), PLANTS.items(), ids=PLANTS)
def test_the_truth_lies_near_by_what_is_told_of_it(kind: str, values: list[float]) -> None:
    u = steps(2)
    fit = fitted(kind, (u, output(kind, values, u, seed=3)))
    assert isinstance(fit.model, FittedProcess)
    truth = dict(zip(ProcessType.parse(kind).names, values, strict=True))
    assert max(off(fit, truth).values()) < 3.0
    assert (fit.uncertainty.standard_deviations[:2] < 0.3 * np.abs(values[:2])).all()


@pytest.mark.parametrize("start", ["estimated", "rest"])
def test_a_step_test_is_enough(start: str) -> None:
    fit = fitted("P1D", (STEP, output("P1D", PLANTS["P1D"], STEP, seed=1)), start=start)
    assert max(off(fit, dict(zip(("K", "Tp1", "Td"), PLANTS["P1D"], strict=True))).values()) < 3.0


def test_a_record_that_begins_with_its_step_is_one_from_rest() -> None:
    """A reaction curve as it is exported: the first sample alone has the old value."""
    u = STEP[14:]
    fit = fitted("P1D", (u, output("P1D", PLANTS["P1D"], u, seed=1)), start="rest")
    assert max(off(fit, dict(zip(("K", "Tp1", "Td"), PLANTS["P1D"], strict=True))).values()) < 3.0


def test_a_record_whose_step_came_before_it_is_refused_with_what_to_do() -> None:
    with pytest.raises(TraceError, match="put a sample before it"):
        fitted("P1D", (STEP[15:], output("P1D", PLANTS["P1D"], STEP, seed=1)[15:]))


def test_a_record_in_motion_says_nothing_of_what_came_before() -> None:
    u, state = steps(4), np.array([-3.0])
    whole = run(ProcessType.parse("P1D"), np.array(PLANTS["P1D"]), u, u[0], T, state=state).output
    y = 20.0 + whole + 0.05 * np.random.default_rng(5).normal(size=len(u))
    fit = fitted("P1D", (u[20:], y[20:]))
    assert max(off(fit, dict(zip(("K", "Tp1", "Td"), PLANTS["P1D"], strict=True))).values()) < 3.0


def test_without_noise_the_plant_itself_is_found() -> None:
    u = steps(6)
    fit = fitted("P2DU", (u, output("P2DU", PLANTS["P2DU"], u, seed=1, noise=0.0)))
    assert list(fit.model.parameters.values()) == pytest.approx(PLANTS["P2DU"], rel=1e-6)


def test_several_inputs_have_a_process_each_and_names_say_which() -> None:
    a, b = steps(7), 0.3 * steps(8)
    y = output("P1D", PLANTS["P1D"], a, seed=1) + output("P1", [5.0, 9.0], b, seed=2)
    fit = fitted(["P1D", "P1"], (np.column_stack([a, b]), y), mapping="a+b -> y")
    truth = {"K(a)": 2.0, "Tp1(a)": 24.0, "Td(a)": 8.74, "K(b)": 5.0, "Tp1(b)": 9.0}
    assert max(off(fit, truth).values()) < 3.0


def test_several_records_share_a_plant() -> None:
    records = {f"r{i}": (steps(i, 120), output("P1D", PLANTS["P1D"], steps(i, 120), seed=i)) for i in range(3)}
    traces = sysid.data(records, inputs="u", outputs="y", sample_time=T)
    fit = fitted("P1D", traces)
    assert max(off(fit, dict(zip(("K", "Tp1", "Td"), PLANTS["P1D"], strict=True))).values()) < 3.0


def test_what_is_given_stays_and_what_is_bounded_is_told_at_its_bound() -> None:
    u = steps(2)
    record = (u, output("P1D", PLANTS["P1D"], u, seed=3))
    fit = fitted("P1D", record, parameters={"Td": {"start": 8.74, "fixed": True}, "K": {"start": 1, "high": 1.5}})
    assert fit.model.parameters["Td"] == pytest.approx(8.74)
    assert fit.model.parameters["K"] == pytest.approx(1.5, rel=1e-5)
    assert "Td" not in fit.uncertainty.names
    assert np.isnan(dict(zip(fit.uncertainty.names, fit.uncertainty.standard_deviations, strict=True))["K"])
    assert any("K stands at its bound" in warned for warned in fit.warnings)
    free = fitted("P1D", record)
    sure = fitted("P1D", record, parameters={"Td": {"start": 8.74, "fixed": True}})
    at = free.uncertainty.names.index("Tp1")
    assert sure.uncertainty.standard_deviations[at] < free.uncertainty.standard_deviations[at]


@pytest.mark.parametrize(
    ("asked", "kind", "values", "letter"),
    [("P2DU", "P1D", PLANTS["P1D"], "U"), ("P1D", "P1", [2.0, 24.0], "D")],
    ids=["nothing swings", "no dead time"],
)
def test_a_letter_too_many_is_told(asked: str, kind: str, values: list[float], letter: str) -> None:
    u = steps(2)
    fit = fitted(asked, (u, output(kind, values, u, seed=3, noise=0.0)))
    assert any(f"Leave {letter} out of the type" in warned for warned in fit.warnings)


def test_a_plant_that_integrates_has_the_level_at_which_it_stands() -> None:
    u = steps(2)
    y = output("P0I", [0.1], u - 0.3, seed=3, noise=0.01)
    fit = fitted("P0I", (u, y))
    assert max(off(fit, {"K": 0.1}).values()) < 3.0
    low, high = fit.uncertainty.interval()[fit.uncertainty.names.index("level")]
    assert low < 0.3 < high < low + 0.1


def test_an_input_that_stands_is_refused() -> None:
    u = np.column_stack([steps(2), np.ones(300)])
    with pytest.raises(TraceError, match="b never changes"):
        fitted("P1D", (u, output("P1D", PLANTS["P1D"], u[:, 0], seed=1)), mapping="a+b -> y")


def test_step_bode_and_poles_have_intervals_that_hold_the_truth() -> None:
    u = steps(2)
    fit = fitted("P1D", (u, output("P1D", PLANTS["P1D"], u, seed=3)))
    (pole,) = fit.poles()
    assert pole.intervals["time_constant"][0] < 24.0 < pole.intervals["time_constant"][1]
    (info,) = fit.step().info()
    assert info["gain_low"] < 2.0 < info["gain_high"]
    assert fit.step().values[4, 0] == 0.0  # 8 s, in the dead time
    phase = fit.bode(frequency=[0.05]).phase[0, 0]
    assert phase == pytest.approx(-np.degrees(np.arctan(24.0 * 0.05) + 8.74 * 0.05), abs=3.0)


def test_intervals_of_the_output_hold_another_record() -> None:
    u, other = steps(2), steps(9)
    records = {"one": (u, output("P1D", PLANTS["P1D"], u, seed=3)),
               "two": (other, output("P1D", PLANTS["P1D"], other, seed=4))}  # fmt: skip
    traces = sysid.data(records, inputs="u", outputs="y", sample_time=T, split=["estimation", "test"])
    fit = fitted("P1D", traces)
    found = predict_interval(fit, traces["two"])
    y = traces["two"]["y"][-len(found.low) :]
    inside = (found.low <= y) & (y <= found.high)
    assert 0.90 < inside.mean() < 0.99


def test_masked_samples_do_not_count() -> None:
    u = steps(2)
    y = output("P1D", PLANTS["P1D"], u, seed=3)
    y[100:130] = 500.0
    hidden = {"channel": "y", "start": 100 * T, "stop": 129 * T}
    traces = sysid.data((u, y), inputs="u", outputs="y", sample_time=T, repairs={"mask": [hidden]})
    assert max(off(fitted("P1D", traces), dict(zip(("K", "Tp1", "Td"), PLANTS["P1D"], strict=True))).values()) < 3.0


@pytest.mark.parametrize("unit", [1e-9, 86_400.0], ids=["nanoseconds", "days"])
def test_the_unit_of_time_changes_nothing(unit: float) -> None:
    u = steps(2)
    y = output("P1D", PLANTS["P1D"], u, seed=3)
    found = sysid.fit(sysid.data((u, y), sample_time=T * unit), "u -> y", sysid.ProcessModel(type="P1D"))
    plain = fitted("P1D", (u, y))
    assert found.model.parameters["Td"] == pytest.approx(unit * plain.model.parameters["Td"], rel=1e-5)
    assert found.simulate(u) == pytest.approx(plain.simulate(u), rel=1e-6)


def test_poles_that_come_out_equal_and_what_is_made_up_for_are_told_and_have_no_intervals() -> None:
    u = steps(2)
    pair = fitted("P2D", (u, output("P2DU", [2.0, 10.0, 0.8, 5.0], u, seed=3)))
    assert any("Tp1 and Tp2 came out equal" in warned for warned in pair.warnings)
    deviations = dict(zip(pair.uncertainty.names, pair.uncertainty.standard_deviations, strict=True))
    assert np.isnan(deviations["Tp1"])
    assert deviations["K"] > 0.0
    # Of inputs that are held a zero beside one pole and a part of a sample do the same at all samples.
    zero = fitted("P1DZ", (u, output("P1DZ", [2.0, 20.0, 8.0, 6.6], u, seed=3)))
    assert any("do not tell Tz, Td" in warned for warned in zero.warnings)
