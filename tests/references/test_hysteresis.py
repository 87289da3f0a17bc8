"""The oscillator of Bouc and Wen, beside a solver of SciPy and the benchmark's own records."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from sysid.errors import ConfigError
from sysid.references import hysteresis
from sysid.references.hysteresis import BENCHMARK, FINER, bouc_wen, generate, settled
from sysid.traces import Channel

STEP = 1.0 / 750.0
CHANNELS = (Channel(name="u", unit="N"), Channel(name="y", unit="m"))


@pytest.mark.parametrize(("nu", "beta"), [(1.0, 1e3), (1.6, 100.0)])
def test_it_is_the_equation_by_another_solver(nu: float, beta: float) -> None:
    time = STEP * np.arange(25)
    force = 120.0 * np.sin(2.0 * np.pi * 40.0 * time) + 40.0 * np.sin(2.0 * np.pi * 90.0 * time)
    between = CubicSpline(time, force)
    p = {**BENCHMARK, "nu": nu, "beta": beta}

    def rates(t: float, x: np.ndarray) -> list[float]:
        y, v, z = x
        bent = p["gamma"] * abs(v) * abs(z) ** (nu - 1.0) * z + p["delta"] * v * abs(z) ** nu
        pull = float(between(t)) - p["damping"] * v - p["stiffness"] * y - z
        return [v, pull / p["mass"], p["alpha"] * v - p["beta"] * bent]

    exact = solve_ivp(rates, (0.0, time[-1]), [0.0, 0.0, 0.0], t_eval=time, rtol=1e-7, atol=1e-10, max_step=STEP / 4)
    assert exact.success
    # Newmark's method is of second order: 2e-4 of a swing at the step that the benchmark has
    found = bouc_wen(time, force[:, None], {"nu": nu, "beta": beta})
    assert found == pytest.approx(exact.y[0], abs=1e-3 * np.abs(exact.y[0]).max())


def test_the_compiled_scheme_is_the_plain_one() -> None:
    force = np.random.default_rng(0).normal(size=300) * 200.0
    numbers = np.array([*list(BENCHMARK.values())[:-1], 1.3])
    plain = hysteresis._newmark(force, STEP / FINER, numbers)
    assert hysteresis.displacement(force, STEP / FINER, nu=1.3) == pytest.approx(plain, rel=1e-9, abs=1e-18)


def test_a_record_is_a_settled_period_with_the_noise_asked_for() -> None:
    ask = {"case": "m", "channels": CHANNELS, "sample_time": STEP}
    recipe = {"seed": 3, "samples": 1024}
    seen = generate(recipe=recipe, options={}, **ask)
    clean = generate(recipe=recipe, options={"noise": 0.0}, **ask)
    assert np.std(seen["u"]) == pytest.approx(50.0)
    assert np.std(seen["y"] - clean["y"]) == pytest.approx(8e-6, rel=0.1)
    lines = np.abs(np.fft.rfft(seen["u"])) * 2.0 / 1024
    hertz = np.fft.rfftfreq(1024, STEP)
    excited = lines > 1e-9
    assert hertz[excited].min() >= 5.0 and hertz[excited].max() <= 150.0
    assert lines[excited] == pytest.approx(lines[excited][0])  # of one amplitude, the phases random
    again = generate(recipe=recipe, options={}, **ask)
    assert np.array_equal(again.values, seen.values)
    with pytest.raises(ConfigError, match=r"(?s)unknown field 'sede'.*seed"):
        generate(recipe={"sede": 3}, options={}, **ask)


@pytest.mark.skipif(
    not (Path(os.environ.get("SYSID_DATA", "no folder")) / "bouc_wen").is_dir(),
    reason="the official records are not here",
)
def test_it_gives_the_official_test_records() -> None:
    folder = Path(os.environ["SYSID_DATA"]) / "bouc_wen"

    def official(name: str) -> np.ndarray:
        return np.asarray(scipy.io.loadmat(folder / f"{name}.mat")[name].ravel())

    y = official("yval_multisine")
    error = settled(official("uval_multisine"), STEP) - y
    assert np.sqrt(np.mean(error**2)) < 2e-7  # m, of 6.7e-4
    u, y = official("uval_sinesweep"), official("yval_sinesweep")
    time = STEP * np.arange(len(u))
    assert u == pytest.approx(40.0 * np.sin(2.0 * np.pi * (18.0 * time + time**2 / 12.0)), abs=1e-8)
    found = bouc_wen(time, u[:, None], {})
    error = found - y
    assert np.sqrt(np.mean(error**2)) < 3e-6
    # What is off goes by the second derivative alone, as if the record had been smoothed: the force is known throughout
    bend = CubicSpline(time, found)(time, 2)
    assert np.sqrt(np.mean((error - error @ bend / (bend @ bend) * bend) ** 2)) < 5e-8
