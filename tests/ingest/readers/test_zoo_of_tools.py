"""The zoo of tools: the known record as Excel, INCA, LabVIEW, Dymola, Telegraf and pandas leave it behind.

Each file is read right by nothing but its proposal, samples without a value marked, or it is refused in words.
"""

from __future__ import annotations

import datetime
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sysid.errors import UserError
from sysid.ingest import load_dataset
from sysid.workbench.commands.ingest import ingest_command
from tests.ingest.readers.zoo_binary import TIME, Maker, N, U, Y, as_json, npz, rows, text

ON = (U - 1.0) / 2.0
DAY = datetime.datetime(2024, 5, 1, 23, 59)
LATE = [DAY + datetime.timedelta(seconds=10 * k) for k in range(N)]
EVENTS = [k for k in range(N) for _ in range(2 if k and U[k] != U[k - 1] else 1)]


def book(
    *records: list[Any], head: tuple[Any, ...] = ("t [s]", "u", "y"), before: Callable[[Any], None] | None = None
) -> Maker:
    """A workbook with a sheet of these rows."""

    def make(path: Path) -> None:
        import openpyxl

        made = openpyxl.Workbook()
        if before is not None:
            before(made.active)
        sheet = made.create_sheet("log") if before is not None else made.active
        for row in (head, *records):
            sheet.append(row)
        made.save(path)

    return make


def of(line: Callable[[int], list[Any]]) -> list[list[Any]]:
    return [line(k) for k in range(N)]


def another(sheet: Any) -> None:
    """A hidden sheet with the same columns, in another scale."""
    sheet.sheet_state = "hidden"
    for row in (("t [s]", "u", "y"), *zip(TIME.tolist(), (7 * U).tolist(), Y.tolist(), strict=True)):
        sheet.append(row)


def parameters(sheet: Any) -> None:
    for row in (("Nr", "value"), (1, 0.5), (2, 1.5), (3, 9.5)):
        sheet.append(row)


def mdf(fill: Callable[[Any, Any], None]) -> Maker:
    def make(path: Path) -> None:
        from asammdf import MDF, Signal

        with MDF(version="4.10") as file:
            fill(file, Signal)
            file.save(path, overwrite=True)

    return make


def invalid(file: Any, signal: Any) -> None:
    bad = np.isin(np.arange(N), [5, 6])
    file.append([signal(U, TIME, name="u"), signal(np.where(bad, 1e30, Y), TIME, name="y", invalidation_bits=bad)])


def scaled_with_a_text(file: Any, signal: Any) -> None:
    """What a data base of CAN says: counts of a hundredth, and 65535 for a signal that is not available."""
    from asammdf.blocks.conversion_utils import from_dict

    said = {"lower_0": 65535, "upper_0": 65535, "text_0": "SNA", "default_addr": {"a": 1e-4, "b": 0.0}}
    counts = np.where(np.arange(N) == 7, 65535, np.rint(Y / 1e-4)).astype(np.uint16)
    file.append([signal(U, TIME, name="u"), signal(counts, TIME, name="y", conversion=from_dict(said))])


def over_angle(file: Any, signal: Any) -> None:
    file.append([signal(U, 720.0 * TIME, name="u"), signal(Y, 720.0 * TIME, name="y")])
    file.groups[0].channels[0].sync_type = 2


def frames(file: Any, signal: Any) -> None:
    kind = np.dtype([("CAN_DataFrame.ID", "u4"), ("CAN_DataFrame.DataBytes", "u1", (8,))])
    file.append([signal(np.zeros(N, kind), TIME, name="CAN_DataFrame")])


def tdms(said: dict[str, Any], of_group: dict[str, Any] | None = None, **channels: np.ndarray) -> Maker:
    def make(path: Path) -> None:
        from nptdms import ChannelObject, GroupObject, TdmsWriter

        with TdmsWriter(path) as file:
            made = [ChannelObject("rig", name, values, properties=said) for name, values in channels.items()]
            file.write_segment([GroupObject("rig", properties=of_group or {}), *made])

    return make


def lvm(*above: str, unit: str = "V", over: str = "Time") -> Maker:
    """A LabVIEW measurement file of a German system."""
    head = ["LabVIEW Measurement\t", "Decimal_Separator\t,", "X_Columns\tOne", "***End_of_Header***\t", *above, ""]
    head += ["Channels\t2", f"Y_Unit_Label\t{unit}\tV", f"X_Dimension\t{over}\t{over}", "***End_of_Header***\t\t"]
    lines = [
        f"{t!r}\t{u!r}\t{y!r}".replace(".", ",") for t, u, y in zip(TIME.tolist(), U.tolist(), Y.tolist(), strict=True)
    ]
    return lambda path: (
        path.write_bytes("\r\n".join([*head, "X_Value\tu\ty\tComment", *lines]).encode("cp1252")) and None
    )


def arrow(**columns: Any) -> Maker:
    def make(path: Path) -> None:
        import pyarrow as pa
        from pyarrow import feather

        feather.write_feather(pa.table({n: c(pa) if callable(c) else c for n, c in columns.items()}), path)

    return make


