"""Channels that wrap, and records that were interpolated, are told; test signals and plants that look alike are not."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

import sysid
from sysid.estimation.remarks.record_notes import wraps
from sysid.estimation.remarks.wrapped import period_of
from sysid.models import Mapping

N = 1000
RNG = np.random.default_rng(0)
U = np.repeat(RNG.uniform(-1.0, 1.0, 100), 10)
TURNED = np.cumsum(lfilter([0.0, 0.5], [1.0, -0.9], U) * 4.0 + 3.0) + 0.1 * RNG.standard_normal(N)
SAW = (np.arange(N) % 100) / 100.0
SQUARE = np.sign(np.sin(0.05 * np.arange(N)))

WRAPPED = {
    "degrees": (U, TURNED % 360.0, "y jumps by 360 "),
    "fast turns": (
        U,
        np.cumsum(20.0 + 40.0 * lfilter([0.0, 0.1, 0.05], [1.0, -1.5, 0.6], U)) % 360.0,
        "y jumps by 360 ",
    ),
    "half turns": (U, (TURNED + 180.0) % 360.0 - 180.0, "y jumps by 360 "),
    "radians": (U, np.angle(np.exp(1j * np.radians(TURNED))), "y jumps by 6.28319 "),
    "a counter of 8 bits": (U, TURNED.astype(np.int64).astype(np.int8).astype(np.float64), "y jumps by 256 "),
    "a crank": (TURNED % 360.0, np.sin(np.radians(TURNED)), "u jumps by 360 "),
    "a ramp as test signal": (SAW, lfilter([0.0, 0.2], [1.0, -0.8], SAW), ""),
    "the same at once": (SAW, 2.0 * SAW, ""),
    "a square wave": (U, SQUARE + 0.05 * RNG.standard_normal(N), ""),
    "noise": (U, RNG.standard_normal(N), ""),
}


@pytest.mark.parametrize("case", WRAPPED)
def test_angles_and_counters_that_wrap_are_told(case: str) -> None:
    u, y, said = WRAPPED[case]
    traces = sysid.data((u, y), sample_time=0.1)
    found = wraps(traces.traces, Mapping.parse("u -> y"))
    assert [one[: len(said)] for one in found] == [said] * bool(said)


def test_stretches_of_any_length_are_looked_at() -> None:
    parts = [TURNED[:1] % 360.0, TURNED[:3] % 360.0, TURNED % 360.0, np.zeros(0)]
    moved = [np.zeros(max(len(part) - 1, 0), dtype=np.bool_) for part in parts]
    assert period_of(parts, moved) == period_of([TURNED % 360.0], [np.zeros(N - 1, dtype=np.bool_)])


def test_a_fit_and_advice_say_so() -> None:
    traces = sysid.data((U, TURNED % 360.0), sample_time=0.1)
    told = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=(1,), nk=(1,))).warnings
    assert any("numpy.unwrap(y, period=360)" in one for one in told)
    assert "channel.wraps" in [one.code for one in sysid.advise(traces, "u -> y").findings]


def by_lines(x: NDArray[np.float64], samples: int) -> NDArray[np.float64]:
    return np.interp(np.arange(N) / samples, np.arange(N), x)


LINES = {
    "all of it": (by_lines(RNG.standard_normal(N), 8), by_lines(RNG.standard_normal(N), 8), True),
    "an integrator under steps": (U, np.cumsum(U), False),
    "lines through a plant": (by_lines(U, 8), lfilter([0.0, 0.2], [1.0, -0.8], by_lines(U, 8)), False),
    "another pace": (by_lines(RNG.standard_normal(N), 8), by_lines(RNG.standard_normal(N), 5), False),
    "measured": (U, lfilter([0.0, 0.2], [1.0, -0.8], U) + 0.01 * RNG.standard_normal(N), False),
}


@pytest.mark.parametrize("case", LINES)
def test_a_record_that_was_interpolated_is_told(case: str) -> None:
    u, y, said = LINES[case]
    traces = sysid.data((u, y), sample_time=0.1)
    notes = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=(1,), nk=(1,))).warnings
    assert any("straight lines of 8 samples" in note for note in notes) is said
    codes = [one.code for one in sysid.advise(traces, "u -> y").findings]
    assert ("channel.interpolated" in codes) is said
