"""Roles for records: by share, by time, by a column, or experiment by experiment."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, shortened
from sysid.ingest.tables.durations import seconds
from sysid.traces import Role, Trace, TraceSet

Split = float | Sequence[float] | Sequence[str | Role] | Mapping[Any, Any] | str | None
"""How records get their roles; :func:`sysid.ingest.memory.arrays.data` says what each form means."""

ROLES = {role.value: role for role in Role} | {
    "train": Role.ESTIMATION,
    "training": Role.ESTIMATION,
    "fit": Role.ESTIMATION,
    "est": Role.ESTIMATION,
    "select": Role.SELECTION,
    "choose": Role.SELECTION,
    "val": Role.VALIDATION,
    "valid": Role.VALIDATION,
}
"""Words for roles, ours and those of other libraries."""

SHARES = {2: (Role.ESTIMATION, Role.VALIDATION), 3: (Role.ESTIMATION, Role.SELECTION, Role.VALIDATION)}
"""What two and three shares are for."""


def split_traces(
    traces: tuple[Trace, ...], split: Split, marks: Sequence[NDArray[Any] | None], *, name: str
) -> TraceSet:
    """Give traces their roles, cutting them where the split says so.

    Args:
        traces: The records, whole.
        split: How.
        marks: For each trace the role of each of its samples, where a column says it.
        name: Name of the data set.

    Returns:
        The data set.

    Raises:
        ConfigError: If the split cannot be meant.
    """
    if split is None:
        return TraceSet(name=name, traces=traces, roles={trace.name: Role.ESTIMATION for trace in traces})
    if isinstance(split, str):
        parts = [part for trace, mark in zip(traces, marks, strict=True) for part in _by_column(trace, mark)]
    elif isinstance(split, Mapping):
        parts = _by_name(traces, split) or [part for trace in traces for part in _by_time(trace, split)]
    elif isinstance(split, float | int | np.number):
        parts = _by_share(traces, [float(split)])
    elif not isinstance(split, Iterable):
        raise ConfigError(
            "not a split",
            where="split",
            expected="a share, shares, roles, or spans of time by role",
            got=shortened(split),
            remedy='write for example split={"estimation": (0, 60), "validation": (60, None)}, in seconds from the '
            "first sample, or in durations",
        )
    elif all(isinstance(entry, str | Role) for entry in split):
        parts = _by_experiment(traces, [_word(entry) for entry in split])
    else:
        parts = _by_share(traces, [_share(entry) for entry in split])
    named: list[Trace] = []
    roles: dict[str, Role] = {}
    for role, part in parts:
        label = part.name
        while label in roles:
            label = f"{part.name}-{1 + sum(one.name.startswith(part.name) for one in named)}"
        named.append(dataclasses.replace(part, name=label))
        roles[label] = role
    return TraceSet(name=name, traces=tuple(named), roles=roles)


def spans_of(shares: Sequence[float], n: int) -> list[tuple[Role, int, int]]:
    """What shares come to.

    Args:
        shares: One share, of estimation, or two or three that add up to 1.
        n: How many samples, or experiments.

    Returns:
        For each role its first one, counted from 0, and the one after its last.

    Raises:
        ConfigError: If they are no shares, or one of them is empty.

    Example:
        >>> [(role.value, start, stop) for role, start, stop in spans_of([0.7], 10)]
        [('estimation', 0, 7), ('validation', 7, 10)]
    """
    parts = _shares([*shares, 1.0 - shares[0]] if len(shares) == 1 else list(shares))
    ends = [0, *np.rint(np.cumsum([share for _, share in parts]) * n).astype(int).tolist()]
    if any(stop <= start for start, stop in pairwise(ends)):
        raise ConfigError(
            "a share of the split is empty",
            where="split",
            expected=f"at least one of {n} for each role",
            got=", ".join(f"{role.value} {share:g}" for role, share in parts),
            remedy="give other shares, or a role for each experiment",
        )
    return [(role, start, stop) for (role, _), (start, stop) in zip(parts, pairwise(ends), strict=True)]


def _share(entry: Any) -> float:
    """A number, or NaN, which is no share."""
    return float(entry) if isinstance(entry, int | float | np.number) else float("nan")


def _shares(shares: list[float]) -> list[tuple[Role, float]]:
    if len(shares) not in SHARES or min(shares) <= 0.0 or not np.isclose(sum(shares), 1.0):
        raise ConfigError(
            "not a split into shares",
            where="split",
            expected="a share between 0 and 1, or two or three shares that add up to 1",
            got=", ".join(f"{share:g}" for share in shares),
            remedy="write for example split=0.7, or split=(0.6, 0.2, 0.2) for estimation, selection and validation",
        )
    return list(zip(SHARES[len(shares)], shares, strict=True))


def _by_share(traces: tuple[Trace, ...], shares: list[float]) -> list[tuple[Role, Trace]]:
    """One record is cut along time; of several, whole experiments go to each role in their order."""
    if len(traces) == 1:
        return [
            (role, _cut(traces[0], start, stop, role.value)) for role, start, stop in spans_of(shares, len(traces[0]))
        ]
    return [(role, trace) for role, start, stop in spans_of(shares, len(traces)) for trace in traces[start:stop]]


def _by_experiment(traces: tuple[Trace, ...], words: list[str]) -> list[tuple[Role, Trace]]:
    if len(words) != len(traces):
        raise ConfigError(
            "roles and experiments do not match",
            where="split",
            expected=f"a role for each of {len(traces)} experiments",
            got=", ".join(words),
            remedy="give one role an experiment",
        )
    return [(_role(word), trace) for word, trace in zip(words, traces, strict=True)]


def _by_name(traces: tuple[Trace, ...], roles: Mapping[Any, Any]) -> list[tuple[Role, Trace]]:
    """Each experiment's role by its name; nothing where the values are spans of time."""
    if not roles or not all(isinstance(role, str | Role) for role in roles.values()):
        return []
    names, given = [trace.name for trace in traces], {str(name): role for name, role in roles.items()}
    if set(given) != set(names):
        raise ConfigError(
            "roles and experiments do not match",
            where="split",
            expected=f"a role for each of {', '.join(names)}",
            got=", ".join(given),
            remedy="name each experiment once: its name is its key in the dict of records, or record-1, record-2 ...",
        )
    return [(_role(_word(given[trace.name])), trace) for trace in traces]


