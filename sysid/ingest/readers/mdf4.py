"""ASAM MDF 4 measurement files, by asammdf (the extra ``mdf``)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import MissingExtraError, ReaderError
from sysid.ingest.options import FileOptions, RepairOptions
from sysid.ingest.readers.reader import Reader, damaged
from sysid.ingest.table import RawColumn, RawTable, array_column

_MARKS = (b"MDF     ", b"UnFinMF ")


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    try:
        from asammdf import MDF
    except ImportError as error:
        raise MissingExtraError("asammdf", "mdf", f"reading {path.name}") from error

    with path.open("rb") as raw:
        mark = raw.read(8)
    if mark not in _MARKS:
        raise damaged(path, "MDF", ValueError(f"it begins with {mark!r}"))
    try:
        file = MDF(path)
    except Exception as error:  # asammdf raises MdfException, struct.error, IndexError ... on damaged files
        raise damaged(path, "MDF", error) from error
    with file:
        groups = {name: signals for name, signals in _groups(file).items() if signals}
    chosen = _choose(groups, options.group, path)
    stamps = chosen[0].timestamps
    columns = [array_column("time", np.asarray(stamps), where=str(path), unit="s")]
    columns += [_column(signal, path) for signal in chosen]
    return RawTable(source=path, reader="mdf4", columns=tuple(columns), time="time")


READER = Reader(name="mdf4", suffixes=(".mf4", ".mdf"), read=_read, options=frozenset({"group"}))


def _groups(file: Any) -> dict[str, list[Any]]:
    """Signals with one value per time stamp, by the name of their channel group."""
    found: dict[str, list[Any]] = {}
    for index, group in enumerate(file.groups):
        name = str(getattr(group.channel_group, "acq_name", "") or f"group {index}")
        name = name if name not in found else f"{name} ({index})"
        master = file.masters_db.get(index)
        numbers = [number for number in range(len(group.channels)) if number != master]
        signals = [file.get(group=index, index=number) for number in numbers]
        found[name] = [signal for signal in signals if signal.samples.ndim == 1 and len(signal.samples)]
    return found


def _choose(groups: dict[str, list[Any]], wanted: str | None, path: Path) -> list[Any]:
    if wanted is not None:
        if wanted in groups:
            return groups[wanted]
        raise ReaderError(
            f"there is no channel group {wanted}",
            where=path,
            expected=f"one of {', '.join(groups)}",
            got=wanted,
            remedy="correct group",
        )
    signals = [signal for group in groups.values() for signal in group]
    if not signals:
        raise ReaderError(
            "the file holds no samples",
            where=path,
            expected="at least one channel group with samples",
            got="none",
            remedy="check that the recording was saved",
        )
    if all(_same(signals[0].timestamps, signal.timestamps) for signal in signals):
        return signals
    raise ReaderError(
        "the channel groups have different time stamps",
        where=path,
        expected="one time base, or the name of the group that is meant",
        got=", ".join(f"{name} ({len(group[0].samples)} samples)" for name, group in groups.items()),
        remedy="name one of them (group: ...), or resample in the measurement tool before the export",
    )


def _same(first: NDArray[np.float64], second: NDArray[np.float64]) -> bool:
    return first is second or np.array_equal(first, second)


def _column(signal: Any, path: Path) -> RawColumn:
    samples = np.asarray(signal.samples)
    invalid = signal.invalidation_bits
    if invalid is not None and samples.dtype.kind in "buif":
        samples = np.where(np.asarray(invalid, dtype=bool), np.nan, samples.astype(np.float64))
    return array_column(
        signal.name,
        samples,
        where=str(path),
        unit=str(signal.unit or "") or None,
        description=str(signal.comment or ""),
    )
