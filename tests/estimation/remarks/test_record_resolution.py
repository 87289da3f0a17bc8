"""The steps of a converter are told where they are what a fit is wrong by, and only there."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray

import sysid

ARX, OE = sysid.ARX(na=2, nb=2, nk=1), sysid.OE(nb=1, nf=2, nk=2)
UNASKED = sysid.StabilityOptions(count=0)


def _record(time_constant: float, noise: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1.0, 1.0, 20), 100)
    first, second = np.exp(-1.0 / time_constant), np.exp(-4.0 / time_constant)
    poles = np.convolve([1.0, -first], [1.0, -second])
    y = scipy.signal.lfilter([0.0, 0.0, (1 - first) * (1 - second)], poles, u)
    return u, y / y.std() + noise * rng.standard_normal(len(u))


def _warned(pair: tuple[NDArray[np.float64], NDArray[np.float64]], structure: object) -> list[str]:
    fit = sysid.fit(sysid.data(pair, sample_time=1.0, units={"y": "V"}), "u -> y", structure, stability=UNASKED)
    return [one for one in fit.warnings if "comes in steps of" in one]


def test_a_fit_one_step_ahead_sees_the_steps_of_eight_bit() -> None:
    u, y = _record(200.0)
    step = float(np.ptp(y)) / 2**8
    (told,) = _warned((u, np.round(y / step) * step), ARX)
    assert f"y comes in steps of {step:.3g} V, and one step ahead" in told
    assert "loop: closed" in told
    assert _warned((u, np.round(y / step) * step), OE) == []


def test_what_the_free_run_leaves_may_be_the_steps_alone() -> None:
    u, y = _record(50.0)
    (told,) = _warned((u, np.round(y / 0.2) * 0.2), OE)
    assert "no model comes nearer" in told


@pytest.mark.parametrize(("noise", "digits"), [(0.05, 2), (0.05, 3), (0.2, 1), (0.0, 4), (0.0, 15)])
@pytest.mark.parametrize("structure", [ARX, OE], ids=["ARX", "OE"])
def test_ordinary_digits_are_not_told(structure: object, noise: float, digits: int) -> None:
    u, y = _record(10.0, noise)
    assert _warned((u, np.round(y, digits)), structure) == []


def test_advice_and_the_look_into_a_file_tell_it(tmp_path) -> None:
    from sysid.ingest import inspect_file

    u, y = _record(200.0)
    rounded = np.round(y / 0.05) * 0.05
    (found,) = [
        one
        for one in sysid.advise(sysid.data((u, rounded), sample_time=1.0), "u -> y").findings
        if one.code == "channel.resolution"
    ]
    assert found.verdict.name == "LOOK"
    rows = [f"{k},{a},{b:.2f},{c}" for k, (a, b, c) in enumerate(zip(u, rounded, y, strict=True))]
    (tmp_path / "rig.csv").write_text("\n".join(["t [s],u [V],y [V],z [V]", *rows]))
    assert {one.name: round(one.step, 6) for one in inspect_file(tmp_path / "rig.csv").columns} == {
        "u": 0.0,
        "y": 0.05,
        "z": 0.0,
    }
