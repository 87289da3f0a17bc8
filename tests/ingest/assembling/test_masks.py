"""Stretches of time that are masked: as if their cells were empty, through every door, or it is said why not."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray

import sysid
from sysid.errors import ConfigError, TraceError, UserError
from sysid.ingest import FileOptions, RepairOptions, load_dataset, read_trace, write_csv
from sysid.traces import Trace
from sysid.workbench.commands.reader_options import reading_options, take_options

Array = NDArray[np.float64]
N = 60
STRETCHES = [{"channel": "y", "start": 1.25, "stop": 1.6}, {"start": 4.0, "stop": 4.5}]
HIDDEN = {"u": np.r_[16:19], "y": np.r_[5, 6, 16:19]}


def signals(n: int = N) -> dict[str, Array]:
    rng = np.random.default_rng(5)
    return {"u": np.round(rng.normal(size=n), 3), "y": np.round(rng.normal(size=n), 3)}


def written(
    folder: Path, columns: dict[str, Array] | None = None, *, name: str = "run.csv", first: float = 0.0
) -> Path:
    columns = signals() if columns is None else columns
    rows = zip(*columns.values(), strict=True)
    cells = [",".join("" if np.isnan(cell) else f"{cell:.17g}" for cell in row) for row in rows]
    head = ",".join(f"{name} [V]" for name in columns)
    lines = [f"{first + 0.25 * k:.2f},{one}" for k, one in enumerate(cells)]
    path = folder / name
    path.write_text("\n".join([f"t [s],{head}", *lines]) + "\n")
    return path


def described(folder: Path, repairs: str, cases: str = "  A: {role: estimation, file: run.csv}") -> Path:
    path = folder / "dataset.yaml"
    path.write_text(
        "name: x\nsample_time: 0.25\nchannels: [{name: u, unit: V}, {name: y, unit: V}]\n"
        f"source:\n  files: {{}}\n  repairs: {repairs}\ncases:\n{cases}\n"
    )
    return path


YAML = "{mask: [{channel: y, start: 1.25, stop: 1.6}, {start: 4.0, stop: 4.5}]}"


def typed(folder: Path) -> Trace:
    """As ``sysid simulate FILE --repairs mask=...`` is read, one stretch an option."""
    words = [f"--repairs=mask={one}" for one in ("{channel: y, start: 1.25, stop: 1.6}", "{start: 4.0, stop: 4.5}")]
    options = reading_options(take_options(words, whole=True)[0])
    return read_trace(written(folder), repairs=options["repairs"])


DOORS: dict[str, Callable[[Path], Trace]] = {
    "dataset.yaml": lambda folder: (written(folder), load_dataset(described(folder, YAML)).traces[0])[1],
    "sysid.load": lambda folder: (written(folder), sysid.load(described(folder, YAML)).traces[0])[1],
    "read_trace": lambda folder: read_trace(written(folder), repairs=RepairOptions.model_validate({"mask": STRETCHES})),
    "sysid.data": lambda _: sysid.data(
        signals(), inputs="u", outputs="y", units="V", sample_time=0.25, repairs={"mask": STRETCHES}
    ).traces[0],
    "the command line": typed,
}


@pytest.mark.parametrize("door", DOORS)
def test_every_door_masks_the_same_samples(tmp_path: Path, door: str) -> None:
    trace = DOORS[door](tmp_path)
    for name, rows in HIDDEN.items():
        assert np.flatnonzero(~trace.usable_of([name])).tolist() == rows.tolist()
    empty = {name: np.where(np.isin(np.arange(N), HIDDEN[name]), np.nan, one) for name, one in signals().items()}
    other = read_trace(written(tmp_path, empty, name="empty.csv"), repairs=RepairOptions(nan="mask"))
    assert trace.digest == other.digest
    assert "y: 2 samples masked, from 1.25 s to 1.6 s" in trace.provenance
    assert not any("missing values" in one for one in trace.provenance)


@given(
    ends=st.lists(st.tuples(st.integers(0, N - 1), st.integers(0, 15), st.sampled_from(["u", "y", None])), max_size=4),
    grid=st.sampled_from([{}, {"method": "average"}, {"method": "linear"}, {"method": "hold"}]),
)
@example(ends=[(N - 1, 0, "y")], grid={"method": "average"})
@example(ends=[(0, 0, None)], grid={"method": "average"})
def test_a_mask_is_what_empty_cells_are(ends: list[tuple[int, int, str | None]], grid: dict[str, Any]) -> None:
    columns, empty = signals(), signals()
    for first, more, name in ends:
        for one in ("u", "y") if name is None else (name,):
            empty[one][first : first + more + 1] = np.nan
    if any(np.isnan(one).all() for one in empty.values()):
        return
    masks = [
        {"start": 0.25 * first, "stop": 0.25 * (first + more)} | ({"channel": name} if name else {})
        for first, more, name in ends
    ]
    stamps = 0.25 * np.arange(N)

    def made(values: dict[str, Array], repairs: dict[str, Any]) -> str:
        traces = sysid.data(
            {"t": stamps, **values},
            inputs="u",
            outputs="y",
            sample_time=0.5 if grid else 0.25,
            grid=grid,
            repairs=repairs,
        )
        return str(traces.traces[0].digest)

    assert made(columns, {"mask": masks}) == made(empty, {"nan": "mask"})


def test_what_would_be_filled_from_a_masked_value_is_masked_too() -> None:
    """A blank means as before; what was before is wrong, and so is what is put on a line that begins there."""
    u, y = signals().values()
    y[[3, 4, 12, 13, 14]] = np.nan
    for repair, more in {"hold": [12, 13, 14], "interpolate": [12, 13, 14], "mask": [3, 4, 12, 13, 14]}.items():
        masked = {"nan": repair, "mask": {"channel": "y", "start": 10, "stop": 11}}
        trace = sysid.data((u, y), sample_time=1.0, repairs=masked).traces[0]
        assert np.flatnonzero(~trace.usable_of(["y"])).tolist() == sorted([10, 11, *more])
    ends = {"nan": "interpolate", "mask": {"channel": "y", "start": 15, "stop": 16}}
    trace = sysid.data((u, y), sample_time=1.0, repairs=ends).traces[0]
    assert np.flatnonzero(~trace.usable_of(["y"])).tolist() == [12, 13, 14, 15, 16]
    with pytest.raises(TraceError, match="5 values are missing"):
        sysid.data((u, y), sample_time=1.0, repairs={"mask": {"channel": "y", "start": 10, "stop": 11}})


def test_what_a_logger_writes_for_want_of_a_value_is_nothing_where_it_is_masked() -> None:
    u, y = signals().values()
    y[10:12] = -9999.0
    trace = sysid.data((u, y), sample_time=1.0, repairs={"mask": {"channel": "y", "start": 10, "stop": 11}}).traces[0]
    assert trace["y"].min() > -10.0


def test_a_stretch_is_in_the_time_of_the_file_and_in_the_case_that_is_cut_there(tmp_path: Path) -> None:
    written(tmp_path, first=100.0)
    cases = "  A: {role: estimation, file: run.csv, stop: 107}\n  B: {role: test, file: run.csv, start: 107.25}"
    path = described(tmp_path, "{mask: {channel: y, start: 103, stop: 103.3}}", cases)
    a, b = load_dataset(path).traces
    assert a.time[~a.usable_samples].tolist() == [103.0, 103.25]
    assert b.usable is None
    assert load_dataset(path, cases=["B"]).traces[0].digest == b.digest


def test_a_stretch_is_of_the_cases_that_it_names(tmp_path: Path) -> None:
    written(tmp_path)
    written(tmp_path, name="other.csv")
    cases = "  A: {role: estimation, file: run.csv}\n  run 3: {role: test, file: other.csv}"
    a, b = load_dataset(described(tmp_path, "{mask: {start: 3, stop: 3.3, cases: [run 3]}}", cases)).traces
    assert a.usable is None
    assert np.flatnonzero(~b.usable_samples).tolist() == [12, 13]
    masks = {"mask": {"stop": 1.0, "cases": ["b"]}}
    a, b = sysid.data({"a": signals(), "b": signals()}, inputs="u", outputs="y", sample_time=1.0, repairs=masks)
    assert a.usable is None
    assert np.flatnonzero(~b.usable_samples).tolist() == [0, 1]


def test_a_file_of_ours_is_masked_too(tmp_path: Path) -> None:
    write_csv(read_trace(written(tmp_path)), tmp_path / "ours.csv")
    masked = read_trace(tmp_path / "ours.csv", repairs=RepairOptions.model_validate({"mask": {"stop": 0.5}}))
    assert np.flatnonzero(~masked.usable_samples).tolist() == [0, 1, 2]


def dated(folder: Path, zone: str = "") -> Path:
    """The same record a quarter of a minute a row, from 5 March 2024 on."""
    rows = zip(*signals().values(), strict=True)
    stamps = [f"2024-03-05 {10 + k // 240}:{k // 4 % 60:02d}:{15 * (k % 4):02d}{zone}" for k in range(N)]
    lines = [f"{stamp},{u:g},{y:g}" for stamp, (u, y) in zip(stamps, rows, strict=True)]
    path = folder / "run.csv"
    path.write_text("\n".join(["time,u [V],y [V]", *lines]) + "\n")
    return path


ENDS = {"start": "2024-03-05 10:01:15", "stop": "2024-03-05T10:01:45"}
"""Rows 5 to 7 of :func:`dated`."""


def test_dates_end_a_mask_of_calendar_time_by_every_door(tmp_path: Path) -> None:
    path = dated(tmp_path)
    mask = {"channel": "y", **ENDS}
    shown = ", ".join(f"{key}: {value}" for key, value in mask.items())
    described(tmp_path, f"{{mask: [{{{shown}}}]}}")
    yaml = (tmp_path / "dataset.yaml").read_text().replace("sample_time: 0.25", "sample_time: 15")
    (tmp_path / "dataset.yaml").write_text(yaml)
    import pandas as pd

    frame = pd.read_csv(path, index_col="time", parse_dates=True)
    options = reading_options(take_options([f"--repairs=mask={{{shown}}}"], whole=True)[0])
    read = [
        load_dataset(tmp_path / "dataset.yaml").traces[0],
        read_trace(path, repairs=RepairOptions.model_validate({"mask": [mask]})),
        read_trace(path, repairs=options["repairs"]),
        sysid.data(frame, inputs=["u [V]"], outputs=["y [V]"], repairs={"mask": mask}).traces[0],
    ]
    for trace in read:
        assert np.flatnonzero(~trace.usable_of(["y"])).tolist() == [5, 6, 7]
        assert trace.usable_of(["u"]).all()
        assert any("y: 3 samples masked, from 2024-03-05 10:01:15" in note for note in trace.provenance)


def test_a_date_is_of_the_zone_of_its_file_or_refused(tmp_path: Path) -> None:
    path = dated(tmp_path, "+02:00")
    utc = {"start": "2024-03-05 08:01:15+00:00", "stop": "2024-03-05 10:01:45+02:00"}
    trace = read_trace(path, repairs=RepairOptions.model_validate({"mask": utc}))
    assert np.flatnonzero(~trace.usable_samples).tolist() == [5, 6, 7]
    with pytest.raises(ConfigError, match="the file's time has a zone and the date has none"):
        read_trace(path, repairs=RepairOptions.model_validate({"mask": ENDS}))
    with pytest.raises(ConfigError, match="a date has a zone, the file none"):
        read_trace(dated(tmp_path), repairs=RepairOptions.model_validate({"mask": utc}))
    files = FileOptions.model_validate({"time": {"unit": "datetime", "column": "time", "zone": "Europe/Berlin"}})
    berlin = read_trace(dated(tmp_path), files=files, repairs=RepairOptions.model_validate({"mask": ENDS}))
    assert np.flatnonzero(~berlin.usable_samples).tolist() == [5, 6, 7]


REFUSED: dict[str, tuple[Any, type[UserError], str]] = {
    "an unknown channel": ({"channel": "Y", "stop": 1}, ConfigError, r"(?s)names Y, which is not a channel.*mask\[0\]"),
    "an unknown case": ({"stop": 1, "cases": ["b"]}, ConfigError, "(?s)names the case b, which is not there"),
    "outside of the record": ({"start": 90}, ConfigError, "(?s)holds no sample.*from 0 s to 14.75 s.*from 90 s"),
    "outside of its case": ({"start": 90, "cases": ["A"]}, ConfigError, "(?s)holds no sample.*from 0 s to 14.75 s"),
    "between two samples": ({"start": 0.1, "stop": 0.2}, ConfigError, "holds no sample"),
    "everything": ({"channel": "u", "start": 0}, TraceError, "(?s)leaves a channel no value.*channel u.*60 of 60"),
    "stop before start": ({"start": 2, "stop": 1}, ConfigError, "stop is before start"),
    "no ends": ({"channel": "u"}, ConfigError, "a masked stretch has no ends"),
    "a date": ({"start": "2024-03-05 10:00"}, ConfigError, "(?s)a date, and the record's time is no calendar time"),
    "no date": ({"start": "2024-13-05"}, ConfigError, "are seconds, or dates"),
    "two kinds": ({"start": 1, "stop": "2024-03-05"}, ConfigError, "start and stop are of two kinds"),
    "a truth value": ({"start": True}, ConfigError, "the ends of a masked stretch are seconds"),
    "another word": ({"from": 1}, ConfigError, "unknown field 'from'"),
}


@pytest.mark.parametrize(("mask", "kind", "message"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_masked_is_refused_by_every_door(
    tmp_path: Path, mask: dict[str, Any], kind: type[UserError], message: str
) -> None:
    written(tmp_path)
    shown = ", ".join(f"{key}: {value}" for key, value in mask.items()).replace("'", "")
    path = described(tmp_path, f"{{mask: [{{{shown}}}]}}")
    with pytest.raises(kind, match=message) as caught:
        load_dataset(path)
    assert None not in {caught.value.where, caught.value.expected, caught.value.got, caught.value.remedy}
    with pytest.raises(kind, match=message):
        sysid.data({"A": signals()}, inputs="u", outputs="y", sample_time=0.25, repairs={"mask": [mask]})
    with pytest.raises(kind, match=message):
        words = [f"--repairs=mask={{{shown}}}"]
        read_trace(tmp_path / "run.csv", name="A", **reading_options(take_options(words, whole=True)[0]))


def test_an_end_may_be_a_duration_in_python_and_a_clock_may_count_from_1970() -> None:
    columns = {"time": 1709632800.0 + 0.1 * np.arange(N), **signals()}
    ends = {"start": timedelta(seconds=1709632801), "stop": 1709632801.2}
    trace = sysid.data(columns, inputs="u", outputs="y", repairs={"mask": ends}).traces[0]
    assert np.flatnonzero(~trace.usable_samples).tolist() == [10, 11, 12]


def test_a_resampled_stretch_hides_every_sample_that_it_has_a_part_in() -> None:
    columns = {"t": 0.25 * np.arange(N), **signals()}
    trace = sysid.data(
        columns, inputs="u", outputs="y", sample_time=1.0, grid={"method": "average"}, repairs={"mask": STRETCHES}
    ).traces[0]
    assert trace.time[~trace.usable_of(["y"])].tolist() == [1.0, 4.0]
