"""What comes after measured samples: of every model the prediction from the last of them, one step ahead, two ..."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

import sysid
from sysid.errors import ConfigError

RNG = np.random.default_rng(5)
U = np.repeat(RNG.uniform(-1.0, 1.0, 100), 8)
NOISE = lfilter([1.0, 0.6], [1.0, -0.95], 0.3 * RNG.standard_normal(800))
Y = 20.0 + lfilter([0.0, 0.5, 0.2], [1.0, -1.5, 0.7], U) + NOISE
TRACES = sysid.data((U, Y), sample_time=1.0)
NOW = 600
PREDICT = [
    sysid.ARX(na=3, nb=3, nk=1),
    sysid.ARMAX(na=2, nb=2, nc=1, nk=1),
    sysid.ARMAX(na=2, nb=2, nc=1, nk=1, integrated=True),
    sysid.BJ(nb=2, nc=1, nd=1, nf=2, nk=1),
    sysid.LinearStateSpace(states=3),
]


@pytest.mark.parametrize("structure", PREDICT, ids=lambda one: one.label)
def test_a_forecast_is_what_is_predicted_from_the_last_sample(structure: Any) -> None:
    """The free run from the same samples left the noise out: of BJ it began at 21.5 where 22.8 is to be expected."""
    fit = sysid.fit(TRACES, "u -> y", structure)
    found = fit.forecast(U[NOW:], initial=(U[:NOW], Y[:NOW]))
    assert found.shape == (200,)
    for steps in (1, 2, 5, 20):
        assert found[steps - 1] == pytest.approx(fit.predict(Y, U, steps=steps)[NOW + steps - 1], abs=1e-6)


@pytest.mark.parametrize("structure", [sysid.OE(nb=2, nf=2, nk=1), sysid.TransferFunction(poles=2, zeros=1)])
def test_without_a_model_of_the_noise_a_forecast_is_the_free_run_from_these_samples(structure: Any) -> None:
    fit = sysid.fit(TRACES, "u -> y", structure)
    before = U[:NOW], Y[:NOW]
    assert_allclose(fit.forecast(U[NOW:], initial=before), fit.simulate(U[NOW:], initial=before))


@pytest.mark.parametrize("whole", [True, False], ids=["one model", "a model an output"])
def test_several_outputs_are_forecast_together(whole: bool) -> None:
    y = np.column_stack([Y, 0.5 * Y + RNG.standard_normal(800)])
    structure = sysid.LinearStateSpace(states=3) if whole else PREDICT[1]
    fit = sysid.fit(sysid.data((U, y), sample_time=1.0), "u -> y1+y2", structure)
    found = fit.forecast(U[NOW:], initial=(U[:NOW], y[:NOW]))
    assert_allclose(found[2], fit.predict(y, U, steps=3)[NOW + 2], atol=1e-6)


def test_a_time_series_is_forecast_from_its_past() -> None:
    fit = sysid.fit(sysid.data({"y": NOISE}, sample_time=1.0), "-> y", sysid.ARX(na=1, nb=(), nk=()))
    found = fit.forecast(3, initial=(len(NOISE), NOISE))
    level = fit.model.intercept / (1.0 - fit.model.a[0])
    assert_allclose(found - level, (NOISE[-1] - level) * fit.model.a[0] ** np.arange(1, 4))


@pytest.mark.parametrize("initial", [3.0, {"y": 3.0}, None, [1.0, 2.0]])
def test_a_forecast_asks_for_samples_before(initial: Any) -> None:
    fit = sysid.fit(TRACES, "u -> y", PREDICT[0])
    with pytest.raises(ConfigError, match="goes on from measured samples") as refused:
        fit.forecast(U, initial=initial)
    assert "initial=(u_before, y_before)" in str(refused.value.remedy)
