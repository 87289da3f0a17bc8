"""Clocks that cannot be taken at their word: one that begins anew in each record, one coarser than the samples."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.assembling.timing import Timing, round_step, roundest
from sysid.ingest.tables.table import RawTable, RecordChoice

_MOST_RECORDS = 200
_FEWEST_ROWS = 8
_BACK, _EVEN, _IN_ORDER = 1.5, 0.25, 0.95  # steps that a clock is set back, and how even what is only out of order is
_SHARED = 0.25
"""Of the stamps, how many are those before them again where few digits are all that can be the reason."""
_FEW_DIGITS = range(2, 8)
_CLOSE = 0.02  # of the time that a record lasts: so near to the first start is the start of each record


def records_by_clock(table: RawTable, stamps: NDArray[np.float64]) -> tuple[RecordChoice, ...]:
    """The records of a file that holds one below the other, each with a clock that begins anew or was set.

    Sorted by time, samples of one experiment would stand between those of another; that no stamp steps back is what
    one experiment means.

    Args:
        table: The file.
        stamps: Its time stamps in seconds, shape ``(n_rows,)``.

    Returns:
        One choice of rows a record; empty where the clock does neither.
    """
    if not np.isfinite(stamps).all() or len(stamps) < 2:
        return ()
    steps = np.diff(stamps)
    forward = steps[steps > 0.0]
    step = float(np.median(forward)) if len(forward) else 0.0
    begins = _anew(stamps, step)
    if not 2 <= len(begins) - 1 <= _MOST_RECORDS or np.diff(begins).min() < _FEWEST_ROWS:
        begins = _set(stamps, step)
    if not 2 <= len(begins) - 1 <= _MOST_RECORDS or np.diff(begins).min() < _FEWEST_ROWS:
        return ()
    return tuple(
        RecordChoice(
            name=f"record_{index}",
            options={"rows": [int(first) + 1, int(end)]},
            table=replace(table.between(int(first) + 1, int(end)), notes=table.notes),
        )
        for index, (first, end) in enumerate(itertools.pairwise(begins), 1)
    )


def _anew(stamps: NDArray[np.float64], step: float) -> NDArray[np.int64]:
    """Where records begin, and the end, of a clock that begins each of them near the same time."""
    begins = np.concatenate([[0], np.flatnonzero(np.diff(stamps) < 0.0) + 1, [len(stamps)]])
    # By their usual step: a clock that is set within a record would make it last as long as it jumps.
    spans = step * (np.diff(begins) - 1)
    near = np.abs(stamps[begins[:-1]] - stamps[0]) <= _CLOSE * spans
    return begins if near.all() else np.zeros(1, dtype=np.int64)


def _set(stamps: NDArray[np.float64], step: float) -> NDArray[np.int64]:
    """Where a clock was set, back by some steps or on by more than was recorded, and the end.

    Sorted by time, what came after would stand between what was before. Where it does not, rows were only written in
    another order than they were taken in.
    """
    steps = np.diff(stamps)
    back, on = steps < -_BACK * step, steps > step * len(stamps)
    ordered = np.diff(np.sort(stamps))
    even = np.mean(np.abs(ordered - step) <= _EVEN * step) if len(ordered) else 1.0
    # What is left open between them is no place for what was written later: a counter that wraps begins anew.
    if not on.any() and even >= _IN_ORDER and ordered.max(initial=0.0) <= _BACK * step:
        return np.zeros(1, dtype=np.int64)
    return np.concatenate([[0], np.flatnonzero(back | on) + 1, [len(stamps)]])


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


def of_few_digits(known: NDArray[np.float64]) -> tuple[float, str] | None:
    """The sample time of an even clock of which only the first digits were written: 1230, 1230, 1240 of 1231.2 on.

    ``%g`` and the like keep as many digits however large the number is, so that later stamps are coarser than earlier
    ones, and stamps of many samples are one.

    Args:
        known: Time stamps in seconds, shape ``(n,)``, all finite.

    Returns:
        Seconds between samples, and how that is known; ``None`` unless an even clock has all of these stamps.
    """
    n = len(known)
    if n < _FEWEST_ROWS or (np.diff(known) < 0.0).any() or known[0] < 0.0 or not known[-1] > known[0]:
        return None
    decade = np.floor(np.log10(np.maximum(known, np.finfo(np.float64).tiny)) + 1e-12)
    for digits in _FEW_DIGITS:
        unit = 10.0 ** (decade - digits + 1)
        if (np.abs(np.rint(known / unit) * unit - known) > 1e-9 * known).any():
            continue
        k, last = np.arange(1, n), np.where(known > 0.0, unit, 0.0) * (1.0 + 1e-6)
        shared = np.mean(np.diff(known) == 0.0) >= _SHARED
        for off in (0.5 * last, last)[: 1 + shared]:  # rounded once; or cut off, or rounded again in other units
            low = float(((known[1:] - off[1:] - known[0] - off[0]) / k).max())
            high = float(((known[1:] + off[1:] - known[0] + off[0]) / k).min())
            if 0.0 < low <= high:
                step = roundest(low, high)
                told = f"samples {step:g} s apart would have all of its stamps"
                return step, f"the clock is written in {digits} digits, and {told}"
        return None
    return None
