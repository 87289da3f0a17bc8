"""A raw table to a trace: every problem is refused, and repaired where that repair was asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ChannelError, ConfigError, TraceError, UnitError, UserError
from sysid.ingest import FileOptions, GridOptions, RawColumn, RawTable, RepairOptions, Wanted, assemble
from sysid.traces import Channel, Trace
from sysid.units import Reference

N = 20
NAN = float("nan")


def ramp(values: Sequence[float] | None = None) -> list[float]:
    return list(values) if values is not None else [float(i) for i in range(N)]


def make(
    folder: Path,
    *,
    stamps: Sequence[float] | None = None,
    values: Sequence[float] | None = None,
    unit: str | None = "V",
    time_unit: str | None = "s",
    reference: Reference | None = None,
    channel: Channel | None = None,
    sample_time: float = 0.1,
    files: dict[str, Any] | None = None,
    grid: dict[str, Any] | None = None,
    repairs: dict[str, Any] | None = None,
    **wanted: Any,
) -> Trace:
    """One channel u through the whole way; its lines in the file start at 2."""
    source = folder / "run.csv"
    source.write_text("content")
    times = [0.1 * i for i in range(N)] if stamps is None else stamps
    levels = [float(i) for i in range(len(times))] if values is None else values
    table = RawTable(
        source=source,
        reader="csv",
        columns=(
            RawColumn(name="t", values=np.array(times, dtype=float), unit=time_unit),
            RawColumn(name="u", values=np.array(levels, dtype=float), unit=unit, reference=reference),
        ),
        time="t",
        lines=np.arange(len(times)) + 2,
    )
    return assemble(
        table,
        Wanted(name="RUN", channels=(channel or Channel(name="u", unit="V"),), sample_time=sample_time, **wanted),
        files=FileOptions.model_validate(files or {}),
        grid=GridOptions.model_validate(grid or {}),
        repairs=RepairOptions.model_validate(repairs or {}),
    )


EVEN = [0.1 * i for i in range(N)]
GAP = EVEN[:5] + EVEN[8:]
DUPLICATE = [*EVEN[:5], EVEN[4], *EVEN[5:]]
BACKWARD = [*EVEN[:5], EVEN[6], EVEN[5], *EVEN[7:]]
JITTER = [t + (0.02 if i % 3 == 1 else 0.0) for i, t in enumerate(EVEN)]
HOLE = [*map(float, range(5)), NAN, NAN, *map(float, range(7, N))]

PSI = Channel(name="u", unit="psi", reference=Reference.GAUGE)

# problem: arguments, error class, message: what, where, expected, got, remedy in this order
REFUSED: dict[str, tuple[dict[str, Any], type[UserError], str]] = {
    "gaps": (
        {"stamps": GAP},
        TraceError,
        r"3 samples are missing in 1 gap.*sample 4 \(line 6\).*0\.1 s later.*0\.4 s later.*gaps: linear.*gaps: mask",
    ),
    "duplicate time stamps": (
        {"stamps": DUPLICATE},
        TraceError,
        r"1 time stamps are duplicates.*sample 5 \(line 7\).*after 0\.4 s.*0\.4 s again.*duplicates: drop",
    ),
    "backward time stamps": (
        {"stamps": BACKWARD},
        TraceError,
        r"1 time stamps step back.*sample 6 \(line 8\).*after 0\.6 s.*0\.5 s.*backward: sort",
    ),
    "jitter": (
        {"stamps": JITTER},
        TraceError,
        r"uneven.*sample 4 \(line 6\).*steps of 0\.1.*to within 1 %.*up to 0\.01.*jitter: resample.*method: linear",
    ),
    "jitter without a method": (
        {"stamps": JITTER, "repairs": {"jitter": "resample"}},
        ConfigError,
        r"needs a method.*method: linear.*no method.*add grid",
    ),
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
    "missing values": (
        {"values": HOLE},
        TraceError,
        r"2 values are missing.*channel u, sample 5 \(line 7\).*finite.*nan.*nan: interpolate.*nan: mask",
    ),
    "infinite values": (
        {"values": [float("inf"), *map(float, range(1, N))]},
        TraceError,
        r"1 values are missing.*sample 0.*finite.*got: +inf",
    ),
    "missing values at the end": (
        {"values": [*map(float, range(N - 1)), NAN], "repairs": {"nan": "interpolate"}},
        TraceError,
        r"end of a record cannot be interpolated.*sample 19.*first and the last.*nan: mask",
    ),
    "no values at all": (
        {"values": [NAN] * N, "repairs": {"nan": "mask"}},
        TraceError,
        r"no values at all.*channel u.*numbers.*only empty.*leave the channel out",
    ),
    "missing time stamps": (
        {"stamps": [*EVEN[:5], NAN, *EVEN[6:]]},
        TraceError,
        r"1 samples have no time stamp.*channel t, sample 5 \(line 7\).*number.*nan.*stamps: drop",
    ),
    "constant channels": (
        {"values": [3.5] * N},
        TraceError,
        r"channel u never changes.*information.*3\.5 in all 20 samples.*constant: accept",
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
    with pytest.raises(kind, match=f"(?s){message}") as caught:
        make(tmp_path, **arguments)
    assert "run.csv" in str(caught.value.where)
    assert None not in {caught.value.expected, caught.value.got, caught.value.remedy}


# repair: arguments, values that come out, samples that do not count, what the provenance says
REPAIRED: dict[str, tuple[dict[str, Any], list[float], list[int], str]] = {
    "gaps: linear": (
        {"stamps": GAP, "values": [*range(5), *range(8, N)], "repairs": {"gaps": "linear"}},
        ramp(),
        [],
        "3 missing samples filled (linear)",
    ),
    "gaps: hold": (
        {"stamps": GAP, "values": [*range(5), *range(8, N)], "repairs": {"gaps": "hold"}},
        [*range(5), 4, 4, 4, *range(8, N)],
        [],
        "3 missing samples filled (hold)",
    ),
    "gaps: mask": (
        {"stamps": GAP, "values": [*range(5), *range(8, N)], "repairs": {"gaps": "mask"}},
        ramp(),
        [5, 6, 7],
        "3 missing samples masked",
    ),
    "duplicates: drop": (
        {"stamps": DUPLICATE, "values": [*range(5), 99, *range(5, N)], "repairs": {"duplicates": "drop"}},
        ramp(),
        [],
        "dropped: 1 duplicate time stamps, first at sample 5 (line 7)",
    ),
    "duplicates: average": (
        {"stamps": DUPLICATE, "values": [*range(5), 99, *range(5, N)], "repairs": {"duplicates": "average"}},
        [*range(4), (4 + 99) / 2, *range(5, N)],
        [],
        "averaged: 1 duplicate time stamps, first at sample 5 (line 7)",
    ),
    "backward: sort": (
        {"stamps": BACKWARD, "values": [*range(5), 6, 5, *range(7, N)], "repairs": {"backward": "sort"}},
        ramp(),
        [],
        "sorted by time: 1 backward time stamps, first at sample 6 (line 8)",
    ),
    "backward: drop": (
        {
            "stamps": [*EVEN[:5], EVEN[2], *EVEN[5:]],
            "values": [*range(5), 99, *range(5, N)],
            "repairs": {"backward": "drop"},
        },
        ramp(),
        [],
        "dropped: 1 backward time stamps, first at sample 5 (line 7)",
    ),
    "stamps: drop": (
        {
            "stamps": [*EVEN[:5], NAN, *EVEN[5:]],
            "values": [*range(5), 99, *range(5, N)],
            "repairs": {"stamps": "drop"},
        },
        ramp(),
        [],
        "1 samples without a time stamp dropped, first at sample 5 (line 7)",
    ),
    "nan: interpolate": (
        {"values": HOLE, "repairs": {"nan": "interpolate"}},
        ramp(),
        [],
        "u: 2 missing values interpolated, first at sample 5 (line 7), longest run 2",
    ),
    "nan: mask": (
        {"values": HOLE, "repairs": {"nan": "mask"}},
        ramp(),
        [5, 6],
        "u: 2 missing values filled and masked, first at sample 5 (line 7), longest run 2",
    ),
    "nan: mask, at the ends": (
        {"values": [NAN, NAN, *range(2, N - 1), NAN], "repairs": {"nan": "mask"}},
        [2, 2, *range(2, N - 1), N - 2],
        [0, 1, N - 1],
        "u: 3 missing values filled and masked, first at sample 0 (line 2), longest run 2",
    ),
    "constant: accept": (
        {"values": [3.5] * N, "repairs": {"constant": "accept"}},
        [3.5] * N,
        [],
        "constant and accepted: u",
    ),
    "jitter: resample": (
        {
            "stamps": JITTER,
            "values": [10.0 * t for t in JITTER],
            "grid": {"method": "linear"},
            "repairs": {"jitter": "resample"},
        },
        ramp(),
        [],
        "resampled (linear) from a step of 0.100105 s to 0.1 s, jitter 0.0139 s",
    ),
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


@pytest.mark.parametrize(("arguments", "values", "masked", "told"), REPAIRED.values(), ids=REPAIRED)
def test_a_repair_is_made_and_told(
    tmp_path: Path, arguments: dict[str, Any], values: list[float], masked: list[int], told: str
) -> None:
    trace = make(tmp_path, **arguments)
    np.testing.assert_allclose(trace["u"], values, atol=1e-9)
    assert np.flatnonzero(~trace.usable_samples).tolist() == masked
    assert told in trace.provenance
    assert trace.provenance[0].startswith("read from run.csv (SHA-256 ")


def test_every_repair_has_its_test() -> None:
    tested = {key for arguments, *_ in REPAIRED.values() for key in arguments.get("repairs", {})}
    assert tested == set(RepairOptions.model_fields) - {"ragged"}  # ragged is the CSV reader's


def test_clean_samples_pass_unchanged(tmp_path: Path) -> None:
    values = np.random.default_rng(1).normal(size=N).tolist()
    trace = make(tmp_path, values=values)
    assert trace["u"].tolist() == values
    assert (trace.start_time, trace.usable, len(trace.provenance)) == (0.0, None, 1)


def test_repairs_that_are_not_needed_change_nothing(tmp_path: Path) -> None:
    every = {
        "stamps": "drop", "backward": "sort", "duplicates": "average", "gaps": "mask", "nan": "mask",
        "jitter": "resample", "constant": "accept",
    }  # fmt: skip
    plain, repaired = make(tmp_path), make(tmp_path, repairs=every, grid={"method": "linear"})
    assert repaired.digest == plain.digest
    assert repaired.provenance == plain.provenance


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


def test_a_record_on_change_is_held(tmp_path: Path) -> None:
    stamps = [0.0, 0.1, 0.5, 0.6, 2.0, 2.1, 2.2, 2.9, 3.0, 4.0]
    trace = make(
        tmp_path,
        stamps=stamps,
        grid={"method": "hold", "longest_step": 10.0},
        repairs={"jitter": "resample"},
    )
    expected = [max(i for i, s in enumerate(stamps) if s <= t + 1e-9) for t in trace.time]
    assert trace["u"].tolist() == expected


def test_gauge_and_absolute_are_told_apart(tmp_path: Path) -> None:
    absolute = make(
        tmp_path, unit="kPa", reference=Reference.ABSOLUTE, channel=PSI, values=[101.325 + i for i in range(N)]
    )
    np.testing.assert_allclose(absolute["u"], 0.1450377 * np.arange(N), atol=1e-5)
    declared = make(tmp_path, unit="kPa", channel=PSI, files={"references": "gauge"})
    np.testing.assert_allclose(declared["u"], 0.1450377 * np.arange(N), atol=1e-5)


@given(
    st.floats(0.0, 0.3),
    st.sampled_from(["linear", "hold"]),
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.1, 0.05, 0.25]),
)
def test_a_jittered_line_resampled_is_the_line(
    tmp_path_factory: pytest.TempPathFactory, share: float, method: str, seed: int, sample_time: float
) -> None:
    noise = 0.1 * share * np.random.default_rng(seed).uniform(-0.5, 0.5, 60)
    stamps = 0.1 * np.arange(60) + noise
    trace = make(
        tmp_path_factory.mktemp("line"),
        stamps=stamps.tolist(),
        values=(7.0 - 3.0 * stamps).tolist(),
        sample_time=sample_time,
        grid={"method": method},
        repairs={"jitter": "resample"},
    )
    lag = 0.0 if method == "linear" else 3.0 * 0.1 * (1.0 + share) + 1e-9
    error = trace["u"] - (7.0 - 3.0 * trace.time)
    # within the tolerance of the grid, stamps are taken as lying on it
    slack = 3.0 * 0.011 * sample_time
    assert error.min() >= -slack
    assert error.max() <= lag + slack
