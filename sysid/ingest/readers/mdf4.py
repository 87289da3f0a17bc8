"""ASAM MDF measurement files of versions 3 and 4, by asammdf (the extra ``mdf``)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ReaderError
from sysid.extras import need
from sysid.ingest.options import FileOptions, RepairOptions
from sysid.ingest.readers.joining import Signal, joined_signals
from sysid.ingest.readers.reader import Reader, damaged, silent
from sysid.ingest.readers.tree import table_of
from sysid.ingest.table import RawTable

_MARKS = (b"MDF     ", b"UnFinMF ")


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    need("asammdf", f"reading {path.name}")
    from asammdf import MDF

    with path.open("rb") as raw:
        mark = raw.read(8)
    if mark not in _MARKS:
        raise damaged(path, "MDF", ValueError(f"it begins with {mark!r}"))
    try:
        with silent():
            file = MDF(path)
    except Exception as error:  # asammdf raises MdfException, struct.error, IndexError ... on damaged files
        raise damaged(path, "MDF", error) from error
    with file, silent():
        groups = {name: signals for name, signals in _groups(file).items() if signals}
    columns, notes = joined_signals(_choose(groups, options.group, path), path)
    return table_of(columns, path=path, reader="mdf4", options=options.model_copy(update={"group": None}), notes=notes)


READER = Reader(
    name="mdf4",
    suffixes=(".mf4", ".mdf", ".mf3", ".md3"),
    read=_read,
    options=frozenset({"group"}),
    is_mine=lambda head: head[:8] in _MARKS and head[8:9].isdigit(),
)


def _groups(file: Any) -> dict[str, list[Signal]]:
    """Signals with one value per time stamp, by the name of their channel group."""
    found: dict[str, list[Signal]] = {}
    for index, group in enumerate(file.groups):
        name = str(getattr(group.channel_group, "acq_name", "") or f"group {index}")
        name = name if name not in found else f"{name} ({index})"
        master = file.masters_db.get(index)
        numbers = [number for number in range(len(group.channels)) if number != master]
        signals = [_get(file, index, number) for number in numbers]
        found[name] = [_signal(s, name) for s in signals if s.samples.ndim == 1 and len(s.samples)]
    return found


def _get(file: Any, group: int, index: int) -> Any:
    signal = file.get(group=group, index=index)
    # States that the file gives names to are taken by their numbers.
    return signal if signal.samples.dtype.kind in "buif" else file.get(group=group, index=index, raw=True)


def _choose(groups: dict[str, list[Signal]], wanted: str | None, path: Path) -> list[Signal]:
    if wanted is not None:
        if wanted in groups:
            return groups[wanted]
        raise ReaderError(
            f"there is no channel group {wanted}",
            where=path,
            expected=f"one of {', '.join(groups)}",
            got=wanted,
            remedy="correct group, or leave it out",
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
    return signals


def _signal(signal: Any, group: str) -> Signal:
    samples = np.asarray(signal.samples)
    invalid = signal.invalidation_bits
    if invalid is not None and samples.dtype.kind in "buif":
        samples = np.where(np.asarray(invalid, dtype=bool), np.nan, samples.astype(np.float64))
    return Signal(
        name=signal.name,
        group=group,
        values=samples,
        stamps=np.asarray(signal.timestamps, dtype=np.float64),
        unit=str(signal.unit or "") or None,
        description=str(signal.comment or ""),
    )
