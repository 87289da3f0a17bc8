"""Grey boxes of records whose parameters are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import sysid
from sysid.errors import ConfigError, TraceError
from sysid.estimation.grey_box.fit import fit_grey_box
from sysid.estimation.results.result import FitResult, Status
from sysid.models import GreyBox, GreyBoxModel, Mapping, Start, StartKind, VectorGreyBox
from sysid.traces import Channel, Trace
from sysid.validation import predict_interval
from tests.benchmarks.grey_box_starts import SYSTEMS, started
from tests.benchmarks.grey_box_starts import record as simulated
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")
ESTIMATED = Start(kind=StartKind.ESTIMATED)


def a_trace(u: np.ndarray, y: np.ndarray, *, sample_time: float = 0.5, name: str = "record") -> Trace:
    return trace_of({"u": u, "y": y}, name=name, sample_time=sample_time)


def steps(n: int, seed: int = 0, *, low: float = 0.0, high: float = 2.0) -> np.ndarray:
    return np.repeat(np.random.default_rng(seed).uniform(low, high, n // 15 + 1), 15)[:n]


def first_order(gain: float, lag: float, *, n: int = 200, begin: float = 0.0, seed: int = 0) -> Trace:
    """The exact samples of ``lag dx/dt = gain u - x``, with noise of 0.01."""
    u, x = steps(n, seed), np.empty(n + 1)
    x[0], pole = begin, np.exp(-0.5 / lag)
    for t in range(n):
        x[t + 1] = pole * x[t] + (1.0 - pole) * gain * u[t]
    return a_trace(u, x[:n] + 0.01 * np.random.default_rng(seed + 1).standard_normal(n))


def fitted(
    traces: list[Trace],
    equations: str,
    training: sysid.Training | None = None,
    *,
    start: Start = ESTIMATED,
    **fields: Any,
) -> FitResult:
    return fit_grey_box(
        traces, MAPPING, GreyBox(equations=equations, **fields), training or sysid.Training(starts=1), start=start
    )


LAG = "dx/dt = (gain*u - x)/lag; y = x"


def test_units_that_contradict_each_other_are_told() -> None:
    fits = [
        fitted([first_order(3.0, 4.0)], LAG, parameters={"gain": 2.0, "lag": {"start": 3.0, "low": 0.1, "unit": unit}})
        for unit in ("s", "min")
    ]
    told = [[text for text in fit.warnings if "nothing converts it" in text] for fit in fits]
    assert told == [[], ["The rate of x is in V/s, and its equation gives V/min: nothing converts it."]]


def test_parameters_and_initial_states_of_several_records_are_found() -> None:
    records = [first_order(3.0, 4.0, begin=begin, seed=seed) for begin, seed in ((5.0, 0), (-2.0, 7))]
    fit = fitted(records, LAG, parameters={"gain": 1, "lag": {"start": 1, "low": 0.01, "unit": "s"}})
    model, known = fit.model, fit.uncertainty
    assert isinstance(model, GreyBoxModel)
    assert known is not None
    assert fit.status is Status.CONVERGED
    assert known.names == ("gain", "lag [s]")
    assert (np.abs(known.values - [3.0, 4.0]) < 3.0 * known.standard_deviations).all()
    assert (known.standard_deviations < 0.02).all()
    assert model.parameters == dict(zip(("gain", "lag"), known.values, strict=True))
    assert known.noise_variance == pytest.approx(1e-4, rel=0.2)


def test_a_record_at_rest_begins_at_equilibrium() -> None:
    record = first_order(3.0, 4.0, begin=3.0 * steps(200)[0])
    fit = fitted([record], LAG, parameters={"gain": 1, "lag": 1}, start=Start())
    assert fit.model.parameters == pytest.approx({"gain": 3.0, "lag": 4.0}, rel=0.01)  # type: ignore[attr-defined]
    assert fit.model.simulate(np.full((5, 1), 2.0)) == pytest.approx(np.full(5, 6.0), rel=0.01)


def test_a_declared_beginning_is_kept() -> None:
    record = first_order(3.0, 4.0, begin=5.0)
    fit = fitted(
        [record], LAG, parameters={"gain": 1, "lag": 1}, initial={"x": {"start": 5.0, "fixed": True}}, start=Start()
    )
    assert fit.model.parameters == pytest.approx({"gain": 3.0, "lag": 4.0}, rel=0.01)  # type: ignore[attr-defined]
    assert fit.model.simulate(np.zeros((1, 1)))[0] == 5.0


def test_a_bound_that_binds_is_told_and_has_no_interval() -> None:
    fit = fitted([first_order(3.0, 4.0)], LAG, parameters={"gain": {"start": 1, "high": 2}, "lag": 1})
    assert fit.model.parameters["gain"] == 2.0  # type: ignore[attr-defined]
    assert fit.uncertainty is not None
    assert np.isnan(fit.uncertainty.standard_deviations[0])
    assert any("gain stands at its bound, 2" in warning for warning in fit.warnings)


@pytest.mark.parametrize(("apart", "told"), [(0.02, True), (1.0, False)])
def test_intervals_that_are_short_only_for_a_bound_are_told(apart: float, told: bool) -> None:
    """Beside a coefficient at its bound that of nearly the same input was known a hundred times too well."""
    rng = np.random.default_rng(0)
    u = rng.uniform(-1.0, 1.0, 300)
    v = u + apart * rng.standard_normal(300)
    y = 2.0 * u - v / apart * 0.02 + 0.05 * rng.standard_normal(300)
    traces = sysid.data((np.column_stack([u, v]), y), sample_time=1.0)
    two = sysid.GreyBox(equations="y = a*u1 + b*u2", parameters={"a": 1.0, "b": {"start": 0.1, "low": 0}})
    fit = sysid.fit(traces, "u1+u2 -> y", two, sysid.Training(starts=1), stability=sysid.StabilityOptions(count=0))
    assert any("b stands at its bound, 0" in one for one in fit.warnings)
    said = [one for one in fit.warnings if "hold only if the parameter at the bound is there" in one]
    assert bool(said) is told
    if told:
        # By least squares: the deviation of a beside b, and without it.
        wide, narrow = (np.linalg.inv(x.T @ x)[0, 0] for x in (np.column_stack([u, v]), u[:, np.newaxis]))
        assert said[0].startswith("a: ")
        times = float(said[0].split("up to ")[1].split(" times")[0])
        assert times == pytest.approx(np.sqrt(wide / narrow), rel=0.05)


def test_parameters_that_the_record_leaves_open_are_told() -> None:
    fit = fitted([first_order(3.0, 4.0)], "dx/dt = (a*b*u - x)/lag; y = x", parameters={"a": 1, "b": 1, "lag": 1})
    assert any("a and b can hardly be told apart" in w or "not determine" in w for w in fit.warnings)
    assert fit.model.parameters["a"] * fit.model.parameters["b"] == pytest.approx(3.0, rel=0.01)  # type: ignore[attr-defined]


def test_a_prior_decides_what_the_record_leaves_open() -> None:
    fit = fitted(
        [first_order(3.0, 4.0)], "dx/dt = (a*b*u - x)/lag; y = x",
        parameters={"a": {"start": 2, "prior": 0.001}, "b": 1, "lag": 1},
    )  # fmt: skip
    found = fit.model.parameters  # type: ignore[attr-defined]
    assert (found["a"], found["b"]) == (pytest.approx(2.0, abs=0.01), pytest.approx(1.5, rel=0.02))
    assert fit.warnings == ()


def test_a_network_finds_what_the_equations_leave_out() -> None:
    u, x = steps(300, low=-1.0, high=1.0), np.zeros(301)
    for t in range(300):
        x[t + 1] = 0.8 * x[t] + 0.2 * np.sin(3.0 * u[t])
    record = a_trace(u, x[:300])
    fit = fitted([record], "x[k+1] = a*x + net(u; neurons=4); y = x", sysid.Training(starts=2, max_iterations=150),
                 parameters={"a": 0.5}, initial={"x": {"start": 0.0, "fixed": True}}, start=Start(),)  # fmt: skip
    assert fit.model.parameters["a"] == pytest.approx(0.8, abs=0.01)  # type: ignore[attr-defined]
    assert np.abs(fit.model.simulate(u[:, None]) - x[:300]).max() < 0.05


def test_a_switch_is_trained_soft_and_exact_in_the_model() -> None:
    u, x = steps(400, low=-1.0, high=2.0), np.zeros(401)
    for t in range(400):
        x[t + 1] = 0.7 * x[t] + (0.6 if u[t] > 0.8 else -0.1)
    fit = fitted(
        [a_trace(u, x[:400])], "x[k+1] = a*x + where(u > level, up, down); y = x",
        parameters={"a": 0.5, "level": 0.5, "up": 1, "down": 0},
        initial={"x": {"start": 0.0, "fixed": True}}, start=Start(),
    )  # fmt: skip
    assert np.abs(fit.model.simulate(u[:, None]) - x[:400]).max() < 0.02
    assert any("1 switch were trained" in note for note in fit.notes)


def test_the_step_is_chosen_and_told() -> None:
    fit = fitted([first_order(3.0, 0.2)], LAG, parameters={"gain": 3, "lag": 0.2})
    assert fit.model.substeps > 4  # type: ignore[attr-defined]
    assert any("Runge-Kutta steps of" in note for note in fit.notes)
    asked = fitted([first_order(3.0, 4.0)], LAG, parameters={"gain": 3, "lag": 4}, substeps=2)
    assert any("2 Runge-Kutta steps of 0.25 s as asked for" in note for note in asked.notes)


def test_a_relay_that_swings_by_itself_does_not_ask_for_ever_shorter_steps() -> None:
    """A thermostat's run slips by a sample sooner or later, however short the steps: it had 256, and took minutes."""
    u, x, on = steps(300, high=0.3), np.zeros(301), 0.0
    for t in range(300):
        on = 1.0 if 1.0 - x[t] > 0.2 else on if 1.0 - x[t] >= -0.2 else 0.0
        x[t + 1] = u[t] + (x[t] - u[t]) * np.exp(-0.1) + 2.0 * (1.0 - np.exp(-0.1)) * on
    fit = fitted(
        [a_trace(u, x[:300])], "on = relay(1 - x, on=0.2, off=-0.2); dx/dt = (u - x)/lag + heat*on; y = x",
        sysid.Training(starts=1, max_iterations=3), parameters={"lag": 4.6, "heat": 0.41},
    )  # fmt: skip
    assert fit.model.substeps <= 16  # type: ignore[attr-defined]
    assert any("do not bring runs nearer" in warning for warning in fit.warnings)


