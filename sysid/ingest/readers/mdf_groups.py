"""Groups of ASAM MDF measurement files of versions 3 and 4, by asammdf (the extra ``mdf``)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ReaderError
from sysid.extras import need
from sysid.ingest.readers.late import table_of
from sysid.ingest.readers.marks import MDF_MARKS
from sysid.ingest.readers.reader import damaged, silent
from sysid.ingest.readers.trees.joining import as_leaf, joined_signals, not_over_time
from sysid.ingest.tables.joining import Signal
from sysid.ingest.tables.options import FileOptions
from sysid.ingest.tables.table import RawTable

_FRAMES = {"CAN_DataFrame", "CAN_ErrorFrame", "CAN_RemoteFrame", "LIN_Frame", "FLX_Frame", "ETH_Frame", "MOST_Message"}
_OVER = {2: "angle", 3: "distance", 4: "the number of the sample"}
"""What a group may be recorded over but time, by the sync type of its master channel."""


def read(path: Path, options: FileOptions) -> RawTable:
    """Read such a file.

    Args:
        path: The file.
        options: How.

    Returns:
        Its columns.

    Raises:
        ReaderError: If it is damaged, or holds no record over time.
    """
    need("asammdf", f"reading {path.name}")
    from asammdf import MDF

    with path.open("rb") as raw:
        mark = raw.read(8)
    if mark not in MDF_MARKS:
        raise damaged(path, "MDF", ValueError(f"it begins with {mark!r}"))
    try:
        with silent():
            file = MDF(path)
    except Exception as error:  # asammdf raises MdfException, struct.error, IndexError ... on damaged files
        raise damaged(path, "MDF", error) from error
    with file, silent():
        found, aside = _groups(file, path)
    groups = {name: signals for name, signals in found.items() if signals}
    if not groups and aside:
        raise next(iter(aside.values()))
    chosen = _choose(groups, options.group, path)
    timed = [signal for signal in chosen if len(signal.stamps)]
    columns, notes = joined_signals(timed, path) if timed else ({s.name: as_leaf(s, s.values) for s in chosen}, [])
    notes += [f"{signal.name}: left out, as it has no clock" for signal in chosen if signal not in timed and timed]
    notes += [f"{name}: left out, as {error.what}" for name, error in aside.items()]
    return table_of(columns, path=path, reader="mdf4", options=options.model_copy(update={"group": None}), notes=notes)


def _groups(file: Any, path: Path) -> tuple[dict[str, list[Signal]], dict[str, ReaderError]]:
    """Signals with one value per time stamp, by the name of their channel group; and why groups have none."""
    found: dict[str, list[Signal]] = {}
    aside: dict[str, ReaderError] = {}
    for index, group in enumerate(file.groups):
        name = str(getattr(group.channel_group, "acq_name", "") or f"group {index}")
        name = name if name not in found else f"{name} ({index})"
        master = file.masters_db.get(index)
        numbers = [number for number in range(len(group.channels)) if number != master]
        signals = [_get(file, index, number) for number in numbers]
        signals = [signal for signal in signals if signal.samples.ndim == 1 and len(signal.samples)]
        problem = _not_a_record(signals, path) if signals else None
        if problem is None:
            found[name] = [_signal(signal, name, clock=master is not None) for signal in signals]
        else:
            aside[name] = problem
    return found, aside


def _not_a_record(signals: list[Any], path: Path) -> ReaderError | None:
    """Why a group is no record over time: the frames of a bus, or samples over angle, distance or number."""
    names = {str(signal.name).partition(".")[0] for signal in signals}
    frames = next((name for name in sorted(names) if name in _FRAMES), None)
    if frames is not None:
        return ReaderError(
            "frames of a bus are not decoded",
            where=path,
            expected="signals with values",
            got=f"{frames}: the bytes of messages",
            remedy="decode the log with the data base of the bus (in asammdf: file.extract_bus_logging({'CAN': "
            "[('bus.dbc', 0)]})), and save what comes of it",
        )
    sync = (signals[0].master_metadata or ("time", 1))[1]
    return not_over_time(path, _OVER[sync]) if sync in _OVER else None


def _get(file: Any, group: int, index: int) -> Any:
    # What is invalid stays in its place: without it, a signal would be interpolated there and nobody told.
    signal = file.get(group=group, index=index, ignore_invalidation_bits=True)
    if signal.samples.dtype.kind in "buif":
        return signal
    # States that the file gives names to are taken by their numbers.
    return file.get(group=group, index=index, raw=True, ignore_invalidation_bits=True)


def _choose(groups: dict[str, list[Signal]], wanted: str | None, path: Path) -> list[Signal]:
    if wanted is not None:
        if wanted in groups:
            return groups[wanted]
        raise ReaderError.unknown(
            f"there is no channel group {wanted}", wanted, groups, "correct group, or leave it out", where=path
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


def _signal(signal: Any, group: str, *, clock: bool) -> Signal:
    samples = np.asarray(signal.samples)
    invalid = signal.invalidation_bits
    if invalid is not None and samples.dtype.kind in "buif":
        samples = np.where(np.asarray(invalid, dtype=bool), np.nan, samples.astype(np.float64))
    return Signal(
        name=signal.name,
        group=group,
        values=samples,
        stamps=np.asarray(signal.timestamps if clock else (), dtype=np.float64),  # else asammdf counts the samples
        unit=str(signal.unit or "") or None,
        description=str(signal.comment or ""),
    )
