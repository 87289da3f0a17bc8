"""What we write, we read back exactly."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ConfigError, TraceError, UserError
from sysid.ingest import FileOptions, load_dataset, read_trace, write_csv, write_parquet, write_trace
from sysid.traces import Channel, Trace
from sysid.units import Reference

FINITE = st.floats(allow_nan=False, allow_infinity=False, width=64)
WRITERS = [pytest.param(write_csv, ".csv", id="csv"), pytest.param(write_parquet, ".parquet", id="parquet")]


def everything(trace: Trace) -> tuple[object, ...]:
    return (trace.digest, trace.name, trace.channels, trace.provenance, trace.usable is None)


@st.composite
def traces(draw: st.DrawFn) -> Trace:
    names = draw(
        st.lists(st.text("abcXYZ äπ_[]()-.,;\"'#", min_size=1, max_size=8), min_size=1, max_size=3, unique=True)
    )
    names = [name for name in names if name == name.strip()] or ["u"]
    count = draw(st.integers(1, 12))
    values = [[draw(FINITE) for _ in names] for _ in range(count)]
    mask = draw(st.none() | st.lists(st.booleans(), min_size=count, max_size=count))
    channels = [
        Channel(
            name=name,
            unit=draw(st.sampled_from(["kPa", "1", "V", "m/s^2"])),
            reference=draw(st.sampled_from(list(Reference))),
            description=draw(st.text(max_size=10)),
        )
        for name in names
    ]
    return Trace(
        name=draw(st.text(max_size=8)),
        sample_time=draw(st.floats(1e-6, 1e6)),
        start_time=draw(st.floats(-1e9, 1e9)),
        channels=tuple(channels),
        values=np.array(values),
        usable=None if mask is None else np.array(mask),
        provenance=tuple(draw(st.lists(st.text(max_size=20), max_size=3))),
    )


@pytest.mark.parametrize(("writer", "ending"), WRITERS)
@given(trace=traces())
def test_any_trace_comes_back_as_it_was(
    tmp_path_factory: pytest.TempPathFactory, writer: Callable[[Trace, Path], Path], ending: str, trace: Trace
) -> None:
    path = writer(trace, tmp_path_factory.mktemp("out") / f"trace{ending}")
    assert everything(read_trace(path)) == everything(trace)


TRACE = Trace(
    name="RUN",
    sample_time=0.1,
    start_time=3.7,
    channels=(Channel(name="BP", unit="psi", reference=Reference.GAUGE), Channel(name="u", unit="1")),
    values=np.random.default_rng(5).normal(size=(40, 2)),
    usable=np.arange(40) % 9 != 4,
)


@pytest.mark.parametrize(("writer", "ending"), WRITERS)
def test_a_data_set_reads_it_too_with_the_mask(
    tmp_path: Path, writer: Callable[[Trace, Path], Path], ending: str
) -> None:
    writer(TRACE, tmp_path / f"run{ending}")
    (tmp_path / "dataset.yaml").write_text(
        "{name: a, sample_time: 0.1, channels: [{name: BP, unit: psi, reference: gauge}, {name: u, unit: 1}], "
        f"source: {{files: {{}}}}, cases: {{RUN: {{role: test, file: run{ending}}}}}}}"
    )
    assert load_dataset(tmp_path)["RUN"].digest == TRACE.digest


def test_a_file_changed_since_is_read_for_what_it_says(tmp_path: Path) -> None:
    path = write_csv(TRACE, tmp_path / "run.csv")
    lines = path.read_text().splitlines()
    cells = lines[5].split(",")
    path.write_text("\n".join([*lines[:5], ",".join([cells[0], "99.0", *cells[2:]]), *lines[6:]]))
    changed = read_trace(path)
    assert changed["BP"][3] == 99.0
    assert changed.channel_names == TRACE.channel_names
    np.testing.assert_array_equal(changed.usable_samples, TRACE.usable_samples)
    assert changed.provenance[0].startswith("read from run.csv")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("u [1]", "u [V]", ["BP [psi gauge]", "u [V]"]),
        ("u [1]", "valve [1]", ["BP [psi gauge]", "valve [1]"]),
        ("psi gauge", "psi absolute", ["BP [psi absolute]", "u [1]"]),
    ],
)
def test_a_header_corrected_since_counts(tmp_path: Path, old: str, new: str, said: list[str]) -> None:
    """The remark above it had counted, without a word."""
    path = write_csv(dataclasses.replace(TRACE, usable=None), tmp_path / "run.csv")
    remark, header, *rows = path.read_text().splitlines()
    path.write_text("\n".join([remark, header.replace(old, new), *rows]))
    assert [channel.label for channel in read_trace(path).channels] == said


def test_a_row_taken_out_is_a_gap(tmp_path: Path) -> None:
    path = write_csv(TRACE, tmp_path / "run.csv")
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:9] + lines[10:]))
    with pytest.raises(TraceError, match="1 samples are missing"):
        read_trace(path)


def test_a_plain_file_is_a_trace_of_all_its_columns(tmp_path: Path) -> None:
    path = tmp_path / "plain.csv"
    path.write_text("time [ms],BP [kPa],u [V]\n" + "".join(f"{20 * i},{i},{-i}\n" for i in range(15)))
    trace = read_trace(path)
    assert (trace.name, trace.sample_time, trace.channel_names) == ("plain", 0.02, ("BP", "u"))
    wanted = read_trace(path, name="x", channels=[Channel(name="BP", unit="Pa")])
    assert (wanted.name, wanted["BP"].tolist()) == ("x", [1000.0 * i for i in range(15)])


def test_a_plain_file_without_units_says_how_to_give_them(tmp_path: Path) -> None:
    path = tmp_path / "plain.csv"
    path.write_text("time [s],BP\n" + "".join(f"{i},{i}\n" for i in range(15)))
    with pytest.raises(UserError, match=r"(?s)no unit.*column BP.*'BP \[kPa\]'"):
        read_trace(path)
    assert read_trace(path, files=FileOptions(units="kPa")).channels[0].unit == "kPa"


def test_the_ending_chooses_the_writer(tmp_path: Path) -> None:
    for ending in (".csv", ".parquet"):
        assert everything(read_trace(write_trace(TRACE, tmp_path / f"a{ending}"))) == everything(TRACE)
    with pytest.raises(ConfigError, match=r"(?s)no writer knows.*\.csv or \.parquet.*got: +\.xlsx"):
        write_trace(TRACE, tmp_path / "a.xlsx")


@pytest.mark.parametrize("name", ["time", "usable", " BP", "a\rb"])
def test_a_name_that_would_not_read_back_is_refused(tmp_path: Path, name: str) -> None:
    trace = Trace(name="x", sample_time=1.0, channels=(Channel(name=name, unit="V"),), values=np.zeros((2, 1)))
    with pytest.raises(UserError, match=r"(?s)cannot hold this channel.*\.parquet"):
        write_csv(trace, tmp_path / "a.csv")


@pytest.mark.parametrize(("writer", "ending"), WRITERS)
def test_a_place_that_cannot_be_written_to_is_named(
    tmp_path: Path, writer: Callable[[Trace, Path], Path], ending: str
) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(UserError, match=r"(?s)cannot be written.*choose another place"):
        writer(TRACE, tmp_path / "file" / f"a{ending}")


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_csv(TRACE, tmp_path / "run.csv")
    old = path.read_bytes()

    def full(*args: object, **kwargs: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(UserError, match="No space left"):
        write_csv(TRACE, path)
    assert path.read_bytes() == old
    assert [file.name for file in tmp_path.iterdir()] == ["run.csv"]


@pytest.mark.parametrize(("unit", "plain"), [("%", "percent"), ("m3/h", "m^3/h"), ("Deg C", "degC"), ("Volts", "V")])
def test_a_unit_as_people_write_it_is_written_and_read(tmp_path: Path, unit: str, plain: str) -> None:
    """A channel in % was refused, with the advice to rename it."""
    channels = (Channel(name="u", unit=unit),)
    trace = Trace(name="a", sample_time=1.0, channels=channels, values=np.arange(20.0)[:, None])
    assert read_trace(write_csv(trace, tmp_path / "a.csv")).channels == channels
    assert read_trace(write_csv(trace, tmp_path / "b.csv", plain=True)).channels[0].unit == plain
