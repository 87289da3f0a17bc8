"""A record that is scored and holds what was fitted is told."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid
from sysid.traces import Channel, Trace
from sysid.validation.repeated import repeated

N = 300


def trace(name: str, values: np.ndarray) -> Trace:
    channels = tuple(Channel(name=one, unit="1") for one in ("u", "y"))
    return Trace(name=name, sample_time=1.0, channels=channels, values=values)


VALUES = np.random.default_rng(0).integers(0, 50, (N, 2)).astype(np.float64)
OTHER = np.random.default_rng(1).integers(0, 50, (N, 2)).astype(np.float64)


@pytest.mark.parametrize(
    "values,share",
    [(VALUES, 100), (VALUES[100:], 100), (np.concatenate([OTHER, VALUES[:200]]), 38)],
    ids=["all", "its end", "among others"],
)
def test_what_was_fitted_is_told_where_it_is_scored(values: np.ndarray, share: int) -> None:
    (told,) = repeated(("u", "y"), [trace("a", VALUES)], [trace("b", values), trace("c", OTHER)])
    assert told.startswith(f"b: up to {share} %")


def test_what_is_alike_is_not_the_same() -> None:
    still = VALUES.copy()
    still[50:] = still[50]  # what stands is the same in many records
    assert not repeated(("u", "y"), [trace("a", VALUES)], [trace("b", OTHER)])
    assert not repeated(("u", "y"), [trace("a", still)], [trace("b", np.concatenate([OTHER, still[100:]]))])
    again = np.column_stack([VALUES[:, 0], OTHER[:, 1]])  # the same experiment, measured once more
    assert not repeated(("u", "y"), [trace("a", VALUES)], [trace("b", again), trace("short", VALUES[:5])])
    assert repeated(("u",), [trace("a", VALUES)], [trace("b", again)])


def _coarse(seed: int, n: int, hold: int = 12) -> np.ndarray:
    """Two levels and an output in coarse steps, without noise."""
    u = np.repeat(np.random.default_rng(seed).choice([-1.0, 1.0], n // hold + 1), hold)[:n]
    return np.column_stack([u, np.round(2.0 * lfilter([0.0, 0.2, 0.1], [1.0, -1.5, 0.7], u)) / 2.0])


@pytest.mark.parametrize("n", [2_000, 20_000])
def test_other_experiments_of_few_levels_are_not_the_same_and_copies_of_them_are(n: int) -> None:
    """98 % of one were said to be in the other."""
    fitted, other = _coarse(1, n), _coarse(2, 600)
    assert not repeated(("u", "y"), [trace("a", fitted)], [trace("b", other), trace("c", _coarse(3, 500))])
    assert repeated(("u", "y"), [trace("a", fitted)], [trace("b", fitted[100:500])])
    assert repeated(("u", "y"), [trace("a", fitted)], [trace("b", np.concatenate([other, fitted[-450:]]))])
    assert repeated(("u", "y"), [trace("a", fitted), trace("twice", fitted)], [trace("b", fitted)])


def test_further_periods_without_noise_are_the_same() -> None:
    u = np.sin(2.0 * np.pi * np.arange(2_000) / 50).round(6)
    values = np.column_stack([np.tile(u[:50], 40), np.tile(np.cos(u[:50]), 40)])
    assert repeated(("u", "y"), [trace("a", values[:1_200])], [trace("b", values[1_200:])])


def test_a_comparison_says_so() -> None:
    u = np.random.default_rng(0).standard_normal(N)
    y = np.convolve(u, 0.5 * 0.5 ** np.arange(20))[:N]
    traces = sysid.data({"a": (u, y), "b": (u[20:], y[20:])}, sample_time=1.0, split=["estimation", "validation"])
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=0))
    assert any("b: up to 100 %" in note for note in sysid.compare(traces, fit).notes)
    other = sysid.data((u, y + 1.0), sample_time=1.0)
    assert not sysid.compare(other, fit).notes
