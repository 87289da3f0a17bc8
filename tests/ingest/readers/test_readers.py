"""The contract of every reader: the same signal in any format is the same trace set."""

from __future__ import annotations

import gc
import logging
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ChannelError, ConfigError, MissingExtraError, ReaderError
from sysid.ingest import READERS, FileOptions, load_dataset, read_table
from sysid.ingest.readers import choose_reader, read_with
from sysid.ingest.readers.reader import silent
from sysid.ingest.tables.options import RepairOptions
from sysid.ingest.tables.table import RawTable
from tests.ingest.recordings import (
    PIPE,
    TIME,
    VOLT,
    write_codesys,
    write_comtrade,
    write_csv,
    write_csv_european,
    write_csv_tabs,
    write_excel,
    write_feather,
    write_hdf5,
    write_json,
    write_json_lines,
    write_lvm,
    write_mat5,
    write_mat73,
    write_mdf4,
    write_npy,
    write_npz,
    write_parquet,
    write_spice,
    write_tdms,
)

# reader, file name, writer: one row or more per reader
CONTRACT = [
    pytest.param("csv", "run.csv", write_csv, id="csv"),
    pytest.param("csv", "run.txt", write_csv_european, id="csv: BOM, CRLF, comment, decimal comma, units line"),
    pytest.param("csv", "run.tsv", write_csv_tabs, id="csv: tabs, UTF-16, separators at the ends of lines"),
    pytest.param("parquet", "run.parquet", write_parquet, id="parquet"),
    pytest.param("matlab", "run.mat", write_mat5, id="matlab 5"),
    pytest.param("matlab", "run.mat", write_mat73, id="matlab 7.3"),
    pytest.param("hdf5", "run.h5", write_hdf5, id="hdf5"),
    pytest.param("mdf4", "run.mf4", write_mdf4, id="mdf4"),
    pytest.param("tdms", "run.tdms", write_tdms, id="tdms"),
    pytest.param("feather", "run.feather", write_feather, id="feather"),
    pytest.param("numpy", "run.npz", write_npz, id="numpy: several arrays"),
    pytest.param("numpy", "run.npy", write_npy, id="numpy: a table"),
    pytest.param("json", "run.json", write_json, id="json: columns"),
    pytest.param("json", "run.jsonl", write_json_lines, id="json: lines"),
    pytest.param("lvm", "run.lvm", write_lvm, id="lvm: decimal comma, no column of time"),
    pytest.param("codesys", "run.trace.csv", write_codesys, id="codesys: a variable after the other"),
    pytest.param("spice", "run.raw", write_spice, id="spice: waveforms"),
    pytest.param("comtrade", "run.cff", write_comtrade, id="comtrade: all parts in one"),
    pytest.param("excel", "run.xlsx", write_excel, id="excel: title, units row"),
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


OVER_FREQUENCY = {"touchstone"}
"""Readers of files that can hold no record over time; each has a file of tests of its own."""


def test_every_reader_stands_in_the_contract() -> None:
    assert {row.values[0] for row in CONTRACT} | OVER_FREQUENCY == {reader.name for reader in READERS}


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
    [
        pytest.param(*row.values[1:], id=str(row.id))
        for row in CONTRACT
        if row.values[0] not in {"csv", "lvm", "codesys"}
    ],
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
    if name.endswith(".mf4"):
        gc.collect()  # asammdf leaves a half-made object behind whose end prints a complaint: let it end here


def test_a_file_that_is_written_to_meanwhile_is_no_record(tmp_path: Path) -> None:
    # Half of it would be the old one; and the digest that the trace keeps would be of neither.
    path = tmp_path / "log.csv"
    path.write_text("time [s],u [V]\n0,1\n1,2\n2,3\n")
    csv = choose_reader(path, READERS, None)

    def logged(source: Path, files: FileOptions, repairs: RepairOptions) -> RawTable:
        table = csv.read(source, files, repairs)
        with source.open("a") as file:
            file.write("3,4\n")
        return table

    assert len(read_with(csv, path, FileOptions(), RepairOptions())) == 3
    with pytest.raises(ReaderError, match="written to while it was read"):
        read_with(replace(csv, read=logged), path, FileOptions(), RepairOptions())


@pytest.mark.parametrize(
    ("package", "extra", "record"),
    [
        pytest.param("asammdf", "mdf", ("run.mf4", b"anything"), id="mdf"),
        pytest.param("nptdms", "tdms", ("run.tdms", b"anything"), id="tdms"),
        pytest.param("matio", "matlab", ("run.mat", b"MATLAB 5.0 MAT-file".ljust(200)), id="matlab"),
        pytest.param("h5py", "hdf5", ("run.h5", b"\x89HDF\r\n\x1a\n"), id="hdf5"),
        pytest.param("pyarrow", "parquet", ("run.parquet", b"PAR1"), id="parquet"),
        pytest.param("pyarrow", "parquet", ("run.feather", b"ARROW1"), id="feather"),
        pytest.param("openpyxl", "excel", ("run.xlsx", b"PK\x03\x04"), id="xlsx"),
        pytest.param("xlrd", "excel", ("run.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"), id="xls"),
    ],
)
def test_a_missing_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, package: str, extra: str, record: tuple[str, bytes]
) -> None:
    name, content = record
    (tmp_path / name).write_bytes(content)
    monkeypatch.setattr("sysid.extras.has", lambda asked: asked != package)
    with pytest.raises(MissingExtraError, match=rf"(?s){package}.*sysid-workbench\[{extra}\]"):
        read_table(tmp_path / name)


