"""MATLAB files: objects that only MATLAB reads, Simulink's structures, columns of several lengths, matrices."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.errors import ReaderError
from sysid.ingest import inspect_file, read_table
from tests.ingest.readers.zoo_binary import U, Y, cells, iddata, mat, modelica
from tests.ingest.recordings import PIPE, TIME, VOLT, mark_as_mat73


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
    mark_as_mat73(path)


@pytest.mark.parametrize("writer", [_opaque_mat5, _opaque_mat73], ids=["5", "7.3"])
def test_a_matlab_object_is_refused_with_the_line_that_exports_it(
    tmp_path: Path, writer: Callable[[Path], None]
) -> None:
    writer(tmp_path / "run.mat")
    with pytest.raises(ReaderError, match=r"(?s)only MATLAB can read.*ts\.Time"):
        read_table(tmp_path / "run.mat")


def test_what_simulink_streams_into_a_file_is_an_object_and_no_damage(tmp_path: Path) -> None:
    """It lies in a group of HDF5, at which the library stops that lists the variables."""
    import h5py

    _opaque_mat73(tmp_path / "run.mat")
    with h5py.File(tmp_path / "run.mat", "a") as file:
        file.create_group("#sigstream#").create_dataset("0", data=np.zeros(3))
    with pytest.raises(ReaderError, match=r"(?s)ts is a MATLAB object.*d\{1\}\.Values"):
        read_table(tmp_path / "run.mat")


@pytest.mark.parametrize("wrapped", [True, False], ids=["in a structure", "as variables"])
def test_names_and_units_that_stand_beside_u_and_y_are_theirs(tmp_path: Path, *, wrapped: bool) -> None:
    about = {"InputName": "voltage", "OutputName": cells("speed"), "InputUnit": "V", "OutputUnit": "rad/s"}
    fields: dict[str, Any] = {"u": VOLT[None, :], "y": PIPE, "Ts": 0.1, **about}
    mat("5", **({"exp1": fields} if wrapped else fields))(tmp_path / "run.mat")
    table = read_table(tmp_path / "run.mat")
    assert [(column.name, column.unit) for column in table.columns] == [("voltage", "V"), ("speed", "rad/s")]
    assert table.step == 0.1
    np.testing.assert_array_equal(table.find("voltage").values, VOLT)


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


def test_a_sample_time_in_a_cell_is_that_of_its_record(tmp_path: Path) -> None:
    mat("5", u=cells(U, U[:12]), y=cells(Y, Y[:12]), Ts=cells(0.1, 0.2))(tmp_path / "run.mat")
    assert [record.table.step for record in read_table(tmp_path / "run.mat").records] == [0.1, 0.2]


def test_an_iddata_is_taken_by_itself_and_what_stands_beside_it_stays_there(tmp_path: Path) -> None:
    mat("5", z=iddata(U[:, None], Y[:, None]), t=0.5 * np.arange(20.0), extra=2.0 * U)(tmp_path / "run.mat")
    table = read_table(tmp_path / "run.mat")
    assert (table.names, table.time, table.step) == (("z.u1", "z.y1"), None, 0.1)
    assert (table.find("z.u1").unit, table.find("z.y1").unit) == ("A", "V")
    np.testing.assert_array_equal(table.find("extra").values, 2.0 * U)


@pytest.mark.parametrize(
    ("more", "time", "step"),
    [
        ({"TimeUnit": "minutes"}, None, 6.0),
        ({"Ts": cells(0.1)}, None, 0.1),
        ({"Tstart": 5.0}, [5.0, 5.1], None),
        ({"SamplingInstants": 0.25 * np.arange(20.0)[:, None]}, [0.0, 0.25], None),
    ],
    ids=["minutes", "in a cell", "start", "instants"],
)
def test_the_clock_of_an_iddata(
    tmp_path: Path, more: dict[str, Any], time: list[float] | None, step: float | None
) -> None:
    mat("5", z=iddata(U[:, None], Y[:, None], **more))(tmp_path / "run.mat")
    table = read_table(tmp_path / "run.mat")
    assert table.step == step
    assert time is None or table.find("time").values[:2].tolist() == pytest.approx(time)


def test_cells_beside_vectors_leave_them_readable(tmp_path: Path) -> None:
    mat("5", t=TIME, u=VOLT, info=cells("rig 3", np.arange(3.0)), more=cells({"a": 1.0}, np.arange(2.0)))(
        tmp_path / "run.mat"
    )
    table = read_table(tmp_path / "run.mat")
    np.testing.assert_array_equal(table.find("u").values, VOLT)
    with pytest.raises(ReaderError, match=r"(?s)another length.*got: +3 samples"):
        table.find("info{2}")


def test_what_a_case_asks_for_is_compared_and_nothing_else(tmp_path: Path) -> None:
    mat("5", uEst=U, yEst=Y, uVal=U[:12], yVal=Y[:12], Ts=0.1)(tmp_path / "run.mat")
    table = read_table(tmp_path / "run.mat")
    assert len(table.narrowed(["uVal", "yVal"])) == 12
    with pytest.raises(ReaderError, match=r"(?s)another length.*columns: \{\.\.\.\} of the case"):
        table.narrowed(["uEst", "yVal"])


def test_a_simulation_result_gives_variables_with_units_aliases_and_parameters(tmp_path: Path) -> None:
    modelica("binTrans")(tmp_path / "run.mat")
    table = read_table(tmp_path / "run.mat")
    assert table.names == ("time", "rig.u", "rig.y", "rig.minus_y", "k")
    assert [column.unit for column in table.columns] == ["s", "V", "m", "m", None]
    np.testing.assert_allclose(table.find("rig.minus_y").values, -Y)
    assert (set(table.find("k").values), table.find("k").aside) == ({0.2}, "a parameter, 0.2 throughout")


def _structure(stamps: np.ndarray, values: np.ndarray, label: str) -> dict[str, Any]:
    return {"time": stamps[:, None], "signals": {"values": values[:, None], "dimensions": 1.0, "label": label}}


def test_signals_that_were_saved_apart_with_clocks_of_their_own_are_one_record(tmp_path: Path) -> None:
    t = 0.1 * np.arange(20)
    slow = {"Name": "level", "Time": t[::2][:, None], "Data": 3.0 * t[::2][:, None]}
    mat("5", pump=_structure(t, np.cos(t), "pump"), level=slow)(tmp_path / "run.mat")
    table = read_table(tmp_path / "run.mat")
    assert (table.names, table.time, table.others) == (("time", "pump", "level"), "time", ())
    np.testing.assert_allclose(table.find("level").values[:19], 3.0 * t[:19])
    assert any("level: interpolated from 0.2 s" in note for note in table.notes)
    mat("5", est=_structure(t, np.cos(t), "a"), val=_structure(t[:15], np.sin(t[:15]), "b"))(tmp_path / "two.mat")
    assert read_table(tmp_path / "two.mat").notes == (), "records stay apart"


@pytest.mark.parametrize("clock", ["of each", "one", "none"])
def test_structures_of_a_name_and_samples_are_signals_and_no_records(tmp_path: Path, clock: str) -> None:
    """Two signals were two records of one channel, ``Data``."""
    from scipy.io import savemat

    own = {"Raster": TIME} if clock == "of each" else {}
    signals = [{"Name": "u", "Unit": "V", "Data": VOLT, **own}, {"Name": "p pipe", "Unit": "bar", "Data": PIPE, **own}]
    savemat(tmp_path / "run.mat", {"X": signals, **({"t": TIME} if clock == "one" else {})})
    table = read_table(tmp_path / "run.mat")
    names = [name for name in table.names if name not in {"t", "time"}]
    head = "X." if clock == "one" else ""  # as of any structure beside which something stands
    assert names == [f"{head}u", f"{head}p pipe"]
    for name, values, unit in ((names[0], VOLT, "V"), (names[1], PIPE, "bar")):
        np.testing.assert_array_equal(table.find(name).values, values)
        assert table.find(name).unit == unit
    assert (table.time is None) == (clock == "none")


def test_structures_that_are_records_stay_records(tmp_path: Path) -> None:
    from scipy.io import savemat

    runs = [{"name": name, "data": k * PIPE} for k, name in enumerate(("est", "val"), 1)]
    other = [{"name": "a", "u": VOLT, "y": PIPE}, {"name": "b", "u": VOLT, "y": PIPE}]
    savemat(tmp_path / "run.mat", {"X": runs})
    savemat(tmp_path / "other.mat", {"X": other})
    assert set(read_table(tmp_path / "run.mat").names) == {"X{1}.data", "X{2}.data"}
    assert set(read_table(tmp_path / "other.mat").names) == {"X{1}.u", "X{1}.y", "X{2}.u", "X{2}.y"}


def test_numbers_without_an_imaginary_part_are_real_and_others_are_named(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"t": TIME, "u": VOLT + 0j, "y": VOLT + 1j})
    table = read_table(tmp_path / "run.mat")
    np.testing.assert_array_equal(table.find("u").values, VOLT)
    with pytest.raises(ReaderError, match="complex numbers"):
        table.find("y")


def test_objects_that_hold_one_another_are_refused_not_walked_through(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A digital filter holds a converter that holds the filter; reading it ended in a RecursionError."""
    import matio
    from matio.utils.matclass import MatlabOpaque

    one = MatlabOpaque({"Fs": np.array([[1.0]])}, "dfilt.df2sos")
    one.properties["owner"] = MatlabOpaque({"filter": one}, "dfilt.basefilter")
    mat("5", y=Y)(tmp_path / "filter.mat")
    monkeypatch.setattr(matio, "load_from_mat", lambda *_, **__: {"Hd": one})
    with pytest.raises(ReaderError, match=r"(?s)Hd is a MATLAB object.*class dfilt\.df2sos"):
        read_table(tmp_path / "filter.mat")


