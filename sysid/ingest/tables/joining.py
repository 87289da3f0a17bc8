"""Signals with time stamps of their own on one grid."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError


@dataclass(frozen=True, kw_only=True, eq=False)
class Signal:
    """A channel with its own clock.

    Args:
        name: Its name.
        group: The group it stands in.
        values: Shape ``(n,)``.
        stamps: Shape ``(n,)``, seconds.
        unit: As found in the file.
        description: As found in the file.
    """

    name: str
    group: str
    values: NDArray[Any]
    stamps: NDArray[np.float64]
    unit: str | None = None
    description: str = ""

    @property
    def step(self) -> float:
        """Median of its steps, in seconds; infinite for a single sample."""
        return float(np.median(np.diff(self.stamps))) if len(self.stamps) > 1 else np.inf


def joined(signals: Sequence[Signal], path: Path) -> tuple[list[Signal], list[str]]:
    """All signals at the stamps of the fastest one.

    A slower signal of real numbers is interpolated linearly between its samples, one of whole numbers is held.
    After its last sample it is held for one of its own steps; further out it is missing.

    Args:
        signals: At least one, each with samples.
        path: The file, for errors.

    Returns:
        The signals, all with the same stamps and each with a name of its own, and what was done.

    Raises:
        ReaderError: If they do not overlap in time.
    """
    signals = _differently_named(signals)
    first = signals[0]
    if all(len(s.stamps) == len(first.stamps) and np.array_equal(s.stamps, first.stamps) for s in signals):
        return signals, []
    fastest = min(signals, key=lambda signal: (signal.step, -len(signal.stamps)))
    grid = fastest.stamps
    found, notes = list[Signal](), []
    for signal in signals:
        if np.array_equal(signal.stamps, grid):
            found.append(signal)
            continue
        if signal.values.dtype.kind not in "buif":
            found.append(replace(signal, values=np.full(len(grid), "", dtype=np.str_), stamps=grid))
            continue
        values = _at(signal, grid)
        if not np.isfinite(values).any():
            raise _apart(signals, path)
        found.append(replace(signal, values=values, stamps=grid))
        how = "held" if signal.values.dtype.kind in "bui" else "interpolated"
        notes.append(
            f"{signal.name}: {how} from {signal.step:g} s onto the time stamps of {fastest.name}, {fastest.step:g} s"
        )
    return found, notes


def _differently_named(signals: Sequence[Signal]) -> list[Signal]:
    count = Counter(signal.name for signal in signals)
    named = [
        replace(signal, name=f"{signal.group}.{signal.name}") if count[signal.name] > 1 and signal.group else signal
        for signal in signals
    ]
    again = Counter(signal.name for signal in named)
    return [
        replace(signal, name=f"{signal.name} ({index + 1})")
        if again[signal.name] > 1 or signal.name == "time"
        else signal
        for index, signal in enumerate(named)
    ]


def _at(signal: Signal, grid: NDArray[np.float64]) -> NDArray[np.float64]:
    order = np.argsort(signal.stamps, kind="stable")
    stamps, samples = signal.stamps[order], signal.values[order].astype(np.float64)
    step = signal.step if np.isfinite(signal.step) else 0.0
    fuzz = 1e-9 * max(abs(float(grid[0])), abs(float(grid[-1])), step)
    if signal.values.dtype.kind in "bui":
        place = np.searchsorted(stamps, grid + fuzz, side="right") - 1
        values = samples[np.clip(place, 0, None)]
    else:
        values = np.interp(grid, stamps, samples)
    values[(grid < stamps[0] - fuzz) | (grid >= stamps[-1] + step - fuzz) & (grid > stamps[-1] + fuzz)] = np.nan
    return values


def _apart(signals: Sequence[Signal], path: Path) -> ReaderError:
    spans = dict.fromkeys(f"{s.group or s.name} ({s.stamps[0]:g} to {s.stamps[-1]:g} s)" for s in signals)
    return ReaderError(
        "the groups of channels do not overlap in time",
        where=path,
        expected="channels that were recorded together, or the name of the group that is meant",
        got=", ".join(spans),
        remedy=f"name one of them, for example files: {{group: {signals[0].group}}}",
    )
