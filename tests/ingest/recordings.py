"""One signal, recorded in every format that is read."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

TIME = 0.05 * np.arange(40)
PIPE = 500.0 + 10.0 * np.sin(TIME)
VOLT = np.cos(3.0 * TIME) / 3.0


def write_csv(path: Path) -> None:
    rows = [f"{t!r},{p!r},{v!r}" for t, p, v in zip(TIME.tolist(), PIPE.tolist(), VOLT.tolist(), strict=True)]
    path.write_text("\n".join(["time [s],BP [kPa gauge],u [V]", *rows]))


def write_csv_european(path: Path) -> None:
    cells = zip(TIME.tolist(), PIPE.tolist(), VOLT.tolist(), strict=True)
    rows = [f"{t!r};{p!r};{v!r}".replace(".", ",") for t, p, v in cells]
    text = "\r\n".join(["# made on the rig", "Zeit (s);BP;u", "s;kPa gauge;V", *rows])
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())


def write_csv_tabs(path: Path) -> None:
    rows = [f"{t!r}\t{p!r}\t{v!r}\t" for t, p, v in zip(TIME.tolist(), PIPE.tolist(), VOLT.tolist(), strict=True)]
    path.write_text("\n".join(["t [s]\tBP [kPa gauge]\tu [V]\t", *rows, "", ""]), encoding="utf-16")


def write_parquet(path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    metadata = [{"unit": "s"}, {"unit": "kPa", "reference": "gauge"}, {"unit": "V"}]
    fields = [pa.field(n, pa.float64(), metadata=m) for n, m in zip(("time", "BP", "u"), metadata, strict=True)]
    parquet.write_table(pa.table([TIME, PIPE, VOLT], schema=pa.schema(fields)), path)


def write_mat5(path: Path) -> None:
    from scipy.io import savemat

    units = {"t": "s", "BP": "kPa gauge", "u": "V"}
    savemat(path, {"run": {"t": TIME[:, None], "BP": PIPE[:, None], "u": VOLT[:, None], "units": units}})


def write_mat73(path: Path) -> None:
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
    mark_as_mat73(path)


def mark_as_mat73(path: Path) -> None:
    """Write the head by which MATLAB knows an HDF5 file with a block for its user as its own."""
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, made for a test".ljust(124) + b"\x00\x02IM")


def write_hdf5(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        for name, values, unit in (("time", TIME, "s"), ("BP", PIPE, "kPa"), ("u", VOLT, "V")):
            file.create_dataset(name, data=values).attrs["units"] = unit
        file["BP"].attrs["reference"] = "gauge"


def write_mdf4(path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append(
            [
                Signal(PIPE, TIME, name="BP", unit="kPa gauge"),
                Signal(VOLT, TIME, name="u", unit="V"),
            ]
        )
        file.save(path, overwrite=True)


def write_tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as file:
        file.write_segment(
            [
                ChannelObject("rig", "BP", PIPE, properties={"unit_string": "kPa gauge", "wf_increment": 0.05}),
                ChannelObject("rig", "u", VOLT, properties={"unit_string": "V", "wf_increment": 0.05}),
            ]
        )


def named_columns() -> dict[str, np.ndarray]:
    return {"time [s]": TIME, "BP [kPa gauge]": PIPE, "u [V]": VOLT}


def write_feather(path: Path) -> None:
    import pyarrow as pa
    from pyarrow import feather

    feather.write_feather(pa.table(named_columns()), path)


def write_npz(path: Path) -> None:
    np.savez_compressed(path, **named_columns())


def write_npy(path: Path) -> None:
    table = np.zeros(len(TIME), dtype=[(name, "f8") for name in named_columns()])
    for name, values in named_columns().items():
        table[name] = values
    np.save(path, table)


def write_json(path: Path) -> None:
    path.write_text(json.dumps({name: values.tolist() for name, values in named_columns().items()}))


def write_json_lines(path: Path) -> None:
    rows = np.column_stack(list(named_columns().values())).tolist()
    path.write_text("".join(json.dumps(dict(zip(named_columns(), row, strict=True))) + "\n" for row in rows))


def write_lvm(path: Path) -> None:
    head = ["LabVIEW Measurement\t", "Separator\tTab", "Decimal_Separator\t,", "X_Columns\tNo", "***End_of_Header***\t"]
    head += ["", "Channels\t2", "Samples\t40\t40", "Y_Unit_Label\tkPa gauge\tV", "X0\t0,0\t0,0", "Delta_X\t0,05\t0,05"]
    head += ["***End_of_Header***\t\t", "X_Value\tBP\tu\tComment"]
    rows = [f"\t{p!r}\t{v!r}".replace(".", ",") for p, v in zip(PIPE.tolist(), VOLT.tolist(), strict=True)]
    path.write_text("\n".join([*head, *rows]))


def write_codesys(path: Path) -> None:
    lines = ["[key]; [value]", "Version; 0x03050000", "IecTaskName; MainTask"]
    for number, (name, values) in enumerate((("BP [kPa gauge]", PIPE), ("u [V]", VOLT))):
        lines += [f"{number}.Variable; {name}", f"{number}.Class; 14", f"{number}.Data; "]
        lines += [f"; {1000 * t:.0f}; {x!r}" for t, x in zip(TIME.tolist(), values.tolist(), strict=True)]
    path.write_text("\n".join(lines))


def write_excel(path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    for row in (["Rig 3"], [], ["time", "BP", "u"], ["s", "kPa gauge", "V"]):
        book.active.append(row)
    for row in np.column_stack([TIME, PIPE, VOLT]).tolist():
        book.active.append(row)
    book.save(path)


def write_spice(path: Path) -> None:
    """Waveforms as ngspice saves them, in float64."""
    kinds = {"time": "time", "BP": "kPa gauge", "u": "voltage"}
    variables = [f"\t{k}\t{name}\t{kind}" for k, (name, kind) in enumerate(kinds.items())]
    said = ["Title: * rig", "Date: Tue Mar 12 08:15:00 2024", "Plotname: Transient Analysis", "Flags: real"]
    head = [*said, "No. Variables: 3", f"No. Points: {len(TIME)}", "Variables:", *variables, "Binary:\n"]
    path.write_bytes("\n".join(head).encode() + np.column_stack([TIME, PIPE, VOLT]).tobytes())


def write_comtrade(path: Path) -> None:
    """A fault recorder's file of all parts, with samples as text."""
    channels = ["1,BP,,,kPa gauge,1.0,0.0,0,-32767,32767,1,1,P", "2,u,,,mV,1000.0,0.0,0,-32767,32767,1,1,P"]
    rates = ["50", "1", f"20,{len(TIME)}", "12/03/2024,08:15:00.000000", "12/03/2024,08:15:00.500000", "ASCII", "1"]
    said = ["--- file type: CFG ---", "rig,recorder,2013", "2,2A,0D", *channels, *rates, "--- file type: DAT ASCII ---"]
    cells = enumerate(zip(PIPE.tolist(), VOLT.tolist(), strict=True), 1)
    rows = [f"{k},{50000 * (k - 1)},{p!r},{v!r}" for k, (p, v) in cells]
    path.write_text("\r\n".join([*said, *rows, ""]), newline="")
