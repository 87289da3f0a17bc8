"""LAPACK straight against SciPy's ways to it: the same routines, and so the same numbers."""

import numpy as np
import pytest
from scipy import linalg

from sysid.estimation.least_squares.small_matrices import (
    add_to_diagonal,
    back_substituted,
    cholesky,
    inverse_of,
    orthogonal,
    singular,
    solved,
)


@pytest.mark.parametrize("n", [1, 2, 65, 200])
def test_factor_solution_and_inverse_are_those_of_scipy(n):
    rng = np.random.default_rng(n)
    root = rng.standard_normal((n + 5, n))
    matrix, right = root.T @ root, rng.standard_normal(n)
    factor = cholesky(matrix)
    np.testing.assert_array_equal(factor, linalg.cholesky(matrix, lower=True))
    np.testing.assert_array_equal(solved(factor, right), linalg.cho_solve(linalg.cho_factor(matrix, lower=True), right))
    np.testing.assert_array_equal(inverse_of(factor), linalg.solve_triangular(factor, np.eye(n), lower=True))


@pytest.mark.parametrize("right", [(65,), (65, 7)], ids=["one", "seven"])
@pytest.mark.parametrize("transposed", [False, True], ids=["R", "transposed"])
def test_an_upper_triangle_is_solved_as_scipy_does_and_nothing_is_written(transposed, right):
    rng = np.random.default_rng(1)
    upper = np.asfortranarray(np.triu(rng.standard_normal((65, 65))) + 9.0 * np.eye(65))
    b = np.asfortranarray(rng.standard_normal(right))
    before = upper.copy(), b.copy()
    expected = linalg.solve_triangular(upper, b, trans=int(transposed))
    np.testing.assert_array_equal(back_substituted(upper, b, transposed=transposed), expected, strict=True)
    for one, other in zip((upper, b), before, strict=True):
        np.testing.assert_array_equal(one, other)


def test_an_upper_triangle_without_an_answer_is_refused_and_one_of_nothing_has_none(capfd):
    with pytest.raises(np.linalg.LinAlgError, match="at 1"):
        back_substituted(np.diag([1.0, 0.0, 2.0]), np.ones(3))
    assert back_substituted(np.zeros((0, 0)), np.zeros((0, 2))).shape == (0, 2)
    assert capfd.readouterr() == ("", "")


def test_of_nothing_the_inverse_is_nothing_and_nothing_is_printed(capfd):
    """Equations of which nothing is left to estimate are a fit too."""
    assert inverse_of(np.zeros((0, 0))).shape == (0, 0)
    assert capfd.readouterr() == ("", "")


def test_the_lower_half_is_read_and_nothing_is_written():
    matrix = np.array([[4.0, 77.0], [2.0, 5.0]])
    before = matrix.copy()
    np.testing.assert_allclose(cholesky(matrix), [[2.0, 0.0], [1.0, 2.0]])
    np.testing.assert_array_equal(matrix, before)


@pytest.mark.parametrize("wrong", [-1.0, 0.0, np.nan, np.inf])
def test_what_has_no_factor_has_none(wrong):
    assert cholesky(np.diag([1.0, wrong, 1.0])) is None


def test_a_diagonal_is_added_to_in_place():
    matrix = np.ones((2, 2))
    add_to_diagonal(matrix, np.array([1.0, 2.0]))
    add_to_diagonal(matrix, 0.5)
    np.testing.assert_array_equal(matrix, [[2.5, 1.0], [1.0, 3.5]])


@pytest.mark.parametrize("shape", [(300, 6), (40, 40), (3, 5), (7, 1), (5, 0)], ids=str)
def test_orthogonal_factors_are_scipys_to_the_last_bit(shape):
    matrix = np.asfortranarray(np.random.default_rng(3).standard_normal(shape))
    expected = linalg.qr(matrix, mode="economic")
    for one, other in zip(orthogonal(matrix.copy(order="F")), expected, strict=True):
        np.testing.assert_array_equal(one, other, strict=True)


@pytest.mark.parametrize("shape", [(6, 6), (40, 40), (3, 5), (7, 1)], ids=str)
def test_singular_values_and_vectors_are_scipys_to_the_last_bit(shape):
    matrix = np.random.default_rng(3).standard_normal(shape)
    for one, other in zip(singular(matrix), linalg.svd(matrix), strict=True):
        np.testing.assert_array_equal(one, other, strict=True)
