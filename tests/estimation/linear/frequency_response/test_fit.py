"""Transfer functions from frequency responses and spectra."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

import sysid
from sysid.errors import TraceError
from sysid.estimation.linear.frequency_response.fit import fit_spectra
from sysid.estimation.linear.frequency_response.spectrum import Spectrum
from sysid.estimation.linear.transfer_function.training import TransferFunctionTraining
from sysid.models import Domain, Mapping, TransferFunction

T = 0.1
W = np.logspace(-1, np.log10(25.0), 200)
TWO, ONE = Mapping.parse("a+b -> y"), Mapping.parse("a -> y")
TRUE = {
    Domain.DISCRETE: np.array([1.0, 0.5, -1.5, 0.7, 0.4, -0.9]),
    Domain.CONTINUOUS: np.array([3.0, 2.0, 4.0, 1.0, 1.0, 0.5]),
}
DELAYS = {Domain.DISCRETE: (2, 1), Domain.CONTINUOUS: (2, 0)}
DOMAINS = pytest.mark.parametrize("domain", list(Domain), ids=lambda d: d.value)
QUICK = TransferFunctionTraining(scattered_starts=0)
TERMS = {"sample_time": T, "output_unit": "1"}


def responses(domain: Domain) -> np.ndarray:
    if domain is Domain.DISCRETE:
        parts = [signal.freqz([1.0, 0.5], [1.0, -1.5, 0.7], W * T)[1], signal.freqz([0.4], [1.0, -0.9], W * T)[1]]
    else:
        parts = [signal.freqs([2.0, 3.0], [1.0, 1.0, 4.0], W)[1], signal.freqs([1.0], [1.0, 0.5], W)[1]]
    return np.column_stack([p * np.exp(-1j * W * T * k) for p, k in zip(parts, DELAYS[domain], strict=True)])


def orders(domain: Domain, delays: tuple[int, ...] | None = None) -> TransferFunction:
    return TransferFunction(poles=(2, 1), zeros=(1, 0), delays=delays, domain=domain, intercept=False)


@DOMAINS
def test_true_parameters_lie_within_their_95_percent_intervals(domain: Domain) -> None:
    held = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        noisy = responses(domain) + 0.02 * (rng.normal(size=(200, 2)) + 1j * rng.normal(size=(200, 2)))
        fit = fit_spectra(
            Spectrum.of_response(W, noisy), TWO, orders(domain, DELAYS[domain]), QUICK, input_units=("1", "1"), **TERMS
        )
        low, high = fit.uncertainty.interval(0.95).T
        held += int(np.sum((low <= TRUE[domain]) & (high >= TRUE[domain])))
    assert 0.90 <= held / 120 <= 0.99


@DOMAINS
def test_dead_times_are_found(domain: Domain) -> None:
    fit = fit_spectra(Spectrum.of_response(W, responses(domain)), TWO, orders(domain), input_units=("1", "1"), **TERMS)
    assert fit.model.delays == DELAYS[domain]
    np.testing.assert_allclose(fit.uncertainty.values, TRUE[domain], rtol=1e-6)


@DOMAINS
def test_spectra_of_both_inputs_at_once(domain: Domain) -> None:
    """Two experiments, each with both inputs."""
    rng = np.random.default_rng(0)
    made = []
    for _ in range(2):
        u = rng.normal(size=(200, 2)) + 1j * rng.normal(size=(200, 2))
        made.append(Spectrum(frequency=W, inputs=u, output=np.sum(u * responses(domain), axis=1)))
    fit = fit_spectra(made, TWO, orders(domain, DELAYS[domain]), input_units=("1", "1"), **TERMS)
    np.testing.assert_allclose(fit.uncertainty.values, TRUE[domain], rtol=1e-6)


def test_twenty_poles_are_found_exactly() -> None:
    """Sanathanan-Koerner in the orthonormal basis; in powers of z the problem has no digit left."""
    rng = np.random.default_rng(0)
    w = np.linspace(0.01, np.pi, 500) / T
    poles = 0.97 * np.exp(1j * np.linspace(0.05, 3.0, 10))
    weights = rng.normal(size=10) + 1j * rng.normal(size=10)
    z = np.exp(1j * w * T)[:, None]
    response = np.sum(weights / (z - poles) + weights.conj() / (z - poles.conj()), axis=1)
    twenty = TransferFunction(poles=(20,), zeros=(19,), delays=(1,), intercept=False)
    fit = fit_spectra(Spectrum.of_response(w, response), ONE, twenty, input_units=("1",), **TERMS)
    found = np.sort_complex(fit.model.poles(0))
    np.testing.assert_allclose(found, np.sort_complex(np.concatenate([poles, poles.conj()])), atol=1e-9)
    np.testing.assert_allclose(fit.model.response(0, w), response, atol=1e-8 * np.abs(response).max())


def test_weights_decide_where_the_fit_is_good() -> None:
    response = signal.freqs([1.0], [1.0, 1.0, 1.0], W)[1][:, None]
    one = TransferFunction(poles=(1,), zeros=(0,), delays=(0,), domain=Domain.CONTINUOUS, intercept=False)
    low = fit_spectra(
        Spectrum.of_response(W, response, weights=(W < 0.3).astype(float)), ONE, one, input_units=("1",), **TERMS
    )
    even = fit_spectra(Spectrum.of_response(W, response), ONE, one, input_units=("1",), **TERMS)
    at = W < 0.3
    errors = [np.abs(f.model.response(0, W[at]) - response[at, 0]).max() for f in (low, even)]
    assert errors[0] < 0.5 * errors[1]


def test_shapes_that_disagree_are_refused() -> None:
    with pytest.raises(TraceError, match="not a spectrum"):
        Spectrum(frequency=W, inputs=np.ones((200, 1)), output=np.ones(10))


def test_an_intercept_is_refused() -> None:
    with pytest.raises(TraceError, match="do not match the spectra"):
        fit_spectra(
            Spectrum.of_response(W, responses(Domain.DISCRETE)),
            TWO,
            TransferFunction(poles=(2, 1), zeros=(1, 0)),
            input_units=("1", "1"),
            **TERMS,
        )


BEYOND = {
    "an integrator": ([2.0], [1.0, 1.0, 0.0], [-1.0, 0.0]),
    "two of them": ([2.0], [1.0, 0.0, 0.0], [0.0, 0.0]),
    "an unstable plant, measured in its loop": ([9.0], [1.0, 1.0, -6.0], [-3.0, 2.0]),
}


@pytest.mark.parametrize("case", BEYOND)
def test_poles_lie_where_the_response_puts_them(case: str) -> None:
    """They had been held within the stable region, CONVERGED, and told to be stable."""
    top, bottom, poles = BEYOND[case]
    rng = np.random.default_rng(0)
    response = signal.freqs(top, bottom, W)[1] * (1.0 + 0.01 * (rng.normal(size=200) + 1j * rng.normal(size=200)))
    two = TransferFunction(poles=(2,), zeros=(0,), delays=(0,), domain=Domain.CONTINUOUS, intercept=False)
    relative = Spectrum.of_response(W, response, weights=np.abs(response) ** -2)
    fit = fit_spectra(relative, ONE, two, QUICK, input_units=("1",), **TERMS)
    assert any("is not stable" in note for note in fit.notes)
    np.testing.assert_allclose(np.sort(fit.model.poles(0).real), np.sort(poles), atol=0.03)
    integrating = [pole for pole in poles if pole == 0.0]
    assert np.count_nonzero(fit.model.poles(0) == 0.0) == len(integrating)


@pytest.mark.parametrize("samples", [11, 83])
def test_a_dead_time_of_many_samples_is_found(samples: int) -> None:
    """It had been searched up to four."""
    rng = np.random.default_rng(1)
    response = signal.freqs([1.0], [1.0, 1.0, 4.0], W)[1] * np.exp(-0.01j * samples * W)
    response = response * (1.0 + 0.01 * (rng.normal(size=200) + 1j * rng.normal(size=200)))
    two = TransferFunction(poles=(2,), zeros=(0,), domain=Domain.CONTINUOUS, intercept=False)
    relative = Spectrum.of_response(W, response, weights=np.abs(response) ** -2)
    fit = fit_spectra(relative, ONE, two, QUICK, input_units=("1",), sample_time=0.01, output_unit="1")
    assert fit.model.delays == (samples,)


def test_frequencies_beyond_half_the_sampling_rate_are_refused() -> None:
    with pytest.raises(TraceError, match=r"(?s)beyond half of its sampling rate.*0\.0126 s or less"):
        fit_spectra(
            Spectrum.of_response(10.0 * W, responses(Domain.DISCRETE)),
            TWO,
            orders(Domain.DISCRETE, DELAYS[Domain.DISCRETE]),
            input_units=("1", "1"),
            **TERMS,
        )


def test_an_integrator_of_a_drive_with_a_resonance_gets_its_pole_at_zero() -> None:
    """It had stayed at the bound of slow poles, 1.8 degrees off at the lowest frequency; a pole more made up for it."""
    w = np.logspace(-1, 2, 80)
    s, rng = 1j * w, np.random.default_rng(0)
    drive = (s**2 / 225 + 0.04 * s / 15 + 1) / (s * (s**2 / 900 + 0.04 * s / 30 + 1))
    rough = 1.0 + 0.02 * (rng.standard_normal(80) + 1j * rng.standard_normal(80)) / np.sqrt(2.0)
    structure = sysid.TransferFunction(poles=(3,), zeros=(2,), delays=(0,), domain="continuous")
    swept = sysid.response_data({"w [rad/s]": w, "H": drive * rough})
    fit = sysid.fit_response(swept, structure, weighting="relative", sample_time=0.0003)
    assert np.abs(fit.model.poles(0)).min() == 0.0