STIFF_LAG = {
    "equations": "dq/dt = (gain*u - q)/fast; dx/dt = (q - x)/lag; y = x",
    "parameters": {"gain": 1, "lag": 1, "fast": {"start": 1e-5, "fixed": True}},
}


def test_stiff_equations_are_stepped_implicitly_and_it_is_told() -> None:
    fit = fitted([first_order(3.0, 4.0)], **STIFF_LAG)
    model = fit.model
    assert isinstance(model, GreyBoxModel)
    assert (model.solver, model.substeps <= 8) == ("rosenbrock", True)
    assert model.parameters == pytest.approx({"gain": 3.0, "lag": 4.0, "fast": 1e-5}, rel=0.01)
    assert any("implicit" in note and "Runge-Kutta steps would be 17,953 from" in note for note in fit.notes)
    again = FitResult.from_dict(fit.to_dict())
    assert np.array_equal(again.model.simulate(steps(50)[:, None]), model.simulate(steps(50)[:, None]))


def test_explicit_steps_of_stiff_equations_are_refused_with_the_remedy() -> None:
    with pytest.raises(TraceError, match="17,953 a sample to stay bounded: leave solver out"):
        fitted([first_order(3.0, 4.0)], solver="runge-kutta", **STIFF_LAG)


def test_intervals_of_the_output_hold_the_measurement() -> None:
    fit = fitted([first_order(3.0, 4.0)], LAG, parameters={"gain": 1, "lag": 1})
    other = first_order(3.0, 4.0, seed=11)
    interval = predict_interval(fit, other, start=ESTIMATED)
    assert interval.coverage(other["y"][-len(interval.output) :]).share > 0.88


