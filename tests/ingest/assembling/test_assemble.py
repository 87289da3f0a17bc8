"""A raw table to a trace: columns and units as they were asked for, times onto the grid, nothing else changed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.errors import ChannelError, ConfigError, TraceError, UnitError, UserError
from sysid.traces import Channel
from sysid.units import Reference
from tests.ingest.assembling.one_channel import EVEN, Done, N, Refused, check_done, check_refused, make, ramp

PSI = Channel(name="u", unit="psi", reference=Reference.GAUGE)

REFUSED: dict[str, Refused] = {
    "another sample time": (
        {"sample_time": 0.2},
        TraceError,
        r"another sample time.*expected: 0\.2 s.*got: +0\.1 s.*sample_time: 0\.1.*method: average.*unit of time",
    ),
    "the wrong unit of time": (
        {"time_unit": "ms"},
        TraceError,
        r"another sample time.*expected: 0\.1 s.*got: +0\.0001 s.*check the unit of time",
    ),
    "averaging a slow record": (
        {"sample_time": 0.04, "grid": {"method": "average"}},
        ConfigError,
        r"nothing to average.*at most 0\.04 s.*0\.1 s.*method: linear",
    ),
    "too few samples": (
        {"stamps": EVEN[:4]},
        TraceError,
        r"too few samples.*at least 10.*got: +4.*fewest_samples",
    ),
    "nothing between start and stop": (
        {"start": 5.0},
        TraceError,
        r"nothing is left.*between 0 s and 1\.9 s.*start 5\.0.*correct start",
    ),
    "no unit": (
        {"unit": None},
        UnitError,
        r"no unit.*channel u \(column u\).*a unit.*none.*units: \{u: V\}",
    ),
    "an unknown unit": (
        {"unit": "foo"},
        UnitError,
        r"unknown unit 'foo'.*channel u.*known to pint.*foo.*correct the unit",
    ),
    "an incompatible unit": (
        {"unit": "kPa"},
        UnitError,
        r"cannot convert kPa to V.*channel u.*a unit of.*kPa.*correct the unit",
    ),
    "a pressure without reference": (
        {"unit": "kPa", "channel": PSI},
        UnitError,
        r"measured from.*channel u.*gauge or absolute.*neither.*references: \{u: gauge\}",
    ),
    "a pressure without reference where an absolute one is wanted": (
        {"unit": "kPa", "channel": Channel(name="u", unit="bar", reference=Reference.ABSOLUTE)},
        UnitError,
        r"measured from.*where it is absolute, as here.*references: \{u: absolute\}.*gauge where it is that",
    ),
    "no unit of time": (
        {"time_unit": None},
        UnitError,
        r"time column has no unit.*column t.*unit of time.*none.*time: 't \[s\]'",
    ),
    "a unit of time that is none": (
        {"time_unit": "V"},
        UnitError,
        r"cannot convert V to s.*column t",
    ),
    "a misspelt column": (
        {"files": {"columns": {"u": "uu"}}},
        ChannelError,
        r"missing channel uu.*one of t, u.*did you mean u\?",
    ),
    "a column for an unknown channel": (
        {"files": {"columns": {"v": "u"}}},
        ConfigError,
        r"columns names v, which is not a channel.*source\.files\.columns.*one of u.*got: +v",
    ),
    "a unit for an unknown channel": (
        {"files": {"units": {"v": "V"}}},
        ConfigError,
        r"units names v.*one of u",
    ),
    "a misspelt time column": (
        {"files": {"time": "tt [s]"}},
        ChannelError,
        r"missing channel tt.*did you mean t\?",
    ),
}


@pytest.mark.parametrize(("arguments", "kind", "message"), REFUSED.values(), ids=REFUSED)
def test_a_problem_is_refused_with_its_remedy(
    tmp_path: Path, arguments: dict[str, Any], kind: type[UserError], message: str
) -> None:
    check_refused(tmp_path, arguments, kind, message)


DONE: dict[str, Done] = {
    "decimation by averaging": (
        {"sample_time": 0.2, "grid": {"method": "average"}},
        [2.0 * i + 0.5 for i in range(N // 2)],
        [],
        "resampled (average) from a step of 0.1 s to 0.2 s",
    ),
    "interpolation to a faster grid": (
        {"sample_time": 0.05, "grid": {"method": "linear"}},
        [0.5 * i for i in range(2 * N - 1)],
        [],
        "resampled (linear) from a step of 0.1 s to 0.05 s",
    ),
    "holding to a faster grid": (
        {"sample_time": 0.05, "grid": {"method": "hold"}},
        [float(i // 2) for i in range(2 * N - 1)],
        [],
        "resampled (hold) from a step of 0.1 s to 0.05 s",
    ),
    "rounding": (
        {"values": [i / 3 for i in range(N)], "decimals": {"u": 1}},
        [round(i / 3, 1) for i in range(N)],
        [],
        "u: rounded to 1 decimals",
    ),
    "start and stop": (
        {"start": 0.3, "stop": 1.5},
        [float(i) for i in range(3, 16)],
        [],
        "cut to 13 of 20 samples by start 0.3, stop 1.5",
    ),
    "a unit instead of the file's": (
        {"unit": "kPa", "files": {"units": {"u": "mV"}}, "values": [1000.0 * i for i in range(N)]},
        ramp(),
        [],
        "u: taken as mV although the file says kPa, converted from mV to V",
    ),
}


@pytest.mark.parametrize(("arguments", "values", "masked", "told"), DONE.values(), ids=DONE)
def test_what_is_asked_for_is_done_and_told(
    tmp_path: Path, arguments: dict[str, Any], values: list[float], masked: list[int], told: str
) -> None:
    check_done(tmp_path, arguments, values, masked, told)


@pytest.mark.parametrize(
    ("unit", "wanted", "told"),
    [("volt", "V", []), ("percent", "%", []), ("%", "1", ["u: converted from % to 1"])],
)
def test_a_unit_by_another_name_is_no_conversion(tmp_path: Path, unit: str, wanted: str, told: list[str]) -> None:
    provenance = make(tmp_path, unit=unit, channel=Channel(name="u", unit=wanted)).provenance
    assert [one for one in provenance if "converted" in one] == told


def test_clean_samples_pass_unchanged(tmp_path: Path) -> None:
    values = np.random.default_rng(1).normal(size=N).tolist()
    trace = make(tmp_path, values=values)
    assert trace["u"].tolist() == values
    assert (trace.start_time, trace.usable, len(trace.provenance)) == (0.0, None, 1)


@pytest.mark.parametrize(
    ("unit", "factor"), [("s", 1.0), ("ms", 1e3), ("min", 1 / 60), ("ds", 10.0), ("h", 1 / 3600), ("us", 1e6)]
)
def test_time_comes_in_any_unit(tmp_path: Path, unit: str, factor: float) -> None:
    trace = make(tmp_path, stamps=[factor * t for t in EVEN], time_unit=None, files={"time": f"t [{unit}]"})
    assert trace.sample_time == 0.1
    np.testing.assert_allclose(trace["u"], ramp())


def test_a_file_without_time_stamps_is_given_its_step(tmp_path: Path) -> None:
    trace = make(tmp_path, files={"time": {"step": 0.1}}, time_unit=None)
    assert trace["u"].tolist() == ramp()


def test_far_from_zero_stamps_still_lie_on_the_grid(tmp_path: Path) -> None:
    trace = make(tmp_path, stamps=[1.7e9 + 0.001 * i for i in range(N)], sample_time=0.001)
    assert trace["u"].tolist() == ramp()


def test_gauge_and_absolute_are_told_apart(tmp_path: Path) -> None:
    absolute = make(
        tmp_path, unit="kPa", reference=Reference.ABSOLUTE, channel=PSI, values=[101.325 + i for i in range(N)]
    )
    np.testing.assert_allclose(absolute["u"], 0.1450377 * np.arange(N), atol=1e-5)
    declared = make(tmp_path, unit="kPa", channel=PSI, files={"references": "gauge"})
    np.testing.assert_allclose(declared["u"], 0.1450377 * np.arange(N), atol=1e-5)
