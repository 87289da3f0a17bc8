"""Traces of columns that a test has."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sysid.traces import Channel, Trace


def trace_of(
    columns: Mapping[str, ArrayLike],
    *,
    name: str = "record",
    sample_time: float = 1.0,
    units: str | Mapping[str, str] = "V",
    usable: NDArray[np.bool_] | None = None,
) -> Trace:
    """A trace of some columns by name, each of shape ``(n_samples,)``; one unit stands for all."""
    channels = tuple(Channel(name=one, unit=units if isinstance(units, str) else units[one]) for one in columns)
    values = np.column_stack(list(columns.values()))
    return Trace(name=name, sample_time=sample_time, channels=channels, values=values, usable=usable)
