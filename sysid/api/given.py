"""What a word of the short way may be given as its records."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sysid.errors import ConfigError
from sysid.traces import Role, Trace, TraceSet

TracesLike = TraceSet | Trace | Sequence[Trace]
"""A data set; or a record or several, all of them for estimation."""


def traces_of(given: TracesLike, *, word: str) -> TraceSet:
    """The data set that was given, or one of the records that were.

    Args:
        given: A data set, a record, or several.
        word: What it was given to, for the error.

    Returns:
        The data set; records of no set are all for estimation.

    Raises:
        ConfigError: If it is something else.
        TraceError: If the records do not go together, or there is none.
    """
    if isinstance(given, TraceSet):
        return given
    records = (given,) if isinstance(given, Trace) else given
    if not isinstance(records, list | tuple) or not all(isinstance(one, Trace) for one in records):
        raise ConfigError(
            f"sysid.{word} takes a data set",
            where="traces",
            expected="a TraceSet, a Trace, or a list of Traces",
            got=_named(given),
            remedy=f'write sysid.load("{given}")'
            if isinstance(given, str | Path)
            else "make one of it first: sysid.data(frame) of a frame, sysid.data((u, y), sample_time=0.1) of arrays",
        )
    name = records[0].name if len(records) == 1 else "traces"
    return TraceSet(name=name, traces=tuple(records), roles={one.name: Role.ESTIMATION for one in records})


def _named(given: object) -> str:
    if isinstance(given, list | tuple):
        inside = dict.fromkeys(type(one).__name__ for one in given)
        return f"a {type(given).__name__} of {' and '.join(inside) or 'nothing'}"
    return f"a {type(given).__name__}"
