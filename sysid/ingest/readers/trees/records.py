"""Which columns of a file belong together, where it holds several records.

Three habits are known: a group for each record, a cell of an array for each record (``u{1}``, ``u{2}``), and a
word in the name for each record (``uEst``, ``uVal``).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from sysid.ingest.readers.trees.roles import PIECES, WORDS, role_of
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.table import RawTable, RecordChoice
from sysid.ingest.tables.time_columns import recognise_time

_SHORT = {"e": "estimation", "v": "validation"}
_ENDINGS = ("train", "test", "est", "val", "id")
_NUMBERED = re.compile(
    r"(?:exp|experiment|run|record|rec|recording|trial|test|case|seg|segment|sweep|set|measurement|meas|log|data|"
    r"part|session|batch|shot)[ _.-]?\d+",
    re.IGNORECASE,
)
_MANY = 3  # names with both letters, from which on it is no chance
_INDEXED = re.compile(r".*\{\d+\}")


@dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """A column and its place.

    Args:
        path: Names of the groups that it stands in.
        stem: Its name without the index of a cell.
        cell: Index in the cell array that it is an element of.
        column: The column.
        step: Sample time of its group.
        whole: Whether its group is a record in itself.
    """

    path: tuple[str, ...]
    stem: str
    cell: int | None
    column: RawColumn
    step: float | None
    whole: bool


def records_of(table: RawTable, found: list[Found], *, separator: str, head: str = "") -> tuple[RecordChoice, ...]:
    """The records of a table, if its columns seem to be of several.

    Args:
        table: All columns.
        found: The same with their places.
        separator: What stands between names of groups.
        head: Name of the group that all of them stand in.

    Returns:
        Two or more records, or none.
    """
    usable = [item for item in found if item.column.problem is None]
    usable = [item for item in usable if item.whole] or usable
    groups = _by_group(table, usable, separator)
    if len(groups) > 1:
        return tuple(
            replace(choice, options={"group": joined(head, str(choice.options["group"]), separator)})
            for choice in groups
        )
    return tuple(_by_cell(table, usable) or _by_word(table, usable))


def joined(head: str, tail: str, separator: str) -> str:
    """The name of a group in a group.

    Args:
        head: The outer one, or the empty text.
        tail: The inner one; ``{1}`` is an element of the outer one.
        separator: What stands between them.

    Returns:
        For example ``"data.runs{1}"``.
    """
    return f"{head}{separator}{tail}" if head and not tail.startswith("{") else f"{head}{tail}"


def _by_group(table: RawTable, found: list[Found], separator: str) -> list[RecordChoice]:
    for depth in range(max((len(item.path) for item in found), default=0)):
        groups: dict[tuple[str, ...], list[Found]] = {}
        for item in found:
            if len(item.path) > depth:
                groups.setdefault(item.path[: depth + 1], []).append(item)
        if all(item.whole for group in groups.values() for item in group) and len(groups) > 1:
            return [_group_record(table, path, group, separator) for path, group in groups.items()]
        alike = _largest(groups, depth)
        if len(alike) > 1 and _are_records(alike):
            return [_group_record(table, path, group, separator) for path, group in alike.items()]
    return []


def _largest(groups: Mapping[tuple[str, ...], list[Found]], depth: int) -> dict[tuple[str, ...], list[Found]]:
    """Of the groups with the same columns in them, those that are most."""
    kinds: dict[frozenset[tuple[tuple[str, ...], str]], dict[tuple[str, ...], list[Found]]] = {}
    for path, group in groups.items():
        kinds.setdefault(frozenset((item.path[depth + 1 :], item.stem) for item in group), {})[path] = group
    return max(kinds.values(), key=len, default={})


def _are_records(groups: Mapping[tuple[str, ...], list[Found]]) -> bool:
    """Whether groups with the same columns are records, and not the places of one measurement."""
    last = [path[-1] for path in groups]
    if all(_INDEXED.fullmatch(name) or _NUMBERED.fullmatch(name) or role_of(name) for name in last):
        return True
    lengths = [{len(item.column.values) for item in group} for group in groups.values()]
    if any(len(own) > 1 for own in lengths):
        return False
    if len({frozenset(own) for own in lengths}) > 1 or len({group[0].step for group in groups.values()}) > 1:
        return True
    clocks = [_clock(group) for group in groups.values()]
    return (
        all(clock is not None for clock in clocks)
        and any(
            not np.array_equal(clock.values, clocks[0].values, equal_nan=True)  # type: ignore[union-attr]  # none is None
            for clock in clocks[1:]
        )
    )


def _clock(group: Iterable[Found]) -> RawColumn | None:
    bare = {item.stem: item.column for item in group}
    name = recognise_time([replace(column, name=stem) for stem, column in bare.items()])
    return bare[name] if name is not None else None


def _group_record(table: RawTable, path: tuple[str, ...], group: list[Found], separator: str) -> RecordChoice:
    head = separator.join(path)
    columns = [replace(item.column, name=item.column.name.removeprefix(f"{head}{separator}")) for item in group]
    return RecordChoice(
        name=_case_name(path[-1]),
        options={"group": head},
        table=_record(table, columns, group[0].step),
    )


def _case_name(name: str) -> str:
    return re.sub(r"[{(](\d+)[})]", r"_\1", name).strip("_ ") or name


def _record(table: RawTable, columns: list[RawColumn], step: float | None) -> RawTable:
    lengths = [len(column.values) for column in columns]
    time = recognise_time(columns)
    usual = next(
        (len(c.values) for c in columns if c.name == time), max(set(lengths), key=lambda n: (lengths.count(n), n))
    )
    alike = tuple(column for column in columns if len(column.values) == usual)
    others = tuple(column for column in columns if len(column.values) != usual)
    notes = tuple(note for note in table.notes if not note.startswith("sample time"))
    told = (f"sample time {step:g} s, from the file",) if time is None and step is not None else ()
    own = step if time is None else None
    return replace(
        table, columns=alike, others=others, time=time, step=own, records=(), lines=None, notes=(*notes, *told)
    )


def _by_cell(table: RawTable, found: list[Found]) -> list[RecordChoice]:
    cells: dict[int, list[Found]] = {}
    for item in found:
        if item.cell is not None:
            cells.setdefault(item.cell, []).append(item)
    names = [tuple((item.path, item.stem) for item in group) for group in cells.values()]
    if len(cells) < 2 or len(set(names)) > 1:
        return []
    plain = {len(item.column.values) for item in found if item.cell is None}
    if len(names[0]) == 1 and plain & {len(item.column.values) for group in cells.values() for item in group}:
        return []  # a cell of two channels beside others, not of two records
    return [
        _column_record(table, f"record_{index + 1}", {item.stem: item for item in group})
        for index, group in cells.items()
    ]


def _column_record(table: RawTable, name: str, members: Mapping[str, Found]) -> RecordChoice:
    columns = [replace(item.column, name=stem) for stem, item in members.items()]
    record = _record(table, columns, next(iter(members.values())).step)
    options: dict[str, object] = {
        "columns": {
            stem: item.column.name
            for stem, item in members.items()
            if stem != record.time and len(item.column.values) == len(record)
        }
    }
    if record.time is not None:
        options["time"] = members[record.time].column.name
    return RecordChoice(name=name, options=options, table=record)


def _by_word(table: RawTable, found: list[Found]) -> list[RecordChoice]:
    plain = [item for item in found if item.cell is None]
    for tag_of, needs_lengths in ((_word_tag, False), (_short_tag, True), (_number_tag, True)):
        tags: dict[str, dict[str, Found]] = {}
        for item in plain:
            split = _split(item.stem, tag_of)
            if split is not None:
                stem, tag = split
                tags.setdefault(tag, {})[f"{'.'.join((*item.path, ''))}{stem}"] = item
        tags = _agreeing(tags)
        lengths = [{len(item.column.values) for item in members.values()} for members in tags.values()]
        differ = len({frozenset(own) for own in lengths}) > 1
        told = tag_of is _short_tag and _are_told(set(next(iter(tags.values()), ())), len(plain))
        told = told or (tag_of is _number_tag and all(map(_is_numbered_matrix, tags.values())))
        if len(tags) > 1 and all(len(own) == 1 for own in lengths) and (differ or told or not needs_lengths):
            return [_column_record(table, tag, members) for tag, members in tags.items()]
    return []


def _are_told(stems: set[str], count: int) -> bool:
    """Whether channels of like length that end in e and in v are two records, and not one of twice as many channels.

    So are ``u`` and ``y``, a matrix ``z`` of both, and many names of which each stands there once with each letter.
    """
    matrix = len(stems) > 1 and all(re.fullmatch(r"z_\d+", stem) for stem in stems)
    return stems == {"u", "y"} or matrix or (len(stems) >= _MANY and 2 * len(stems) == count)


def _is_numbered_matrix(members: Mapping[str, Found]) -> bool:
    """Whether these are the columns of one matrix that is called a run, an experiment or the like, and its number."""
    matrices = [re.fullmatch(r"(.+)_\d+", item.stem) for item in members.values()]
    return len(members) > 1 and all(found is not None and _NUMBERED.fullmatch(found[1]) for found in matrices)


def _split(name: str, tag_of: Callable[[str], tuple[str, str] | None]) -> tuple[str, str] | None:
    """The stem and the tag of a name; the number of a column of a matrix stays with the stem."""
    matrix = re.fullmatch(r"(.+)(_\d+)", name)
    split = tag_of(matrix[1]) if matrix else None
    return (f"{split[0]}{matrix[2]}", split[1]) if matrix and split else tag_of(name)


def _agreeing(tags: dict[str, dict[str, Found]]) -> dict[str, dict[str, Found]]:
    """The tags under which the same stems stand; the largest such set."""
    kinds: dict[frozenset[str], dict[str, dict[str, Found]]] = {}
    for tag, members in tags.items():
        kinds.setdefault(frozenset(members), {})[tag] = members
    several = [kind for kind in kinds.values() if len(kind) > 1]
    return max(several, key=lambda kind: len(next(iter(kind.values()))), default={})


def _word_tag(name: str) -> tuple[str, str] | None:
    """``uEst``, ``u_est``, ``est_u``, ``uest`` to the stem and the word."""
    pieces = PIECES.findall(name)
    for word, rest in ((pieces[-1:], pieces[:-1]), (pieces[:1], pieces[1:])):
        stem = "".join(rest).strip("_ .-")
        if stem and word[0].casefold() in WORDS:
            return stem, word[0]
    ending = next((word for word in _ENDINGS if name.endswith(word)), "")
    return (name.removesuffix(ending), ending) if ending and name != ending else None


def _short_tag(name: str) -> tuple[str, str] | None:
    """``ue``, ``yv``, ``u_e`` to the stem and the word they are short for."""
    stem, last = name[:-1].rstrip("_"), name[-1:]
    return (stem, _SHORT[last]) if stem and last in _SHORT else None


def _number_tag(name: str) -> tuple[str, str] | None:
    match = re.fullmatch(r"(.*?\D)_?(\d+)", name)
    return (match[1].rstrip("_"), f"record_{int(match[2])}") if match else None
