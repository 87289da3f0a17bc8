"""Polynomial models: their state space is the difference equation, in free run and ahead."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from sysid.models import ARMAX, ARX, BJ, OE, ARXModel, History, Mapping, PolynomialModel, Scaling, model_from_dict
from sysid.models.linear.polynomial_orders import AbstractPolynomial

TERMS = {
    "mapping": Mapping.parse("u1+u2 -> y"), "sample_time": 0.1, "input_units": ("V", "A"), "output_unit": "bar",
    "rest_output": 0.0,
}  # fmt: skip


def model(orders: AbstractPolynomial, theta: list[float]) -> PolynomialModel:
    scaling = Scaling(input_offset=(0.0, 0.0), input_scale=(2.0, 1.0), output_offset=0.0, output_scale=4.0)
    return PolynomialModel(orders=orders, theta=np.array(theta), scaling=scaling, **TERMS)


BJ_ = model(BJ(nb=(2, 1), nc=1, nd=1, nf=(1, 2), nk=(1, 0)), [1.0, 0.5, 0.3, -0.7, -0.9, 0.4, 0.3, -0.8, 0.0])
ARMAX_ = model(ARMAX(na=2, nb=(1, 1), nc=2, nk=(1, 3)), [1.0, 0.2, -1.2, 0.5, 0.4, 0.1, 0.0])
OE_ = model(OE(nb=(1, 1), nf=(1, 1), nk=(2, 1)), [1.0, 0.2, -0.5, 0.3, 0.0])


def driven(one: PolynomialModel, u: np.ndarray) -> np.ndarray:
    p = one.polynomials
    scaled = u / np.array(one.scaling.input_scale)
    total = sum(lfilter(b, np.convolve(p.A, f), x) for b, f, x in zip(p.B, p.F, scaled.T, strict=True))
    return np.asarray(one.scaling.output_scale * total)


@pytest.mark.parametrize("one", [BJ_, ARMAX_, OE_], ids=["BJ", "ARMAX", "OE"])
def test_a_free_run_is_the_filter_of_its_polynomials(one: PolynomialModel) -> None:
    u = np.random.default_rng(0).normal(size=(60, 2))
    u[0] = 0.0
    np.testing.assert_allclose(one.simulate(u), driven(one, u), rtol=1e-9, atol=1e-9)
    again = model_from_dict(one.to_dict())
    np.testing.assert_array_equal(again.simulate(u), one.simulate(u))


@pytest.mark.parametrize("one", [BJ_, ARMAX_], ids=["BJ", "ARMAX"])
def test_errors_one_step_ahead_are_the_innovations(one: PolynomialModel) -> None:
    rng = np.random.default_rng(1)
    u, e, p = rng.normal(size=(80, 2)), rng.normal(size=80), one.polynomials
    u[0], e[0] = 0.0, 0.0
    y = driven(one, u) + lfilter(p.C, np.convolve(p.A, p.D), e)
    np.testing.assert_allclose(y - one.predict(u, y), e, rtol=1e-8, atol=1e-8)


def test_a_prediction_far_ahead_is_the_free_run() -> None:
    rng = np.random.default_rng(2)
    u, y = rng.normal(size=(40, 2)), rng.normal(size=40)
    far = BJ_.predict(u, y, steps=40)
    np.testing.assert_allclose(far, BJ_.simulate(u), rtol=1e-9, atol=1e-9)
    one, two = BJ_.predict(u, y, steps=1), BJ_.predict(u, y, steps=2)
    assert not np.allclose(one[5:], two[5:])
    short = History(inputs=u[:20], output=y[:20])
    assert np.isfinite(BJ_.predict(u[20:], y[20:], short, steps=3)).all()


def test_armax_without_c_is_arx_in_every_start() -> None:
    orders = ARMAX(na=2, nb=(1, 1), nc=0, nk=(1, 2))
    one = PolynomialModel(
        orders=orders, theta=np.array([1.0, 0.2, -1.2, 0.5, 0.7 / 0.3]), scaling=Scaling.identity(2), **TERMS
    )
    other = ARXModel(
        orders=ARX(na=2, nb=(1, 1), nk=(1, 2)), coefficients=np.array([1.0, 0.2, 1.2, -0.5]), intercept=0.7, **TERMS
    )
    rng = np.random.default_rng(3)
    u, y = rng.normal(size=(30, 2)), rng.normal(size=30)
    rest = History.at_rest(inputs=u[0], output=1.5)
    np.testing.assert_allclose(one.simulate(u, rest), other.simulate(u, rest), rtol=1e-9, atol=1e-9)
    for steps in (1, 3):
        ahead = one.predict(u, y, rest, steps=steps)
        np.testing.assert_allclose(ahead, other.predict(u, y, rest, steps=steps), rtol=1e-9, atol=1e-9)
