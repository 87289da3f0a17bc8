"""One known record in every kind of file but text: the makers of the zoo.

The record: time 0 to 1.9 s in steps of 0.1 s, u a square of 1 and 3, and y[k+1] = 0.8 y[k] + 0.2 u[k] from y[0] = 0.
"""

from __future__ import annotations

import json
import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

N = 20
TIME = 0.1 * np.arange(N)
U = np.where(np.arange(N) // 5 % 2 == 0, 1.0, 3.0)
Y = np.zeros(N)
for _k in range(N - 1):
    Y[_k + 1] = 0.8 * Y[_k] + 0.2 * U[_k]

Maker = Callable[[Path], None]


def mat(version: str, **variables: Any) -> Maker:
    """A MATLAB file of a version (4, 5, 7.3)."""

    def make(path: Path) -> None:
        if version == "7.3":
            mat_of_objects("v7.3", **variables)(path)
        else:
            from scipy.io import savemat

            savemat(path, variables, format=version, oned_as="column")

    return make


def mat_of_objects(version: str, **variables: Any) -> Maker:
    """A MATLAB file with tables, time tables or objects of classes in it (v7 or v7.3)."""

    def make(path: Path) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about how a duration is shown, and about an option of pandas
            from matio import save_to_mat

            save_to_mat(str(path), variables, version=version)

    return make


def cells(*values: Any) -> np.ndarray:
    """A cell array of one row."""
    array = np.empty((1, len(values)), dtype=object)
    for index, value in enumerate(values):
        array[0, index] = value
    return array


def column(values: np.ndarray) -> np.ndarray:
    return np.asarray(values).reshape(-1, 1)


def iddata(u: Any, y: Any, **more: Any) -> dict[str, Any]:
    """What a saved iddata shows of itself."""
    return {
        "Domain": "Time", "OutputData": y, "OutputName": cells("y1"), "OutputUnit": cells("V"),
        "InputData": u, "InputName": cells("u1"), "InputUnit": cells("A"), "Ts": 0.1, "TimeUnit": "seconds",
        "Utility": {"last": np.arange(6.0), "create": np.arange(6.0)},
    } | more  # fmt: skip


def modelica(layout: str, *, scrambled: bool = False) -> Maker:
    """A result file of Dymola or OpenModelica, byte by byte (MAT 4)."""

    def make(path: Path) -> None:
        names = ["time", "rig.u", "rig.y", "rig.minus_y", "k"]
        texts = ["Simulation time [s]", "Voltage [V]", "Level [m|cm]", "alias [m]", "Gain"]
        index = np.array([[0, 1, 0, -1], [2, 2, 0, -1], [2, 3, 0, -1], [2, -3, 0, -1], [1, 2, 0, 0]], dtype=np.int32)
        data_1 = np.array([[0.0, 0.2], [1.9, 0.2]])
        data_2 = np.column_stack([TIME, U, Y])
        turn = layout == "binTrans"

        def characters(rows: list[str]) -> np.ndarray:
            width = max(map(len, rows))
            return np.array([list(row.ljust(width).encode()) for row in rows], dtype=np.uint8)

        def put(file: Any, name: str, matrix: np.ndarray, kind: int) -> None:
            file.write(struct.pack("<5i", kind, *matrix.shape, 0, len(name) + 1) + name.encode() + b"\0")
            file.write(np.asarray(matrix).tobytes(order="F"))

        with path.open("wb") as file:
            put(file, "Aclass", characters(["Atrajectory", "1.1", "", layout]), 51)
            about = characters(texts)
            put(file, "name", characters(names).T if turn else characters(names), 51)
            put(file, "description", about.reshape(about.T.shape) if scrambled else about.T if turn else about, 51)
            put(file, "dataInfo", index.T if turn else index, 20)
            put(file, "data_1", data_1.T if turn else data_1, 0)
            put(file, "data_2", data_2.T if turn else data_2, 0)

    return make


def hdf5(fill: Callable[[Any], None]) -> Maker:
    def make(path: Path) -> None:
        import h5py

        with h5py.File(path, "w") as file:
            fill(file)

    return make


def packed(file: Any) -> None:
    """CF packing: counts of a thousandth above 1, one of them missing."""
    counts = np.rint((Y - 1.0) / 0.001).astype(np.int16)
    counts[7] = -32768
    file["time"], file["u"], file["y"] = TIME, U, counts
    file["time"].attrs["units"] = "seconds since 2024-05-01 00:00:00"
    file["u"].attrs["units"] = "A"
    file["y"].attrs.update({"units": "V", "scale_factor": 0.001, "add_offset": 1.0, "_FillValue": np.int16(-32768)})


def grouped(file: Any) -> None:
    for name, part in (("est", slice(0, 20)), ("val", slice(0, 15))):
        file[f"{name}/u"], file[f"{name}/y"] = U[part], Y[part]
        file[name].attrs["fs"] = 10.0


def netcdf3(path: Path) -> None:
    from scipy.io import netcdf_file

    with netcdf_file(path, "w") as file:
        file.createDimension("time", N)
        for name, values, unit in (("time", TIME, "seconds since 2024-05-01 00:00:00"), ("u", U, "A")):
            variable = file.createVariable(name, "f8", ("time",))
            variable[:] = values
            variable.units = unit
        variable = file.createVariable("y", "i2", ("time",))
        variable[:] = np.rint(Y / 0.001).astype(np.int16)
        variable.units, variable.scale_factor, variable.add_offset = "V", 0.001, 0.0


def npz(**arrays: np.ndarray) -> Maker:
    return lambda path: np.savez_compressed(path, **arrays)


def npy(array: np.ndarray) -> Maker:
    return lambda path: np.save(path, array)


def table() -> np.ndarray:
    made = np.zeros(N, dtype=[("t", "f8"), ("u", "f4"), ("y", "f8")])
    made["t"], made["u"], made["y"] = TIME, U, Y
    return made


def text(content: str) -> Maker:
    return lambda path: path.write_text(content) and None


def rows() -> list[dict[str, float]]:
    return [{"t": t, "u": u, "y": y} for t, u, y in zip(TIME.tolist(), U.tolist(), Y.tolist(), strict=True)]


def as_json(content: Any) -> Maker:
    return text(json.dumps(content))


def arrow(kind: str) -> Maker:
    def make(path: Path) -> None:
        import pyarrow as pa
        from pyarrow import feather, parquet

        made = pa.table({"t": TIME, "u": U, "y": Y})
        if kind == "stream":
            with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_stream(sink, made.schema) as writer:
                writer.write_table(made)
        elif kind == "feather":
            feather.write_feather(made, path)
        else:
            parquet.write_table(made, path, row_group_size=7)

    return make


def lvm(style: str, *, segments: int = 1) -> Maker:
    """A LabVIEW measurement file: X_Columns No, One or Multi."""

    def make(path: Path) -> None:
        lines = ["LabVIEW Measurement\t", "Separator\tTab", "Multi_Headings\tYes", f"X_Columns\t{style}"]
        lines += ["***End_of_Header***\t", ""]
        for _ in range(segments):
            lines += ["Channels\t2", "Samples\t20\t20", "Y_Unit_Label\tA\tV", "X_Dimension\tTime\tTime"]
            lines += ["X0\t0.0\t0.0", "Delta_X\t0.1\t0.1", "***End_of_Header***\t\t"]
            names = {"No": "X_Value\tu\ty", "One": "X_Value\tu\ty", "Multi": "X_Value\tu\tX_Value\ty"}[style]
            lines.append(f"{names}\tComment")
            for t, u, y in zip(TIME.tolist(), U.tolist(), Y.tolist(), strict=True):
                lines.append(
                    {"No": f"\t{u!r}\t{y!r}", "One": f"{t!r}\t{u!r}\t{y!r}", "Multi": f"{t!r}\t{u!r}\t{t!r}\t{y!r}"}[
                        style
                    ]
                )
            lines.append("")
        path.write_text("\n".join(lines))

    return make


def workbook(
    *sheets: str, first: list[list[Any]] | None = None, header: tuple[list[Any], ...] = (["t", "u", "y"],)
) -> Maker:
    """An Excel workbook; ``first`` is a sheet of text before the others."""

    def make(path: Path) -> None:
        import openpyxl

        book = openpyxl.Workbook()
        book.remove(book.active)
        for row in first or ():
            (book["about"] if "about" in book.sheetnames else book.create_sheet("about")).append(row)
        for name in sheets:
            sheet = book.create_sheet(name)
            for line in header:
                sheet.append(line)
            for row in zip(TIME.tolist(), U.tolist(), Y.tolist(), strict=True):
                sheet.append(row)
        book.save(path)

    return make


def xls(path: Path) -> None:
    """A workbook of Excel 2.1, byte by byte: labels and numbers."""

    def record(kind: int, data: bytes) -> bytes:
        return struct.pack("<HH", kind, len(data)) + data

    body = record(0x0009, struct.pack("<HH", 2, 0x10))
    for at, name in enumerate(("t", "u", "y")):
        body += record(0x0004, struct.pack("<HH3xB", 0, at, len(name)) + name.encode())
    for row, cells_of_row in enumerate(zip(TIME, U, Y, strict=True)):
        for at, value in enumerate(cells_of_row):
            body += record(0x0003, struct.pack("<HH3xd", row + 1, at, value))
    path.write_bytes(body + record(0x000A, b""))


def mdf(version: str, *, slow: bool = False) -> Maker:
    def make(path: Path) -> None:
        from asammdf import MDF, Signal

        made = path.with_name(f"made{'.mdf' if version.startswith('3') else '.mf4'}")
        with MDF(version=version) as file:
            file.append([Signal(U, TIME, name="u", unit="A"), Signal(Y, TIME, name="y", unit="V")])
            if slow:
                file.append([Signal(TIME[::5], TIME[::5], name="slow", unit="K")])
            file.save(made, overwrite=True)
        made.rename(path)

    return make


def tdms(*groups: str) -> Maker:
    def make(path: Path) -> None:
        from nptdms import ChannelObject, TdmsWriter

        clock = {
            "wf_increment": 0.1,
            "wf_start_time": np.datetime64("2024-05-01T10:00:00", "us"),
            "wf_start_offset": 0.0,
        }
        with TdmsWriter(path) as file:
            for group in groups:
                u = ChannelObject(group, "u", U, properties=clock | {"unit_string": "A"})
                file.write_segment([u, ChannelObject(group, "y", Y, properties=clock | {"unit_string": "V"})])

    return make
