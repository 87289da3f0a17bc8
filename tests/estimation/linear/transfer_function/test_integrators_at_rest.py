"""Plants that integrate, in records that are declared to begin at rest: fitted as they are scored."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid

REST = sysid.Start(kind="rest")


def summed(n: int, offset: float, seed: int) -> sysid.TraceSet:
    """What adds up two inputs, of which the second stands far from zero."""
    rng = np.random.default_rng(seed)
    u = np.column_stack([rng.standard_normal(n), offset + rng.standard_normal(n)])
    y = np.concatenate([[0.0], np.cumsum(u.sum(axis=1))[:-1]])
    return sysid.data((u, y), sample_time=0.1)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("offset", [10.0, 1e5])
def test_a_dead_time_that_is_wrong_costs_a_sample_and_no_runaway(offset: float, seed: int) -> None:
    """Free poles were fitted from a free state, ended a little off 1, and had an equilibrium far beyond the record."""
    traces = summed(87, offset, seed)
    orders = sysid.TransferFunction(poles=(1, 1), zeros=(0, 0), delays=(1, 0))
    fit = sysid.fit(traces, "u1+u2 -> y", orders, start=REST)
    assert fit.status.usable
    assert [fit.model.poles(j).tolist() for j in (0, 1)] == [[1.0], [1.0]]
    (case,) = next(iter(sysid.compare(traces, fit, start=REST).evaluations.values())).cases.values()
    assert case.free_run.mse**0.5 < 2.0  # the inputs' noise over a sample


@pytest.mark.parametrize("seed", [0, 1])
def test_each_input_has_its_own_integrator_and_neither_record_nor_plant_is_called_more(seed: int) -> None:
    orders = sysid.TransferFunction(poles=(1, 1), zeros=(0, 0), delays=(1, 1))
    fit = sysid.fit(summed(400, 10.0, seed), "u1+u2 -> y", orders, start=REST)
    assert any("not stable: an integrator" in note for note in fit.notes)
    assert not any("does not begin in equilibrium" in note for note in fit.notes)


@pytest.mark.parametrize("start", [REST, sysid.Start(kind="estimated")], ids=["at rest", "estimated"])
@pytest.mark.parametrize("orders", [sysid.OE(nb=1, nf=2, nk=4), sysid.TransferFunction(poles=2, zeros=0, delays=4)])
def test_a_sum_is_found_and_begins_at_rest_where_its_input_does_not_stand_at_zero(
    orders: sysid.OE | sysid.TransferFunction, start: sysid.Start
) -> None:
    """OE saw an equilibrium that no plant has and fitted none of it; either ran off before its dead time was over."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.standard_normal(30), 10)
    u[:20] = 1.0
    y = 5.0 + 0.1 * np.cumsum(lfilter([0, 0, 0, 0, 1.0], [1.0, -0.5], u))
    y += 0.01 * rng.standard_normal(len(y))
    fit = sysid.fit(sysid.data((u[:, np.newaxis], y), sample_time=1.0), "u -> y", orders, start=start, rest_output=5.0)
    run = fit.model.simulate(u[:, np.newaxis])
    assert fit.model.pole_radius == pytest.approx(1.0, abs=1e-9)
    assert np.abs(run[:4] - 5.0).max() < 1e-9
    assert np.std(run - y) < 0.005 * np.std(y)


def test_inputs_that_say_nothing_are_left_out_of_smaller_structures_too() -> None:
    """Fewer samples than dead times and past inputs have: of two inputs one is not determined."""
    u = np.random.default_rng(0).standard_normal((6, 2))
    y = np.array([0.0, 1.43, 1.96, 1.50, 0.04, -1.12])
    copied = np.column_stack([u[:, 0], 2.0 * u[:, 0]])
    orders = sysid.TransferFunction(poles=(1, 1), zeros=(0, 1))
    training = sysid.TransferFunctionTraining(max_iterations=5, max_delay=3)
    for inputs in (u, copied):
        fit = sysid.fit(sysid.data((inputs, y), sample_time=0.1), "u1+u2 -> y", orders, training, start=REST)
        assert np.isfinite(fit.simulate(inputs)).all()
