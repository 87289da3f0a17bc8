"""Stretches of time in which channels must not count: their cells are emptied before anything else looks at them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.ingest.cells.began import Began
from sysid.ingest.tables.mask_options import MaskOptions
from sysid.ingest.tables.options import RepairOptions
from sysid.traces import Trace


def hidden(
    stamps: NDArray[np.float64],
    names: Sequence[str],
    repairs: RepairOptions,
    *,
    case: str,
    span: tuple[float, float],
    sample_time: float,
    source: Path,
    began: Began | None = None,
) -> tuple[NDArray[np.bool_], list[str]]:
    """Which cells of a file the stretches of ``repairs: {mask: ...}`` empty.

    Args:
        stamps: Shape ``(n_rows,)``, seconds; NaN where the file has none.
        names: The channels.
        repairs: What was asked for.
        case: Name of the record.
        span: What is left of it, in seconds: its ``start`` and ``stop``.
        sample_time: Seconds.
        source: The file, for errors.
        began: When its second 0 is, of calendar time.

    Returns:
        Shape ``(n_rows, n_channels)``, and one sentence for each stretch.

    Raises:
        ConfigError: If a channel is not there, or a stretch holds no sample of a record that it is for.
    """
    cells, notes = np.zeros((len(stamps), len(names)), dtype=np.bool_), []
    for number, mask in enumerate(repairs.mask or ()):
        if mask.channel is not None and mask.channel not in names:
            raise ConfigError.unknown(
                f"repairs.mask names {mask.channel}, which is not a channel",
                mask.channel,
                names,
                "write the name of a channel, or leave channel out: all of them are masked",
                where=f"the description of {source}, repairs.mask[{number}]",
            )
        if mask.cases and case not in mask.cases:
            continue
        stretch = mask.stretch(began, where=f"the description of {source}, repairs.mask[{number}]")
        low, high = stretch.span(sample_time)
        inside = stretch.holds(stamps, sample_time) & (stamps >= span[0]) & (stamps <= span[1])
        left = stamps[(stamps >= span[0]) & (stamps <= span[1])]
        if not inside.any():
            if len(left) and (mask.cases or (low <= left.max() and high >= left.min())):
                raise _empty(mask, number, f"{source}", [(case, float(left.min()), float(left.max()))])
            continue
        cells[inside] |= [mask.channel in {None, name} for name in names]
        before, behind = _sentence(mask)
        notes.append(f"{before}{int(inside.sum())}{behind}")
    return cells, notes


def masked(trace: Trace, repairs: RepairOptions, where: str) -> Trace:
    """A trace that was made, and not read, without the samples in stretches that are for it.

    Args:
        trace: The trace.
        repairs: What was asked for.
        where: Named in errors.

    Returns:
        The trace; itself where none is.

    Raises:
        ChannelError: If a channel is not there.
        ConfigError: If a stretch that names the trace holds no sample.
    """
    for number, mask in enumerate(repairs.mask or ()):
        if mask.cases and trace.name not in mask.cases:
            continue
        stretch = mask.stretch(where=f"{where}, repairs.mask[{number}]")
        if stretch.holds(trace.time, trace.sample_time).any():
            trace = trace.masked(mask.channel, start=stretch.start, stop=stretch.stop)
        elif mask.cases:
            raise _empty(mask, number, where, [(trace.name, float(trace.time[0]), float(trace.time[-1]))])
    return trace


def _sentence(mask: MaskOptions) -> tuple[str, str]:
    """What is noted of a stretch, before the number of samples and behind it."""
    return f"{mask.channel or 'all channels'}: ", f" samples masked, {mask.told}"


def check_masks(
    repairs: RepairOptions, traces: Sequence[Trace], *, cases: Sequence[str], where: str, whole: bool = True
) -> None:
    """Refuse a stretch that is for no record at all: of records that are parts of one file it is in one of them.

    Whether one held samples is read off what was noted: what is left of a record on its grid does not say it.

    Args:
        repairs: What was asked for.
        traces: The records.
        cases: The names that records may have.
        where: Named in errors.
        whole: Whether these are all records that there are.

    Raises:
        ConfigError: If a record is named that is not there, or a stretch lies outside of all of them.
    """
    for number, mask in enumerate(repairs.mask or ()):
        strangers = [case for case in mask.cases if case not in cases]
        if strangers:
            raise ConfigError.unknown(
                f"repairs.mask names the case {strangers[0]}, which is not there",
                strangers[0],
                cases,
                "write names of the data set's cases, or leave cases out: all of them are masked",
                where=f"{where}, repairs.mask[{number}]",
            )
        before, behind = _sentence(mask)
        told = (note for one in traces for note in one.provenance)
        if whole and not mask.cases and not any(note.startswith(before) and note.endswith(behind) for note in told):
            ends = [(one.name, one.start_time, one.start_time + one.sample_time * (len(one) - 1)) for one in traces]
            raise _empty(mask, number, where, ends)


def _empty(mask: MaskOptions, number: int, where: str, ends: Sequence[tuple[str, float, float]]) -> ConfigError:
    there = "; ".join(f"{name} from {first:.10g} s to {last:.10g} s" for name, first, last in ends[:5])
    return ConfigError(
        "a stretch to be masked holds no sample",
        where=f"{where}, repairs.mask[{number}]",
        expected=f"a stretch of {there}" + (" ..." if len(ends) > 5 else ""),
        got=mask.told,
        remedy="correct start and stop; they are seconds in the file's own time, of calendar time from its first row "
        "on, or dates" + (", or name the cases it is for" if not mask.cases else ""),
    )
