"""The zoo: one known record in every kind of file but text, read by nothing but what ``sysid ingest`` proposes.

Each file is looked at by ``sysid ingest FILE --propose X`` and then loaded as ``sysid ingest X`` does; what
cannot be read right is refused, and the remedy of the refusal is followed to the letter.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sysid.ingest import load_dataset
from sysid.traces import TraceSet
from sysid.workbench.commands.ingest import ingest_command
from tests.ingest.readers.zoo_binary import (
    TIME,
    Maker,
    N,
    U,
    Y,
    arrow,
    as_json,
    cells,
    column,
    grouped,
    hdf5,
    iddata,
    lvm,
    mat,
    mat_of_objects,
    mdf,
    modelica,
    netcdf3,
    npy,
    npz,
    rows,
    table,
    tdms,
    text,
    workbook,
    xls,
)

ALL = slice(0, N)
SIDE = np.vstack([TIME, U, Y])
FRAME = pd.DataFrame({"u": U, "y": Y}, index=pd.to_timedelta(TIME, unit="s"))
SHORT = slice(0, 7)  # fewer samples than a record has by default
TWO = {"est": ALL, "val": slice(0, 12)}
RUNS = np.array([({"u": column(U[p]), "y": column(Y[p]), "Ts": 0.1}) for p in (ALL, slice(0, 12))], dtype=object)

ONE = {"a": ALL}

Columns = tuple[str, str]
"""Names of u and y."""

Cases = dict[str, slice]
"""Which part of the record each case is."""

ZOO: dict[str, tuple[str, Maker, Columns, Cases]] = {
    "MAT 4: vectors": ("a.mat", mat("4", t=TIME, u=U, y=Y), ("u", "y"), ONE),
    "MAT 5: vectors": ("a.mat", mat("5", t=TIME, u=U, y=Y), ("u", "y"), ONE),
    "MAT 7.3: vectors": ("a.mat", mat("7.3", t=column(TIME), u=column(U), y=column(Y)), ("u", "y"), ONE),
    "MAT 5: Ts": ("a.mat", mat("5", u=U, y=Y, Ts=0.1), ("u", "y"), ONE),
    "MAT 5: fs": ("a.mat", mat("5", u=U, y=Y, fs=10.0), ("u", "y"), ONE),
    "MAT 7.3: dt": ("a.mat", mat("7.3", u=column(U), y=column(Y), dt=np.array([[0.1]])), ("u", "y"), ONE),
    "MAT 5: matrix": ("a.mat", mat("5", data=SIDE.T), ("data_2", "data_3"), ONE),
    "MAT 5: matrix on its side": ("a.mat", mat("5", data=SIDE), ("data_2", "data_3"), ONE),
    "MAT 5: matrix beside a vector": ("a.mat", mat("5", t=TIME, d=SIDE[1:]), ("d_1", "d_2"), ONE),
    "MAT 5: iddata": ("a.mat", mat("5", z=iddata(column(U), column(Y))), ("u1", "y1"), ONE),
    "MAT 5: two iddata": (
        "a.mat",
        mat("5", id=iddata(column(U), column(Y)), val=iddata(column(U[:12]), column(Y[:12]))),
        ("u1", "y1"),
        {"id": ALL, "val": TWO["val"]},
    ),
    "MAT 7.3: two iddata": (
        "a.mat",
        mat("7.3", id=iddata(column(U), column(Y)), val=iddata(column(U[:12]), column(Y[:12]))),
        ("u1", "y1"),
        {"id": ALL, "val": TWO["val"]},
    ),
    "MAT 5: iddata of two experiments": (
        "a.mat",
        mat(
            "5",
            z=iddata(
                cells(column(U), column(U[:12])),
                cells(column(Y), column(Y[:12])),
                Ts=cells(0.1, 0.1),
                ExperimentName=cells("Exp1", "Exp2"),
            ),
        ),
        ("u1", "y1"),
        {"Exp1": ALL, "Exp2": TWO["val"]},
    ),
    "MAT 5: cells": (
        "a.mat",
        mat("5", u=cells(U, U[:12]), y=cells(Y, Y[:12]), Ts=0.1),
        ("u", "y"),
        {"record_1": ALL, "record_2": TWO["val"]},
    ),
    "MAT 5: cells, one of few samples": (
        "a.mat",
        mat("5", u=cells(U, U[SHORT]), y=cells(Y, Y[SHORT]), Ts=0.1),
        ("u", "y"),
        {"record_1": ALL, "record_2": SHORT},
    ),
    "MAT 7.3: cells": (
        "a.mat",
        mat("7.3", u=cells(column(U), column(U[:12])), y=cells(column(Y), column(Y[:12])), Ts=np.array([[0.1]])),
        ("u", "y"),
        {"record_1": ALL, "record_2": TWO["val"]},
    ),
    "MAT 5: cells of matrices": (
        "a.mat",
        mat("5", d=cells(SIDE.T, SIDE.T[:12])),
        ("d_2", "d_3"),
        {"record_1": ALL, "record_2": TWO["val"]},
    ),
    "MAT 5: structure array": ("a.mat", mat("5", runs=RUNS), ("u", "y"), {"runs_1": ALL, "runs_2": TWO["val"]}),
    "MAT 5: EST and VAL": (
        "a.mat",
        mat("5", uEst=U, yEst=Y, uVal=U[:12], yVal=Y[:12], Ts=0.1),
        ("u", "y"),
        {"Est": ALL, "Val": TWO["val"]},
    ),
    "MAT 5: EST and VAL with a clock each": (
        "a.mat",
        mat("5", t_est=TIME, u_est=U, y_est=Y, t_val=TIME[:12], u_val=U[:12], y_val=Y[:12]),
        ("u", "y"),
        TWO,
    ),
    "MAT 5: ue, ye, uv, yv": (
        "a.mat",
        mat("5", ue=U, ye=Y, uv=U[:12], yv=Y[:12], Ts=0.1),
        ("u", "y"),
        {"estimation": ALL, "validation": TWO["val"]},
    ),
    "MAT 7: time table": ("a.mat", mat_of_objects("v7", T=FRAME), ("u", "y"), ONE),
    "MAT 7.3: time table": ("a.mat", mat_of_objects("v7.3", T=FRAME), ("u", "y"), ONE),
    "MAT 7.3: table": ("a.mat", mat_of_objects("v7.3", T=pd.DataFrame({"t": TIME, "u": U, "y": Y})), ("u", "y"), ONE),
    "MAT 5: fields of a timeseries": (
        "a.mat",
        mat("5", u={"Name": "u", "Time": TIME, "Data": U}, y={"Name": "y", "Time": TIME, "Data": Y}),
        ("u.u", "y.y"),
        ONE,
    ),
    "Modelica: binTrans": ("a.mat", modelica("binTrans"), ("rig.u", "rig.y"), ONE),
    "Modelica: binNormal": ("a.mat", modelica("binNormal"), ("rig.u", "rig.y"), ONE),
    "Modelica: descriptions laid out anew": ("a.mat", modelica("binTrans", scrambled=True), ("rig.u", "rig.y"), ONE),
    "HDF5: matrix on its side": ("a.h5", hdf5(lambda f: f.update({"d": SIDE})), ("d_2", "d_3"), ONE),
    "HDF5: groups": ("a.h5", hdf5(grouped), ("u", "y"), {"est": ALL, "val": slice(0, 15)}),
    "netCDF 3": ("a.nc", netcdf3, ("u", "y"), ONE),
    "npz": ("a.npz", npz(t=TIME, u=U, y=Y), ("u", "y"), ONE),
    "npz: EST and VAL": ("a.npz", npz(u_est=U, y_est=Y, u_val=U[:12], y_val=Y[:12], Ts=np.array(0.1)), ("u", "y"), TWO),
    "npy: matrix": ("a.npy", npy(SIDE.T), ("column_2", "column_3"), ONE),
    "npy: matrix on its side": ("a.npy", npy(SIDE), ("column_2", "column_3"), ONE),
    "npy: table": ("a.npy", npy(table()), ("u", "y"), ONE),
    "JSON: columns": ("a.json", as_json({"t": TIME.tolist(), "u": U.tolist(), "y": Y.tolist()}), ("u", "y"), ONE),
    "JSON: rows": ("a.json", as_json(rows()), ("u", "y"), ONE),
    "JSON: lines": ("a.jsonl", text("".join(pd.Series(row).to_json() + "\n" for row in rows())), ("u", "y"), ONE),
    "JSON: pandas by column": ("a.json", text(pd.DataFrame(rows()).to_json(double_precision=15)), ("u", "y"), ONE),
    "JSON: pandas split": (
        "a.json",
        text(pd.DataFrame(rows()).to_json(orient="split", double_precision=15)),
        ("u", "y"),
        ONE,
    ),
    "JSON: pandas table": (
        "a.json",
        text(pd.DataFrame(rows()).to_json(orient="table", double_precision=15)),
        ("u", "y"),
        ONE,
    ),
    "JSON: several records": (
        "a.json",
        as_json([{"dt": 0.1, "u": U[p].tolist(), "y": Y[p].tolist()} for p in (ALL, slice(0, 12))]),
        ("u", "y"),
        {"record_1": ALL, "record_2": TWO["val"]},
    ),
    "Parquet": ("a.parquet", arrow("parquet"), ("u", "y"), ONE),
    "Feather": ("a.feather", arrow("feather"), ("u", "y"), ONE),
    "Arrow stream": ("a.arrow", arrow("stream"), ("u", "y"), ONE),
    "Feather by content": ("a.dat", arrow("feather"), ("u", "y"), ONE),
    "Arrow stream by content": ("a.dat", arrow("stream"), ("u", "y"), ONE),
    "LVM: no column of time": ("a.lvm", lvm("No"), ("u", "y"), ONE),
    "LVM: one column of time": ("a.lvm", lvm("One"), ("u", "y"), ONE),
    "LVM: a column of time each": ("a.lvm", lvm("Multi"), ("u", "y"), ONE),
    "LVM: two segments": ("a.lvm", lvm("One", segments=2), ("u", "y"), {"segment_1": ALL, "segment_2": ALL}),
    "xlsx": ("a.xlsx", workbook("log"), ("u", "y"), ONE),
    "xlsx: title, units row": (
        "a.xlsx",
        workbook("log", header=(["Rig 3", None], [], ["t", "u", "y"], ["s", "A", "V"])),
        ("u", "y"),
        ONE,
    ),
    "xlsx: text before, two sheets": (
        "a.xlsx",
        workbook("run 1", "run 2", first=[["made on", "Monday"]]),
        ("u", "y"),
        {"run 1": ALL, "run 2": ALL},
    ),
    "xls": ("a.xls", xls, ("u", "y"), ONE),
    "MDF 4": ("a.mf4", mdf("4.10"), ("u", "y"), ONE),
    "MDF 4: two rates": ("a.mf4", mdf("4.10", slow=True), ("u", "y"), ONE),
    "MDF 3 by the suffix of a text": ("a.dat", mdf("3.30"), ("u", "y"), ONE),
    "TDMS": ("a.tdms", tdms("rig"), ("u", "y"), ONE),
    "TDMS: two groups": ("a.tdms", tdms("run 1", "run 2"), ("u", "y"), {"run 1": ALL, "run 2": ALL}),
}


def proposed(path: Path) -> TraceSet:
    """The data set that is proposed for a file, written, looked at and loaded as it stands."""
    proposal = path.parent / "X.yaml"
    ingest_command(str(path), propose=proposal)
    ingest_command(str(proposal), propose=None)
    return load_dataset(proposal)


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    # What is drawn is tested where it is drawn, and takes most of the time.
    monkeypatch.setattr("sysid.workbench.commands.ingest._picture", lambda *_: "none")


@pytest.mark.parametrize("animal", ZOO.values(), ids=ZOO.keys())
def test_the_zoo_is_read_right_by_what_is_proposed(tmp_path: Path, animal: tuple[str, Maker, Columns, Cases]) -> None:
    name, make, (u, y), cases = animal
    make(tmp_path / name)
    traces = proposed(tmp_path / name)
    assert traces.names == tuple(cases)
    assert traces.sample_time == 0.1
    for case, part in cases.items():
        np.testing.assert_allclose(traces[case][u], U[part], atol=1e-12)
        # A millionth: what JSON of pandas and packed counts lose is far below what a wrong reading would.
        np.testing.assert_allclose(traces[case][y], Y[part], atol=6e-4 if name.endswith(".nc") else 1e-9)
