"""The separable problem: gradients against differences, and the Jacobian's span against the full one."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.estimation.linear.frequency_response.spectral_record import SpectralRecord
from sysid.estimation.linear.records import AbstractRecord
from sysid.estimation.linear.time_record import TimeRecord
from sysid.estimation.linear.variable_projection import PoleParameters, SeparableProvider
from sysid.models.converting.orthonormal_basis import Domain

DOMAINS = pytest.mark.parametrize("domain", list(Domain), ids=lambda d: d.value)
ORDERS = pytest.mark.parametrize(
    ("n_poles", "n_zeros"),
    [((2,), (1,)), ((1,), (0,)), ((5, 4), (2, 3)), ((5, 4), (4, 0)), ((3, 4), (1, 2))],
    ids=["2/1", "1/0", "5+4/2+3", "5+4/4+0", "3+4/1+2"],
)


def time_record(domain: Domain, m: int, *, free_start: bool, n: int = 300) -> TimeRecord:
    rng = np.random.default_rng(0)
    weights = np.ones(n)
    weights[40:60] = 0.0
    return TimeRecord(
        inputs=rng.normal(size=(n, m)),
        past=rng.normal(size=m),
        target=rng.normal(size=n),
        root_weights=weights,
        domain=domain,
        sample_time=0.5,
        free_start=free_start,
        moving=tuple(j % 2 == 0 for j in range(m)),
    )


def spectral_record(domain: Domain, m: int, n: int = 100) -> SpectralRecord:
    rng = np.random.default_rng(1)
    w = np.linspace(0.05, 3.0, n)
    inputs = rng.normal(size=(n, m)) + 1j * rng.normal(size=(n, m))
    variable = np.exp(-1j * w) if domain is Domain.DISCRETE else 1j * w
    return SpectralRecord(
        inputs=inputs, variable=variable, target=rng.normal(size=2 * n), root_weights=np.ones(2 * n), domain=domain
    )


def records(kind: str, domain: Domain, m: int) -> tuple[AbstractRecord, ...]:
    if kind == "spectra":
        return (spectral_record(domain, m),)
    free = time_record(domain, m, free_start=True)
    return (time_record(domain, m, free_start=False),) if kind == "at rest" else (free, free)


@DOMAINS
@ORDERS
@pytest.mark.parametrize("kind", ["at rest", "two in motion", "spectra"])
@pytest.mark.parametrize("stable", [True, False], ids=["kept stable", "free"])
def test_gradient_is_that_of_the_loss(
    domain: Domain, n_poles: tuple[int, ...], n_zeros: tuple[int, ...], kind: str, stable: bool
) -> None:
    poles = PoleParameters(n_poles=n_poles, domain=domain, stable=stable, slowest=0.05)
    provider = SeparableProvider(
        poles=poles, n_zeros=n_zeros, records=records(kind, domain, len(n_poles)), constant=True
    )
    theta = np.random.default_rng(2).uniform(0.2, 0.8, sum(n_poles))
    gradient = provider.linearise(theta).gradient
    h = 1e-5
    differences = [(provider.loss(theta + h * e) - provider.loss(theta - h * e)) / (2 * h) for e in np.eye(len(theta))]
    np.testing.assert_allclose(gradient, differences, rtol=1e-5, atol=1e-6)


@DOMAINS
def test_poles_go_there_and_back(domain: Domain) -> None:
    poles = PoleParameters(n_poles=(5, 2), domain=domain, stable=True, slowest=0.05)
    theta = np.random.default_rng(3).normal(size=7)
    np.testing.assert_allclose(poles.theta(poles.sections(theta)), theta, rtol=1e-9)


@DOMAINS
def test_every_vector_is_stable(domain: Domain) -> None:
    poles = PoleParameters(n_poles=(4,), domain=domain, stable=True)
    for seed in range(50):
        for d in poles.sections(3.0 * np.random.default_rng(seed).normal(size=4))[0]:
            roots = np.roots(d if domain is Domain.DISCRETE else d[::-1])
            assert np.abs(roots).max() < 1.0 if domain is Domain.DISCRETE else roots.real.max() < 0.0


def test_no_vector_of_continuous_poles_has_one_slower_than_the_slowest() -> None:
    """Also of a section with a fast pole: a record does not tell one that is slower from an integrator."""
    poles = PoleParameters(n_poles=(4,), domain=Domain.CONTINUOUS, stable=True, slowest=1e-3)
    for seed in range(20):
        (part,) = poles.sections(np.random.default_rng(seed).normal(scale=6.0, size=4))
        rates = [-float(np.roots(section[::-1]).real.max()) for section in part]
        assert min(rates) >= 1e-3 * (1.0 - 1e-6)


def test_a_pair_that_decays_within_the_records_keeps_its_poles_however_slowly_it_turns() -> None:
    """Bounds of the coefficients had kept it away: transfer functions of records sampled fast had not reached it."""
    poles = PoleParameters(n_poles=(2,), domain=Domain.DISCRETE, stable=True, slowest=1e-4)
    for rate, turn in ((5e-3, 1e-3), (2e-4, 5e-3), (2e-4, 0.0)):
        pair = np.real(np.poly(np.exp([-rate + 1j * turn, -rate - 1j * turn])))
        ((found,),) = poles.sections(poles.theta(((pair,),)))
        np.testing.assert_allclose(found, pair, rtol=0.0, atol=1e-12)


def test_no_vector_of_discrete_poles_has_one_slower_than_the_slowest() -> None:
    poles = PoleParameters(n_poles=(4,), domain=Domain.DISCRETE, stable=True, slowest=1e-3)
    for seed in range(20):
        (part,) = poles.sections(np.random.default_rng(seed).normal(scale=6.0, size=4))
        assert max(np.abs(np.roots(section)).max() for section in part) <= (1.0 - 1e-3) * (1.0 + 1e-9)


def test_a_model_that_runs_away_has_infinite_loss() -> None:
    poles = PoleParameters(n_poles=(2,), domain=Domain.DISCRETE, stable=False)
    record = time_record(Domain.DISCRETE, 1, free_start=False, n=5000)
    provider = SeparableProvider(poles=poles, n_zeros=(1,), records=(record,), constant=True)
    assert provider.loss(np.array([5.0, 3.0])) == np.inf
