"""State spaces as matrices: coordinates change nothing, and polynomials are those of the determinant."""

from __future__ import annotations

import numpy as np
from scipy import signal

from sysid.models.innovations import Innovations
from sysid.models.linear_state_space import polynomials


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