def _by_time(trace: Trace, spans: Mapping[Any, Any]) -> list[tuple[Role, Trace]]:
    parts = []
    fuzz = 1e-6 * trace.sample_time
    taken = np.zeros(len(trace), dtype=bool)
    for key, span in spans.items():
        word = _word(key)
        start, stop = _span(word, span)
        inside = np.flatnonzero((trace.time >= start - fuzz) & (trace.time < stop - fuzz))
        if not len(inside):
            raise ConfigError(
                "a span of the split holds no sample",
                where=f"split, {word}",
                expected=f"seconds between {trace.time[0]:g} and {trace.time[-1]:g}",
                got=f"{start:g} to {stop:g}",
                remedy="correct the span; its end is not part of it",
            )
        if taken[inside].any():
            raise ConfigError(
                "two spans of the split hold the same samples",
                where=f"split, {word}",
                expected="spans that do not overlap: what is fitted cannot test the fit",
                got=f"{start:g} to {stop:g}, of which {int(taken[inside].sum())} samples are in an earlier span",
                remedy="let each span begin where the one before it ends; its end is not part of it",
            )
        taken[inside] = True
        parts.append((_role(word), _cut(trace, int(inside[0]), int(inside[-1]) + 1, word)))
    return parts


def _span(word: str, span: Any) -> tuple[float, float]:
    try:
        first, last = span
        start = -np.inf if first is None else float(seconds(first))
        stop = np.inf if last is None else float(seconds(last))
    except (TypeError, ValueError):
        raise ConfigError(
            "a span of the split is a pair of times",
            where=f"split, {word}",
            expected="(start, stop), in seconds or as durations; None for an open end",
            got=repr(span)[:60],
            remedy="write for example split={'estimation': (0, 60), 'validation': (60, 90)}",
        ) from None
    return start, stop


def _by_column(trace: Trace, marks: NDArray[Any] | None) -> list[tuple[Role, Trace]]:
    """One part for each stretch of samples that have the same word."""
    words = [] if marks is None else [str(word) for word in marks.tolist()]
    if len(words) != len(trace):
        raise ConfigError(
            "a record that is resampled cannot be split by a column",
            where="split",
            expected=f"a word for each of {len(trace)} samples",
            got=f"{len(words)} words",
            remedy="split it by time: {'estimation': (start, stop), ...}",
        )
    changes = [0, *(i for i in range(1, len(words)) if words[i] != words[i - 1]), len(words)]
    return [(_role(words[start]), _cut(trace, start, stop, words[start])) for start, stop in pairwise(changes)]


def _word(role: object) -> str:
    """A role as a word, of :class:`Role` or as text."""
    return str(role.value if isinstance(role, Role) else role)


def _role(word: str) -> Role:
    if word.strip().lower() not in ROLES:
        raise ConfigError.unknown(
            "unknown role",
            word,
            ROLES,
            "estimation is fitted, selection chooses between fits, validation and test are only scored",
            where="split",
        )
    return ROLES[word.strip().lower()]


def _cut(trace: Trace, start: int, stop: int, name: str) -> Trace:
    return dataclasses.replace(trace[start:stop], name=name)
