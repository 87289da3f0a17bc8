"""National Instruments TDMS files, by npTDMS (the extra ``tdms``)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import MissingExtraError, ReaderError
from sysid.ingest.options import FileOptions, RepairOptions
from sysid.ingest.readers.reader import Reader, damaged
from sysid.ingest.table import RawColumn, RawTable, array_column, of_one_length, recognise_time


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    try:
        from nptdms import TdmsFile
    except ImportError as error:
        raise MissingExtraError("npTDMS", "tdms", f"reading {path.name}") from error

    try:
        file = TdmsFile.read(path)
        groups = {group.name: group.channels() for group in file.groups()}
    except Exception as error:  # npTDMS raises ValueError, KeyError, struct.error ... on damaged files
        raise damaged(path, "TDMS", error) from error
    channels = _channels(groups, options.group, path)
    columns = [_column(channel, path) for channel in channels]
    if recognise_time(columns) is None:
        columns = _waveform_time(channels, path) + columns
    alike = of_one_length(columns, where=str(path))
    notes = ("the file breaks off in its last segment",) if file.file_status.incomplete_final_segment else ()
    return RawTable(source=path, reader="tdms", columns=alike, time=recognise_time(alike), notes=notes)


READER = Reader(name="tdms", suffixes=(".tdms",), read=_read, options=frozenset({"group"}))


def _channels(groups: dict[str, list[Any]], wanted: str | None, path: Path) -> list[Any]:
    filled = {name: [channel for channel in channels if len(channel)] for name, channels in groups.items()}
    filled = {name: channels for name, channels in filled.items() if channels}
    if wanted is None and len(filled) == 1:
        return next(iter(filled.values()))
    if wanted in filled:
        return filled[wanted]
    raise ReaderError(
        "the file holds several groups" if wanted is None else f"there is no group {wanted}",
        where=path,
        expected=f"one of {', '.join(filled) or 'none: the file holds no samples'}",
        got="no choice among them" if wanted is None else wanted,
        remedy="name the group that is meant (group: ...)",
    )


def _column(channel: Any, path: Path) -> RawColumn:
    properties = channel.properties
    return array_column(
        channel.name,
        np.asarray(channel[:]),
        where=str(path),
        unit=str(properties.get("unit_string") or properties.get("unit") or "") or None,
        description=str(properties.get("description") or ""),
    )


def _waveform_time(channels: list[Any], path: Path) -> list[RawColumn]:
    """Time from the waveform properties, where there is no time channel."""
    for channel in channels:
        step = channel.properties.get("wf_increment")
        if step:
            start = float(channel.properties.get("wf_start_offset", 0.0))
            stamps = start + float(step) * np.arange(len(channel))
            return [array_column("time", stamps, where=str(path), unit="s")]
    return []
