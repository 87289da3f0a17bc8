"""What a word of the short way may be given as its records."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sysid.errors import ConfigError, shortened
from sysid.estimation import FitResult
from sysid.models import AbstractStructure, Mapping, Start, StartKind
from sysid.traces import Role, Trace, TraceSet

ESTIMATED = Start(kind=StartKind.ESTIMATED)

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
            remedy=_instead(given, word),
        )
    name = records[0].name if len(records) == 1 else "traces"
    return TraceSet(name=name, traces=tuple(records), roles={one.name: Role.ESTIMATION for one in records})


def path_of(given: object, *, word: str) -> Path:
    """A path that was given, by name or as a path.

    Args:
        given: What stands where one belongs.
        word: What it was given to, for the error.

    Returns:
        The path.

    Raises:
        ConfigError: If it is no name and no path.
    """
    if isinstance(given, str | Path):
        return Path(given)
    raise ConfigError(
        f"sysid.{word} takes a name or a path",
        expected="text, or a pathlib.Path",
        got=_named(given),
        remedy="what is in memory becomes a data set by sysid.data(...)" if word == "load" else "write where it lies",
    )


def check_order(mapping: object, structure: object) -> None:
    """Refuse a mapping and a structure that stand in each other's place.

    Args:
        mapping: What stands where the mapping belongs.
        structure: What stands where the structure belongs.

    Raises:
        ConfigError: If the first is a structure.
    """
    if isinstance(mapping, AbstractStructure) or (isinstance(mapping, type) and issubclass(mapping, AbstractStructure)):
        swapped = isinstance(structure, str | Mapping | Dict)
        raise ConfigError(
            "mapping and structure are swapped" if swapped else "a structure stands where the mapping belongs",
            where="mapping",
            expected="the mapping, then the structure",
            got=f"{_shown(mapping)}, then {_shown(structure)}",
            remedy='write sysid.fit(traces, "u -> y", structure)',
        )


def _shown(given: object) -> str:
    return f"class {given.__name__}" if isinstance(given, type) else shortened(given, limit=60)


def _instead(given: Any, word: str) -> str:
    """What to write in place of what is no data set."""
    if isinstance(given, AbstractStructure | Mapping | FitResult) or (isinstance(given, str) and "->" in given):
        return f"the data set comes first: sysid.{word}(traces, ...)"
    if isinstance(given, str | Path):
        return f'write sysid.load("{given}")'
    return "make one of it first: sysid.data(frame) of a frame, sysid.data((u, y), sample_time=0.1) of arrays"


def _named(given: object) -> str:
    if isinstance(given, list | tuple):
        inside = dict.fromkeys(type(one).__name__ for one in given)
        return f"a {type(given).__name__} of {' and '.join(inside) or 'nothing'}"
    return f"a {type(given).__name__}"
