"""The phase of a linear model has every turn that it makes from zero frequency on, asked for where it may be."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from sysid.reporting.linear_views import LinearView

LAG, SUM = [1.0, -0.9], [1.0, -1.0]
RINGS, RUNS_AWAY = [1.0, -2 * 0.9999 * np.cos(0.5), 0.9999**2], [1.0, -2 * 1.05 * np.cos(0.5), 1.05**2]
BESIDE = [1.0, -2 * 0.9999 * np.cos(0.3), 0.9999**2]

Polynomial = list[float] | NDArray[np.float64]


def view(B: Polynomial, F: Polynomial, *, discrete: bool = True, T: float = 1.0, delay: int = 0) -> LinearView:
    one = {"name": "u", "unit": "V", "source": 0, "target": 0, "discrete": discrete, "sample_time": T, "delay": delay}
    return LinearView(**one, B=np.array([B], dtype=float), F=np.array([F], dtype=float))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("one", "begins", "ends"),
    [
        # A lag whose output is 60 samples late: 2,880 degrees had been said at the end, of 10,980.
        (view([0.0, 0.1], LAG, delay=60), 0.0, -10980.0),
        (view([0.0, -0.1], LAG, delay=6), 180.0, -1080.0),
        (view([0.0, 0.1], SUM, delay=3), -90.0, -720.0),
        (view([0.0, -0.1], SUM, delay=3), 90.0, -540.0),
        (view([0.0, 0.1, 0.1], np.convolve(SUM, SUM)), -180.0, -270.0),
        (view([0.0, 0.1], RINGS, delay=20), 0.0, -3780.0),
        (view(np.convolve(BESIDE, [1.0, -0.2]), RINGS, delay=20), 0.0, -3600.0),
        (view([0.0, 0.1], [1.0, -1.1]), -180.0, -180.0),
        (view([0.0, 0.1], RUNS_AWAY), 0.0, 180.0),
        (view([0.0, 0.1, -0.15], LAG), 180.0, -180.0),
        (view([1.0, -1.0], LAG), 90.0, 0.0),
        (view([1.0], [1.0, 1.0], discrete=False, T=0.01, delay=300), 0.0, None),
        (view([1.0], [-1.0, 1.0], discrete=False, T=0.1), -180.0, None),
        (view([1.0, -1.0], [1.0, 1.0], discrete=False, T=0.1), 0.0, None),
        (view([1.0], [0.0, 0.0, 1.0], discrete=False, T=0.1), -180.0, -180.0),
        (view([1e17], [1e17, 9.4e7, 1.0], discrete=False, T=1e-9, delay=30), 0.0, None),
        (view([1e-9], [1e-9, 1.0], discrete=False, T=1e6), 0.0, -90.0),
    ],
)
def test_a_phase_counts_every_turn(one: LinearView, begins: float, ends: float | None) -> None:
    fine = np.linspace(1e-6, 1.0, 300_001)[:-1] * np.pi / one.sample_time
    slow = np.unwrap(np.angle(one.responses(fine)[0]))
    chosen = np.array([200_000, 3, 777, 250_123, 50_000])  # in no order
    turns = (one.phase(fine[chosen]) - slow[chosen]) / (2.0 * np.pi)
    assert_allclose(turns, np.round(turns[0]), atol=1e-6)
    at_rest, at_end = np.degrees(one.phase(np.pi / one.sample_time * np.array([1e-7, 1.0 - 1e-6])))
    assert at_rest == pytest.approx(begins, abs=1.0)
    if ends is not None:
        assert at_end == pytest.approx(ends, abs=1.0)


@pytest.mark.parametrize(("zero", "pole"), [(-1.2e-6, 1.3e-6), (1.2e-6, 0.9e-6), (-1e-9, 1.2e-6), (5e-6, -5e-6)])
def test_what_nearly_cancels_beside_one_is_no_turn(zero: float, pole: float) -> None:
    """Of two outputs that integrate, a model of both has the other's sum in each: it was told as 270, not -90."""
    one = view([0.0, 0.02, -0.02 * (1.0 + zero)], np.convolve(SUM, [1.0, -1.0 - pole]))
    assert_allclose(np.degrees(one.phase(np.array([1e-3, 0.1]))), [-90.0, -90.0], atol=3.0)


def test_what_does_nothing_turns_nothing() -> None:
    assert_allclose(view([0.0, 0.0], LAG, delay=5).phase(np.array([0.0, 1.0, 2.0])), 0.0)


def test_zero_frequency_has_a_phase() -> None:
    assert np.degrees(view([0.0, 0.1], SUM).phase(np.zeros(1)))[0] == pytest.approx(-90.0, abs=0.1)
