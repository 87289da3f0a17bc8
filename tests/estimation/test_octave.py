"""A second implementation agrees: numbers from GNU Octave 7.3.0 with its control package 3.4.0.

The record is made from formulas, so that both programs see the same numbers. In Octave, ``u`` and ``y`` columns::

    sys = arx(iddata(y, u, 1), 'na', 2, 'nb', 2)                       % ARX
    [q, r] = qr([Phi Y], 0); r(end, end)^2 / length(Y)                 % losses; rows 4 to 200 of lagged columns
    th = (filter(l, 1, Z)(5:end, :)' * filter(l, 1, Phi)(5:end, :)) \\ ...  % IV4 of Ljung 1999, section 15.3

The dead time that Octave's ``arx`` counts is one less than ours. Octave's package has no instrumental variables; those
are written out from the textbook there. SIPPY 1.0.1 (package ``sippy_unipi``) gives the numbers of the longer dead time
too, counting as Octave does.
"""

from __future__ import annotations

import numpy as np
import pytest

from sysid.estimation import fit_arx, fit_iv4
from sysid.estimation.linear.order_grid import OrderGrid
from sysid.estimation.linear.order_search import search_orders
from sysid.models import ARX, Mapping, Start, StartKind
from sysid.traces import Trace
from tests.estimation.linear_systems import arx_response, trace_of

MAPPING = Mapping.parse("u1 -> y")
ORDERS = ARX(na=2, nb=(2,), nk=(1,), intercept=False)
LOSSES = {
    (1, 1): 3.2097982777529,
    (1, 2): 2.1174872506717,
    (1, 3): 1.7761584667069,
    (2, 1): 0.070787859719419,
    (2, 2): 0.0049766908865885,
    (2, 3): 0.0049766906649277,
    (3, 1): 0.015130206485194,
    (3, 2): 0.0049656875567905,
    (3, 3): 0.0048469730358925,
}


@pytest.fixture(scope="module")
def trace() -> Trace:
    t = np.arange(200)
    u = np.sign(np.sin(0.37 * t) + np.sin(0.11 * t + 1.0) + 0.3 * np.sin(1.7 * t))
    return trace_of(
        u[:, np.newaxis], arx_response([1.5, -0.7], [[0.0, 1.0, 0.5]], u[:, None], 0.1 * np.sin(37.0 * t**1.5))
    )


def measured(n: int) -> Start:
    return Start(kind=StartKind.MEASURED, n_measured=n)


def test_arx(trace: Trace) -> None:
    model = fit_arx([trace], MAPPING, ORDERS, start=measured(2)).model
    np.testing.assert_allclose(-model.a, [-1.50261668306, 0.702779524832], rtol=1e-10)
    np.testing.assert_allclose(model.b[0], [1.00915074978, 0.481774269667], rtol=1e-10)


def test_arx_with_a_longer_dead_time(trace: Trace) -> None:
    """Octave: 'nk', 1. SIPPY: system_identification(y, u, 'ARX', ARX_orders=[2, 2, 1])."""
    model = fit_arx([trace], MAPPING, ARX(na=2, nb=(2,), nk=(2,), intercept=False), start=measured(3)).model
    np.testing.assert_allclose(-model.a, [-1.5746050210271714, 0.7649227326009992], rtol=1e-10)
    np.testing.assert_allclose(model.b[0], [1.0465951672799245, 0.0027913436525338173], rtol=1e-8)


def test_instrumental_variables(trace: Trace) -> None:
    model = fit_iv4([trace], MAPPING, ORDERS, start=measured(2)).model
    np.testing.assert_allclose(-model.a, [-1.50211650343, 0.702431367794], rtol=1e-8)
    np.testing.assert_allclose(model.b[0], [1.01020084483, 0.483786729278], rtol=1e-8)


def test_order_losses(trace: Trace) -> None:
    grid = OrderGrid(max_na=3, max_nb=3, min_nk=1, max_nk=1, intercept=False)
    losses = search_orders([trace], MAPPING, grid, start=measured(3))
    found = {(int(na), int(nb[0])): mse for na, nb, mse in zip(losses.na, losses.nb, losses.mse, strict=True)}
    assert found == pytest.approx(LOSSES, rel=1e-10)
