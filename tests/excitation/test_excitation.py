"""Excitations: always within their range, of the length and band that was asked for, the same for a seed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sysid.errors import ConfigError, UnitError
from sysid.excitation import KINDS, PRBS, Excitation, Multisine, excite


def drawn(kind: str, samples: int = 1000, **options: Any) -> Excitation:
    return excite(kind, samples=samples, sample_time=0.1, low=2.0, high=5.0, **options)


def crest(x: np.ndarray[Any, Any]) -> float:
    x = x - x.mean()
    return float(np.abs(x).max() / x.std())


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(sorted(KINDS)),
    st.integers(20, 400),
    st.integers(0, 10**6),
    st.tuples(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6)),
    st.integers(1, 3),
)
def test_levels_are_always_within_the_range(
    kind: str, samples: int, seed: int, of_range: tuple[float, float], channels: int
) -> None:
    low, span = of_range
    names = [f"u{k}" for k in range(channels)]
    found = excite(kind, samples=samples, sample_time=0.5, low=low, high=low + span, seed=seed, names=names)
    assert found.values.shape == (samples, channels)
    assert found.values.min() >= low
    assert found.values.max() <= low + span


@pytest.mark.parametrize("kind", KINDS)
def test_a_seed_says_it_all(kind: str) -> None:
    np.testing.assert_array_equal(drawn(kind, seed=3).values, drawn(kind, seed=3).values)


@pytest.mark.parametrize("kind", sorted(set(KINDS) - {"chirp", "staircase"}))
def test_another_seed_is_another_signal(kind: str) -> None:
    assert not np.array_equal(drawn(kind, seed=3).values, drawn(kind, seed=4).values)


@pytest.mark.parametrize("kind", KINDS)
def test_the_range_is_used(kind: str) -> None:
    x = drawn(kind).values
    assert x.min() < 2.05
    assert x.max() > 4.95


def test_ramps_move_at_most_by_the_range_over_their_shortest_rise_and_stand_between() -> None:
    x = drawn("ramps", 5000, rise=50, hold=20).values[:, 0]
    moves = np.diff(x)
    assert 0.0 < np.abs(moves).max() <= 3.0 / 50 * (1.0 + 1e-9)
    assert np.mean(np.abs(moves) < 1e-12) > 0.2
    turning = drawn("ramps", 5000, rise=50, longest_hold=0).values[:, 0]
    assert np.count_nonzero(np.diff(turning) == 0.0) == 0


def test_a_sine_has_one_line() -> None:
    power = np.abs(np.fft.rfft(drawn("sine", periods=7).values[:, 0] - 3.5)) ** 2
    assert power[7] > 0.999 * power.sum()
    with pytest.raises(ConfigError, match="fewest is out of range"):
        drawn("sine", fewest=501, most=600)


def test_pulses_go_down_by_their_depth_and_come_back() -> None:
    x = drawn("pulses", 4000, hold=20, longest=60, depth=0.25).values[:, 0]
    assert set(x.tolist()) == {5.0, 4.25}
    turns = np.diff(np.flatnonzero(np.diff(x)))
    assert 20 <= turns.min() <= turns.max() <= 60


def test_a_prbs_has_the_autocorrelation_of_one() -> None:
    x = excite(PRBS(order=7), samples=127, sample_time=1.0).values[:, 0]
    X = np.fft.rfft(x)
    np.testing.assert_allclose(np.fft.irfft(np.abs(X) ** 2, 127)[1:], -1.0, atol=1e-9)


def test_a_clock_holds_each_level() -> None:
    x = drawn("prbs", clock=5).values[:, 0]
    assert np.all(np.diff(np.flatnonzero(np.diff(x))) % 5 == 0)


def test_channels_of_a_prbs_are_not_correlated() -> None:
    x = excite(PRBS(order=9), samples=511, sample_time=1.0, names=["a", "b"]).values
    assert abs(np.corrcoef(x.T)[0, 1]) < 0.01


@pytest.mark.parametrize("lines", ["full", "odd", "odd-random"])
def test_a_multisine_has_its_lines_and_no_other(lines: str) -> None:
    x = excite("multisine", samples=512, sample_time=0.1, band=(0.2, 2.0), lines=lines, periods=2).values[:, 0]
    np.testing.assert_array_equal(x[:256], x[256:])
    power = np.abs(np.fft.rfft(x[:256] - x[:256].mean()))
    excited = np.flatnonzero(power > 1e-9 * power.max())
    assert excited.min() / 25.6 >= 0.2
    assert excited.max() / 25.6 <= 2.0
    np.testing.assert_allclose(power[excited], power[excited][0], rtol=1e-9)
    assert lines == "full" or np.all(excited % 2 == 1)


def test_phases_are_improved_for_a_low_peak() -> None:
    low, random = (drawn("multisine", samples=2048, band=(0.01, 1.0), iterations=n).values[:, 0] for n in (200, 0))
    assert crest(low) < 1.6
    assert crest(random) > 2.0


def test_channels_of_a_multisine_share_the_lines_out() -> None:
    X = np.abs(np.fft.rfft(drawn("multisine", names=["a", "b"]).values - 3.5, axis=0))[1:]
    excited = 1e-6 * X.max() < X
    assert excited.sum(axis=1).max() == 1


def test_filtered_noise_keeps_to_its_band() -> None:
    x = drawn("noise", samples=8000, band=(0.5, 1.0), peak=6.0).values[:, 0]
    power, f = np.abs(np.fft.rfft(x - x.mean())) ** 2, np.fft.rfftfreq(8000, 0.1)
    assert power[(f > 0.4) & (f < 1.1)].sum() > 0.98 * power.sum()


def test_a_staircase_has_its_levels_and_an_aprbs_many() -> None:
    assert np.unique(drawn("staircase", levels=4).values).tolist() == [2.0, 3.0, 4.0, 5.0]
    assert np.unique(drawn("staircase", levels=4, direction="random").values).tolist() == [2.0, 3.0, 4.0, 5.0]
    assert len(np.unique(drawn("aprbs", hold=10).values)) > 20


def test_it_is_an_array_a_frame_and_a_trace() -> None:
    found = drawn("prbs", names="valve", units="mm")
    assert np.asarray(found).shape == (1000, 1)
    assert found.to_frame().columns.tolist() == ["time", "valve"]
    assert found.trace().channels[0].label == "valve [mm]"
    assert excite(Multisine(periods=2), duration=10.0, sample_time=0.1).values.shape == (100, 1)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("sinus", {}),
        ("sine", {"periods": 51}),
        ("ramps", {"rise": 30, "longest_rise": 20}),
        ("pulses", {"depth": 1.5}),
        ("prbs", {"hold": 3}),
        ("prbs", {"clock": 0}),
        ("prbs", {"clock": 2.5}),
        ("prbs", {"order": 60}),
        ("multisine", {"lines": "even"}),
        ("multisine", {"band": (1.0, 50.0)}),
        ("multisine", {"band": (2.0, 1.0)}),
        ("multisine", {"band": 3}),
        ("noise", {"peak": "high"}),
        ("staircase", {"levels": 1}),
        ("aprbs", {"hold": 5000}),
        ("prbs", {"low": 3.0, "high": 3.0}),
        ("prbs", {"low": float("nan")}),
        ("prbs", {"names": ["a", "a"]}),
        ("prbs", {"samples": 10**12}),
        ("prbs", {"sample_time": 0.0}),
        ("prbs", {"duration": 3.0}),
    ],
)
def test_what_cannot_be_is_refused_in_words(kind: str, options: dict[str, Any]) -> None:
    with pytest.raises(ConfigError):
        excite(kind, **({"samples": 100, "sample_time": 0.1} | options))


def test_an_unknown_unit_is_refused() -> None:
    with pytest.raises(UnitError):
        drawn("prbs", units="flibbers")