def micros(kind: str, start: int = 0) -> Callable[[Any], Any]:
    counts = start + np.rint(TIME * 1e6).astype(np.int64)
    return lambda pa: pa.array(counts).cast(getattr(pa, kind)("us"))


def with_events(path: Path) -> None:
    """Before each step of u stands a sample with the value from before, at the same instant."""
    made = np.column_stack([TIME, U, Y])[EVENTS]
    again = np.flatnonzero(np.diff(EVENTS) == 0)
    made[again, 1] = made[again - 1, 1]
    lines = [",".join(map(repr, row)) for row in made.tolist()]
    path.write_text("\n".join(['"time","u","y"', *lines]))


def lines(records: list[Any]) -> Maker:
    return text("".join(json.dumps(record) + "\n" for record in records))


T, INDEX = TIME.tolist(), pd.date_range("2024-05-01", periods=N, freq="100ms")
WORD = np.where(U > 2.0, "ON", "OFF")
STEP = {"wf_increment": 0.1}
AS_TEXT = [f"{y:.12f}".replace(".", ",") for y in Y]
READ: dict[str, tuple[str, Maker, str, np.ndarray, float, int]] = {
    "xlsx: time of day past midnight": (
        "a.xlsx", book(*of(lambda k: [LATE[k].time(), U[k], Y[k]]), head=("Zeit", "u", "y")), "u", U, 10.0, 0),
    "xlsx: date and time in two columns": (
        "a.xlsx", book(
            *of(lambda k: [LATE[k].date(), LATE[k].time(), U[k], Y[k]]), head=("Datum", "Uhrzeit", "u", "y")),
        "u", U, 10.0, 0),
    "xlsx: durations of more than a day": (
        "a.xlsx", book(*of(lambda k: [datetime.timedelta(minutes=10 * k + 1400), U[k], Y[k]]), head=("Zeit", "u", "y")),
        "u", U, 600.0, 0),
    "xlsx: dates as text, numbers as text": (
        "a.xlsx", book(*of(lambda k: [f"{LATE[k]:%d.%m.%Y %H:%M:%S}", U[k], AS_TEXT[k]]), head=("Zeit", "u", "y")),
        "u", U, 10.0, 0),
    "xlsx: words, remarks": (
        "a.xlsx", book(*of(lambda k: [T[k], WORD[k], Y[k], "x" if k == 3 else None]), head=("t [s]", "u", "y", "Bem.")),
        "u", ON, 0.1, 0),
    "xlsx: an error in a cell": (
        "a.xlsx", book(*of(lambda k: [T[k], U[k], "#N/A" if k == 7 else Y[k]])), "u", U, 0.1, 1),
    "xlsx: numbers of rows, units behind strokes": (
        "a.xlsx", book(*of(lambda k: [k + 1, 100 * k, U[k], Y[k]]), head=("Nr.", "Zeit / ms", "u / V", "y")),
        "u", U, 0.1, 0),
    "xlsx: a few values beside the table": (
        "a.xlsx", book(*of(lambda k: [T[k], U[k], Y[k], None, "K" if k < 3 else None, k if k < 3 else None])),
        "u", U, 0.1, 0),
    "xlsx: a hidden sheet of the same columns": (
        "a.xlsx", book(*of(lambda k: [T[k], U[k], Y[k]]), before=another), "u", U, 0.1, 0),
    "xlsx: a sheet of parameters before": (
        "a.xlsx", book(*of(lambda k: [T[k], U[k], Y[k]]), before=parameters), "u", U, 0.1, 0),
    "xls that is text": ("a.xls", text("t [s]\tu\ty\n" + "".join(f"{t!r}\t{u!r}\t{y!r}\n" for t, u, y in zip(
        T, U.tolist(), Y.tolist(), strict=True))), "u", U, 0.1, 0),
    "MDF: invalidation bits": ("a.mf4", mdf(invalid), "u", U, 0.1, 2),
    "MDF: scaled, with a text for one value": ("a.mf4", mdf(scaled_with_a_text), "u", U, 0.1, 1),
    "TDMS: the rate in words": ("a.tdms", tdms({}, {"Sample Rate": 10.0}, u=U, y=Y), "u", U, 0.1, 0),
    "TDMS: a channel of time beside a step that nobody set": (
        "a.tdms", tdms({"wf_increment": 1.0}, Zeit=TIME, u=U, y=Y), "u", U, 0.1, 0),
    "LVM: code page of Windows, a special block": (
        "a.lvm", lvm("***Start_Special***", "Foo\tbar", "***End_Special***", unit="°C"), "u", U, 0.1, 0),
    "OpenModelica: events": ("a.csv", with_events, "u", U, 0.1, 0),
    "npz: words, durations": (
        "a.npz", npz(time=np.rint(TIME * 1e9).astype("timedelta64[ns]"), u=WORD, y=Y), "u", ON, 0.1, 0),
    "Feather: categories, durations": (
        "a.feather", arrow(time=micros("duration"), u=lambda pa: pa.array(WORD).dictionary_encode(), y=Y),
        "u", ON, 0.1, 0),
    "Feather: times of day, numbers as text": (
        "a.feather", arrow(time=micros("time64", 10**9), u=U, y=list(map(repr, Y.tolist()))), "u", U, 0.1, 0),
    "JSON: messages": (
        "a.jsonl", lines([{"fields": {"u": u, "y": y}, "tags": {"rig": "a"}, "timestamp": 1_710_231_300_000 + 100 * k}
                          for k, (u, y) in enumerate(zip(U.tolist(), Y.tolist(), strict=True))]),
        "fields.u", U, 0.1, 0),
    "JSON: words, numbers as text": (
        "a.jsonl", lines([{"t": t, "u": w, "y": str(y)} for t, w, y in zip(T, WORD.tolist(), Y.tolist(), strict=True)]),
        "u", ON, 0.1, 0),
    "JSON: a long table": (
        "a.jsonl", lines([{"time": row["t"], "signal": n, "value": row[n]} for row in rows() for n in ("u", "y")]),
        "u", U, 0.1, 0),
    "JSON: pandas, by its index of dates": (
        "a.json", text(pd.DataFrame({"u": U, "y": Y}, index=INDEX).to_json(date_format="iso", double_precision=15)),
        "u", U, 0.1, 0),
    "JSON: units above the columns": (
        "a.json", as_json({"units": {"u": "V"}, "data": {"t": T, "u": U.tolist(), "y": Y.tolist()}}), "u", U, 0.1, 0),
}  # fmt: skip
UNITS = {"xlsx: numbers of rows, units behind strokes": "V", "JSON: units above the columns": "V",
         "LVM: code page of Windows, a special block": "degC"}  # fmt: skip

