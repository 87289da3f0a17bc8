"""Subspace methods: a system without noise comes out exactly, whatever the method, over records of their own."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.errors import TraceError
from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.subspace.projections import Weighting
from sysid.estimation.linear.subspace.starts import Subspace
from sysid.estimation.linear.subspace.windows import Windows
from sysid.models.linear.innovations import Innovations

A = np.array([[0.9, 0.3, 0.0], [-0.3, 0.9, 0.1], [0.0, 0.0, 0.6]])
B = np.array([[1.0, 0.0], [0.5, 1.0], [1.0, -1.0]])
C = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, -1.0]])
K = np.array([[0.3, 0.1], [0.0, 0.2], [0.1, 0.0]])
TRUE = Innovations(A=A, B=B, C=C, D=np.zeros((2, 2)), K=K, constant=np.array([0.4, -1.0]))


def segment(n: int, seed: int, *, noise: float = 0.0, feedback: float = 0.0) -> Segment:
    rng = np.random.default_rng(seed)
    x, e = rng.normal(size=3), noise * rng.normal(size=(n, 2))
    u, y = rng.normal(size=(n, 2)), np.empty((n, 2))
    for t in range(n):
        y[t] = C @ x + TRUE.constant + e[t]
        u[t] -= feedback * y[t]
        x = A @ x + B @ u[t] + K @ e[t]
    return Segment(inputs=u, outputs=y, root_weights=np.ones(n))


def poles(found: Innovations) -> np.ndarray:
    return np.sort_complex(found.poles())


@pytest.mark.parametrize("weighting", list(Weighting), ids=lambda one: one.value)
def test_a_system_without_noise_is_found_from_short_records_of_their_own(weighting: Weighting) -> None:
    records = [segment(90, seed) for seed in range(3)]
    found = Subspace.of(records, states=3, horizon=6, feedthrough=False, noise=False)
    assert (found.singular_values()[:3] > 0.1).all()
    assert found.singular_values()[3:4].max(initial=0.0) < 1e-4
    system = found.estimate(3, weighting)
    np.testing.assert_allclose(poles(system), poles(TRUE), atol=1e-6)
    u = np.random.default_rng(9).normal(size=(40, 2))
    expected = TRUE.simulated(u, np.zeros(3))
    np.testing.assert_allclose(system.simulated(u, np.zeros(3)), expected, atol=1e-5)


@pytest.mark.parametrize("weighting", [Weighting.SSARX, Weighting.CVA], ids=lambda one: one.value)
def test_noise_and_its_gain_are_found(weighting: Weighting) -> None:
    found = Subspace.of([segment(6000, 4, noise=0.5)], states=3, horizon=None, feedthrough=False, noise=True)
    system = found.estimate(3, weighting)
    np.testing.assert_allclose(poles(system), poles(TRUE), atol=0.02)
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(system.predictor)),
                               np.sort_complex(np.linalg.eigvals(TRUE.predictor)), atol=0.1)  # fmt: skip
    assert found.order(8) == 3


def test_under_feedback_ssarx_finds_what_open_loop_projections_miss() -> None:
    """The input is what it is because of the noise: ``u = r - 0.8 y`` with a small ``r``."""
    rng = np.random.default_rng(0)
    e, u, y, x = rng.normal(size=12_000), 0.2 * rng.normal(size=(12_000, 1)), np.empty((12_000, 1)), 0.0
    for t in range(len(e)):
        y[t] = x + e[t]
        u[t] -= 0.8 * y[t]
        x = 0.9 * x + u[t, 0] + 0.9 * e[t]
    record = Segment(inputs=u, outputs=y, root_weights=np.ones(len(e)))
    found = Subspace.of([record], states=1, horizon=10, feedthrough=False, noise=True)
    errors = {one: abs(found.estimate(1, one).A[0, 0] - 0.9) for one in (Weighting.SSARX, Weighting.MOESP)}
    assert errors[Weighting.SSARX] < 0.1 < errors[Weighting.MOESP] / 3.0


def test_windows_cross_neither_records_nor_gaps() -> None:
    whole = segment(60, 6)
    weights = np.ones(60)
    weights[25:27] = 0.0
    torn = Segment(inputs=whole.inputs, outputs=whole.outputs, root_weights=weights)
    parts = [
        Segment(inputs=whole.inputs[at], outputs=whole.outputs[at], root_weights=np.ones(at.stop - at.start))
        for at in (slice(0, 25), slice(27, 60))
    ]
    one, other = Windows.of([torn], 3, 2), Windows.of(parts, 3, 2)
    assert one.n_rows == other.n_rows == (25 - 4) + (33 - 4)
    np.testing.assert_allclose(one.R.T @ one.R, other.R.T @ other.R, rtol=1e-10, atol=1e-10)


def test_what_is_kept_does_not_depend_on_the_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    records = [segment(300, seed) for seed in range(2)]
    one = Windows.of(records, 2, 2)
    monkeypatch.setattr("sysid.estimation.linear.subspace.windows.BLOCK_VALUES", 17 * 40)
    other = Windows.of(records, 2, 2)
    np.testing.assert_allclose(one.R.T @ one.R, other.R.T @ other.R, rtol=1e-10, atol=1e-9)
    kept = [0, *range(5, 17)]
    short = one.shortened(1).R
    np.testing.assert_allclose(short.T @ short, (one.R.T @ one.R)[np.ix_(kept, kept)], atol=1e-9)


def test_records_shorter_than_a_window_are_refused() -> None:
    with pytest.raises(TraceError, match="long enough for the horizon") as caught:
        Windows.of([segment(5, 0)], 4, 4)
    assert caught.value.remedy
