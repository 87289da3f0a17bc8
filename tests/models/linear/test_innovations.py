"""State spaces as matrices: coordinates change nothing, and polynomials are those of the determinant."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg, signal

import sysid
from sysid.models import History
from sysid.models.linear.innovations import Innovations, spectral_radius
from sysid.models.linear.state_space_polynomials import polynomials


def system(n: int = 3, m: int = 2, p: int = 2) -> Innovations:
    rng = np.random.default_rng(3)
    A = 0.6 * rng.normal(size=(n, n)) / np.sqrt(n)
    B, C, D = rng.normal(size=(n, m)), rng.normal(size=(p, n)), rng.normal(size=(p, m))
    return Innovations(A=A, B=B, C=C, D=D, K=0.1 * rng.normal(size=(n, p)), constant=rng.normal(size=p))


def test_balancing_changes_the_coordinates_alone() -> None:
    one, u = system(), np.random.default_rng(0).normal(size=(30, 2))
    other = one.balanced()
    assert not np.allclose(one.A, other.A)
    y = np.random.default_rng(1).normal(size=(30, 2))
    expected, _ = one.predicted(u, y, np.zeros(3))
    np.testing.assert_allclose(other.predicted(u, y, np.zeros(3))[0], expected, rtol=1e-9, atol=1e-9)


def test_polynomials_are_the_transfer_functions_scipy_finds() -> None:
    one = system()
    F, rows, noise = polynomials(one)
    for j in range(2):
        num, den = signal.ss2tf(one.A, one.B, one.C, one.D, input=j)
        np.testing.assert_allclose(F, den, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(rows[:, j], num, rtol=1e-9, atol=1e-12)
    num, _ = signal.ss2tf(one.A, one.K, one.C, np.eye(2), input=0)
    np.testing.assert_allclose(noise[:, 0], num, rtol=1e-9, atol=1e-12)


def test_what_has_stood_for_ever_goes_on_standing() -> None:
    one = system()
    u, y = np.array([1.0, -2.0]), np.array([0.5, 3.0])
    x = one.standing(u, y)
    after = x.copy()
    one.predicted(np.tile(u, (5, 1)), np.tile(y, (5, 1)), after)
    np.testing.assert_allclose(after, x, rtol=1e-9, atol=1e-10)


def test_it_is_the_same_after_json() -> None:
    one = system(m=0)
    again = Innovations.from_dict(one.to_dict())
    for name in ("A", "B", "C", "D", "K", "constant"):
        np.testing.assert_array_equal(getattr(again, name), getattr(one, name))


def test_a_free_run_keeps_its_digits_where_hardly_any_noise_was_seen() -> None:
    # A pendulum without noise: a predictor that forgets at once, of a system that keeps what it has.
    N, x = 300, np.zeros(2)
    u = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, (2, N // 5))[1], 5)
    y = np.zeros((N, 2))
    for k in range(N):
        y[k] = x
        x = x + 0.05 * np.array([x[1], -4.0 * np.sin(x[0]) - 0.4 * x[1] + 2.0 * u[k]])
    fit = sysid.fit(sysid.data((u, y), sample_time=0.1), "u -> y1+y2", sysid.VectorStateSpace(states=3))
    form = fit.model.recursion
    assert np.linalg.norm(fit.model.system.A) > 100.0
    assert np.linalg.norm(form.A) < 3.0
    assert np.linalg.norm(form.B) * np.linalg.norm(form.C) < 3.0
    inputs = u[:, np.newaxis]
    history = History(inputs=inputs[:30], output=y[:30])
    free = fit.model.simulate(inputs[30:], history) - y[30:]
    assert (np.sqrt(np.mean(free**2, axis=0)) < 0.15 * y.std(axis=0)).all()
    one = fit.model.predict(inputs[30:], y[30:], history) - y[30:]
    assert (np.sqrt(np.mean(one**2, axis=0)) < 1e-2 * y.std(axis=0)).all()
    gain = (form.C @ np.linalg.solve(np.eye(3) - form.A, form.B)).ravel()
    system = fit.model.system
    assert gain == pytest.approx((system.C @ np.linalg.solve(np.eye(3) - system.A, system.B)).ravel(), abs=2e-3)


@pytest.mark.parametrize("n", [1, 4, 40])
def test_the_largest_pole_is_that_of_scipys_eigenvalues_to_the_last_bit(n: int) -> None:
    A = np.random.default_rng(n).normal(size=(n, n))
    assert spectral_radius(A) == np.abs(linalg.eigvals(A)).max()


def test_the_predictor_has_a_radius_of_its_own_where_noise_is_modelled() -> None:
    one = system()
    assert one.predictor_radius == spectral_radius(one.A - one.K @ one.C) != one.radius
    assert one.without_noise().predictor_radius == one.radius