def test_a_fit_is_stored_and_read_again() -> None:
    fit = fitted([first_order(3.0, 4.0)], LAG, parameters={"gain": 1, "lag": 1})
    again = FitResult.from_dict(fit.to_dict())
    inputs = steps(50)[:, None]
    assert np.array_equal(again.model.simulate(inputs), fit.model.simulate(inputs))


def test_masked_samples_do_not_count() -> None:
    record = first_order(3.0, 4.0)
    values = record.values.copy()
    values[60:90, 1] = 1e6
    usable = np.ones(200, dtype=bool)
    usable[60:90] = False
    masked = Trace(name="m", sample_time=0.5, channels=record.channels, values=values, usable=usable)
    fit = fitted([masked], LAG, parameters={"gain": 1, "lag": 1})
    assert fit.model.parameters == pytest.approx({"gain": 3.0, "lag": 4.0}, rel=0.01)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("equations", "solver"),
    [("dx/dt = log(-gain) + u; y = x", None), ("dx/dt = u + 50*gain*x; y = x", None),
     ("dx/dt = u + 50*gain*x; y = x", "rosenbrock")],
    ids=["no number", "explodes", "explodes, implicit steps asked for"],
)  # fmt: skip
def test_equations_without_a_run_are_refused(equations: str, solver: str | None) -> None:
    """Implicit steps forget what is fast, what grows too: a run that explodes had been fitted and called bounded."""
    with pytest.raises(TraceError, match="no free run at their declared start"):
        fitted([first_order(3.0, 4.0)], equations, parameters={"gain": 1.0}, solver=solver)


