"""Tables whose rows are frequencies, as a sweep or a network analyser saves them, and no samples over time."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.cells.headers import unit_in_name
from sysid.ingest.tables.columns import RawColumn

_CALLED = re.compile(r"(?:^|[^a-z])(?:freq(?:uency|uenz|uence|s)?|hz|khz)(?:$|[^a-z])", re.IGNORECASE)
_SPEED_TOO = re.compile(r"(?:^|[^a-z])omega(?:$|[^a-z])", re.IGNORECASE)
_NAMELESS = re.compile(r"(?:[a-z]*[ _.]?\d+|[fwxω]|fr)$", re.IGNORECASE)
_PARTS = re.compile(
    r"(?P<ii>''|\")|(?P<r>')|\b[ZYHG]?(?:(?P<re>re(?:al)?)|(?P<im>im(?:ag(?:inary)?)?)|(?P<ph>ph(?:ase|z))|"
    r"(?P<g>mod(?:ulus)?|mag(?:nitude)?|gain))(?![a-z])",
    re.IGNORECASE,
)
_PART = {"ii": "imaginary", "im": "imaginary", "r": "real", "re": "real", "ph": "phase", "g": "gain"}
_UNITS, _UNIT_OF_SPEED = {"Hz", "kHz", "MHz", "GHz"}, "rad/s"
_LEAST = 5  # rows of a sweep
_DECADE, _SAME_RATIO = 10.0, 0.05


def frequencies_in(columns: Sequence[RawColumn]) -> RawColumn | None:
    """The column of frequencies of a frequency response.

    It is called so, is above 0, and rises from row to row, or falls, once or from its end on again and again, as it
    does for each gain or load at which it was swept. An omega, or what is in rad/s, may be the speed of a motor that is
    started: it is a frequency where the parts of a response stand beside it, or where it rises by the same ratio. The
    first of several columns is one, too, where it stands beside complex numbers; and one without a name of its own
    that rises by the same ratio, over a decade and more.

    Args:
        columns: Of a file in which nothing is called time.

    Returns:
        The column, or ``None``: what is measured in Hz over time goes up and down.
    """
    for column in columns:
        if called_frequency(column) and any(_swept(column.values[::way]) for way in (1, -1)):
            speed = not _CALLED.search(column.name) and _unit(column) not in _UNITS
            if not speed or _has_parts(columns) or any(rises_by_ratio(column.values[::way]) for way in (1, -1)):
                return column
    first = next((column for column in columns if column.complex_values is None), None)
    if first is None or len(columns) < 2:
        return None
    beside = any(column.complex_values is not None for column in columns) and _swept(first.values)
    ratio = _NAMELESS.match(first.name) and any(rises_by_ratio(first.values[::way]) for way in (1, -1))
    return first if beside or ratio else None


def _swept(values: NDArray[np.float64]) -> bool:
    """Whether values rise from row to row, once or from the least of them on again and again."""
    if len(values) < _LEAST or not np.isfinite(values).all() or values.min() < 0.0:
        return False
    again = values[1:][np.diff(values) <= 0.0]
    return bool(len(again) <= len(values) / _LEAST and np.all(again == values.min()))


def swept_beside(columns: Sequence[RawColumn]) -> RawColumn | None:
    """The column of frequencies of a response whose rows have times, too, as analysers of impedances write them.

    Args:
        columns: Of a file with a clock.

    Returns:
        The column; ``None`` where nothing beside it is both parts of a response: a frequency that rises over time is
        a signal.
    """
    if not _has_parts(columns):
        return None
    swept = frequencies_in([c for c in columns if called_frequency(c)])
    return swept if swept is not None and np.ptp(swept.values) > 0.0 else None


def called_frequency(column: RawColumn) -> bool:
    """Whether name or unit say that a column is a frequency."""
    named = _CALLED.search(column.name) or _SPEED_TOO.search(column.name)
    return bool(named) or _unit(column) in {*_UNITS, _UNIT_OF_SPEED}


def _unit(column: RawColumn) -> str | None:
    return column.unit or unit_in_name(column.name)


def _has_parts(columns: Sequence[RawColumn]) -> bool:
    """Whether both parts of a response stand side by side, or complex numbers."""
    parts = {_PART[match.lastgroup] for c in columns if (match := _PARTS.search(c.name)) and match.lastgroup}
    whole = any(column.complex_values is not None for column in columns)
    return whole or {"real", "imaginary"} <= parts or {"gain", "phase"} <= parts


def rises_by_ratio(values: NDArray[np.float64]) -> bool:
    """Whether values rise as the frequencies of a sweep do, which is how no clock runs."""
    if len(values) < 2 * _LEAST or not np.isfinite(values).all() or values.min() <= 0.0:
        return False
    ratios = np.log(values[1:] / values[:-1])
    usual = float(np.median(ratios))
    return bool(usual > 0.0 and np.ptp(ratios) < _SAME_RATIO * usual and values[-1] >= _DECADE * values[0])
