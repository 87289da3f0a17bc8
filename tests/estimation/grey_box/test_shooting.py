"""Multiple shooting: its residuals, the starts that begin by it, and when none is needed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import sysid
from sysid.errors import ConfigError
from sysid.estimation import estimators
from sysid.estimation.grey_box import at_noise
from sysid.estimation.grey_box.fit import fit_grey_box
from sysid.estimation.grey_box.provider import EquationProvider
from sysid.estimation.grey_box.readying import common, ready_for
from sysid.estimation.grey_box.record import Record
from sysid.estimation.grey_box.shooting import Shooting, cut
from sysid.estimation.records.experiment import experiments_of, unit_range
from sysid.estimation.results.result import FitResult
from sysid.models import NARX, AbstractStructure, GreyBox, GreyBoxModel, Mapping, NeuralStateSpace, Start, StartKind
from sysid.traces import Channel, Trace
from tests.traces.made import trace_of

MAPPING, ESTIMATED = Mapping.parse("u -> y"), Start(kind=StartKind.ESTIMATED)
SWING = "dx/dt = v; dv/dt = m*(1 - x^2)*v - w*x + b*u; y = x"
TRUE, FAR = {"m": 1.5, "w": 1.0, "b": 0.8}, {"m": 0.5, "w": 3.0, "b": 0.3}


def a_trace(n: int = 240, *, noise: float = 0.05, seed: int = 0, name: str = "record") -> Trace:
    """Van der Pol's oscillator, by the classical Runge-Kutta method."""
    rng = np.random.default_rng(seed)
    u, z, y = np.repeat(rng.uniform(-1.0, 1.0, n // 20 + 1), 20)[:n], np.array([1.0, 0.0]), np.empty(n)

    def rates(z: np.ndarray, u: float) -> np.ndarray:
        return np.array([z[1], TRUE["m"] * (1.0 - z[0] ** 2) * z[1] - TRUE["w"] * z[0] + TRUE["b"] * u])

    for t in range(n):
        y[t] = z[0]
        for _ in range(4):
            a = rates(z, u[t])
            b = rates(z + 0.0125 * a, u[t])
            c = rates(z + 0.0125 * b, u[t])
            z = z + 0.025 / 6.0 * (a + 2.0 * b + 2.0 * c + rates(z + 0.025 * c, u[t]))
    return trace_of({"u": u, "y": y + noise * rng.standard_normal(n)}, name=name, sample_time=0.1)


def a_box(starts: dict[str, float], **fields: Any) -> GreyBox:
    named = {name: {"start": value, "low": 0} for name, value in starts.items()}
    return GreyBox(equations=SWING, parameters=named, **({"initial": {"x": 0.8, "v": 0.3}} | fields))


def prepared(traces: list[Trace], grey: GreyBox) -> tuple[EquationProvider, np.ndarray]:
    experiments = experiments_of(traces, MAPPING, ESTIMATED, 0.0)
    template = GreyBoxModel(
        **common(traces[0], MAPPING, grey),
        scaling=replace(unit_range(experiments), input_offset=(0.0,), input_scale=(1.0,)),
        output_unit="V",
        rest_output=0.0,
    )
    ready = ready_for(template, experiments)
    return ready.provider, ready.theta


def fitted(begun: dict[str, float], **options: Any) -> FitResult:
    return fit_grey_box([a_trace()], MAPPING, a_box(begun), sysid.Training(**options), start=ESTIMATED)


def test_slopes_are_those_of_the_loss() -> None:
    whole, theta = prepared([a_trace(40), a_trace(30, seed=1, name="other")], a_box(TRUE))
    known = np.ones((40, 1))
    known[17:20] = 0.0
    whole = replace(whole, records=(replace(whole.records[0], roots=known), whole.records[1]))
    windows, trained = Shooting.of(whole, theta).begun_at(whole, theta)
    assert windows.follows == (False, True, True, False, True)
    windows = replace(windows, weight=0.7)
    trained = trained + 0.05 * np.random.default_rng(2).standard_normal(len(trained))
    at = windows.linearise(trained)
    assert at.loss == pytest.approx(windows.loss(trained), rel=1e-12)
    for i in range(len(trained)):
        step = np.where(np.arange(len(trained)) == i, 1e-5, 0.0)
        slope = (windows.loss(trained + step) - windows.loss(trained - step)) / 2e-5
        assert at.gradient[i] == pytest.approx(slope, rel=1e-6, abs=1e-7 * np.abs(at.gradient).max())
    assert np.allclose(at.gauss_newton, at.gauss_newton.T)
    assert np.linalg.eigvalsh(at.gauss_newton).min() > -1e-9 * np.linalg.eigvalsh(at.gauss_newton).max()


def test_windows_that_meet_are_the_free_run() -> None:
    whole, theta = prepared([a_trace(60)], a_box(TRUE))
    windows, trained = Shooting.of(whole, theta).begun_at(whole, theta)
    path = whole.paths(theta)[0][1]
    firsts = np.cumsum([0, *(len(one.output) for one in windows.records)])[:-1]
    trained = windows.with_states(trained, list(path[firsts]))
    assert replace(windows, weight=1e3).loss(trained) == pytest.approx(whole.loss(theta), rel=1e-9)
    assert np.allclose(windows.ended(whole, trained, theta), theta)


def test_what_is_known_of_the_first_state_holds_for_the_first_window_alone() -> None:
    grey = a_box(TRUE, initial={"x": {"start": 1, "fixed": True}, "v": {"start": 0, "low": -0.5}})
    whole, theta = prepared([a_trace(60)], grey)
    windows, trained = Shooting.of(whole, theta).begun_at(whole, theta)
    low, high = windows.bounds
    first, second = windows.places(0), windows.places(1)
    assert low[first][0] == high[first][0] == trained[first][0]
    assert np.isfinite(low[first][1])
    assert np.isinf(low[second]).all()
    assert np.isinf(high[second]).all()


def test_a_record_is_cut_without_a_rest() -> None:
    whole, _ = prepared([a_trace(50)], a_box(TRUE))
    some = cut(whole.records[0], 12)
    assert np.array_equal(np.concatenate([one.output for one in some]), whole.records[0].output)
    assert {len(one.output) for one in some} == {12, 13}


def test_parameters_far_off_are_found_by_multiple_shooting_and_it_is_told() -> None:
    single, found = fitted(FAR, shooting="single", starts=1), fitted(FAR, starts=2)
    assert single.history["mse"][-1] > 100.0 * found.history["mse"][-1]
    assert isinstance(found.model, GreyBoxModel)
    values = dict(zip(("m", "w", "b"), found.model.theta, strict=True))
    assert values == pytest.approx(TRUE, rel=0.05)
    assert any("found by multiple shooting from the declared start" in note for note in found.notes)
    alone = fitted(FAR, shooting="multiple", starts=1)
    assert alone.history["mse"][-1] == pytest.approx(found.history["mse"][-1], rel=1e-6)


def test_a_growing_part_of_each_record_finds_them_too_and_a_short_record_is_run_whole() -> None:
    single, found = (fitted(FAR, shooting=way, starts=1) for way in ("single", "growing"))
    assert single.history["mse"][-1] > 100.0 * found.history["mse"][-1]
    assert isinstance(found.model, GreyBoxModel)
    assert dict(zip(("m", "w", "b"), found.model.theta, strict=True)) == pytest.approx(TRUE, rel=0.05)
    assert any("found by a growing part of each record from the declared start" in note for note in found.notes)
    record = prepared([a_trace()], a_box(TRUE))[0].records[0]
    assert [len(record.first(n).output) for n in (20, 1000)] == [20, 240]
    short = fit_grey_box(
        [a_trace(15)], MAPPING, a_box(TRUE), sysid.Training(shooting="growing", starts=1, max_iterations=5),
        start=ESTIMATED,
    )  # fmt: skip
    assert np.isfinite(short.history["mse"][-1])


def test_no_other_start_is_begun_where_the_first_comes_down_to_the_noise() -> None:
    found = fitted({"m": 1.2, "w": 1.2, "b": 1.0})
    assert {one.start for one in found.attempts} == {1}
    assert any("what it leaves is white: 1 of 4 starts were needed" in note for note in found.notes)
    assert not any("had a place in" in note for note in found.notes)
    every = fitted({"m": 1.2, "w": 1.2, "b": 1.0}, shooting="single", starts=2)
    assert {one.start for one in every.attempts} == {1, 2}
    assert found.history["mse"][-1] == pytest.approx(every.history["mse"][-1], rel=1e-6)


def test_noise_is_told_from_what_is_left_of_a_wrong_run() -> None:
    whole, theta = prepared([a_trace()], a_box(TRUE))
    assert at_noise.at_noise(whole, theta) == (whole.loss(theta) < 0.5 * 0.06**2 / whole.unit[0] ** 2 * 240)
    true = theta.copy()
    true[3:] = whole.with_states(theta, [np.array([1.0, 0.0])])[3:]
    assert at_noise.at_noise(whole, true)
    off = true.copy()
    off[0] *= 1.1
    assert not at_noise.at_noise(whole, off)
    assert at_noise.at_noise(replace(whole, records=(exact(whole, true),)), true)
    short = replace(whole, records=tuple(cut(whole.records[0], 40)[:1]))
    assert not at_noise.at_noise(short, true)


def test_a_run_that_explodes_in_its_last_sample_is_no_noise() -> None:
    """All others are none beside it, so that nothing correlates."""
    errors = np.append(0.01 * np.random.default_rng(0).standard_normal(200), 1e30)
    assert at_noise._is_noise([errors[:-1]])
    assert not at_noise._is_noise([errors])


def test_equations_with_a_network_are_fitted_where_their_declared_start_has_no_run() -> None:
    """A pole that is declared unstable: the run leaves the record by 50 powers of ten, and windows do not."""
    rng = np.random.default_rng(0)
    u, y, x = np.repeat(rng.uniform(-1.0, 1.0, 40), 10), np.empty(400), 0.3
    for t in range(400):
        y[t] = x
        for _ in range(20):
            x += 0.005 * (-0.8 * x - 0.6 * x**3 + u[t])
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
    values = np.column_stack([u, y + 1e-3 * rng.standard_normal(400)])
    trace = Trace(name="record", sample_time=0.1, channels=channels, values=values)
    grey = GreyBox(equations="dx/dt = k*x + net(x, neurons=3) + u; y = x", parameters={"k": 3})
    quick = sysid.Training(starts=2, max_iterations=60)
    found = fit_grey_box([trace], MAPPING, grey, quick, start=ESTIMATED)
    assert found.status.usable
    assert found.history["mse"][-1] < 0.01 * np.var(y)
    assert any("found by multiple shooting" in note for note in found.notes)


def exact(whole: EquationProvider, theta: np.ndarray) -> Record:
    form = whole.at(theta)
    output = form.run(whole.records[0].u, whole.begin(form, theta, 0))
    return replace(whole.records[0], output=output)


@pytest.mark.parametrize(
    "structure",
    [NARX(input_delays=(1,), output_delays=(1,), neurons=2), NeuralStateSpace(states=1, neurons=2)],
    ids=lambda one: one.kind,
)
def test_what_has_no_equations_is_not_shot(structure: AbstractStructure) -> None:
    with pytest.raises(ConfigError, match="no equations to shoot with"):
        estimators.estimator_of(structure).check_training(sysid.Training(shooting="multiple"))
    estimators.estimator_of(structure).check_training(sysid.Training())
    estimators.ESTIMATORS["GreyBox"].check_training(sysid.Training(shooting="multiple"))


def test_a_way_that_there_is_not_is_refused() -> None:
    with pytest.raises(ConfigError, match="unknown value of shooting"):
        sysid.Training(shooting="double")