def test_a_declared_state_without_a_run_is_not_the_end() -> None:
    """A tank in which the reaction would run away from the temperature that is declared, not from the one measured."""
    tank, rng = SYSTEMS["stirred tank"], np.random.default_rng([3, len("stirred tank"), 10])
    record, noise, spans = simulated(tank, rng)
    hot = started(tank, 10.0, spans, rng)
    assert [one.start for one in hot.initial][1] == pytest.approx(641.0, abs=1.0)
    fit = fit_grey_box([record], MAPPING, hot, sysid.Training(), start=ESTIMATED)
    assert fit.status.usable, fit.notes
    assert fit.history["mse"][-1] < 1.1**2 * noise
    assert fit.model.parameters == pytest.approx(tank.true, rel=0.05)  # type: ignore[attr-defined]


def test_options_of_lagged_regressors_are_refused() -> None:
    with pytest.raises(ConfigError, match="a grey box is not trained with stride"):
        fitted([first_order(3.0, 4.0)], LAG, sysid.Training(stride=2), parameters={"gain": 1, "lag": 1})


def test_several_outputs_share_states_and_parameters_and_count_over_their_noise() -> None:
    u, x, z = steps(250), np.zeros(251), np.zeros(251)
    for t in range(250):
        x[t + 1] = 0.8 * x[t] + 0.4 * u[t]
        z[t + 1] = 0.9 * z[t] + 0.05 * x[t]
    noise = np.random.default_rng(2).standard_normal((2, 250))
    channels = tuple(Channel(name=name, unit="V") for name in ("u", "x", "z"))
    values = np.column_stack([u, x[:250] + 0.2 * noise[0], z[:250] + 0.001 * noise[1]])
    record = Trace(name="r", sample_time=1.0, channels=channels, values=values)
    grey = GreyBox(
        equations="x[k+1] = a*x + b*u; z[k+1] = c*z + d*x", parameters={"a": 0.5, "b": 0.5, "c": 0.5, "d": 0.1}
    ).for_outputs(2)
    assert isinstance(grey, VectorGreyBox)
    fit = fit_grey_box([record], Mapping.parse("u -> x+z"), grey, sysid.Training(starts=1), start=ESTIMATED)
    assert fit.uncertainty is not None
    away = np.abs(fit.uncertainty.values - [0.8, 0.4, 0.9, 0.05]) / fit.uncertainty.standard_deviations
    assert (away < 3.5).all()
    assert fit.uncertainty.standard_deviations[0] < 0.004  # what the noisy output alone says is ten times wider
    again = FitResult.from_dict(fit.to_dict())
    assert again.model.simulate(u[:, None]).shape == (250, 2)
    interval = predict_interval(fit, record, start=ESTIMATED)
    assert interval.low.shape[1] == 2


