"""Sums in vector registers against the same in NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numba.core.errors import TypingError
from numpy.testing import assert_allclose

from sysid.kernels.registers import LANES, affine, dot, tanh


@njit
def _affine(weights, first, n_x, x, x_first, h, h_blocks, g, g_blocks):  # noqa: PLR0917
    """Neurons and gates from ``first`` on, each in an array of their own."""
    affine(weights, first, n_x, x, x_first, h, first, h_blocks, g, first, g_blocks)


# As the kernels are compiled: a compiler that may reorder sums takes a rounding out that is written as two of them.
@njit(fastmath={"reassoc", "contract", "arcp", "nsz"}, error_model="numpy")
def _tanh(a, first, n):
    tanh(a, first, n)


@njit
def _dot(left, left_first, right, right_first, blocks):
    return dot(left, left_first, right, right_first, blocks)


@given(
    n_x=st.integers(0, 30),
    blocks=st.tuples(st.integers(0, 6), st.integers(0, 6)),
    first=st.integers(0, 5),
    x_first=st.integers(0, 3),
    seed=st.integers(0, 2**32 - 1),
)
def test_affine_functions_of_blocks_of_neurons_and_gates(n_x, blocks, first, x_first, seed):
    rng = np.random.default_rng(seed)
    weights, x = rng.normal(size=(sum(blocks), n_x + 1, LANES)), rng.normal(size=x_first + n_x + 3)
    h, g = (np.full(first + LANES * some + 1, 7.0) for some in blocks)

    padded = np.concatenate([np.full(first, np.nan), weights.ravel()])
    _affine(padded, first, n_x, x, x_first, h, blocks[0], g, blocks[1])

    expected = weights[:, n_x] + np.einsum("bik,i->bk", weights[:, :n_x], x[x_first : x_first + n_x])
    for out, own in ((h, expected[: blocks[0]]), (g, expected[blocks[0] :])):
        assert_allclose(out[first:-1], own.ravel(), rtol=1e-12, atol=1e-12)
        assert np.all(out[:first] == 7.0), "nothing before the first neuron is written"
        assert out[-1] == 7.0, "nor behind the last"


@given(blocks=st.integers(0, 6), a=st.integers(0, 5), b=st.integers(0, 5), seed=st.integers(0, 2**32 - 1))
def test_sums_of_products(blocks, a, b, seed):
    rng = np.random.default_rng(seed)
    n = LANES * blocks
    left, right = rng.normal(size=a + n), rng.normal(size=b + n)

    assert _dot(left, a, right, b, blocks) == pytest.approx(left[a:] @ right[b:], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_a_number_stays_so(value):
    h, g = np.zeros(LANES), np.zeros(LANES)

    _affine(np.ones(6 * LANES), 0, 2, np.array([1.0, value]), 0, h, 1, g, 1)

    assert_allclose([h, g], np.full((2, LANES), value))


def test_numbers_of_another_kind_are_refused():
    with pytest.raises(TypingError, match=r"right: expected a contiguous array of float64, got array\(float32"):
        _dot(np.ones(LANES), 0, np.ones(LANES, dtype=np.float32), 0, 1)
    with pytest.raises(TypingError, match="x: expected a contiguous array of float64"):
        _affine(np.ones(3 * LANES), 0, 2, np.ones(4)[::2], 0, np.zeros(LANES), 1, np.zeros(0), 0)


@given(st.lists(st.floats(-50.0, 50.0), max_size=40), st.integers(0, 3))
def test_tanh_is_right_to_the_last_digit_but_one(values, first):
    x = np.array([3.0] * first + values + [3.0])
    a = x.copy()

    _tanh(a, first, len(values))

    assert_allclose(a[first:-1], np.tanh(values), rtol=0.0, atol=2.3e-16)
    assert a[-1] == 3.0
    assert np.all(a[:first] == 3.0), "only the numbers that were named are replaced"


def test_tanh_over_the_line_and_of_what_is_not_a_number():
    x = np.linspace(-25.0, 25.0, 200_001)
    a = x.copy()
    _tanh(a, 0, len(a))
    assert np.abs(a - np.tanh(x)).max() < 2.3e-16
    assert np.all(np.diff(a) >= -2.3e-16)

    special = np.array([np.inf, -np.inf, np.nan, 0.0, -0.0, 1e300, -1e-300])
    _tanh(special, 0, len(special))
    assert special[:2].tolist() == [1.0, -1.0]
    assert np.isnan(special[2])
    assert special[3:].tolist() == [0.0, 0.0, 1.0, 0.0]
