"""What is wrong with the samples of a record: refused, and repaired where that repair was asked for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ConfigError, TraceError, UserError
from sysid.ingest import RepairOptions
from sysid.ingest.assembling.record import Record
from sysid.ingest.assembling.repairs import drifts, repeated_values
from sysid.ingest.memory.memory_table import table_of
from tests.ingest.assembling.one_channel import EVEN, NAN, Done, N, Refused, check_done, check_refused, make, ramp

GAP = EVEN[:5] + EVEN[8:]
DUPLICATE = [*EVEN[:5], EVEN[4], *EVEN[5:]]
BACKWARD = [*EVEN[:5], EVEN[6], EVEN[5], *EVEN[7:]]
JITTER = [t + (0.02 if i % 3 == 1 else 0.0) for i, t in enumerate(EVEN)]
MIDDLE = (N - 1) / 2
HOLE = [*map(float, range(5)), NAN, NAN, *map(float, range(7, N))]

REFUSED: dict[str, Refused] = {
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
        r"1 time stamp steps back.*sample 6 \(line 8\).*after 0\.6 s.*0\.5 s.*backward: sort",
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
    "missing values": (
        {"values": HOLE},
        TraceError,
        r"2 values are missing.*channel u, sample 5 \(line 7\).*finite.*nan.*nan: interpolate.*nan: mask",
    ),
    "infinite values": (
        {"values": [float("inf"), *map(float, range(1, N))]},
        TraceError,
        r"a value is missing.*sample 0.*finite.*got: +inf",
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
}


@pytest.mark.parametrize(("arguments", "kind", "message"), REFUSED.values(), ids=REFUSED)
def test_a_problem_is_refused_with_its_remedy(
    tmp_path: Path, arguments: dict[str, Any], kind: type[UserError], message: str
) -> None:
    check_refused(tmp_path, arguments, kind, message)


REPAIRED: dict[str, Done] = {
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
    "marks: missing": (
        {"values": [*range(5), -9999, *range(6, N)], "repairs": {"marks": "missing", "nan": "interpolate"}},
        ramp(),
        [],
        "u: -9999 taken for missing, 1 values",
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
    "mask": (
        {"values": [*range(5), 99, 99, *range(7, N)], "repairs": {"mask": {"channel": "u", "start": 0.5, "stop": 0.6}}},
        ramp(),
        [5, 6],
        "u: 2 samples masked, from 0.5 s to 0.6 s",
    ),
    "mask, up to the end": (
        {"values": [*range(N - 2), 99, -9999], "repairs": {"mask": [{"start": (N - 2) * 0.1}]}},
        [*range(N - 2), N - 3, N - 3],
        [N - 2, N - 1],
        f"all channels: 2 samples masked, from {(N - 2) * 0.1:.15g} s",
    ),
    "repeats: mask": (
        {"values": [x - x % 3 for x in range(N)], "repairs": {"repeats": {"u": "mask"}}},
        [x - x % 3 for x in range(N)],
        [x for x in range(N) if x % 3],
        f"u: {sum(x % 3 > 0 for x in range(N))} values that repeat the one before masked",
    ),
    "drift: line": (
        {"values": [0.5 * x + (x - MIDDLE) ** 2 for x in range(N)], "repairs": {"drift": {"u": "line"}}},
        [0.5 * MIDDLE + (x - MIDDLE) ** 2 for x in range(N)],
        [],
        "u: a straight line of 5 a second taken off, its mean left",
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
}


@pytest.mark.parametrize(("arguments", "values", "masked", "told"), REPAIRED.values(), ids=REPAIRED)
def test_a_repair_is_made_and_told(
    tmp_path: Path, arguments: dict[str, Any], values: list[float], masked: list[int], told: str
) -> None:
    check_done(tmp_path, arguments, values, masked, told)


def test_every_repair_has_its_test() -> None:
    tested = {key for arguments, *_ in REPAIRED.values() for key in arguments.get("repairs", {})}
    assert tested == set(RepairOptions.model_fields) - {"ragged"}  # ragged is the CSV reader's


def test_repairs_that_are_not_needed_change_nothing(tmp_path: Path) -> None:
    every = {
        "stamps": "drop", "backward": "sort", "duplicates": "average", "gaps": "mask", "nan": "mask",
        "jitter": "resample", "constant": "accept",
    }  # fmt: skip
    plain, repaired = make(tmp_path), make(tmp_path, repairs=every, grid={"method": "linear"})
    assert repaired.digest == plain.digest
    assert repaired.provenance == plain.provenance


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


@pytest.mark.parametrize("repair", [drifts, repeated_values])
def test_samples_of_which_nothing_is_asked_are_not_copied(repair: Any) -> None:
    values, stamps = np.arange(6.0).reshape(3, 2), np.arange(3.0)
    columns = {"u": values[:, 0], "y": values[:, 1]}
    marked = np.zeros((3, 2), dtype=np.bool_)
    record = Record(
        table=table_of(columns, name="record"), stamps=stamps, names=("u", "y"), values=values, marked=marked
    )
    assert repair(record, RepairOptions()) is record