@pytest.mark.parametrize("written", ["g*abs(u)^(n - 1)*u", "u*(g*abs(u)^(n - 1))"])
def test_a_bent_power_has_a_value_at_0_whatever_its_exponent(written: str) -> None:
    """As the law of Bouc and Wen writes it: abs(0)^(n - 1) is infinite where n < 1, and the product is 0."""
    u = np.array([0.0, *np.random.default_rng(0).normal(size=30), 0.0])
    record = a_trace(u, 2.0 * np.sign(u) * np.abs(u) ** 0.7)
    fit = fitted([record], f"y = {written}", parameters={"g": 1, "n": {"start": 1.2, "low": 0.3}}, start=Start())
    assert isinstance(fit.model, GreyBoxModel)
    assert fit.model.parameters == pytest.approx({"g": 2.0, "n": 0.7}, abs=1e-6)


@pytest.mark.parametrize(
    ("raised", "told"),
    [
        pytest.param("x", "; x^p is no number where what is raised is below 0: write max(x, 0)^p.", id="stuck"),
        pytest.param("max(x, 0)", "", id="at a minimum"),
    ],
)
def test_intervals_are_told_of_a_minimum_alone(raised: str, told: str) -> None:
    u, x, y = steps(150, 3) * (steps(150, 4) > 0.8), 0.0, []
    for value in u:
        y.append(x)
        for _ in range(5):
            x += 0.1 * (value - 0.8 * np.sqrt(max(x, 0.0)))
    record = a_trace(u, np.array(y) + 0.01 * np.random.default_rng(0).standard_normal(150))
    starts = {"a": {"start": 0.5, "low": 0}, "b": {"start": 0.5, "low": 0}, "p": {"start": 0.9, "low": 0.1}}
    training = sysid.Training(starts=1, shooting="single")
    fit = fitted([record], f"dx/dt = a*u - b*{raised}^p; y = x", training, parameters=starts, start=Start())
    assert fit.uncertainty is not None
    assert np.isfinite(fit.uncertainty.covariance).all() == (fit.status is Status.CONVERGED) == (not told)
    said = [one for one in fit.warnings if "has not come to a minimum" in one]
    assert [one.endswith(told) for one in said] == [True] * bool(told)


@pytest.mark.parametrize("solver", ["runge-kutta", "rosenbrock"])
def test_an_input_that_moves_between_samples_leaves_no_error_where_that_is_said(solver: str) -> None:
    """A forced Duffing oscillator beside SciPy's solver, whose force goes straight from sample to sample."""
    n, rng = 150, np.random.default_rng(0)
    t, u = 0.1 * np.arange(n), np.concatenate([[0.0], np.cumsum(0.3 * rng.normal(size=n - 1))])

    def rates(time: float, x: np.ndarray) -> list[float]:
        return [x[1], -2.0 * x[1] - 9.0 * x[0] - 3.0 * x[0] ** 3 + 5.0 * np.interp(time, t, u)]

    y = solve_ivp(rates, (0.0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-11, max_step=0.1).y[0]
    true = {"d": 2.0, "k": 9.0, "c": 3.0, "b": 5.0}
    duffing = "dx/dt = v; dv/dt = b*u - d*v - k*x - c*x^3; y = x"
    starts = {"d": 1.5, "k": 8.0, "c": 2.0, "b": 4.0}
    fit = fitted([a_trace(u, y, sample_time=0.1)], duffing, parameters=starts, intersample="foh", solver=solver)
    assert isinstance(fit.model, GreyBoxModel)
    assert fit.model.parameters == pytest.approx(true, rel=1e-4)
    assert any("Between samples u goes straight to the next value (foh)." in note for note in fit.notes)
    if solver == "runge-kutta":
        held = sysid.fit(a_trace(u, y, sample_time=0.1), "u -> y", GreyBox(equations=duffing, parameters=starts))
        assert held.model.parameters != pytest.approx(true, rel=0.05)
        assert any("it moves between samples (intersample: foh)" in note for note in held.notes)
