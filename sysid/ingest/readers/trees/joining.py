"""Signals with time stamps of their own as the leaves of a tree."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.readers.trees.leaves import Leaf
from sysid.ingest.tables.joining import Signal, joined


def joined_signals(signals: Sequence[Signal], path: Path) -> tuple[dict[str, Leaf], list[str]]:
    """All signals at the stamps of the fastest one, as :func:`~sysid.ingest.tables.joining.joined` puts them there.

    Args:
        signals: At least one, each with samples.
        path: The file, for errors.

    Returns:
        Time and the signals by name, and what was done.

    Raises:
        ReaderError: If they do not overlap in time.
    """
    found, notes = joined(signals, path)
    columns = {signal.name: as_leaf(signal, signal.values) for signal in found}
    return {"time": Leaf(values=found[0].stamps, unit="s"), **columns}, notes


def as_leaf(signal: Signal, values: NDArray[Any]) -> Leaf:
    """A signal as a leaf of a tree.

    Args:
        signal: The signal.
        values: Its values, at whatever stamps.

    Returns:
        The leaf.
    """
    return Leaf(values=values, unit=signal.unit, description=signal.description)


def not_over_time(path: Path, over: str) -> ReaderError:
    """The error for channels that are recorded over anything but time.

    Args:
        path: The file.
        over: What they are recorded over.

    Returns:
        The error to raise.
    """
    return ReaderError(
        f"the channels stand over {over}, not over time",
        where=path,
        expected="values at instants of time",
        got=f"values over {over}",
        remedy="export the record over time in the program that made it",
    )
