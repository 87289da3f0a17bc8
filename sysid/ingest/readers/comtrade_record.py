"""COMTRADE records: a file that says what the channels are, and one of samples, or both in one (``.cff``).

Source: IEEE C37.111-1999 and C37.111-2013 (IEC 60255-24). A sample ``x`` of an analogue channel is ``a*x + b`` in its
unit. Samples are text, 16 or 32 bit integers, or float32; states are bits, 16 in a word.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.readers.bounds import check_claim
from sysid.ingest.tables.columns import RawColumn, array_column, distinct
from sysid.ingest.tables.table import RawTable

_SECTION = re.compile(rb"--- file type:\s*(?P<kind>[A-Za-z]+)\s*(?P<form>[A-Za-z0-9]*)\s*(?::\s*\d+\s*)?---\r?\n")
_KINDS = {"BINARY": "<i2", "BINARY32": "<i4", "FLOAT32": "<f4"}
_MISSING = {"BINARY": -(2**15), "BINARY32": -(2**31)}
"""What stands for a sample that was lost; in text it is a blank, or 99999."""


@dataclass(frozen=True, kw_only=True)
class _Described:
    """What the file of the channels says.

    Args:
        station: Where it was recorded.
        analogue: Name, unit, ``a`` and ``b`` of each.
        states: Names of channels of 0 and 1.
        rates: Samples a second, and up to which sample each holds; empty where the stamps tell alone.
        form: ``ASCII``, ``BINARY``, ``BINARY32`` or ``FLOAT32``.
        tick: Seconds that a stamp counts.
    """

    station: str
    analogue: tuple[tuple[str, str, float, float], ...]
    states: tuple[str, ...]
    rates: tuple[tuple[float, int], ...]
    form: str
    tick: float


def read(path: Path, *, described: Path | None) -> RawTable:
    """Read a record.

    Args:
        path: The ``.cfg``, the ``.dat`` or the ``.cff``.
        described: The ``.cfg`` beside a ``.dat``.

    Returns:
        Its channels, and the time.

    Raises:
        ReaderError: If one of the files is missing or broken.
    """
    source = described or path
    whole = source.read_bytes()
    parts = _sections(whole)
    if not parts and source.suffix.lower() != ".cff":
        parts = {"CFG": whole, "DAT": _samples_beside(source).read_bytes()}
    if not {"CFG", "DAT"} <= parts.keys():
        raise _broken(path, "sections CFG and DAT", ", ".join(parts) or "none")
    try:
        said = _described(parts["CFG"])
        width = 2 + len(said.analogue) + len(said.states)
        check_claim(path, [("the samples", (_rows(parts["DAT"], said), width))])
        numbers, analogue, states = (_of_text if said.form == "ASCII" else _of_binary)(parts["DAT"], said)
    except (ValueError, LookupError) as error:  # of a form that is not known, too
        raise _broken(path, "channels, rates and samples as IEEE C37.111 has them", str(error)) from error
    expected = said.rates[-1][1] if said.rates else 1
    if len(numbers) < max(expected, 1):
        raise _broken(path, f"{expected} samples, as its description says", f"{len(numbers)}: cut off")
    step = _step(numbers, said)
    columns = [] if step is not None else [_time(numbers, said, path)]
    for (name, unit, a, b), values in zip(said.analogue, analogue.T, strict=True):
        columns.append(array_column(name, a * values + b, where=str(path), unit=unit or None))
    columns += [
        array_column(name, one, where=str(path), unit="1") for name, one in zip(said.states, states.T, strict=True)
    ]
    named, notes = distinct(columns)
    time = named[0].name if step is None else None
    told = (*([f"recorded by {said.station}"] if said.station else []), *notes)
    return RawTable(source=path, reader="comtrade", columns=tuple(named), time=time, step=step, notes=told)


def _sections(raw: bytes) -> dict[str, bytes]:
    """The parts of a file that holds all of them; none of another."""
    found = list(_SECTION.finditer(raw))
    ends = [*(one.start() for one in found[1:]), len(raw)]
    return {one["kind"].decode().upper(): raw[one.end() : end] for one, end in zip(found, ends, strict=False)}


def _samples_beside(path: Path) -> Path:
    """The file of the samples of a ``.cfg``."""
    for suffix in (".dat", ".DAT", ".Dat"):
        if (beside := path.with_suffix(suffix)).is_file():
            return beside
    raise ReaderError(
        "the samples of the record are missing",
        where=path,
        expected=f"{path.with_suffix('.dat').name} beside it",
        got="no such file",
        remedy="copy both files of the record into one folder",
    )


def _described(text: bytes) -> _Described:
    try:
        lines = text.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        lines = text.decode("latin-1").splitlines()
    rows = [[cell.strip() for cell in line.replace("\x1a", "").split(",")] for line in lines]
    n_analogue, n_states = int(rows[1][1][:-1]), int(rows[1][2][:-1])
    analogue, states = rows[2 : 2 + n_analogue], rows[2 + n_analogue : 2 + n_analogue + n_states]
    at = 2 + n_analogue + n_states
    n_rates = int(rows[at + 1][0])
    rates = [(float(row[0]), int(row[1])) for row in rows[at + 2 : at + 2 + n_rates]]
    at += 2 + max(n_rates, 1)
    fraction = rows[at][1].rpartition(".")[2] if len(rows[at]) > 1 else ""
    times = float(rows[at + 3][0]) if len(rows) > at + 3 and rows[at + 3][0] else 1.0
    return _Described(
        station=", ".join(cell for cell in rows[0][:2] if cell),
        analogue=tuple((row[1], row[4], float(row[5]), float(row[6])) for row in analogue),
        states=tuple(row[1] for row in states),
        rates=tuple(rates),
        form=rows[at + 2][0].upper(),
        tick=times * (1e-9 if len(fraction) > 6 else 1e-6),
    )


def _rows(samples: bytes, said: _Described) -> int:
    return samples.count(b"\n") + 1 if said.form == "ASCII" else len(samples) // _kind(said).itemsize


def _kind(said: _Described) -> np.dtype[np.void]:
    """A sample as it is stored."""
    words = -(-len(said.states) // 16)
    return np.dtype([("at", "<u4", 2), ("analogue", _KINDS[said.form], len(said.analogue)), ("states", "<u2", words)])


Parts = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Number and stamp of each sample, its analogue channels, its states: a row each."""