REFUSED: dict[str, tuple[str, Maker, str]] = {
    "xlsx: formulas that nobody computed": (
        "a.xlsx", book(*of(lambda k: [f"=(ROW()-2)/{10}", U[k], Y[k]])), r"formulas that the file has no values for"),
    "xls that is a web page": ("a.xls", text("<html><table><tr><td>1</td></tr></table></html>"), r"a web page or XML"),
    "xlsx behind a password": (
        "a.xlsx", lambda path: path.write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 504
                                                + "EncryptedPackage".encode("utf-16-le")) and None, r"is encrypted"),
    "MDF: over angle": ("a.mf4", mdf(over_angle), r"stand over angle, not over time"),
    "MDF: frames of a bus": ("a.mf4", mdf(frames), r"(?s)not decoded.*extract_bus_logging"),
    "TDMS: a spectrum": ("a.tdms", tdms({**STEP, "wf_xname": "Frequency"}, u=U, y=Y), r"stand over Frequency"),
    "TDMS: scales that are not whole": (
        "a.tdms", tdms({**STEP, "NI_Number_Of_Scales": np.uint32(2), "NI_Scaling_Status": "unscaled",
                        "NI_Scale[1]_Scale_Type": "Linear", "NI_Scale[1]_Linear_Slope": 2.0,
                        "NI_Scale[1]_Linear_Y_Intercept": 0.0, "NI_Scale[1]_Linear_Input_Source": np.uint32(0)},
                       u=np.arange(N, dtype=np.int16), y=np.arange(N, dtype=np.int16)), r"not a whole TDMS file"),
    "LVM: a spectrum": ("a.lvm", lvm(over="Frequency"), r"stand over Frequency"),
}  # fmt: skip


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    # What is drawn is tested where it is drawn, and takes most of the time.
    monkeypatch.setattr("sysid.workbench.commands.ingest._picture", lambda *_: "none")


@pytest.mark.parametrize("kind", READ)
def test_what_a_tool_leaves_behind_is_read_right_by_what_is_proposed(tmp_path: Path, kind: str) -> None:
    name, make, u, expected, step, missing = READ[kind]
    make(tmp_path / name)
    ingest_command(str(tmp_path / name), propose=tmp_path / "X.yaml")
    traces = load_dataset(tmp_path / "X.yaml")
    (trace,) = traces
    y = u.replace("u", "y")
    usable = np.ones(N, dtype=bool) if trace.usable is None else trace.usable_samples
    assert traces.sample_time == pytest.approx(step, rel=1e-9)
    assert {u, y} <= {channel.name for channel in trace.channels} and int((~usable).sum()) == missing
    np.testing.assert_allclose(trace[u], expected, atol=1e-12)
    tolerance = 5.1e-5 if "scaled" in kind else 1e-9  # half a count
    np.testing.assert_allclose(trace[y][usable], Y[usable], atol=tolerance)
    if kind in UNITS:
        assert trace.channels[trace.index(u)].unit == UNITS[kind]


@pytest.mark.parametrize("kind", REFUSED)
def test_what_cannot_be_a_record_is_refused_with_a_way_out(tmp_path: Path, kind: str) -> None:
    name, make, words = REFUSED[kind]
    make(tmp_path / name)
    with pytest.raises(UserError, match=words) as refused:
        ingest_command(str(tmp_path / name), propose=tmp_path / "X.yaml")
    assert refused.value.remedy