def test_a_clock_of_another_length_than_all_signals_is_not_theirs(tmp_path: Path) -> None:
    """A workspace had a record of 6,717 samples, and the last thousand times of a simulation: no channel was left."""
    mat("5", T=TIME, U=VOLT, Y=PIPE, tout=TIME[-20:])(tmp_path / "workspace.mat")
    table = read_table(tmp_path / "workspace.mat")
    assert {"T", "U", "Y"} <= set(table.names)
    assert [column.name for column in table.others] == ["tout"]


def test_dates_and_states_in_texts_of_as_many_rows_are_columns(tmp_path: Path) -> None:
    stamps = [f"2024-03-12 08:15:{k // 10:02d}.{k % 10}" for k in range(len(U))]
    words = cells(*("on" if u > 2 else "off" for u in U))
    mat("5", t=np.array(stamps), valve=words, u=U, y=Y, names=cells("one", "two"))(tmp_path / "a.mat")
    found = inspect_file(tmp_path / "a.mat")
    assert found.sample_time == pytest.approx(0.1)
    assert [column.name for column in found.channels] == ["valve", "u", "y"]


def test_a_matrix_over_time_and_place_is_turned_by_what_is_called_time(tmp_path: Path) -> None:
    place = np.linspace(0.0, 1.0, 30)
    mat("5", t=TIME[:20], x=place, field=np.outer(np.sin(place), 1.0 + TIME[:20]))(tmp_path / "a.mat")
    found = inspect_file(tmp_path / "a.mat")
    assert (found.time.column, found.samples, len(found.channels)) == ("t", 20, 30)
