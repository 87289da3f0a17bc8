"""A second implementation agrees: SciPy's filter and least squares find the same coefficients, to 1e-6 of each.

Both minimise the same sum of squared errors of a record that begins at rest; the errors are written out here with
``scipy.signal.lfilter``, the minimum is that of ``scipy.optimize.least_squares``.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import optimize
from scipy.signal import lfilter

from sysid.estimation import FitResult, fit_polynomial, fit_state_space, fit_transfer_function
from sysid.models import ARMAX, BJ, OE, LinearStateSpace, Mapping, TransferFunction
from sysid.traces import Trace
from tests.estimation.linear_systems import trace_of

Array = NDArray[np.float64]
ONE, N = Mapping.parse("u1 -> y"), 400


@pytest.fixture(scope="module")
def trace() -> Trace:
    """Two poles, coloured noise that passes through the same and through another, at rest before."""
    rng = np.random.default_rng(3)
    u, e = np.sign(rng.normal(size=N)), 0.2 * rng.normal(size=N)
    u[:3] = 0.0
    return trace_of(u[:, None], lfilter([0.0, 1.0, 0.5], [1.0, -1.5, 0.7], u) + lfilter([1.0, 0.5], [1.0, -0.8], e))


def oe(p: Array, u: Array, y: Array) -> Array:
    return np.asarray(lfilter([0.0, *p[:2]], [1.0, *p[2:4]], u) - y)


def armax(p: Array, u: Array, y: Array) -> Array:
    b, a, c = [0.0, *p[:2]], [1.0, *p[2:4]], [1.0, *p[4:6]]
    return np.asarray(lfilter(a, c, y) - lfilter(b, c, u))


def bj(p: Array, u: Array, y: Array) -> Array:
    left = y - lfilter([0.0, *p[:2]], [1.0, *p[2:4]], u)
    return np.asarray(lfilter([1.0, p[5]], [1.0, p[4]], left))


CASES: dict[str, tuple[Callable[[list[Trace]], FitResult], Callable[[Array, Array, Array], Array], list[float]]] = {
    "OE": (
        lambda t: fit_polynomial(t, ONE, OE(nb=2, nf=2, nk=1, intercept=False), rest_output=0.0), oe,
        [1.0, 0.5, -1.5, 0.7],
    ),
    "TF": (
        lambda t: fit_transfer_function(
            t, ONE, TransferFunction(poles=(2,), zeros=(1,), delays=(1,), intercept=False), rest_output=0.0
        ), oe, [1.0, 0.5, -1.5, 0.7],
    ),
    "ARMAX": (
        lambda t: fit_polynomial(t, ONE, ARMAX(na=2, nb=2, nc=2, nk=1, intercept=False), rest_output=0.0), armax,
        [1.0, 0.5, -1.5, 0.7, -0.2, 0.1],
    ),
    "BJ": (
        lambda t: fit_polynomial(t, ONE, BJ(nb=2, nc=1, nd=1, nf=2, nk=1, intercept=False), rest_output=0.0), bj,
        [1.0, 0.5, -1.5, 0.7, 0.5, -0.8],
    ),
    "SS": (
        lambda t: fit_state_space(t, ONE, LinearStateSpace(states=2, intercept=False), rest_output=0.0), armax,
        [1.0, 0.5, -1.5, 0.7, -0.2, 0.1],
    ),
}  # fmt: skip
"""How it is fitted here, its errors written out, and where the other program begins."""


@pytest.mark.parametrize("name", CASES)
def test_the_coefficients_are_those_of_scipy(name: str, trace: Trace) -> None:
    ours, errors, begin = CASES[name]
    u, y = trace["u1"], trace["y"]
    theirs = optimize.least_squares(errors, begin, args=(u, y), jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    found = ours([trace])
    assert found.uncertainty is not None
    assert float(found.history["mse"][-1]) == pytest.approx(2.0 * theirs.cost / N, rel=1e-9)
    np.testing.assert_allclose(found.uncertainty.values, theirs.x, rtol=1e-6, atol=1e-6)
