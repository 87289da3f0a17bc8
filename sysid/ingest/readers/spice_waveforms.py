"""What LTspice, ngspice and their like save (``.raw``): transients, and responses over frequency.

The form is that of SPICE 3: a head of lines, in UTF-16 from LTspice, then one point after the other. ngspice writes
float64, LTspice float32 for all but the time, whose sign marks points that it left out (``abs`` is the time).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.cells.headers import split_reference
from sysid.ingest.readers.bounds import check_claim
from sysid.ingest.tables.columns import RawColumn, array_column, distinct
from sysid.ingest.tables.table import RawTable
from sysid.written_units import plain_unit

_HEAD = 2**20
"""Bytes in which the head has to end."""

_UNITS = {"time": "s", "frequency": "Hz", "voltage": "V", "current": "A", "device_current": "A", "power": "W"}
"""By what SPICE calls the kind of a variable; some programs write a unit there."""


@dataclass(frozen=True, kw_only=True)
class _Head:
    """What the lines above the numbers say.

    Args:
        words: What stands before and behind each colon, the words lower case.
        variables: Name and kind of each.
        begin: Where the numbers begin, bytes.
        binary: Whether they are binary, and not text.
    """

    words: dict[str, str]
    variables: tuple[tuple[str, str], ...]
    begin: int
    binary: bool

    @property
    def points(self) -> int:
        """How many there are."""
        return int(self.words["no. points"])

    @property
    def flags(self) -> set[str]:
        """``real`` or ``complex``, ``stepped``, ``double`` and others."""
        return set(self.words.get("flags", "real").lower().split())


def read(path: Path) -> RawTable:
    """Read waveforms.

    Args:
        path: The file.

    Returns:
        The variables as columns, the time or the frequency first.

    Raises:
        ReaderError: If it is cut off or none of these, or holds an analysis over neither time nor frequency.
    """
    head = _head_of(path)
    check_claim(path, [("the points", (head.points, len(head.variables), 2 if "complex" in head.flags else 1))])
    numbers = (_binary if head.binary else _texts)(path, head)
    columns = [_column(*variable, one, path) for variable, one in zip(head.variables, numbers, strict=True)]
    named, notes = distinct(columns)
    first = named[0]
    kind = head.variables[0][1].lower()
    if kind not in {"time", "frequency"}:
        raise ReaderError(
            "the waveforms are no record over time",
            where=path,
            expected="a transient analysis, or one over frequency",
            got=head.words.get("plotname") or f"variables over {first.name}",
            remedy="save the result of .tran, or of .ac for a frequency response",
        )
    time = first.name if kind == "time" else None
    if time is not None:
        named[0] = array_column(first.name, np.abs(first.values), where=str(path), unit="s")
    plot = head.words.get("plotname", "")
    told = [f"{plot}, of {len(head.variables)} variables"] if plot else []
    return RawTable(
        source=path, reader="spice", columns=tuple(named), time=time, notes=(*told, *notes), by_solver=time is not None
    )


def _head_of(path: Path) -> _Head:
    with path.open("rb") as file:
        raw = file.read(_HEAD)
    wide = raw[1:2] == b"\0"
    marks = [f"{word}:{end}" for word in ("Binary", "Values") for end in ("\n", "\r\n")]
    ends = {mark: mark.encode("utf-16-le" if wide else "ascii") for mark in marks}
    found = [(raw.find(end), mark, len(end)) for mark, end in ends.items() if end in raw]
    if not found:
        raise _broken(path, "Binary: or Values: below its variables", "none")
    at, mark, length = min(found)
    lines = raw[:at].decode("utf-16-le" if wide else "latin-1").splitlines()
    split = next((k for k, line in enumerate(lines) if line.strip().lower() == "variables:"), len(lines))
    words = {key.strip().lower(): value.strip() for key, _, value in (line.partition(":") for line in lines[:split])}
    rows = [line.split() for line in lines[split + 1 :] if line.strip()]
    variables = tuple((row[1], " ".join(word for word in row[2:] if "=" not in word)) for row in rows if len(row) > 2)
    if not variables or not words.get("no. points", "").isdigit() or words.get("no. variables") != str(len(variables)):
        raise _broken(path, "No. Points, No. Variables and as many lines of variables", f"{len(variables)} variables")
    return _Head(words=words, variables=variables, begin=at + length, binary=mark.startswith("Binary"))


def _binary(path: Path, head: _Head) -> list[NDArray[np.generic]]:
    """Each variable's numbers."""
    count, size = len(head.variables), path.stat().st_size - head.begin
    if "complex" in head.flags:
        kinds = ["<c16"] * count
    elif size >= 8 * count * head.points:
        kinds = ["<f8"] * count
    else:
        kinds = ["<f8"] + ["<f4"] * (count - 1)
    row = np.dtype([(f"v{k}", kind) for k, kind in enumerate(kinds)])
    if size < row.itemsize * head.points:
        raise _broken(path, f"{row.itemsize * head.points} bytes of {head.points} points", f"{size}: cut off")
    if "fastaccess" in head.flags:  # a variable after the other
        starts = head.begin + head.points * np.cumsum([0, *(np.dtype(kind).itemsize for kind in kinds)])
        each = zip(kinds, starts, strict=False)
        return [np.fromfile(path, dtype=kind, count=head.points, offset=int(start)) for kind, start in each]
    rows = np.fromfile(path, dtype=row, count=head.points, offset=head.begin)
    return [rows[name] for name in rows.dtype.names or ()]


def _texts(path: Path, head: _Head) -> list[NDArray[np.generic]]:
    """Each variable's numbers where they are text: a point's number, then a number a line, ``re,im`` of a complex."""
    raw = path.read_bytes()
    wide = raw[1:2] == b"\0"
    words = raw[head.begin :].decode("utf-16-le" if wide else "latin-1").split()
    each = 1 + len(head.variables)
    if len(words) < each * head.points:
        raise _broken(path, f"{each * head.points} numbers of {head.points} points", f"{len(words)}: cut off")
    table = np.array(words[: each * head.points]).reshape(head.points, each)[:, 1:]
    try:
        if "complex" in head.flags:
            parts = np.array([cell.split(",") for cell in table.ravel()], dtype=np.float64)
            return list((parts[:, 0] + 1j * parts[:, 1]).reshape(table.shape).T)
        return list(table.astype(np.float64).T)
    except ValueError as error:
        raise _broken(path, "numbers", str(error)) from error


def _column(name: str, kind: str, numbers: NDArray[np.generic], path: Path) -> RawColumn:
    unit = _UNITS.get(kind.lower()) or (kind if plain_unit(split_reference(kind)[0]) else None)
    return array_column(name, numbers, where=str(path), unit=unit)


def _broken(path: Path, expected: str, got: str) -> ReaderError:
    return ReaderError(
        "the waveforms cannot be read",
        where=path,
        expected=expected,
        got=got,
        remedy="check that the simulation came to its end; or export the traces as text (LTspice: File, Export data)",
    )
