"""LabVIEW measurement files (``.lvm``): text in segments, each with a header block of its own."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.cells.numbers import NumberFormat
from sysid.ingest.readers.late import table_of
from sysid.ingest.readers.marks import LABVIEW
from sysid.ingest.readers.reader import damaged
from sysid.ingest.readers.trees.joining import joined_signals, not_over_time
from sysid.ingest.readers.trees.leaves import Leaf
from sysid.ingest.tables.joining import Signal
from sysid.ingest.tables.options import FileOptions
from sysid.ingest.tables.table import RawTable

_END = "***End_of_Header***"
_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}


@dataclass
class _Segment:
    header: dict[str, list[str]] = field(default_factory=dict)
    names: list[str] = field(default_factory=list)
    rows: list[list[str]] = field(default_factory=list)
    line: int = 0


def read(path: Path, options: FileOptions) -> RawTable:
    """The columns of a LabVIEW measurement file.

    Args:
        path: The file.
        options: How it is read.

    Returns:
        The table, or its records.

    Raises:
        ReaderError: If it is damaged, or holds channels over frequency.
    """
    text = _decoded(path.read_bytes(), options.encoding)
    if not text.startswith(LABVIEW):
        raise damaged(path, "LabVIEW measurement", ValueError(f"it begins with {text[:20]!r}"))
    lines = text.splitlines()
    separator = _separator(lines)
    about, at = _block(lines, 1, separator)
    numbers = NumberFormat(decimal=next(iter(about.get("decimal_separator", [])), ".") or ".")
    segments = [segment for segment in _segments(lines, at, separator) if segment.rows]
    notes: list[str] = []
    try:
        parts = [_columns(segment, about, numbers, path, notes) for segment in segments]
    except (ValueError, IndexError) as error:
        raise damaged(path, "LabVIEW measurement", error) from error
    parts = _continued(parts, notes)
    tree = parts[0] if len(parts) == 1 else {f"segment_{index + 1}": part for index, part in enumerate(parts)}
    return table_of(tree, path=path, reader="lvm", options=options, notes=notes)


def _decoded(raw: bytes, encoding: str | None) -> str:
    """The file as text: LabVIEW writes in the code page of the system."""
    for name in [encoding] if encoding else ["utf-8-sig", "cp1252"]:
        try:
            return raw.decode(name)
        except UnicodeDecodeError:
            continue
    return raw.decode(encoding or "cp1252", errors="replace")


def _separator(lines: list[str]) -> str:
    word = next((line for line in lines[:40] if line.casefold().startswith("separator")), "")
    rest = word[len("separator") :].strip("\t,; ").casefold()
    return _SEPARATORS.get(rest, "\t")


def _block(lines: list[str], at: int, separator: str) -> tuple[dict[str, list[str]], int]:
    """A header block and the line after it."""
    block: dict[str, list[str]] = {}
    while at < len(lines) and not lines[at].startswith(_END):
        key, *values = lines[at].split(separator)
        if key.strip():
            block[key.strip().casefold()] = [value.strip() for value in values]
        at += 1
    return block, at + 1


def _segments(lines: list[str], at: int, separator: str) -> list[_Segment]:
    segments: list[_Segment] = []
    header: dict[str, list[str]] = {}
    while at < len(lines):
        if not lines[at].strip(separator + " "):
            at += 1
            continue
        first = lines[at].split(separator)[0].strip().casefold()
        if first in {"channels", "samples", "date", "time", "y_unit_label", "x_dimension", "x0", "delta_x", "notes"}:
            header, at = _block(lines, at, separator)
            continue
        if first == "***start_special***":  # blocks of add-ons, which are no numbers
            ends = (i for i in range(at, len(lines)) if lines[i].casefold().startswith("***end_special***"))
            at = next(ends, at) + 1
            continue
        if first.startswith("***"):
            at += 1
            continue
        cells = [cell.strip() for cell in lines[at].split(separator)]
        if any(cell.casefold() == "x_value" for cell in cells) or not segments:
            named = any(cell.casefold() == "x_value" for cell in cells)
            segments.append(_Segment(header=header, names=cells if named else [], line=at + 1))
            if not named:
                segments[-1].rows.append(cells)
        else:
            segments[-1].rows.append(cells)
        at += 1
    return segments


def _columns(
    segment: _Segment, about: dict[str, list[str]], numbers: NumberFormat, path: Path, notes: list[str]
) -> dict[str, Leaf]:
    over = next((x for x in segment.header.get("x_dimension", []) if x and x.casefold() != "time"), None)
    if over is not None:
        raise not_over_time(path, over)
    style = (next(iter(about.get("x_columns", [])), "") or "One").casefold()
    names = [name for name in segment.names if name.casefold() != "comment"]
    width = max(len(row) for row in segment.rows)
    if not names:
        names = ["X_Value", *(f"channel_{index}" for index in range(1, width))]
    is_x = [name.casefold() == "x_value" for name in names]
    units = segment.header.get("y_unit_label", [])
    clocks: list[tuple[str, NDArray[np.float64]]] = []
    signals: list[Signal] = []
    channel = 0
    for at, name in enumerate(names):
        if is_x[at]:
            if style != "no":
                clocks.append((name, _numbers(segment, at, numbers, path, name)))
            continue
        values = _numbers(segment, at, numbers, path, name)
        stamps = clocks[-1][1] if clocks else _generated(segment, channel, len(values), numbers)
        kept = np.isfinite(stamps)
        while style == "multi" and len(values) and not (np.isfinite(values) & kept).all():
            kept &= np.isfinite(values)  # channels of a shorter record leave their cells empty
            break
        unit = units[channel] if channel < len(units) and units[channel] else None
        signals.append(Signal(name=name, group="", values=values[kept], stamps=stamps[kept], unit=unit))
        channel += 1
    joined, told = joined_signals(signals, path)
    notes.extend(told)
    return joined


def _numbers(segment: _Segment, at: int, numbers: NumberFormat, path: Path, name: str) -> NDArray[np.float64]:
    cells = [row[at] if at < len(row) else "" for row in segment.rows]
    values = numbers.column(cells)
    if isinstance(values, int):
        raise ReaderError(
            "a cell is not a number",
            where=f"{path}, line {segment.line + values + 1}, column {name}",
            expected=f"a number with decimal {numbers.decimal!r}",
            got=repr(cells[values]),
            remedy="correct the cell, or the line Decimal_Separator of the file",
        )
    return values


def _generated(segment: _Segment, channel: int, count: int, numbers: NumberFormat) -> NDArray[np.float64]:
    """Stamps of a channel by the start and the step in its header."""

    def of(key: str, default: float) -> float:
        cells = segment.header.get(key, [])
        value = numbers.parse(cells[channel]) if channel < len(cells) else None
        return default if value is None or not np.isfinite(value) else value

    return of("x0", 0.0) + of("delta_x", 1.0) * np.arange(count, dtype=np.float64)


def _continued(parts: list[dict[str, Any]], notes: list[str]) -> list[dict[str, Any]]:
    """Segments that go on in time where the one before ends are one record."""
    merged: list[dict[str, Any]] = parts[:1]
    for part in parts[1:]:
        last = merged[-1]
        if set(last) == set(part) and _goes_on(last["time"].values, part["time"].values):
            merged[-1] = {
                name: Leaf(values=np.concatenate([leaf.values, part[name].values]), unit=leaf.unit)
                for name, leaf in last.items()
            }
        else:
            merged.append(part)
    if len(merged) < len(parts):
        notes.append(f"{len(parts)} segments, of which those that go on in time are one record")
    return merged


def _goes_on(before: NDArray[np.float64], after: NDArray[np.float64]) -> bool:
    if len(before) < 2 or not len(after):
        return False
    step = float(np.median(np.diff(before)))
    return abs(float(after[0] - before[-1]) - step) < 0.01 * step
