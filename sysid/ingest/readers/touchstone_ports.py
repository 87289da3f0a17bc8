"""Touchstone files: how each port of a network answers each other, by frequency.

Source: Touchstone File Format Specification, version 1.1 (EIA/IBIS Open Forum, 2002). A line ``# GHz S MA R 50`` says
the unit of the frequencies, what is given (S, Y or Z), and how: real and imaginary part, magnitude and angle in
degrees, or decibels and angle. ``!`` begins a comment. Of two ports S21 stands before S12.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.tables.columns import RawColumn, array_column
from sysid.ingest.tables.table import RawTable

_UNITS = {"hz": 1.0, "khz": 1e3, "mhz": 1e6, "ghz": 1e9}
_GIVEN = ("s", "y", "z", "h", "g")
_FORMS = ("ri", "ma", "db")
_DEFAULT = ("ghz", "s", "ma")
"""What holds where the line says nothing of it."""


def read(path: Path) -> RawTable:
    """Read the responses of a network.

    Args:
        path: The file; its ending says how many ports there are.

    Returns:
        The frequency in hertz, and a column of complex numbers a pair of ports, ``S21`` for the answer at port 2 to
        what comes in at port 1.

    Raises:
        ReaderError: If its lines are none of such a file.
    """
    ports = int(re.findall(r"\d+", path.suffix)[0])
    lines = [line.partition("!")[0].strip() for line in path.read_text(encoding="latin-1").splitlines()]
    said = next((line[1:].lower().split() for line in lines if line.startswith("#")), None)
    if said is None or any(line.startswith("[") for line in lines):
        raise _broken(path, "a line such as '# MHz S RI R 50', and no [keywords] of version 2", "none of it")
    unit, given, form = (
        next((word for word in said if word in known), default)
        for known, default in zip((_UNITS, _GIVEN, _FORMS), _DEFAULT, strict=True)
    )
    words = [word for line in lines if not line.startswith("#") for word in line.split()]
    try:
        numbers = np.array(words, dtype=np.float64)
    except ValueError as error:
        raise _broken(path, "numbers", str(error)) from error
    width = 1 + 2 * ports**2
    rows = numbers[: len(numbers) // width * width].reshape(-1, width)
    back = np.flatnonzero(np.diff(rows[:, 0]) <= 0.0)  # figures of noise may follow
    rows = rows[: back[0] + 1] if len(back) else rows
    if not len(rows):
        raise _broken(path, f"rows of {width} numbers, as of so many ports", f"{len(numbers)} numbers")
    values = _complex(rows[:, 1::2], rows[:, 2::2], form)
    pairs = [(i, j) for i in range(1, ports + 1) for j in range(1, ports + 1)]
    pairs = [(j, i) for i, j in pairs] if ports == 2 else pairs
    names = [f"{given.upper()}{i}{j}" for i, j in pairs]
    columns = [
        RawColumn(name="frequency", values=rows[:, 0] * _UNITS[unit], unit="Hz"),
        *(array_column(name, one, where=str(path)) for name, one in zip(names, values.T, strict=True)),
    ]
    return RawTable(source=path, reader="touchstone", columns=tuple(columns))


def _complex(first: NDArray[np.float64], second: NDArray[np.float64], form: str) -> NDArray[np.complex128]:
    if form == "ri":
        return first + 1j * second
    size = first if form == "ma" else 10.0 ** (first / 20.0)
    return np.asarray(size * np.exp(1j * np.radians(second)), dtype=np.complex128)


def _broken(path: Path, expected: str, got: str) -> ReaderError:
    return ReaderError(
        "the file is no Touchstone file of version 1",
        where=path,
        expected=expected,
        got=got,
        remedy="save it once more as Touchstone 1.1, or as CSV with frequency, real and imaginary part",
    )
