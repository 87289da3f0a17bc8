"""Groups of National Instruments TDMS files, by npTDMS (the extra ``tdms``)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ReaderError
from sysid.extras import need
from sysid.ingest.readers.late import table_of
from sysid.ingest.readers.reader import damaged, silent
from sysid.ingest.readers.trees.joining import joined_signals, not_over_time
from sysid.ingest.readers.trees.leaves import Leaf, refused
from sysid.ingest.tables.joining import Signal
from sysid.ingest.tables.options import FileOptions
from sysid.ingest.tables.rates import said_step
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import is_called_time

_UNITS = ("unit_string", "NI_UnitDescription", "unit", "units")
_NO_TIMES = {"frequency", "frequenz", "angle", "winkel", "order", "ordnung", "distance", "weg"}


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
    need("nptdms", f"reading {path.name}")
    from nptdms import TdmsFile

    try:
        with silent():
            file = TdmsFile.read(path)
            groups = {group.name: [channel for channel in group.channels() if len(channel)] for group in file.groups()}
            steps = {group.name: _said(group.properties) or _said(file.properties) for group in file.groups()}
    except Exception as error:  # npTDMS raises ValueError, KeyError, struct.error ... on damaged files
        raise damaged(path, "TDMS", error) from error
    notes = ["the file breaks off in its last segment"] if file.file_status.incomplete_final_segment else []
    for channel in (channel for members in groups.values() for channel in members):
        over = str(channel.properties.get("wf_xname", "")).strip()
        if over.casefold() in _NO_TIMES or str(channel.properties.get("wf_xunit_string", "")).casefold() == "hz":
            raise not_over_time(path, over or "frequency")
    filled = {name: channels for name, channels in groups.items() if channels}
    tree = _tree(filled, options.group, path, notes, steps)
    return table_of(tree, path=path, reader="tdms", options=options, separator="/", notes=notes)


def _said(properties: Mapping[str, Any]) -> float | None:
    """The sample time that properties say in words: ``Sample Rate = 10``."""
    return said_step(f"{name}: {value}" for name, value in properties.items())


def _tree(
    groups: dict[str, list[Any]],
    wanted: str | None,
    path: Path,
    notes: list[str],
    steps: Mapping[str, float | None],
) -> dict[str, Any]:
    if not groups:
        raise ReaderError(
            "the file holds no samples",
            where=path,
            expected="at least one channel with samples",
            got=f"groups {', '.join(groups)}" if groups else "none",
            remedy="check that the recording was saved",
        )
    channels = [channel for members in groups.values() for channel in members]
    names = [channel.name for channel in channels]
    if wanted is None and len(groups) > 1 and len(set(names)) == len(names) and all(map(_has_clock, channels)):
        # Groups of other channels that one clock has stamped are one recording.
        return _columns(channels, "", path, notes, None)
    return {name: _columns(members, name, path, notes, steps.get(name)) for name, members in groups.items()}


def _columns(channels: Sequence[Any], group: str, path: Path, notes: list[str], step: float | None) -> dict[str, Leaf]:
    """The channels of a group: at their own time stamps joined on one grid, where they have any."""
    own = {channel.name: _leaf(channel, path, step) for channel in channels}
    timed = [channel for channel in channels if _has_clock(channel) and own[channel.name].problem is None]
    # A channel of time says more than the step of a waveform, which is 1 where nobody set it.
    if not timed or any(is_called_time(channel.name) for channel in channels):
        return own
    if len(timed) < len(channels) and len({len(channel) for channel in channels}) > 1:
        notes.append(f"{group}: channels without a clock beside others: put side by side as they stand")
        return own
    starts = [_start(channel) for channel in timed]
    known = [start for start in starts if start is not None]
    first = min(known, default=None)
    signals = []
    for channel, start in zip(timed, starts, strict=True):
        late = 0.0 if start is None or first is None else float((start - first) / np.timedelta64(1, "ns")) / 1e9
        signals.append(_signal(channel, own[channel.name], group, late))
    joined, told = joined_signals(signals, path)
    notes.extend(told)
    return joined | {name: leaf for name, leaf in own.items() if name not in joined}


def _has_clock(channel: Any) -> bool:
    step = channel.properties.get("wf_increment")
    return isinstance(step, int | float | np.generic) and float(step) > 0.0


def _start(channel: Any) -> np.datetime64 | None:
    start = channel.properties.get("wf_start_time")
    try:
        return None if start is None else np.datetime64(start).astype("datetime64[ns]")
    except (ValueError, TypeError):
        return None


def _signal(channel: Any, leaf: Leaf, group: str, late: float) -> Signal:
    properties = channel.properties
    begin = late + float(properties.get("wf_start_offset", 0.0))
    stamps = begin + float(properties["wf_increment"]) * np.arange(len(channel), dtype=np.float64)
    return Signal(
        name=channel.name,
        group=group,
        values=leaf.values,
        stamps=stamps,
        unit=leaf.unit,
        description=leaf.description,
    )


def _leaf(channel: Any, path: Path, step: float | None) -> Leaf:
    properties = channel.properties
    try:
        values = np.asarray(channel[:])
    except (KeyError, ValueError, TypeError, IndexError, AttributeError) as error:  # of scales that are not whole
        return refused(damaged(Path(f"{path}, channel {channel.name}"), "TDMS", error))
    return Leaf(
        values=values,
        step=_said(properties) or step,
        unit=next((str(properties[key]) for key in _UNITS if properties.get(key)), None),
        description=str(properties.get("description") or ""),
    )
