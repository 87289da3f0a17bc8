"""A masked sample is nobody's regressor: what is fitted one step ahead equals numpy's fit without such rows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import lfilter

from sysid.errors import TraceError
from sysid.estimation import Loop, Training, fit_arx, fit_narx
from sysid.estimation.fitting import fit
from sysid.estimation.linear.instrumental import fit_iv4
from sysid.estimation.linear.order_grid import OrderGrid
from sysid.estimation.linear.order_search import search_orders
from sysid.estimation.records.experiment import Experiment
from sysid.models import (
    ARX,
    NARX,
    OE,
    AbstractStructure,
    Mapping,
    PolynomialNARX,
    Start,
    StartKind,
    TransferFunction,
)
from sysid.traces import Channel, Trace

MAPPING = Mapping.parse("u -> y")
FILL = 99.0
"""What stands under the mask."""


def masked(n: int = 600, gap: slice = slice(200, 260), *, noise: float = 0.0, seed: int = 1) -> Trace:
    """A first-order system, a = 0.8, b = 0.2, constant 0.2, with a filling under the mask of both channels."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.integers(0, 2, n // 5 + 1), 5)[:n] * 2.0 - 1
    y = lfilter([0, 0.2], [1, -0.8], u + 1.0) + noise * rng.standard_normal(n)
    usable = np.ones(n, dtype=np.bool_)
    usable[gap] = False
    y[gap] = u[gap] = FILL
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
    return Trace(name="r", sample_time=0.1, channels=channels, values=np.c_[u, y], usable=usable)


def by_numpy(trace: Trace, orders: ARX, first: int) -> NDArray[np.float64]:
    """Least squares over the rows from ``first`` on that look at no masked sample: ``[b | a | constant]``."""
    u, y, ok = trace["u"], trace["y"], trace.usable_samples
    lags = [*range(orders.nk[0], orders.nk[0] + orders.nb[0])]
    own = [*range(1, orders.na + 1)]
    rows = [k for k in range(first, len(y)) if all(ok[k - lag] for lag in (0, *lags, *own))]
    X = np.array([[*(u[k - lag] for lag in lags), *(y[k - lag] for lag in own), 1.0] for k in rows])
    return np.linalg.lstsq(X, y[rows], rcond=None)[0]


@pytest.mark.parametrize(
    "orders", [ARX(na=1, nb=(1,), nk=(1,)), ARX(na=2, nb=(2,), nk=(1,)), ARX(na=0, nb=(9,), nk=(3,))]
)
def test_arx_is_least_squares_without_the_rows_that_look_at_a_gap(orders: ARX) -> None:
    trace = masked(noise=0.02)
    found = fit_arx([trace], MAPPING, orders, start=Start(kind=StartKind.MEASURED, n_measured=12)).model
    np.testing.assert_allclose([*found.coefficients, found.intercept], by_numpy(trace, orders, 12), atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(first=st.integers(0, 90), length=st.integers(1, 60), measured=st.integers(1, 20))
def test_a_gap_anywhere_leaves_the_true_coefficients(first: int, length: int, measured: int) -> None:
    trace = masked(150, slice(first, first + length))
    start = Start(kind=StartKind.MEASURED, n_measured=measured)
    found = fit_arx([trace], MAPPING, ARX(na=1, nb=(1,), nk=(1,)), start=start).model
    np.testing.assert_allclose([*found.coefficients, found.intercept], [0.2, 0.8, 0.2], atol=1e-9)


def test_instrumental_variables_leave_those_rows_out_too() -> None:
    start = Start(kind=StartKind.MEASURED, n_measured=5)
    found = fit_iv4([masked()], MAPPING, ARX(na=1, nb=(1,), nk=(1,)), start=start).model
    np.testing.assert_allclose([*found.coefficients, found.intercept], [0.2, 0.8, 0.2], atol=1e-8)


def test_an_order_search_counts_the_rows_that_its_largest_candidate_can_count() -> None:
    trace, start = masked(noise=0.02), Start(kind=StartKind.MEASURED, n_measured=12)
    losses = search_orders([trace], MAPPING, OrderGrid(max_na=2, max_nb=2, max_nk=2, min_nk=1), start=start)
    place = next(i for i in range(len(losses)) if losses.orders(i) == ARX(na=2, nb=(2,), nk=(2,)))
    fit = fit_arx([trace], MAPPING, losses.orders(place), start=start)
    assert losses.mse[place] == pytest.approx(fit.history["mse"][0], rel=1e-9)
    assert losses.n_samples == sum(1 for k in range(12, 600) if trace.usable_samples[k - 3 : k + 1].all())


def test_a_network_one_step_ahead_does_not_look_at_a_gap() -> None:
    network = NARX(input_delays=1, output_delays=1, neurons=0)
    start = Start(kind=StartKind.MEASURED, n_measured=5)
    fit = fit_narx([masked()], MAPPING, network, Training(loop=Loop.OPEN, regularisation=0.0), start=start)
    form = fit.model.recursion
    gain = form.scaling.output_scale / form.scaling.input_scale[0]
    np.testing.assert_allclose([form.linear[0] * gain, form.linear[1]], [0.2, 0.8], atol=1e-6)
    assert abs(form.scaling.output_offset) < 2.0  # of what was measured, not of what stands under the mask


@pytest.mark.parametrize(
    "structure",
    [ARX(na=1, nb=(1,), nk=(1,)), OE(nb=(1,), nf=(1,), nk=(1,)), PolynomialNARX(input_delays=1, output_delays=1)],
    ids=lambda one: one.kind,
)
def test_a_mask_on_every_other_sample_is_refused_where_a_sample_needs_its_past(structure: AbstractStructure) -> None:
    trace = masked(gap=slice(0, None, 2))
    with pytest.raises(TraceError, match="in a row") as refused:
        fit((trace,), MAPPING, structure, stability=None)
    assert "transfer function" in refused.value.remedy


@pytest.mark.parametrize(
    "structure",
    [
        ARX(na=1, nb=(1,), nk=(1,)),
        TransferFunction(poles=(1,), zeros=(0,)),
        PolynomialNARX(input_delays=1, output_delays=1, degree=1, terms=3),
    ],
    ids=lambda one: one.kind,
)
def test_a_record_of_which_little_is_left_is_fitted_by_what_is_left(structure: AbstractStructure) -> None:
    trace = masked(gap=slice(40, None))
    found = fit((trace,), MAPPING, structure, stability=None, start=Start(kind=StartKind.ESTIMATED))
    begun = Experiment.for_model(trace, found.model, Start(kind=StartKind.ESTIMATED))
    away = (found.model.simulate(begun.inputs, begun.history) - begun.output)[begun.weights > 0.0]
    assert len(away) > 20
    assert np.abs(away).max() < 1e-6
