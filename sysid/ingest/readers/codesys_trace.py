"""Traces of PLCs that CODESYS saves as text, as do ctrlX, WAGO and others that build on it.

A variable after the other: what is said of it, ``0.Variable; PLC_PRG.level``, and behind ``0.Data;`` its stamps and
values, ``; 20; 1.5``. The stamps are milliseconds, or microseconds where ``Resolution`` says so.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.readers.late import table_of
from sysid.ingest.readers.reader import damaged
from sysid.ingest.readers.trees.joining import joined_signals
from sysid.ingest.tables.joining import Signal
from sysid.ingest.tables.options import FileOptions
from sysid.ingest.tables.table import RawTable

_SAID = re.compile(r"(?:(?P<number>\d+)\.)?(?P<key>[A-Za-z.]+)\s*;\s*(?P<value>.*?)\s*")
_WORDS = {"true": 1.0, "false": 0.0}


def read(path: Path, options: FileOptions) -> RawTable:
    """The variables of a trace, at the stamps of the fastest.

    Args:
        path: The file.
        options: How it is read.

    Returns:
        The table.

    Raises:
        ReaderError: If no variable has samples, or a line of them is none.
    """
    names, rows, resolution = dict[str, str](), dict[str, list[tuple[float, float]]](), ""
    here: list[tuple[float, float]] | None = None
    for at, line in enumerate(path.read_text(encoding=options.encoding or "utf-8-sig", errors="replace").splitlines()):
        said = _SAID.fullmatch(line)
        if said is None:
            if here is not None and line.lstrip().startswith(";"):
                here.append(_sample(line, path, at + 1))
            continue
        number, key = said["number"], said["key"].casefold()
        resolution = said["value"] if number is None and key == "resolution" else resolution
        if number is not None and key == "variable":
            names[number] = said["value"]
        if number is not None and key == "data":
            here = rows.setdefault(number, [])
    signals = [
        _signal(names.get(number, f"variable_{number}"), samples, resolution)
        for number, samples in rows.items()
        if samples
    ]
    if not signals:
        raise damaged(path, "CODESYS trace", ValueError("no variable has samples"))
    columns, notes = joined_signals(signals, path)
    unit = "as the file says" if resolution else "taken for milliseconds, as usual: the file does not say it"
    return table_of(columns, path=path, reader="codesys", options=options, notes=[f"time stamps: {unit}", *notes])


def _sample(line: str, path: Path, number: int) -> tuple[float, float]:
    """Stamp and value of a line ``; 20; 1.5``; a PLC's words for on and off are 1 and 0."""
    cells = [cell.strip() for cell in line.split(";")[1:3]]
    try:
        stamp, value = (_WORDS[cell.casefold()] if cell.casefold() in _WORDS else float(cell) for cell in cells)
    except ValueError as error:
        raise ReaderError(
            "a line of samples is none",
            where=f"{path}, line {number}",
            expected="; time stamp; number",
            got=repr(line[:80]),
            remedy="correct the line, or leave its variable out of the trace and save it again",
        ) from error
    return stamp, value


def _signal(name: str, samples: list[tuple[float, float]], resolution: str) -> Signal:
    table: NDArray[np.float64] = np.array(samples)
    second = 1e-6 if resolution.casefold() in {"us", "µs", "1", "microseconds"} else 1e-3
    return Signal(name=name, group="", values=table[:, 1], stamps=table[:, 0] * second)
