"""Tables whose rows are frequencies, as a sweep or a network analyser saves them, and no samples over time."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from sysid.ingest.cells.headers import unit_in_name
from sysid.ingest.tables.columns import RawColumn

_CALLED = re.compile(r"(?:^|[^a-z])(?:freq(?:uency|uenz|uence|s)?|omega|hz|khz)(?:$|[^a-z])", re.IGNORECASE)
_UNITS = {"Hz", "kHz", "MHz", "GHz", "rad/s"}
_LEAST = 5  # rows of a sweep


def frequencies_in(columns: Sequence[RawColumn]) -> RawColumn | None:
    """The column of frequencies of a frequency response.

    It is called so, is above 0, and rises from row to row, once or from its least value on again and again, as it
    does for each gain or load at which it was swept.

    Args:
        columns: Of a file in which nothing is called time.

    Returns:
        The column, or ``None``: what is measured in Hz over time goes up and down.
    """
    for column in columns:
        values = column.values
        called = _CALLED.search(column.name) or (column.unit or unit_in_name(column.name)) in _UNITS
        if not called or len(values) < _LEAST or not np.isfinite(values).all() or values.min() < 0.0:
            continue
        steps = np.diff(values)
        again = values[1:][steps <= 0.0]
        if len(again) <= len(values) / _LEAST and np.all(again == values.min()):
            return column
    return None


def over_frequency(column: RawColumn) -> str:
    """What is said of it.

    Args:
        column: The frequencies.

    Returns:
        A sentence.
    """
    return (
        f"{column.name} rises from {column.values.min():g} to {column.values.max():g}: these rows are frequencies, "
        "and no samples over time. A measured frequency response is fitted by sysid.estimation.fit_spectra"
    )
