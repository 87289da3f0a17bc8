"""The contract of every reader: the same signal in any format is the same trace set."""

from __future__ import annotations

import builtins
import gc
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ChannelError, ConfigError, MissingExtraError, ReaderError
from sysid.ingest import READERS, FileOptions, RepairOptions, load_dataset, read_table

TIME = 0.05 * np.arange(40)
PIPE = 500.0 + 10.0 * np.sin(TIME)
VOLT = np.cos(3.0 * TIME) / 3.0


def _csv(path: Path) -> None:
    rows = [f"{t!r},{p!r},{v!r}" for t, p, v in zip(TIME.tolist(), PIPE.tolist(), VOLT.tolist(), strict=True)]
    path.write_text("\n".join(["time [s],BP [kPa gauge],u [V]", *rows]))


def _csv_european(path: Path) -> None:
    cells = zip(TIME.tolist(), PIPE.tolist(), VOLT.tolist(), strict=True)
    rows = [f"{t!r};{p!r};{v!r}".replace(".", ",") for t, p, v in cells]
    text = "\r\n".join(["# made on the rig", "Zeit (s);BP;u", "s;kPa gauge;V", *rows])
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())


def _csv_tabs(path: Path) -> None:
    rows = [f"{t!r}\t{p!r}\t{v!r}\t" for t, p, v in zip(TIME.tolist(), PIPE.tolist(), VOLT.tolist(), strict=True)]
    path.write_text("\n".join(["t [s]\tBP [kPa gauge]\tu [V]\t", *rows, "", ""]), encoding="utf-16")