def _of_text(samples: bytes, said: _Described) -> Parts:
    n = len(said.analogue)
    lines = [line.split(",") for line in samples.decode("latin-1").replace("\x1a", "").splitlines() if line.strip()]
    table = np.array([[float(cell) if cell.strip() else np.nan for cell in line] for line in lines], ndmin=2)
    analogue = np.where(table[:, 2 : 2 + n] == 99999.0, np.nan, table[:, 2 : 2 + n])
    return table[:, :2], analogue, table[:, 2 + n : 2 + n + len(said.states)]


def _of_binary(samples: bytes, said: _Described) -> Parts:
    kind = _kind(said)
    rows = np.frombuffer(samples, dtype=kind, count=len(samples) // kind.itemsize)
    analogue = rows["analogue"].reshape(len(rows), len(said.analogue)).astype(np.float64)
    analogue[analogue == _MISSING.get(said.form, np.nan)] = np.nan
    bits = (rows["states"].reshape(len(rows), -(-len(said.states) // 16), 1) >> np.arange(16, dtype=np.uint16)) & 1
    return (
        rows["at"].astype(np.float64),
        analogue,
        bits.reshape(len(rows), -1)[:, : len(said.states)].astype(np.float64),
    )


def _step(numbers: NDArray[np.float64], said: _Described) -> float | None:
    """Seconds between samples, where one rate holds for all of them and none was lost."""
    one = len({rate for rate, _ in said.rates}) == 1 and said.rates[0][0] > 0.0
    return 1.0 / said.rates[0][0] if one and len(numbers) > 1 and np.all(np.diff(numbers[:, 0]) == 1.0) else None


def _time(numbers: NDArray[np.float64], said: _Described, path: Path) -> RawColumn:
    """By the rates, where there are any, which say more digits than the stamps."""
    if not said.rates or not all(rate > 0.0 for rate, _ in said.rates):
        return array_column("time", said.tick * numbers[:, 1], where=str(path), unit="s")
    at = numbers[:, 0] - numbers[0, 0]
    time, begin, behind = np.zeros(len(at)), 0.0, 0.0
    for k, (rate, last) in enumerate(said.rates):
        end = float(last) - numbers[0, 0] + 1.0 if k < len(said.rates) - 1 else np.inf
        inside = (at >= behind) & (at < end)
        time[inside] = begin + (at[inside] - behind) / rate
        begin, behind = begin + (end - behind) / rate, end
    return array_column("time", time, where=str(path), unit="s")


def _broken(path: Path, expected: str, got: str) -> ReaderError:
    return ReaderError(
        "the COMTRADE record cannot be read",
        where=path,
        expected=expected,
        got=got,
        remedy="save it once more from the program of the relay, as COMTRADE 1999 or 2013, or as CSV",
    )
