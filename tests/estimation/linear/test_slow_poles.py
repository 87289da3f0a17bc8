"""A drift is not taken for a plant that integrates in silence, and a plant that integrates is found."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid
from sysid.estimation import fit_polynomial, fit_state_space, fit_transfer_function
from sysid.estimation.linear import slow_poles
from sysid.estimation.results.result import FitResult
from sysid.models import OE, History, LinearStateSpace, Mapping, Scaling, Start, StartKind, TransferFunction
from sysid.models.linear.innovations import Innovations
from sysid.models.linear.state_space import StateSpace
from sysid.traces import Trace
from tests.estimation.linear_systems import steps, trace_of

ONE, FREE = Mapping.parse("u1 -> y"), Start(kind=StartKind.ESTIMATED)
N = 400


def oe(trace: Trace, order: int) -> FitResult:
    return fit_polynomial([trace], ONE, OE(nb=order, nf=order, nk=1), start=FREE)


def ss(trace: Trace, order: int) -> FitResult:
    return fit_state_space([trace], ONE, LinearStateSpace(states=order, noise=False), start=FREE)


def tf(trace: Trace, order: int) -> FitResult:
    orders = TransferFunction(poles=order, zeros=order - 1, delays=1)
    return fit_transfer_function([trace], ONE, orders, start=FREE)


STRUCTURES = pytest.mark.parametrize("fit", [oe, ss])


def drifting(seed: int) -> tuple[Trace, np.ndarray, np.ndarray]:
    """A quick plant under a random walk; inputs and clean output go on for as long again."""
    rng = np.random.default_rng(seed)
    u = steps(2 * N, 1, rng, held=8)
    clean = lfilter([0.0, 0.3], [1.0, -0.7], u[:, 0])
    drift = np.cumsum(rng.standard_normal(N))
    return trace_of(u[:N], clean[:N] + 0.5 * drift / drift.std()), u, clean


@STRUCTURES
@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_a_drift_is_told_and_bounds_the_free_run(fit: object, seed: int) -> None:
    trace, u, clean = drifting(seed)
    found = fit(trace, 3)  # type: ignore[operator]
    assert any("hang together" in note for note in found.notes) or any("slowest pole" in note for note in found.notes)
    # The bound is on eigenvalues; the roots of the polynomial are the same but for rounding.
    bound = 1.0 - 1.0 / (slow_poles.SLOWEST * N) if fit is oe else slow_poles.largest_pole([N])
    assert found.model.pole_radius <= bound + 1e-12
    # The level is lost to the drift, which has a range of about two; beyond it nothing grows.
    assert np.abs(found.model.simulate(u)[N:] - clean[N:]).max() < 6.0 * np.ptp(trace["y"])


@pytest.mark.parametrize("fit", [oe, ss, tf])
def test_a_pole_that_its_bound_holds_back_is_warned_of(fit: Callable[[Trace, int], FitResult]) -> None:
    trace, _, _ = drifting(2)
    found = fit(trace, 3)
    assert slow_poles.undecided(found.model.pole_radius, [N])
    (warning,) = found.warnings
    assert "slowest pole" in warning
    assert warning in found.notes


@pytest.mark.parametrize("fit", [oe, ss, tf])
def test_a_pole_slower_than_the_record_that_stands_where_the_inputs_put_it_is_noted(
    fit: Callable[[Trace, int], FitResult],
) -> None:
    """It had been said that the record cannot tell, of a pole that is right to its fifth digit."""
    rng = np.random.default_rng(0)
    u, pole = steps(N, 1, rng, held=8), 1.0 - 1.0 / (3.0 * N)
    y = lfilter([0.0, 1.0 - pole], [1.0, -pole], u[:, 0])
    found = fit(trace_of(u, y + 0.01 * y.std() * rng.standard_normal(N)), 1)
    assert found.model.pole_radius == pytest.approx(pole, abs=5e-5)
    assert not found.warnings
    assert any("slowest pole" in note for note in found.notes)


@STRUCTURES
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_plant_that_integrates_is_found_and_told(fit: object, noise: float) -> None:
    rng = np.random.default_rng(0)
    u = steps(N, 1, rng, held=5)
    y = lfilter([0.0, 0.1], [1.0, -1.0], u[:, 0]) + noise * rng.standard_normal(N)
    found = fit(trace_of(u, y), 1)  # type: ignore[operator]
    assert found.model.pole_radius > 1.0 - 2e-4
    assert any("slowest pole" in note for note in found.notes)


@pytest.mark.parametrize("seed", range(3))
def test_an_output_error_has_the_slow_poles_of_the_transfer_function_of_its_orders(seed: int) -> None:
    """It had stopped at a bound of its own: 70 % of a record of which the transfer function explains 95 %."""
    rng = np.random.default_rng(seed)
    u, noise = np.repeat(rng.normal(size=60), 10), lfilter([1.0], [1.0, -0.95], rng.normal(size=600))
    y = lfilter([0.0, 0.02, 0.01], np.poly([1.0, 0.8]), u)
    trace = trace_of(u, y + 0.05 * y.std() * noise / noise.std())
    tf = fit_transfer_function([trace], ONE, TransferFunction(poles=(2,), zeros=(1,), delays=(1,)), start=FREE)
    errors = [fit.history["mse"][-1] for fit in (oe(trace, 2), tf)]
    assert errors[0] == pytest.approx(errors[1], rel=1e-2)


@STRUCTURES
def test_a_quick_plant_with_white_noise_has_no_such_note(fit: object) -> None:
    rng = np.random.default_rng(0)
    u = steps(N, 1, rng, held=5)
    y = lfilter([0.0, 0.3], [1.0, -0.7], u[:, 0]) + 0.1 * rng.standard_normal(N)
    assert not [note for note in fit(trace_of(u, y), 1).notes if "slowest" in note or "together" in note]  # type: ignore[operator]


def test_a_transfer_function_tells_errors_that_hang_together() -> None:
    trace, _, _ = drifting(0)
    found = fit_transfer_function([trace], ONE, TransferFunction(poles=(1,), zeros=(0,), delays=(1,)), start=FREE)
    assert any("hang together" in note for note in found.notes)


def test_errors_of_a_random_walk_say_as_little_as_few() -> None:
    rng = np.random.default_rng(1)
    walk = np.cumsum(rng.standard_normal((2000, 1)), axis=0)
    white = rng.standard_normal((2000, 1))
    better = {"parameters": 4, "scale": 1.0}
    assert slow_poles.significantly_better([0.95 * white], [white], **better)
    assert not slow_poles.significantly_better([0.95 * walk], [walk], **better)


@pytest.mark.parametrize("seed", [0, 1])
def test_the_free_run_of_a_state_space_with_noise_is_not_lost_to_a_drift(seed: int) -> None:
    """One state more than the plant has, for a level that rises by one over the record."""
    rng = np.random.default_rng(seed)
    u = steps(2 * N, 1, rng, held=8)
    clean = 5.0 + lfilter([0.0, 0.3], [1.0, -0.7], u[:, 0])
    y = clean[:N] + np.linspace(0.0, 1.0, N) + 0.05 * rng.standard_normal(N)
    model = fit_state_space([trace_of(u[:N], y)], ONE, LinearStateSpace(states=2), start=FREE).model
    off = model.simulate(u[50:], History(inputs=u[:50], output=y[:50])) - clean[50:]
    # The drift would have gone to two; with a pole so near one that nothing held the level it was ten.
    assert np.abs(off).max() < 2.1


def test_a_level_that_only_innovations_reach_is_estimated_from_a_history() -> None:
    """A pole near one, which no input drives, stands for a level of 300: the free run begins there."""
    A, B = np.diag([0.7, 1.0 - 1e-6]), np.array([[0.3], [0.0]])
    system = Innovations(
        A=A, B=B, C=np.ones((1, 2)), D=np.zeros((1, 1)), K=np.array([[0.0], [0.1]]), constant=np.zeros(1)
    )
    form = StateSpace.of(system, Scaling.identity(1), noise=True)
    rng = np.random.default_rng(0)
    u = np.repeat(rng.choice([-1.0, 1.0], 40), 5)[:, None]
    clean = 300.0 + lfilter([0.0, 0.3], [1.0, -0.7], u[:, 0])
    y = clean + 0.1 * rng.normal(size=200)
    run = form.simulate(u[50:], History(inputs=u[:50], output=y[:50]))
    np.testing.assert_allclose(run, clean[50:], atol=0.1)


@pytest.mark.parametrize("level", [0.0, 5.0])
def test_an_output_error_integrates_about_the_input_at_which_its_plant_stands(level: float) -> None:
    """Away from zero its gain came out a seventieth: the constant that undoes the ramp had counted as nothing."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1.0, 1.0, 200), 20)
    y = np.cumsum(np.r_[0.0, 0.02 * u[:-1]]) + 0.01 * rng.standard_normal(4000)
    traces = sysid.data((u + level, y + 8.0 * level), sample_time=2.0, split=0.6)
    fit = sysid.fit(traces, "u -> y", sysid.OE(nb=1, nf=1, nk=1))
    assert fit.step(seconds=20.0).values[-1, 0] == pytest.approx(0.2, rel=0.01)
    assert min(sysid.compare(traces, fit).to_frame()["fit"]) > 98.0
