"""Clocks that cannot be taken at their word: one that begins anew in each record, one coarser than the samples."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.table import RawTable, RecordChoice
from sysid.ingest.timing import Timing, round_step

_MOST_RECORDS = 200
_FEWEST_ROWS = 8
_CLOSE = 0.02  # of the time that a record lasts: so near to the first start is the start of each record


def records_by_clock(table: RawTable, stamps: NDArray[np.float64]) -> tuple[RecordChoice, ...]:
    """The records of a file that holds one below the other, each with a clock that begins anew.

    Sorted by time, samples of one experiment would stand between those of another; that no stamp steps back is what
    one experiment means.

    Args:
        table: The file.
        stamps: Its time stamps in seconds, shape ``(n_rows,)``.

    Returns:
        One choice of rows a record; empty where the clock does not begin anew.
    """
    if not np.isfinite(stamps).all():
        return ()
    begins = np.concatenate([[0], np.flatnonzero(np.diff(stamps) < 0.0) + 1, [len(stamps)]])
    if not 2 <= len(begins) - 1 <= _MOST_RECORDS or np.diff(begins).min() < _FEWEST_ROWS:
        return ()
    spans = stamps[begins[1:] - 1] - stamps[begins[:-1]]
    if (np.abs(stamps[begins[:-1]] - stamps[0]) > _CLOSE * spans).any():
        return ()
    return tuple(
        RecordChoice(
            name=f"record_{index}",
            options={"rows": [int(first) + 1, int(end)]},
            table=replace(table.between(int(first) + 1, int(end)), notes=table.notes),
        )
        for index, (first, end) in enumerate(itertools.pairwise(begins), 1)
    )


def finer_than_clock(known: NDArray[np.float64], timing: Timing) -> tuple[float, str] | None:
    """The sample time of a record whose stamps are coarser than its samples: a logger that writes whole seconds.

    Args:
        known: Its time stamps in seconds, shape ``(n,)``, all finite.
        timing: Their survey.

    Returns:
        Seconds between samples, and how that is known; ``None`` unless the same number of samples shares each stamp.
    """
    if len(timing.backward) or 2 * len(timing.duplicates) < len(known):
        return None
    stamps, counts = np.unique(known, return_counts=True)
    inner = counts[1:-1]  # the first and the last stamp may have been cut off
    if len(inner) < 2 or np.ptp(inner) > 1 or counts.max() > inner.max():
        return None
    steps = np.diff(stamps)
    if np.ptp(steps) > 1e-6 * steps.max():
        return None
    step = round_step(float(steps.mean() / inner.mean()))
    return (
        step,
        f"the clock counts in steps of {steps.mean():g} s and {inner.mean():.4g} samples share each: {step:g} s",
    )
