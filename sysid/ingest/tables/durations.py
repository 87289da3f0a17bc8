"""Lengths of time as Python has them, in seconds."""

from __future__ import annotations

from datetime import timedelta
from typing import Any

import numpy as np

from sysid.errors import ConfigError, shortened


def seconds(value: Any) -> Any:
    """A duration in seconds; of anything else itself.

    Args:
        value: A duration of Python's, NumPy's or pandas's, or a number; a number in single precision is the decimal
            number that it was written as.

    Returns:
        Seconds.

    Example:
        >>> seconds(timedelta(milliseconds=20)), seconds(np.float32(0.1))
        (0.02, 0.1)
    """
    if isinstance(value, np.timedelta64):
        return float(value / np.timedelta64(1, "s"))
    if isinstance(value, np.floating) and value.itemsize < np.dtype(np.float64).itemsize:
        return float(str(value))
    return value.total_seconds() if isinstance(value, timedelta) else value


def length_of_time(value: Any, *, where: str) -> Any:
    """Seconds of what somebody gives as a length of time.

    Args:
        value: As for :func:`seconds`, or nothing.
        where: What it is, for the error.

    Returns:
        Seconds, or nothing.

    Raises:
        ConfigError: If it is neither a number nor a duration.

    Example:
        >>> length_of_time(timedelta(hours=1), where="sample_time")
        3600.0
    """
    found = seconds(value)
    if found is None or (isinstance(found, int | float | np.number) and not isinstance(found, bool)):
        return found
    raise ConfigError(
        "not a length of time",
        where=where,
        expected="a number of seconds, or a duration",
        got=shortened(value),
        remedy=f"write for example {where}=3600, or {where}=datetime.timedelta(hours=1)",
    )
