"""Poles as time constants, natural frequencies and damping, whose intervals are right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from sysid.estimation import Uncertainty, fit_arx, fit_state_space, fit_transfer_function, modes
from sysid.models import ARX, LinearStateSpace, Mapping, Start, TransferFunction
from tests.estimation.linear_systems import noise_for, steps, trace_of

ONE, FREE, T = Mapping.parse("u1 -> y"), Start(kind="estimated"), 0.1
SLOW, PAIR = np.exp(-T / 2.0), np.exp(T * 3.0 * (-0.4 + 1j * np.sqrt(1.0 - 0.16)))
F = np.real(np.poly([SLOW, PAIR, np.conj(PAIR)]))


def record(decibel: float | None, n: int = 1500):
    rng = np.random.default_rng(2)
    u = steps(n, 1, rng)
    y = lfilter([0.0, 0.1, 0.05, 0.02], F, u[:, 0])
    return trace_of(u, y if decibel is None else y + noise_for(y, decibel, rng), sample_time=T)


FITS = {
    "ARX": lambda trace: fit_arx([trace], ONE, ARX(na=3, nb=3, nk=1), start=FREE),
    "SS": lambda trace: fit_state_space([trace], ONE, LinearStateSpace(states=3, noise=False), start=FREE),
    "TF": lambda trace: fit_transfer_function([trace], ONE, TransferFunction(poles=3, zeros=2, delays=1), start=FREE),
    "continuous TF": lambda trace: fit_transfer_function(
        [trace], ONE, TransferFunction(poles=3, zeros=2, delays=0, domain="continuous"), start=FREE
    ),
}


@pytest.mark.parametrize("kind", FITS)
def test_they_are_those_of_the_plant(kind: str) -> None:
    fit = FITS[kind](record(None))
    slow, pair = modes(fit.model, fit.uncertainty)
    assert slow.time_constant == pytest.approx(2.0, rel=1e-5)
    assert (pair.natural_frequency, pair.damping) == pytest.approx((3.0, 0.4), rel=1e-5)
    assert slow.damping is None
    assert pair.time_constant is None


@pytest.mark.parametrize("kind", ["SS", "continuous TF"])
def test_intervals_are_those_of_drawn_coefficients(kind: str) -> None:
    """The slow twin: roots of polynomials drawn from the covariance."""
    fit = FITS[kind](record(40.0))
    slow, pair = modes(fit.model, fit.uncertainty)
    known = fit.uncertainty
    at = [i for i, name in enumerate(known.names) if name.startswith(("F(",))]
    rng = np.random.default_rng(0)
    draws = rng.multivariate_normal(known.values[at], known.covariance[np.ix_(at, at)], size=4000)
    found = []
    for row in draws:
        s = (
            np.roots([1.0, *row[::-1]])
            if kind == "continuous TF"
            else np.log(np.roots([1.0, *row]).astype(complex)) / T
        )
        up, real = s[np.argmax(s.imag)], s[np.argmin(np.abs(s.imag))].real
        found.append((-1.0 / real, abs(up), -up.real / abs(up)))
    ends = np.quantile(found, [0.025, 0.975], axis=0).T
    told = (slow.intervals["time_constant"], pair.intervals["natural_frequency"], pair.intervals["damping"])
    np.testing.assert_allclose(told, ends, rtol=0.01)
    assert 0.0 < told[0][1] - told[0][0] < 1.0


def test_what_has_no_continuous_form_or_no_interval_says_so() -> None:
    model = fit_arx([record(None)], ONE, ARX(na=1, nb=1, nk=1), start=FREE).model
    # An alternating pole, an integrator and one that grows.
    for a, rate, constant in ((-0.5, None, None), (1.0, 0.0, None), (1.1, np.log(1.1) / T, -T / np.log(1.1))):
        (one,) = modes(replace(model, coefficients=np.array([1.0, a])), None)
        assert one.rate == pytest.approx(rate)
        assert one.time_constant == pytest.approx(constant)
        assert one.intervals == {}
    open_ = Uncertainty(names=("a(1)",), values=np.ones(1), covariance=np.full((1, 1), np.nan), noise_variance=1.0)
    assert modes(model, open_)[0].intervals == {}
