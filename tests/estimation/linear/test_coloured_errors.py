"""Errors that hang together: the sandwich equals its definition, and three structures of one system tell the same."""

import numpy as np
import pytest
from scipy import linalg, signal

from sysid.estimation import FitResult, TransferFunctionTraining
from sysid.estimation.fitting import fit
from sysid.estimation.linear.coloured_errors import colour, information, sandwich
from sysid.models import OE, AbstractStructure, LinearStateSpace, Mapping, Start, TransferFunction
from sysid.traces import Channel, Trace

A = np.array([1.0, -1.5, 0.7])


def autocorrelation(a: np.ndarray, lags: int) -> np.ndarray:
    """Of an autoregression over its variance, from its response to a pulse."""
    h = signal.lfilter([1.0], a, np.eye(1, 4_000)[0])
    r = np.correlate(h, h, "full")[len(h) - 1 :][:lags]
    return r / r[0]


@pytest.mark.parametrize("a", [np.ones(1), A], ids=["white", "coloured"])
def test_information_is_the_quadratic_form_of_the_covariance_of_the_errors(a: np.ndarray) -> None:
    J = np.random.default_rng(0).normal(size=(300, 3))
    asked = J.T @ linalg.toeplitz(autocorrelation(a, len(J))) @ J
    np.testing.assert_allclose(information([J[:7], J[7:200], J[200:]], a), asked, rtol=1e-5)


def test_sandwich_is_the_covariance_of_least_squares() -> None:
    J = np.random.default_rng(1).normal(size=(200, 3))
    R = linalg.toeplitz(autocorrelation(A, len(J)))
    inverse = np.linalg.inv(J.T @ J)
    factor, taken = sandwich(np.linalg.cholesky(inverse), J.T @ R @ J, len(J)), np.trace(inverse @ J.T @ R @ J)
    asked = inverse @ J.T @ R @ J @ inverse * (len(J) - 3) / (len(J) - taken)
    np.testing.assert_allclose(factor @ factor.T, asked, rtol=1e-9)


def test_the_variance_of_coloured_errors_is_that_before_the_fit() -> None:
    """What parameters take away of slow errors is put back: the mean of many records is the variance that made them."""
    J, rng, found = np.ones((60, 1)), np.random.default_rng(6), []
    half, slow = np.array([[60.0**-0.5]]), np.array([1.0, -0.8])
    R = linalg.toeplitz(autocorrelation(slow, 60))
    for _ in range(2_000):
        v = np.linalg.cholesky(R) @ rng.normal(size=60)
        left = v - v.mean()
        found.append((left @ left / 59) * float(sandwich(half, J.T @ R @ J, 60)[0, 0]) ** 2)
    assert np.mean(found) == pytest.approx(R.sum() / 60**2, rel=0.03)  # the variance of a mean


def test_no_lag_reaches_over_samples_that_do_not_count() -> None:
    e = signal.lfilter([1.0], A, np.random.default_rng(2).normal(size=4_000))
    counts = np.ones(len(e), dtype=np.bool_)
    counts[::50], e[::50] = False, 1e6
    found = colour([e], [counts])
    np.testing.assert_allclose(found[:3], A, atol=0.1)
    np.testing.assert_array_equal(colour([np.random.default_rng(3).normal(size=4_000)], [counts]), [1.0])


def record(noise: np.ndarray) -> Trace:
    """A system of two poles, its output disturbed."""
    u = np.sign(np.random.default_rng(4).normal(size=len(noise)))
    y = signal.lfilter([0.0, 1.0, 0.5], [1.0, -1.5, 0.7], u) + noise
    channels = (Channel(name="u", unit="1"), Channel(name="y", unit="1"))
    return Trace(name="t", sample_time=1.0, channels=channels, values=np.column_stack([u, y])[100:])


def fitted(structure: AbstractStructure, noise: np.ndarray) -> FitResult:
    few = TransferFunctionTraining(scattered_starts=0) if isinstance(structure, TransferFunction) else None
    mapping = Mapping.parse("u -> y")
    return fit([record(noise)], mapping, structure, few, start=Start(kind="estimated"), stability=None)


def test_three_structures_of_one_system_tell_the_same_intervals_in_coloured_noise() -> None:
    """Polynomials, a state space and a transfer function reach it through other derivatives and other eliminations."""
    white = np.random.default_rng(5).normal(size=900)
    noise = 0.3 * signal.lfilter([1.0], [1.0, -0.9], white)
    structures = (
        OE(nb=2, nf=2, nk=1),
        LinearStateSpace(states=2, noise=False),
        TransferFunction(poles=2, zeros=1, delays=1),
    )
    covariances = []
    for structure in structures:
        told = fitted(structure, noise).uncertainty
        assert told is not None
        covariances.append(told.covariance[:4, :4])
    np.testing.assert_allclose(covariances[1], covariances[0], rtol=1e-3, atol=1e-9)
    # What came before the record is eliminated by other columns, so that the first samples tell a little else.
    np.testing.assert_allclose(np.diag(covariances[2]), np.diag(covariances[0]), rtol=1e-2)
    same = fitted(structures[0], np.std(noise) * white).uncertainty
    assert same is not None
    # Noise of this colour is strong where the system is slow: its poles are known less well than in white noise.
    assert (np.diag(covariances[0])[2:] > 1.2 * np.diag(same.covariance)[2:4]).all()
