"""What is said of a table whose rows are frequencies: it is no record, and fitted as it is."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np

from sysid.errors import ReaderError
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.over_frequency import called_frequency, rises_by_ratio


def over_frequency(column: RawColumn) -> str:
    """What is said of it.

    Args:
        column: The frequencies.

    Returns:
        A sentence.
    """
    values = column.values
    by = (
        " by the same ratio from row to row" if not called_frequency(column) and rises_by_ratio(np.sort(values)) else ""
    )
    way = "rises" if values[-1] >= values[0] else "falls"
    return (
        f"{column.name} {way} from {values[0]:g} to {values[-1]:g}{by}: these rows are frequencies, and no samples "
        "over time"
    )


def refuse_frequencies(told: str, path: Path) -> ReaderError:
    """Why such a file is no record.

    Args:
        told: What is said of its frequencies.
        path: The file.

    Returns:
        The error.
    """
    shown = shlex.quote(str(path))
    return ReaderError(
        "a frequency response is no record over time",
        where=path,
        expected="a row for each sample",
        got=told,
        remedy=f"fit it as it is: sysid fit-response {shown} --poles 2. Where the rows are samples over time, say how "
        f"far apart they are: sysid ingest {shown} --time-step 0.1",
    )
