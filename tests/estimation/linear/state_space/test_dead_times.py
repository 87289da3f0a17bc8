"""Dead times of state spaces: given or found, in every form of the model."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid
from sysid.errors import ConfigError, TraceError
from sysid.estimation import StateSpaceTraining, fit_state_space
from sysid.models import History, LinearStateSpace, Mapping, Start, model_from_dict
from sysid.models.converting.to_control import state_space
from sysid.traces import Trace
from tests.estimation.linear_systems import trace_of

TWO, FREE, REST = Mapping.parse("u1+u2 -> y"), Start(kind="estimated"), Start()
F, B1, B2 = [1.0, -1.5, 0.7], [1.0, 0.5], [-0.8, 0.6]
DEAD = (4, 9)


def record(seed: int, n: int = 400, *, noise: float = 0.0, dead: tuple[int, int] = DEAD, lead: int = 50) -> Trace:
    """Two inputs through the same two poles, each behind a dead time; without a lead it begins at rest."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], ((n + lead) // 4 + 1, 2)), 4, axis=0)[: n + lead]
    if not lead:
        u[:10] = u[0]
    before = np.concatenate([np.repeat(u[:1], 200, axis=0), u])
    pairs = zip((B1, B2), dead, before.T, strict=True)
    y = sum(lfilter(np.concatenate([np.zeros(k), b]), F, column) for b, k, column in pairs)[200:]
    y = y + lfilter([1.0, 0.4], F, noise * rng.normal(size=n + lead))
    return trace_of(u[lead:], 3.0 + y[lead:])


@pytest.mark.parametrize("states", [2, 3])
@pytest.mark.parametrize("size", [0.0, 0.002])
def test_a_dead_time_is_found_where_hardly_anything_is_noise(states: int, size: float) -> None:
    """It ended in "no subspace estimate gives a finite prediction": a long ARX model is not determined there."""
    rng = np.random.default_rng(2)
    u = np.repeat(rng.choice([-1.0, 1.0], 100), 15)
    y = lfilter([0.0] * 4 + [0.05, 0.05], [1.0, -0.9], u) + size * rng.standard_normal(1500)
    fit = sysid.fit(sysid.data((u, y), sample_time=1.0), "u -> y", LinearStateSpace(states=states, nk="auto"))
    assert fit.model.structure.nk[0] in {3, 4}  # with a state that the plant does not have one sample is free
    found = fit.model.ratio(0)
    assert sum(found.B) / sum(found.F) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("noise", [True, False], ids=["K", "no K"])
@pytest.mark.parametrize(("constant", "dead"), [(400.0, 1), (50.0, 21)])
def test_a_single_step_of_a_slow_lag_shows_its_dead_time(constant: float, dead: int, noise: bool) -> None:
    """One step ahead a gain made up for hundreds of samples, and the free run came out with another sign."""
    rng, pole = np.random.default_rng(0), np.exp(-1.0 / constant)
    u = np.repeat([0.0, 1.0], [100, 500])
    y = lfilter([0.0] * dead + [1.0 - pole], [1.0, -pole], u)
    traces = sysid.data((u, y + 0.01 * y.std() * rng.standard_normal(600)), sample_time=1.0)
    fit = sysid.fit(traces, "u -> y", LinearStateSpace(states=1, noise=noise, nk="auto"))
    assert fit.model.structure.nk == (dead,)


def test_a_dead_time_that_no_error_asks_for_is_none() -> None:
    """Nine samples had been found: after a few steps of three resonances they came out a little better."""
    rng = np.random.default_rng(2)
    u = np.repeat(rng.uniform(-1.0, 1.0, 60), 25)
    y = u
    for w, r in ((0.03, 0.999), (0.12, 0.995), (0.3, 0.99)):
        y = lfilter([0.0, 1.0, 1.0], [1.0, -2.0 * r * np.cos(w), r**2], y)
    traces = sysid.data((u, y + 0.001 * y.std() * rng.standard_normal(1500)), sample_time=1.0)
    fit = sysid.fit(traces, "u -> y", LinearStateSpace(states=6, noise=False, nk="auto"))
    assert fit.model.structure.nk == (1,)


@pytest.mark.parametrize("noise", [True, False], ids=["K", "no K"])
@pytest.mark.parametrize(("start", "lead"), [(FREE, 50), (REST, 0)], ids=["free", "rest"])
def test_the_coefficients_behind_a_given_dead_time_are_exact(start: Start, lead: int, noise: bool) -> None:
    structure = LinearStateSpace(states=2, noise=noise, nk=DEAD)
    fit = fit_state_space([record(0, lead=lead)], TWO, structure, start=start)
    for j, (b, k) in enumerate(zip((B1, B2), DEAD, strict=True)):
        ratio = fit.model.ratio(j)
        assert ratio.delay == k
        np.testing.assert_allclose(ratio.B, b, atol=1e-6)
        np.testing.assert_allclose(ratio.F, F, atol=1e-6)
    known = dict(zip(fit.uncertainty.names, fit.uncertainty.values, strict=True))
    assert known["B(u1, 4)"] == pytest.approx(1.0, abs=1e-6)
    assert known["B(u2, 10)"] == pytest.approx(0.6, abs=1e-6)