@pytest.mark.parametrize(
    ("reader", "writer"),
    [
        pytest.param(row.values[0], row.values[2], id=str(row.id))
        for row in CONTRACT
        if row.values[0] not in {"csv", "json"}
    ],
)
def test_a_file_is_known_by_its_content_whatever_it_is_called(
    tmp_path: Path, reader: str, writer: Callable[[Path], None]
) -> None:
    suffix = {"numpy": ".npz" if writer is write_npz else ".npy", "excel": ".xlsx", "mdf4": ".mf4"}.get(reader, ".x")
    writer(tmp_path / f"run{suffix}")
    (tmp_path / f"run{suffix}").rename(tmp_path / "run.dat")
    table = read_table(tmp_path / "run.dat")
    assert (table.reader, len(table)) == (reader, 40)


def test_an_unknown_ending_names_the_known_ones(tmp_path: Path) -> None:
    (tmp_path / "run.xyz").write_text("t [s],u [V]\non,off\n")
    with pytest.raises(ReaderError, match=r"(?s)\.csv.*\.mat.*got: +\.xyz.*name the reader"):
        read_table(tmp_path / "run.xyz")
    (tmp_path / "run.xyz").write_text("t [s],u [V]\n0,1\n1,2\n")
    assert read_table(tmp_path / "run.xyz", files=FileOptions(reader="csv")).names == ("t", "u")


def test_a_missing_file_says_where_paths_start(tmp_path: Path) -> None:
    with pytest.raises(ReaderError, match="relative to that file"):
        read_table(tmp_path / "none.csv")


def test_an_option_of_another_format_is_refused(tmp_path: Path) -> None:
    write_hdf5(tmp_path / "run.h5")
    with pytest.raises(ConfigError, match=r"(?s)separator means nothing for a hdf5 file.*group"):
        read_table(tmp_path / "run.h5", files=FileOptions(separator=";"))


def test_a_pickle_is_never_opened(tmp_path: Path) -> None:
    import pickle

    class Bomb:
        def __reduce__(self) -> tuple[Callable[[Path], None], tuple[Path]]:
            return Path.touch, (tmp_path / "exploded",)

    bomb = pickle.dumps({"t": Bomb()})
    for reader in READERS:
        path = tmp_path / f"bomb{next(iter(reader.suffixes), '')}"
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


def test_libraries_are_silent_while_any_thread_reads_and_heard_again_afterwards() -> None:
    """The second reader ends after the first: neither may leave the log shut, or open it too early."""
    first, second = silent(), silent()
    before = logging.root.manager.disable
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert logging.root.manager.disable == logging.CRITICAL
    second.__exit__(None, None, None)
    assert logging.root.manager.disable == before


def test_a_packed_file_of_a_kind_that_is_not_opened_is_to_be_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "a.csv.zst"
    path.write_bytes(b"\x28\xb5\x2f\xfd" + bytes(20))
    with pytest.raises(ReaderError, match="unpack it first"):
        read_table(path)


@pytest.mark.parametrize("name", ["putty.log", "run.out", "run"])
def test_text_of_numbers_is_read_whatever_its_ending(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("0,91777,0,43.72\n0,92278,0,43.69\n")
    assert read_table(tmp_path / name).reader == "csv"


@pytest.mark.parametrize(("name", "remedy"), [("a.rda", "write.csv"), ("a.ods", "LibreOffice"), ("a.ulg", "ulog2csv")])
def test_a_file_of_another_tool_says_how_it_is_written_as_a_table(tmp_path: Path, name: str, remedy: str) -> None:
    (tmp_path / name).write_bytes(b"\x1f\x8b" + bytes(40))
    with pytest.raises(ReaderError, match=f"remedy: .*{remedy}"):
        read_table(tmp_path / name)