def _parquet(path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    metadata = [{"unit": "s"}, {"unit": "kPa", "reference": "gauge"}, {"unit": "V"}]
    fields = [pa.field(n, pa.float64(), metadata=m) for n, m in zip(("time", "BP", "u"), metadata, strict=True)]
    parquet.write_table(pa.table([TIME, PIPE, VOLT], schema=pa.schema(fields)), path)


def _mat5(path: Path) -> None:
    from scipy.io import savemat

    units = {"t": "s", "BP": "kPa gauge", "u": "V"}
    savemat(path, {"run": {"t": TIME[:, None], "BP": PIPE[:, None], "u": VOLT[:, None], "units": units}})


def _mat73(path: Path) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        run = file.create_group("run")
        run.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in (("t", TIME), ("BP", PIPE), ("u", VOLT)):
            run.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
        units = run.create_group("units")
        units.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, text in (("t", "s"), ("BP", "kPa gauge"), ("u", "V")):
            codes = np.array([[ord(c)] for c in text], dtype=np.uint16)
            units.create_dataset(name, data=codes).attrs["MATLAB_class"] = np.bytes_("char")
    _mark_as_mat73(path)


def _mark_as_mat73(path: Path) -> None:
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, made for a test".ljust(124) + b"\x00\x02IM")


def _hdf5(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        for name, values, unit in (("time", TIME, "s"), ("BP", PIPE, "kPa"), ("u", VOLT, "V")):
            file.create_dataset(name, data=values).attrs["units"] = unit
        file["BP"].attrs["reference"] = "gauge"


def _mdf4(path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append(
            [
                Signal(PIPE, TIME, name="BP", unit="kPa gauge"),
                Signal(VOLT, TIME, name="u", unit="V"),
            ]
        )
        file.save(path, overwrite=True)


def _tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as file:
        file.write_segment(
            [
                ChannelObject("rig", "BP", PIPE, properties={"unit_string": "kPa gauge", "wf_increment": 0.05}),
                ChannelObject("rig", "u", VOLT, properties={"unit_string": "V", "wf_increment": 0.05}),
            ]
        )


# reader, file name, writer: one row or more per reader
CONTRACT = [
    pytest.param("csv", "run.csv", _csv, id="csv"),
    pytest.param("csv", "run.txt", _csv_european, id="csv: BOM, CRLF, comment, decimal comma, units line"),
    pytest.param("csv", "run.tsv", _csv_tabs, id="csv: tabs, UTF-16, separators at the ends of lines"),
    pytest.param("parquet", "run.parquet", _parquet, id="parquet"),
    pytest.param("matlab", "run.mat", _mat5, id="matlab 5"),
    pytest.param("matlab", "run.mat", _mat73, id="matlab 7.3"),
    pytest.param("hdf5", "run.h5", _hdf5, id="hdf5"),
    pytest.param("mdf4", "run.mf4", _mdf4, id="mdf4"),
    pytest.param("tdms", "run.tdms", _tdms, id="tdms"),
]

DESCRIPTION = """
name: contract
sample_time: 0.05
channels:
  - {name: BP, unit: bar, reference: absolute}
  - {name: drive, unit: mV}
source: {files: {columns: {drive: u}}}
cases:
  RUN: {role: estimation, file: %s}
"""


@pytest.mark.parametrize(("reader", "name", "writer"), CONTRACT)
def test_the_same_signal_in_any_format_is_the_same_trace(
    tmp_path: Path, reader: str, name: str, writer: Callable[[Path], None]
) -> None:
    writer(tmp_path / name)
    (tmp_path / "dataset.yaml").write_text(DESCRIPTION % name)
    assert read_table(tmp_path / name).reader == reader
    trace = load_dataset(tmp_path)["RUN"]
    assert trace.channel_names == ("BP", "drive")
    assert len(trace) == len(TIME)
    assert (trace.sample_time, trace.start_time) == (0.05, 0.0)
    np.testing.assert_allclose(trace["BP"], PIPE / 100.0 + 1.01325, rtol=1e-14)
    np.testing.assert_allclose(trace["drive"], VOLT * 1000.0, rtol=1e-14)
    assert "BP: converted from kPa gauge to bar absolute" in trace.provenance


def test_every_reader_stands_in_the_contract() -> None:
    assert {row.values[0] for row in CONTRACT} == {reader.name for reader in READERS}


def test_no_two_readers_claim_one_suffix() -> None:
    suffixes = [suffix for reader in READERS for suffix in reader.suffixes]
    assert len(set(suffixes)) == len(suffixes)


@pytest.mark.parametrize("name", [row.values[1] for row in CONTRACT], ids=[str(row.id) for row in CONTRACT])
@pytest.mark.parametrize("content", [b"", b"\x00\x01\x02not what it says\x00" * 40], ids=["empty", "garbage"])
def test_a_file_that_is_not_what_its_ending_says_is_refused(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ReaderError, match="remedy"):
        read_table(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "writer"),
    [pytest.param(*row.values[1:], id=str(row.id)) for row in CONTRACT if row.values[0] != "csv"],
)
@pytest.mark.filterwarnings("ignore:.*MDF4.__del__:pytest.PytestUnraisableExceptionWarning")
def test_a_file_that_breaks_off_is_refused_or_read_as_far_as_it_goes(
    tmp_path: Path, name: str, writer: Callable[[Path], None]
) -> None:
    writer(tmp_path / name)
    raw = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(raw[: len(raw) // 2])
    try:
        table = read_table(tmp_path / name)
    except ReaderError as error:
        assert error.remedy
    else:
        # TDMS is written in segments so that what a crash leaves is still there.
        assert name.endswith(".tdms")
        np.testing.assert_array_equal(table.find("BP").values, PIPE[: len(table)])
        assert any("breaks off" in note for note in table.notes)
    gc.collect()  # asammdf leaves a half-made object behind whose end prints a complaint: let it end here


@pytest.mark.parametrize(
    ("package", "extra", "name"), [("asammdf", "mdf", "run.mf4"), ("nptdms", "tdms", "run.tdms")], ids=["mdf", "tdms"]
)
def test_a_missing_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, package: str, extra: str, name: str
) -> None:
    (tmp_path / name).write_bytes(b"anything")
    real = builtins.__import__

    def without(module: str, *args: object, **kwargs: object) -> object:
        if module.split(".", maxsplit=1)[0] == package:
            raise ImportError(module)
        return real(module, *args, **kwargs)  # type: ignore[arg-type]  # passed on unchanged

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingExtraError, match=rf"sysid-workbench\[{extra}\]"):
        read_table(tmp_path / name)


def test_an_unknown_ending_names_the_known_ones(tmp_path: Path) -> None:
    (tmp_path / "run.xyz").write_text("t [s],u [V]\n0,1\n1,2\n")
    with pytest.raises(ReaderError, match=r"(?s)\.csv.*\.mat.*got: +\.xyz.*name the reader"):
        read_table(tmp_path / "run.xyz")
    assert read_table(tmp_path / "run.xyz", files=FileOptions(reader="csv")).names == ("t", "u")


def test_a_missing_file_says_where_paths_start(tmp_path: Path) -> None:
    with pytest.raises(ReaderError, match="relative to that file"):
        read_table(tmp_path / "none.csv")


def test_an_option_of_another_format_is_refused(tmp_path: Path) -> None:
    _hdf5(tmp_path / "run.h5")
    with pytest.raises(ConfigError, match=r"(?s)separator means nothing for a hdf5 file.*group"):
        read_table(tmp_path / "run.h5", files=FileOptions(separator=";"))


def _opaque_mat5(path: Path) -> None:
    """A MATLAB 5 file with an object in it, byte by byte (MAT-File Format, class 17)."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data.ljust(-(-len(data) // 8) * 8, b"\0")

    reference = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 6, 1)) + element(1, b"")
    reference += element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1))
    body = element(6, struct.pack("<II", 17, 0))
    body += element(1, b"ts") + element(1, b"MCOS") + element(1, b"timeseries") + element(14, reference)
    head = b"MATLAB 5.0 MAT-file, made for a test".ljust(116) + b"\0" * 8 + b"\x00\x01IM"
    path.write_bytes(head + element(14, body))


def _opaque_mat73(path: Path) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        item = file.create_dataset("ts", data=np.array([[0xDD000000, 2, 1, 1, 1, 1]], dtype=np.uint32))
        item.attrs["MATLAB_class"] = np.bytes_("timeseries")
        item.attrs["MATLAB_object_decode"] = np.int32(3)
    _mark_as_mat73(path)


@pytest.mark.parametrize("writer", [_opaque_mat5, _opaque_mat73], ids=["5", "7.3"])
def test_a_matlab_object_is_refused_with_the_line_that_exports_it(
    tmp_path: Path, writer: Callable[[Path], None]
) -> None:
    writer(tmp_path / "run.mat")
    with pytest.raises(ReaderError, match=r"(?s)only MATLAB can read.*ts\.Time"):
        read_table(tmp_path / "run.mat")


def test_a_matlab_object_beside_plain_arrays_does_no_harm_until_it_is_asked_for(tmp_path: Path) -> None:
    import h5py

    _opaque_mat73(tmp_path / "run.mat")
    with h5py.File(tmp_path / "run.mat", "a") as file:
        for name, values in (("t", TIME), ("u", VOLT)):
            file.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
    table = read_table(tmp_path / "run.mat")
    np.testing.assert_array_equal(table.find("u").values, VOLT)
    with pytest.raises(ReaderError, match="ts is a MATLAB object"):
        table.find("ts")


def test_simulinks_structure_with_time_is_understood(tmp_path: Path) -> None:
    from scipy.io import savemat

    signals = np.array([{"values": PIPE, "label": "BP"}, {"values": VOLT, "label": ""}], dtype=object)
    savemat(tmp_path / "run.mat", {"out": {"time": TIME, "signals": list(signals)}})
    table = read_table(tmp_path / "run.mat")
    assert (table.time, table.names) == ("time", ("time", "BP", "signal_2"))
    np.testing.assert_array_equal(table.find("BP").values, PIPE)


def test_a_column_of_another_length_is_refused_only_when_asked_for(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"t": TIME, "u": VOLT, "short": VOLT[:7]})
    table = read_table(tmp_path / "run.mat")
    assert len(table) == len(TIME)
    with pytest.raises(ReaderError, match=r"(?s)expected: 40 samples.*got: +7 samples"):
        table.find("short")


def test_a_matrix_becomes_numbered_columns(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"t": TIME, "p": np.column_stack([PIPE, VOLT])})
    table = read_table(tmp_path / "run.mat")
    assert table.names == ("t", "p_1", "p_2")
    np.testing.assert_array_equal(table.find("p_2").values, VOLT)


def test_hdf5_groups_are_chosen_by_name(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "run.h5", "w") as file:
        for group, factor in (("a", 1.0), ("b", 2.0)):
            file[f"{group}/time"], file[f"{group}/u"] = TIME, factor * VOLT
        file["text"] = "a remark"
    table = read_table(tmp_path / "run.h5", files=FileOptions(group="b"))
    np.testing.assert_array_equal(table.find("u").values, 2.0 * VOLT)
    with pytest.raises(ReaderError, match=r"(?s)no group c.*one of a, b"):
        read_table(tmp_path / "run.h5", files=FileOptions(group="c"))


def test_hdf5_tables_give_a_column_per_field(tmp_path: Path) -> None:
    import h5py

    table = np.zeros(5, dtype=[("time", "f8"), ("u", "i4")])
    table["time"], table["u"] = np.arange(5) / 10, np.arange(5)
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["log"] = table
    assert read_table(tmp_path / "run.h5").find("u").values.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_mdf4_groups_with_different_time_bases_must_be_chosen(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append([Signal(PIPE, TIME, name="BP", unit="kPa")], acq_name="slow")
        file.append([Signal(VOLT[:9], 2.0 * TIME[:9], name="u", unit="V")], acq_name="fast")
        file.save(tmp_path / "run.mf4", overwrite=True)
    with pytest.raises(ReaderError, match=r"(?s)different time stamps.*slow \(40 samples\), fast \(9 samples\)"):
        read_table(tmp_path / "run.mf4")
    table = read_table(tmp_path / "run.mf4", files=FileOptions(group="fast"))
    np.testing.assert_array_equal(table.find("u").values, VOLT[:9])


def test_tdms_groups_must_be_chosen(tmp_path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(tmp_path / "run.tdms") as file:
        file.write_segment([ChannelObject("a", "time", TIME), ChannelObject("a", "u", VOLT)])
        file.write_segment([ChannelObject("b", "time", TIME), ChannelObject("b", "u", PIPE)])
    with pytest.raises(ReaderError, match=r"(?s)several groups.*one of a, b"):
        read_table(tmp_path / "run.tdms")
    table = read_table(tmp_path / "run.tdms", files=FileOptions(group="b"))
    np.testing.assert_array_equal(table.find("u").values, PIPE)


def test_parquet_calendar_time_becomes_seconds(tmp_path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    stamps = np.datetime64("2024-05-01T10:00:00") + (1000 * TIME).round().astype("timedelta64[ms]")
    parquet.write_table(pa.table({"time": stamps, "u": VOLT, "remark": ["x"] * len(TIME)}), tmp_path / "run.parquet")
    table = read_table(tmp_path / "run.parquet")
    assert table.find("time").unit == "s"
    np.testing.assert_allclose(table.find("time").values, TIME, atol=1e-12)
    with pytest.raises(ReaderError, match="not numeric"):
        table.find("remark")


def test_parquet_nulls_are_missing_values(tmp_path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    parquet.write_table(pa.table({"t": [0.0, 1.0, 2.0], "n": pa.array([1, None, 3])}), tmp_path / "run.parquet")
    np.testing.assert_array_equal(read_table(tmp_path / "run.parquet").find("n").values, [1.0, np.nan, 3.0])


def test_integers_beyond_float64_are_refused_not_rounded(tmp_path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    parquet.write_table(pa.table({"t": [0.0, 1.0], "n": [2**60 + 1, 5]}), tmp_path / "run.parquet")
    with pytest.raises(ReaderError, match="53 bits"):
        read_table(tmp_path / "run.parquet").find("n")


def test_a_pickle_is_never_opened(tmp_path: Path) -> None:
    import pickle

    class Bomb:
        def __reduce__(self) -> tuple[Callable[[Path], None], tuple[Path]]:
            return Path.touch, (tmp_path / "exploded",)

    bomb = pickle.dumps({"t": Bomb()})
    for reader in READERS:
        path = tmp_path / f"bomb{reader.suffixes[0]}"
        path.write_bytes(bomb)
        with pytest.raises(ReaderError):
            read_table(path)
    assert not (tmp_path / "exploded").exists()


def test_two_columns_of_one_name_are_refused(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("t [s],p [bar],p [psi]\n0,1,2\n1,2,3\n")
    with pytest.raises(ReaderError, match=r"(?s)two columns are named p.*names: "):
        read_table(tmp_path / "run.csv")
    named = read_table(tmp_path / "run.csv", files=FileOptions(names=("t [s]", "p [bar]", "q [psi]")))
    assert named.names == ("t", "p", "q")


def test_a_missing_column_is_guessed_at(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("t [s],P_pipe [bar]\n0,1\n1,2\n")
    with pytest.raises(ChannelError, match="did you mean P_pipe"):
        read_table(tmp_path / "run.csv").find("P_pip")


def test_ragged_rows_are_dropped_on_request_and_told(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("t [s],u [V]\n0,1\n1\n2,3,4\n3,4\n")
    with pytest.raises(ReaderError, match=r"(?s)2 rows.*line 3.*expected: 2 cells.*ragged: drop"):
        read_table(tmp_path / "run.csv")
    table = read_table(tmp_path / "run.csv", repairs=RepairOptions(ragged="drop"))
    assert table.find("u").values.tolist() == [1.0, 4.0]
    assert table.notes == ("2 ragged rows dropped, first at line 3",)
