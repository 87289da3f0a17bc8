"""Plants that integrate about an input that no record says: a tank with an outflow, a motor with friction."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

import sysid
from sysid.models import Domain, TransferFunctionModel

DISCRETE, CONTINUOUS = Domain.DISCRETE, Domain.CONTINUOUS


def levels(n: int, seed: int, hold: int = 6) -> NDArray[np.float64]:
    return np.repeat(np.random.default_rng(seed).choice([-1.0, 1.0, 0.5, -0.3], n // hold + 1), hold)[:n]


def tank(*, stands: float, dead: int, noise: float, n: int = 300) -> sysid.TraceSet:
    """A level that stands at one inflow, and rises by 0.05 a sample for 1 more."""
    u = 5.0 + levels(n, 3)
    y = 2.0 + lfilter([0.0] * dead + [0.05], [1.0, -1.0], u - stands)
    return sysid.data((u, y + noise * np.random.default_rng(4).standard_normal(n)), sample_time=0.1)


@pytest.mark.parametrize("domain", [DISCRETE, CONTINUOUS])
@pytest.mark.parametrize(("stands", "dead", "noise"), [(5.1, 1, 0.0), (3.0, 9, 0.01)])
def test_the_pole_is_1_and_the_input_at_which_the_plant_stands_is_found(
    stands: float, dead: int, noise: float, domain: Domain
) -> None:
    """A pole a little off 1 had made the ramp, from a state far away: 'its free run grows without bound'."""
    traces = tank(stands=stands, dead=dead, noise=noise)
    fit = sysid.fit(
        traces, "u -> y", sysid.TransferFunction(poles=1, zeros=0, delays=dead - (domain is CONTINUOUS), domain=domain)
    )
    assert isinstance(fit.model, TransferFunctionModel)
    assert fit.status.usable
    assert fit.model.pole_radius == pytest.approx(1.0, abs=1e-12)
    assert fit.model.scaling.input_offset[0] == pytest.approx(stands, abs=0.02 * bool(noise) + 1e-6)
    assert any("an integrator; an error" in note for note in fit.notes)
    assert any(f"The output stands at u = {stands:.3g}"[:-1] in note for note in fit.notes) or noise
    assert not any("drifts" in warning for warning in fit.warnings)
    if not noise:
        np.testing.assert_allclose(fit.model.numerator(0), 0.05 if domain is DISCRETE else 0.5, rtol=1e-6)


def test_an_output_error_stands_where_its_transfer_function_does() -> None:
    traces = tank(stands=5.1, dead=1, noise=0.01)
    fit = sysid.fit(traces, "u -> y", sysid.OE(nb=1, nf=1, nk=1))
    trace = traces.traces[0]
    assert np.std(fit.simulate(trace) - trace["y"]) < 0.012


def test_two_sums_are_two_poles_at_1() -> None:
    n, e = 400, np.random.default_rng(4).standard_normal(400)
    u, v = levels(n, 3), levels(n, 9, hold=11)
    y = 10.0 + lfilter([0, 0.05], [1, -1], u - 0.4) - lfilter([0, 0.03], [1, -1], v) + 0.01 * e
    traces = sysid.data({"u": u + 5.0, "v": v + 2.0, "y": y}, inputs=["u", "v"], outputs="y", sample_time=0.1)
    fit = sysid.fit(traces, "u+v -> y", sysid.TransferFunction(poles=1, zeros=0, delays=1))
    assert [fit.model.poles(j).tolist() for j in (0, 1)] == [[1.0], [1.0]]
    np.testing.assert_allclose([fit.model.numerator(j)[0] for j in (0, 1)], [0.05, -0.03], rtol=0.05)


def test_the_drift_of_a_sensor_is_no_sum_of_the_input() -> None:
    """A pole at 1 with a level far away draws any line: it is told all the same."""
    n, e = 600, np.random.default_rng(4).standard_normal(600)
    u = levels(n, 3)
    y = lfilter([0, 0.2], [1, -0.8], u) + np.linspace(0.0, 4.0, n) + 0.02 * e
    fit = sysid.fit(sysid.data((u, y), sample_time=0.1), "u -> y", sysid.TransferFunction(poles=2, zeros=1, delays=1))
    assert any("y drifts" in warning for warning in fit.warnings)
