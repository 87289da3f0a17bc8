"""State spaces of records that are sampled fast."""

from __future__ import annotations

import numpy as np
from scipy import linalg, signal

import sysid
from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.state_space.slower import _root

T, N = 0.002, 3000


def test_a_root_makes_the_matrix_again() -> None:
    A = linalg.block_diag([[0.9, 0.2], [-0.2, 0.9]], 0.5)
    np.testing.assert_allclose(np.linalg.matrix_power(_root(A, 5), 5), A, atol=1e-12)


def test_a_pole_below_zero_which_no_slower_system_has_becomes_a_fast_one() -> None:
    poles = np.sort(linalg.eigvals(_root(np.diag([0.9, -0.3]), 5)).real)
    np.testing.assert_allclose(poles**5, [0.02, 0.9], rtol=1e-9)


def test_means_of_a_piece_with_a_masked_sample_are_masked_there() -> None:
    inputs = np.arange(7.0)[:, None]
    found = Segment(inputs=inputs, outputs=2.0 * inputs, root_weights=np.array([1.0, 1, 1, 0, 1, 1, 1])).means(2)
    np.testing.assert_array_equal(found.inputs[:, 0], [0.5, 2.5, 4.5])
    np.testing.assert_array_equal(found.outputs, 2.0 * found.inputs)
    np.testing.assert_array_equal(found.root_weights, [1.0, 0.0, 1.0])


def test_modes_that_hardly_die_away_in_the_record_are_found() -> None:
    """Without a model of the noise it had ended, CONVERGED, at 945 times the noise's power."""
    rng = np.random.default_rng(0)
    u, y = np.repeat(rng.choice([-1.0, 1.0], N // 25), 25), np.zeros(N)
    for frequency, damping in ((0.3, 0.02), (2.0, 0.3)):
        w = 2 * np.pi * frequency
        b, a, _ = signal.cont2discrete(([w * w], [1.0, 2 * damping * w, w * w]), T)
        y += rng.uniform(0.3, 1.0) * signal.lfilter(b.ravel(), a, u)
    noise = 0.02 * y.std() * np.random.default_rng(1).standard_normal(N)
    fit = sysid.fit(sysid.data((u, y + noise), sample_time=T), "u -> y", sysid.LinearStateSpace(states=4, noise=False))
    assert fit.history["mse"][-1] < 1.1 * np.mean(noise**2)
