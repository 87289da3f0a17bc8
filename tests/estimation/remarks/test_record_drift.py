"""A drift is told as what it is, and nothing else is told as a drift."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray

import sysid
from sysid.estimation.remarks.record_drift import trend_of

N = 800
STRUCTURES = {
    "ARX": sysid.ARX(na=2, nb=2, nk=1),
    "OE": sysid.OE(nb=1, nf=1, nk=3),
    "TransferFunction": sysid.TransferFunction(poles=2, zeros=1, delays=3),
    "LinearStateSpace": sysid.LinearStateSpace(states=2),
    "BJ, whose noise takes it": sysid.BJ(nb=1, nf=1, nc=1, nd=1, nk=3),
}
UNASKED = sysid.StabilityOptions(count=0)


def _record(seed: int = 0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.0, 1.0, N // 10), 10)
    y = scipy.signal.lfilter([0.0, 0.0, 0.0, 0.15], [1.0, -0.85], u)
    return u, y / y.std() + 0.02 * rng.standard_normal(N)


@pytest.mark.parametrize("rise", [0.5, -1.5])
@pytest.mark.parametrize("structure", STRUCTURES.values(), ids=STRUCTURES)
def test_a_drift_is_told_whatever_is_fitted_and_no_dead_time_for_it(structure: object, rise: float) -> None:
    u, y = _record()
    drifting = sysid.data((u, y + rise * np.linspace(0.0, 1.0, N)), sample_time=1.0, units={"y": "bar"})
    told = sysid.fit(drifting, "u -> y", structure, stability=UNASKED).warnings
    assert any(f"y drifts: it {'rises' if rise > 0 else 'falls'} by" in one and " bar (" in one for one in told)
    assert not any("dead time is too" in one or "too little memory" in one for one in told)


def test_its_remedy_takes_it_off() -> None:
    u, y = _record()
    pair = (u, y + 2.0 * np.linspace(0.0, 1.0, N))
    (told,) = sysid.fit(sysid.data(pair, sample_time=1.0), "u -> y", STRUCTURES["OE"], stability=UNASKED).warnings[-1:]
    assert "repairs: {drift: {y: line}}" in told
    mended = sysid.data(pair, sample_time=1.0, repairs={"drift": {"y": "line"}})
    plain = sysid.data((u, y), sample_time=1.0)
    fits = [sysid.fit(one, "u -> y", STRUCTURES["OE"], stability=UNASKED) for one in (mended, plain)]
    assert not any("drifts" in one for one in fits[0].warnings)
    np.testing.assert_allclose(*(fit.model.ratios[0, 0].F for fit in fits), atol=0.01)


@pytest.mark.parametrize("plant", ["integrator", "slow", "wandering", "follows an input", "at two levels"])
def test_nothing_else_is_a_drift(plant: str) -> None:
    rng, (u, y) = np.random.default_rng(1), _record(1)
    u, y = {
        "integrator": (u, 0.02 * np.cumsum(u + 0.3)),
        "slow": (u + 1.0, scipy.signal.lfilter([0.0, 0.002], [1.0, -0.998], u + 1.0)),
        "wandering": (u, y + 0.05 * np.cumsum(rng.standard_normal(N))),
        "follows an input": (
            u + np.linspace(0.0, 2.0, N),
            scipy.signal.lfilter([0.0, 1.0], [1.0, -0.5], u + np.linspace(0, 2, N)),
        ),
        "at two levels": (u, y + np.where(np.arange(N) < N // 2, 0.0, 2.0)),
    }[plant]
    traces = sysid.data((u, y + 0.02 * rng.standard_normal(N)), sample_time=1.0)
    for structure in (STRUCTURES["ARX"], STRUCTURES["OE"]):
        assert not [
            one
            for one in sysid.fit(traces, "u -> y", structure, stability=UNASKED).warnings
            if "it rises" in one or "it falls" in one
        ]


@pytest.mark.parametrize("seed", [8008, 8017])
def test_a_slow_mode_that_inputs_drive_is_no_drift(seed: int) -> None:
    """The model had the plant's slow pole, and its free run left the noise alone."""
    rng = np.random.default_rng(seed)
    pole, share = rng.uniform(0.9975, 0.9995), rng.uniform(0.1, 0.6)
    n, held = int(rng.choice([1500, 3000])), int(rng.choice([30, 100]))
    u = np.repeat(rng.choice([-1.0, 1.0], n // held + 1), held)[:n]
    quick, slow = (scipy.signal.lfilter([0.0, 1.0 - p], [1.0, -p], u) for p in (0.6, pole))
    y = share * quick + (1.0 - share) * slow
    traces = sysid.data((u, y + 0.05 * y.std() * rng.standard_normal(n)), sample_time=1.0)
    told = sysid.fit(traces, "u -> y", sysid.OE(nb=2, nf=2, nk=1), stability=UNASKED).warnings
    assert not [one for one in told if "drifts" in one]


def test_a_trend_is_a_line_or_a_jump_or_chance() -> None:
    noise = np.random.default_rng(2).standard_normal(400)
    assert trend_of(noise, 1.0) is None
    drift = trend_of(noise + np.linspace(0.0, 5.0, 400), 1.5)
    assert drift is not None and drift.at is None and drift.size == pytest.approx(5.0, abs=0.5)
    jump = trend_of(noise + np.where(np.arange(400) < 150, 0.0, 4.0), 1.5)
    assert jump is not None and jump.at is not None and abs(jump.at - 150) < 4
    assert trend_of(noise[:30] + np.linspace(0.0, 50.0, 30), 1.0) is None
