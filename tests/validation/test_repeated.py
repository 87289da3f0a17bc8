"""A record that is scored and holds what was fitted is told."""

from __future__ import annotations

import numpy as np
import pytest

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


def test_a_comparison_says_so() -> None:
    u = np.random.default_rng(0).standard_normal(N)
    y = np.convolve(u, 0.5 * 0.5 ** np.arange(20))[:N]
    traces = sysid.data({"a": (u, y), "b": (u[20:], y[20:])}, sample_time=1.0, split=["estimation", "validation"])
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=0))
    assert any("b: up to 100 %" in note for note in sysid.compare(traces, fit).notes)
    other = sysid.data((u, y + 1.0), sample_time=1.0)
    assert not sysid.compare(other, fit).notes
