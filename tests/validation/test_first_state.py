"""First states that are estimated on too few samples for a pole that does not forget them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid
from sysid.models import OE, ARXModel, History, Mapping, PolynomialModel, Scaling
from sysid.validation.first_state import first_states


@pytest.mark.parametrize(("poles", "told"), [((0.9995, 0.998), True), ((0.9998, 0.5), False), ((0.95, 0.5), False)])
def test_what_slow_poles_do_with_a_poor_first_state_is_told(poles: tuple[float, float], told: bool) -> None:
    """Of two poles alike the first samples do not tell how far each has come: the plant itself loses half its fit."""
    rng = np.random.default_rng(4)
    u = np.repeat(rng.choice([-1.0, 1.0], 80), 50)
    y = lfilter([0.0, 1.0], np.poly(poles), u)
    y = y / y.std() + 0.1 * rng.normal(size=4000)
    traces = sysid.data((u, y), sample_time=1.0, split=0.5)
    fit = sysid.fit(traces, "u -> y", sysid.OE(nb=(1,), nf=(2,), nk=(1,)))
    found = [note for note in sysid.compare(traces, fit).notes if "does not forget how a run begins" in note]
    assert bool(found) is told
    if told:
        (note,) = found
        assert "start: {estimated: 400}" in note
        score = sysid.compare(traces, fit, start={"estimated": 400})
        assert f"on 400 samples {score.to_frame()['fit'][1]:.2f} %" in note
        assert not [note for note in score.notes if "does not forget" in note]
        assert not [note for note in sysid.compare(traces, fit, start="rest").notes if "does not forget" in note]


def test_the_first_state_of_a_slow_pole_is_not_that_of_an_input_that_was_always_held() -> None:
    """The state was kept near what the record's first input comes to after all time: it was twice y's spread off."""
    rng = np.random.default_rng(1)
    u = 3.0 + np.repeat(rng.uniform(-1.0, 1.0, 100), 20)
    clean = lfilter([0.0, 1.0], [1.0, -0.9998], u)
    spread = clean[1000:].std()
    clean = clean / spread
    model = PolynomialModel(
        orders=OE(nb=(1,), nf=(1,), nk=(1,)), theta=np.array([1.0 / spread, -0.9998, 0.0]),
        mapping=Mapping.parse("u -> y"),
        scaling=Scaling(input_offset=(0.0,), input_scale=(1.0,), output_offset=0.0, output_scale=1.0), sample_time=1.0,
        input_units=("1",), output_unit="1", rest_output=0.0,
    )  # fmt: skip
    measured = clean + 0.2 * rng.normal(size=2000)
    run = model.simulate(u[1050:, None], History(inputs=u[1000:1050, None], output=measured[1000:1050]))
    assert np.sqrt(np.mean((run - clean[1050:]) ** 2)) < 0.1


def test_of_an_output_that_never_changes_the_error_is_told_and_no_percent() -> None:
    """A single jump of an output lies in the first part: over the second it is at rest, and a fit there is none."""
    rng = np.random.default_rng(8)
    u = np.repeat(rng.uniform(-1, 1, 50), 8)
    y = 7.0 * (np.arange(400) > 200)
    traces = sysid.data((u, y), sample_time=0.1, split=0.7, units={"y": "kPa"})
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=1))
    (told,) = [note for note in sysid.compare(traces, fit).notes if "does not forget how a run begins" in note]
    scored = sysid.compare(traces, fit, start={"estimated": 40}).to_frame()
    rms = np.sqrt(scored["mse"].iloc[1])
    assert "% " not in told
    assert f"on 40 samples {rms:.3g} kPa" in told


def test_a_curved_model_whose_run_hangs_on_its_beginning_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """It rings for ever; its window lasts as long as what disturbs it, and says nothing of the samples after it."""
    u = np.zeros(400)
    y = np.where(np.arange(400) < 6, 0.0, np.where(np.arange(400) < 50, 1.0, 0.0)) + 1e-3 * np.sin(np.arange(400))
    traces = sysid.data((u, y), sample_time=1.0)
    model = ARXModel(
        orders=sysid.ARX(na=2, nb=(1,), nk=(1,)), coefficients=np.array([0.0, 2.0 * np.cos(0.01), -1.0]), intercept=0.0,
        mapping=Mapping.parse("u -> y"), sample_time=1.0, input_units=("1",), output_unit="1", rest_output=0.0,
    )  # fmt: skip
    monkeypatch.setattr(ARXModel, "pole_radius", None)  # as of a network
    (told,) = first_states(model, traces, sysid.Start.of("estimated"))
    assert "hangs on where it began" in told
    assert "start: {measured: 4}" in told
    assert not first_states(model, traces, sysid.Start.of({"measured": 4}))
