"""Bases: they span the right functions, are orthonormal, and are realised exactly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from sysid.errors import ConfigError
from sysid.models.converting.orthonormal_basis import (
    Domain,
    basis_of,
    denominator,
    numerators,
    responses,
    section_orders,
    section_poles,
)
from sysid.models.converting.realisation import realise


def sections(n_poles: int, domain: Domain, seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    found = []
    for order in section_orders(n_poles):
        if domain is Domain.DISCRETE:
            k = rng.uniform(-0.95, 0.95, 2)
            found.append(np.array([1.0, k[0]]) if order == 1 else np.array([1.0, k[0] * (1 + k[1]), k[1]]))
        else:
            c = rng.uniform(0.1, 3.0, 2)
            found.append(np.array([*c[:order], 1.0]))
    return found


DOMAINS = pytest.mark.parametrize("domain", list(Domain), ids=lambda d: d.value)
shapes = st.integers(1, 7).flatmap(lambda n: st.tuples(st.just(n), st.integers(0, n - 1)))


@DOMAINS
@given(shape=shapes, seed=st.integers(0, 1000))
def test_taps_span_all_numerators_of_their_degree(domain: Domain, shape: tuple[int, int], seed: int) -> None:
    n_poles, n_zeros = shape
    table = numerators(basis_of(sections(n_poles, domain, seed), n_zeros, domain))
    assert table.shape == (n_zeros + 1, n_poles + 1)
    np.testing.assert_array_equal(table[:, n_zeros + 1 :], 0.0)
    assert np.linalg.matrix_rank(table, tol=1e-9 * np.abs(table).max()) == n_zeros + 1


@DOMAINS
@given(shape=shapes, seed=st.integers(0, 1000))
def test_responses_are_the_polynomials(domain: Domain, shape: tuple[int, int], seed: int) -> None:
    basis = basis_of(sections(shape[0], domain, seed), shape[1], domain)
    w = np.linspace(0.05, 3.0, 20)
    x = np.exp(-1j * w) if domain is Domain.DISCRETE else 1j * w
    powers = x[:, None] ** np.arange(shape[0] + 1)
    expected = (powers @ numerators(basis).T) / (powers @ denominator(basis))[:, None]
    np.testing.assert_allclose(responses(basis, x), expected, rtol=1e-6, atol=1e-9)


@DOMAINS
@given(shape=shapes, seed=st.integers(0, 1000))
def test_realisations_have_that_response(domain: Domain, shape: tuple[int, int], seed: int) -> None:
    basis = basis_of(sections(shape[0], domain, seed), shape[1], domain)
    system = realise(basis, domain)
    w = np.linspace(0.05, 3.0, 20)
    z = np.exp(1j * w) if domain is Domain.DISCRETE else 1j * w
    found = np.array([system.C @ np.linalg.solve(p * np.eye(shape[0]) - system.A, system.B) + system.D for p in z])
    x = 1.0 / z if domain is Domain.DISCRETE else z
    np.testing.assert_allclose(found, responses(basis, x), rtol=1e-7, atol=1e-9)


def test_full_bases_are_orthonormal_on_the_unit_circle() -> None:
    basis = basis_of(sections(9, Domain.DISCRETE, 3), 8, Domain.DISCRETE)
    grid = np.exp(-2j * np.pi * np.arange(4096) / 4096)
    table = responses(basis, grid)
    np.testing.assert_allclose(table.conj().T @ table / 4096, np.eye(9), atol=1e-9)


def test_full_bases_are_orthogonal_on_the_imaginary_axis() -> None:
    basis = basis_of(sections(5, Domain.CONTINUOUS, 3), 4, Domain.CONTINUOUS)
    w = np.tan(np.pi * (np.arange(200_000) + 0.5) / 200_000 - np.pi / 2)
    table = responses(basis, 1j * w) * np.sqrt((1 + w**2) * np.pi / 200_000 / (2 * np.pi))[:, None]
    np.testing.assert_allclose(table.conj().T @ table, np.eye(5), atol=1e-4)


def test_sampling_is_that_of_scipy() -> None:
    system = realise(basis_of(sections(5, Domain.CONTINUOUS, 1), 4, Domain.CONTINUOUS), Domain.CONTINUOUS)
    ours = system.sampled(0.2)
    A, B, *_ = signal.cont2discrete((system.A, system.B[:, None], system.C, system.D[:, None]), 0.2, "zoh")
    np.testing.assert_allclose(ours.A, A, atol=1e-12)
    np.testing.assert_allclose(ours.B, B[:, 0], atol=1e-12)


def test_twenty_poles_near_one_keep_their_places() -> None:
    """A product polynomial of these has lost them: its roots lie outside the circle."""
    radii = np.linspace(0.95, 0.98, 10)
    made = [np.array([1.0, -2 * r * np.cos(0.02), r * r]) for r in radii]
    basis = basis_of(made, 19, Domain.DISCRETE)
    exact = np.array([abs(section_poles(section.denominator, Domain.DISCRETE)[0]) for section in basis])
    np.testing.assert_allclose(exact, radii, rtol=1e-9)
    assert np.abs(np.roots(denominator(basis))).max() > 1.0
    assert np.isfinite(realise(basis, Domain.DISCRETE).C).all()


@pytest.mark.parametrize("n_zeros", [-1, 3, 5])
def test_more_zeros_than_poles_are_refused(n_zeros: int) -> None:
    with pytest.raises(ConfigError, match="no more zeros"):
        basis_of(sections(2, Domain.DISCRETE, 0), n_zeros, Domain.DISCRETE)