@pytest.mark.parametrize(
    ("dead", "start", "noise"), [((1, 14), REST, False), ((6, 3), FREE, True)], ids=["rest", "free, K"]
)
def test_dead_times_are_found_and_told(dead: tuple[int, int], start: Start, noise: bool) -> None:
    trace = record(1, 250, noise=0.3, dead=dead, lead=0 if start is REST else 50)
    fit = fit_state_space([trace], TWO, LinearStateSpace(states=2, noise=noise, nk="auto"), start=start)
    assert fit.model.structure.nk == dead
    assert f"Dead times in samples: {dead[0]}, {dead[1]}." in fit.notes


def test_a_dead_time_at_the_end_of_the_search_says_so() -> None:
    asked = LinearStateSpace(states=2, nk="auto")
    fit = fit_state_space([record(0, 200, noise=0.1)], TWO, asked, StateSpaceTraining(max_delay=3), start=FREE)
    assert max(fit.model.structure.nk) == 3
    assert any("the longest that was tried" in note for note in fit.notes)


def test_two_outputs_share_the_dead_times_of_their_inputs() -> None:
    one = record(2, 250, noise=0.1, dead=(6, 1))
    z = 5.0 - 0.3 * one["y"] + 0.1 * np.random.default_rng(0).normal(size=len(one["y"]))
    traces = sysid.data({"u1": one["u1"], "u2": one["u2"], "y": one["y"], "z": z}, sample_time=1.0)
    fit = sysid.fit(traces, "u1+u2 -> y+z", sysid.LinearStateSpace(states=2, nk="auto"), start=FREE)
    assert fit.model.structure == sysid.VectorStateSpace(states=2, nk=(6, 1))
    assert [fit.model.ratios[o, j].delay for o in range(2) for j in range(2)] == [6, 1, 6, 1]


@pytest.fixture(scope="module")
def model():
    return fit_state_space([record(3, noise=0.2)], TWO, LinearStateSpace(states=2, nk=DEAD), start=FREE).model


def test_the_free_run_is_that_of_the_states_with_inputs_that_come_later(model) -> None:
    u = record(4).columns(["u1", "u2"])
    late = np.column_stack([np.concatenate([np.full(k - 1, v[0]), v[: 1 - k]]) for k, v in zip(DEAD, u.T, strict=True)])
    behind = replace(model, orders=LinearStateSpace(states=2))
    at = History.at_rest(inputs=u[0], output=3.0)
    np.testing.assert_allclose(model.simulate(u, at), behind.simulate(late, at), atol=1e-9)
    y = record(4)["y"]
    np.testing.assert_allclose(model.predict(u, y, at), behind.predict(late, y, at), atol=1e-9)


def test_dead_times_are_states_of_what_is_exported_but_no_poles_of_the_plant(model) -> None:
    assert model.recursion.n_state == 2 + (DEAD[0] - 1) + (DEAD[1] - 1)
    assert len(model.poles) == 2
    control = pytest.importorskip("control")
    for j, k in enumerate(DEAD):
        ratio = model.ratio(j)
        expected = lfilter(np.concatenate([np.zeros(k), ratio.B]), ratio.F, np.eye(1, 40)[0])
        for form in (model.to_control(), state_space(model)):
            _, y = control.impulse_response(form[0, j], np.arange(40.0))
            np.testing.assert_allclose(np.ravel(y), expected, atol=1e-8)


def test_a_stored_model_keeps_its_dead_times_and_one_of_old_has_none(model) -> None:
    stored = json.loads(json.dumps(model.to_dict()))
    assert model_from_dict(stored).structure == model.structure
    del stored["structure"]["nk"]
    assert model_from_dict(stored).structure == LinearStateSpace(states=2)


def test_what_stands_under_a_mask_a_dead_time_ago_is_nobodys_input() -> None:
    whole = record(5, noise=0.2)
    mask = np.ones(len(whole.values), dtype=bool)
    mask[150:160] = False
    blank, spoiled = (replace(whole, values=np.where(mask[:, None], whole.values, v), usable=mask) for v in (0.0, 7.0))
    orders = LinearStateSpace(states=2, nk=DEAD)
    one, other = (fit_state_space([t], TWO, orders, start=FREE).uncertainty.values for t in (blank, spoiled))
    np.testing.assert_allclose(one, other, rtol=1e-4)


@pytest.mark.parametrize("nk", [(0, 1), (1.5, 1), ("a", 1), (-1, 2)], ids=str)
def test_what_is_no_dead_time_is_refused(nk: tuple) -> None:
    with pytest.raises(ConfigError, match="dead times"):
        LinearStateSpace(states=2, nk=nk)
    assert LinearStateSpace(states=2, feedthrough=True, nk=(0, 1)).label == "SS 2 direct nk 0 1"


def test_dead_times_are_one_for_each_input_and_shorter_than_the_record() -> None:
    with pytest.raises(ConfigError, match="do not match the inputs"):
        sysid.fit(sysid.data(([0.0] * 9, [0.0] * 9), sample_time=1.0), "u -> y", LinearStateSpace(states=1, nk=DEAD))
    with pytest.raises(TraceError, match="longer than the dead time"):
        fit_state_space([record(0, 60)], TWO, LinearStateSpace(states=2, nk=(1, 70)), start=FREE)
