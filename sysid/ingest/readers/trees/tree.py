"""Named arrays inside named groups (structures, cells, HDF5 groups, JSON objects) to columns.

A tree is made of mappings, of lists (the elements of a cell or structure array), and of leaves: arrays,
with what the file says about them. Scalars named like a sample time or a sample rate give the step of
the columns beside and below them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.cells.headers import parse_header
from sysid.ingest.readers.trees.forms import understood
from sysid.ingest.readers.trees.leaves import Leaf, Whole, leaf_of, number_of, step_in, texts_of
from sysid.ingest.readers.trees.records import Found, joined, records_of
from sysid.ingest.tables.columns import array_column, distinct
from sysid.ingest.tables.options import FileOptions
from sysid.ingest.tables.rates import said_step
from sysid.ingest.tables.table import RawTable, by_length
from sysid.ingest.tables.time_columns import is_called_time, recognise_time

_DEEPEST = 40
_NAMES = {"names", "channels", "columns", "labels", "signals", "variables", "fields", "header", "headers", "colheaders"}
_NAMES |= {f"{one}{mark}names" for one in ("channel", "column", "signal", "variable", "var") for mark in ("", "_")}

_UNITS = frozenset({"units", "unit", "channelunits", "channel_units", "varunits", "variableunits"})


def table_of(
    tree: Mapping[str, Any],
    *,
    path: Path,
    reader: str,
    options: FileOptions,
    separator: str = ".",
    short: bool = True,
    metadata: Mapping[str, str] | None = None,
    notes: Sequence[str] = (),
) -> RawTable:
    """The columns in a tree.

    Args:
        tree: Names to arrays, leaves, texts, lists or further mappings.
        path: The file.
        reader: Name of the reader.
        options: ``group`` names a part of the tree, ``transpose`` turns matrices.
        separator: What stands between the names of a group and what is in it.
        short: Whether names lose the groups that all of them stand in.
        metadata: What else the file carries.
        notes: What the reader recognised.

    Returns:
        The columns of the commonest length (of that of the time column, if there is one), those of other lengths
        beside them, and the records that they seem to be.

    Raises:
        ReaderError: If there is no such group, or nothing in it is a column.
    """
    walk = _Walk(where=str(path), separator=separator, transpose=options.transpose)
    joins = list[str]()
    shown = understood(tree, joins)
    outer = walk.step_beside(shown, None)
    if options.group is not None:
        shown, outer = _group(shown, options.group, walk, outer)
    found = list(walk.columns(shown, (), outer))
    found, head = _without_common_prefix(found, separator) if short else (found, "")
    named = [walk.named(item) for item in found]
    columns, renamed = distinct([item.column for item in named])
    named = [replace(item, column=column) for item, column in zip(named, columns, strict=True)]
    # A saved record is taken by itself: whatever stands beside it may have another clock.
    inside = [item for item in named if item.whole] or named
    alike, others = by_length([item.column for item in inside])
    others += tuple(item.column for item in named if item not in inside)
    steps = {item.step for item in inside if len(item.column.values) == (len(alike[0].values) if alike else 0)}
    time = recognise_time(alike)
    step = steps.pop() if len(steps) == 1 else None
    turned = [f"{name}: its rows are taken as channels, as it is {r} x {c}" for name, (r, c) in walk.turned.items()]
    # Where some are turned and some are not, no word is right for all: they are told apart anew each time.
    settings = {"transpose": True} if walk.turned and not walk.standing else {}
    told = [f"sample time {step:g} s, from the file"] if step is not None and time is None else []
    table = RawTable(
        source=path,
        reader=reader,
        columns=alike,
        others=others,
        time=time,
        step=step,
        notes=(*notes, *joins, *turned, *told, *renamed),
        metadata=metadata or {},
        settings=settings,
    )
    return replace(
        table, records=records_of(table, named, separator=separator, head=joined(options.group or "", head, separator))
    )


def _group(tree: Any, name: str, walk: _Walk, step: float | None) -> tuple[Any, float | None]:
    rest, here, beside = name.strip(walk.separator), tree, step
    while rest:
        pairs = [(key, value) for key, value in _named_children(here) if isinstance(value, Mapping | list)]
        match = next((pair for pair in pairs if pair[0] == rest), None)
        if match is None:
            heads = [
                pair for pair in pairs if rest.startswith(pair[0]) and rest[len(pair[0])] in f"{walk.separator}{{("
            ]
            match = max(heads, key=lambda pair: len(pair[0]), default=None)
        if match is None:
            names = list(_group_names(tree, walk.separator))[:40]
            otherwise, none = "correct group, or leave it out", "none: all stands at the top"
            raise ReaderError.unknown(f"there is no group {name}", name, names, otherwise, where=walk.where, none=none)
        rest, here = rest[len(match[0]) :].removeprefix(walk.separator), match[1]
        beside = walk.step_beside(here, beside)
    return here, beside


def _named_children(node: Any) -> list[tuple[str, Any]]:
    """The groups in a node by the names that they can be called by."""
    if isinstance(node, list):
        return [(mark.format(index + 1), item) for index, item in enumerate(node) for mark in ("{{{}}}", "({})")]
    return list(node.items()) if isinstance(node, Mapping) else []


def _group_names(node: Any, separator: str, prefix: str = "", depth: int = 0) -> Iterator[str]:
    if depth > _DEEPEST:
        return
    if isinstance(node, list):
        for index, item in enumerate(node):
            if isinstance(item, Mapping):
                yield f"{prefix}{{{index + 1}}}"
                yield from _group_names(item, separator, f"{prefix}{{{index + 1}}}{separator}", depth + 1)
        return
    for key, value in node.items() if isinstance(node, Mapping) else ():
        if isinstance(value, Mapping):
            yield f"{prefix}{key}"
            yield from _group_names(value, separator, f"{prefix}{key}{separator}", depth + 1)
        elif isinstance(value, list):
            yield from _group_names(value, separator, f"{prefix}{key}", depth + 1)


@dataclass(kw_only=True)
class _Walk:
    """Goes through a tree; remembers which matrices it turned."""

    where: str
    separator: str
    transpose: bool | None

    def __post_init__(self) -> None:
        self.turned: dict[str, tuple[int, int]] = {}
        self.standing = False

    def step_beside(self, node: Any, outer: float | None, index: int | None = None) -> float | None:
        """The sample time that stands in a mapping, else the one from further out.

        In a cell array it is the one of the element ``index``, or that of all where they are the same.
        """
        if not isinstance(node, Mapping):
            return outer
        for key, value in node.items():
            if isinstance(value, str):  # "10 Hz"
                step = said_step([f"{key} = {value}"])
            else:
                step = step_in(str(key), _of_element(value, index))
            if step is not None:
                return step
        said = {self.step_beside(part, None, index) for part in _saying(node)} - {None}
        return said.pop() if len(said) == 1 else outer

    def columns(
        self,
        node: Any,
        path: tuple[str, ...],
        step: float | None,
        *,
        whole: bool = False,
        units: Mapping[str, str] | None = None,
    ) -> Iterator[Found]:
        """Every column below a node, as it comes."""
        if len(path) > _DEEPEST:
            raise ReaderError(
                f"the file nests its groups more than {_DEEPEST} deep",
                where=self.where,
                expected="columns in groups of a few levels",
                got=f"{self.separator.join(path)[:80]} ...",
                remedy="export the arrays that are meant to a file of their own",
            )
        if isinstance(node, list):
            for index, item in enumerate(node):
                yield from self.columns(
                    item, (*path[:-1], f"{path[-1] if path else ''}{{{index + 1}}}"), step, whole=whole, units=units
                )
            return
        if not isinstance(node, Mapping):
            return
        whole = whole or isinstance(node, Whole)
        step, units = self.step_beside(node, step), {**(units or {}), **_units_beside(node)}
        leaves = {str(key): leaf for key, value in node.items() if (leaf := leaf_of(value)) is not None}
        cells = {str(key): parts for key, value in node.items() if (parts := _cell(value)) is not None}
        elements = [leaf for cell in cells.values() for _, leaf in cell]
        lengths = _lengths((*leaves.items(), *(("", leaf) for leaf in elements)))
        names, theirs = _texts_beside(node, _NAMES), _texts_beside(node, _UNITS)
        leaves |= _texts_of_samples(node, lengths, leaves)
        leaves = {
            key: replace(leaf, names=leaf.names or names, units=leaf.units or (theirs if names else ()))
            for key, leaf in leaves.items()
        }
        for key, value in node.items():
            name = str(key)
            if name in cells:
                for index, part in cells[name]:
                    own = self.step_beside(node, step, index)
                    yield from self._leaf(name, part, path, own, index=index, whole=whole, lengths=lengths, units=units)
            elif name in leaves:
                yield from self._leaf(name, leaves[name], path, step, whole=whole, lengths=lengths, units=units)
            elif isinstance(value, Mapping | list):
                yield from self.columns(value, (*path, name), step, whole=whole, units=units)

    def _leaf(
        self,
        name: str,
        leaf: Leaf,
        path: tuple[str, ...],
        step: float | None,
        *,
        lengths: Mapping[int, bool],
        units: Mapping[str, str],
        whole: bool,
        index: int | None = None,
    ) -> Iterator[Found]:
        array = leaf.values
        header = parse_header(name) if leaf.unit is None else None
        base = header.name if header is not None else name
        unit = leaf.unit or (header.unit if header is not None else None) or units.get(name)
        reference = leaf.reference or (header.reference if header is not None else None)
        if array.ndim == 2:
            array = self._standing(base, array, lengths)
        cell = "" if index is None else f"{{{index + 1}}}"
        parts = [("", array)] if array.ndim == 1 else [(f"_{i + 1}", array[:, i]) for i in range(array.shape[1])]
        names = leaf.names if leaf.names and len(leaf.names) == len(parts) else None
        for number, (suffix, values) in enumerate(parts):
            stem = names[number] if names else f"{base}{suffix}"
            full = names[number] if names else f"{base}{cell}{suffix}"
            own = leaf.units[number] if len(leaf.units) == len(parts) else unit
            column = array_column(
                full, values, where=self.where, unit=own, reference=reference, description=leaf.description
            )
            column = replace(column, problem=column.problem or leaf.problem, aside=leaf.aside)
            yield Found(path=path, stem=stem, cell=index, column=column, step=leaf.step or step, whole=whole)

    def _standing(self, name: str, array: NDArray[Any], lengths: Mapping[int, bool]) -> NDArray[Any]:
        """A matrix with its channels in columns."""
        rows, columns = array.shape
        wide = self.transpose
        if wide is None:
            beside = [rows in lengths, columns in lengths]
            if all(beside):  # a matrix over time and place
                beside = [lengths[rows], lengths[columns]]
            # What stands beside it says which side is time; else the longer one is.
            wide = beside[1] if beside[0] != beside[1] else 1 < rows < columns
            if wide:
                self.turned[name] = (rows, columns)
            else:
                self.standing = True
        return array.T if wide else array

    def named(self, found: Found) -> Found:
        """The column under the full name of its place."""
        prefix = "".join(f"{part}{self.separator}" for part in found.path)
        return replace(found, column=replace(found.column, name=f"{prefix}{found.column.name}"))


def _lengths(leaves: Iterable[tuple[str, Leaf]]) -> dict[int, bool]:
    """How long vectors of numbers are, and whether one of each length is called time."""
    found = dict[int, bool]()
    for name, leaf in leaves:
        if leaf.vector and leaf.values.dtype.kind not in "USO":
            found[len(leaf.values)] = found.get(len(leaf.values), False) or is_called_time(name)
    return found


def _texts_of_samples(
    node: Mapping[str, Any], lengths: Mapping[int, bool], leaves: Mapping[str, Leaf]
) -> dict[str, Leaf]:
    """Lists of as many texts as there are samples: dates, or words for states, as MATLAB saves both."""
    long = {max(leaf.values.shape) for leaf in leaves.values() if not leaf.vector and leaf.values.dtype.kind in "buif"}
    found = dict[str, Leaf]()
    for key, value in node.items():
        if not isinstance(value, list) or len(value) not in {*lengths, *long} or str(key).casefold().strip() in _NAMES:
            continue
        if all(isinstance(text, str) for text in value):
            found[str(key)] = Leaf(values=np.array(value))
    return found


def _cell(value: Any) -> list[tuple[int, Leaf]] | None:
    """The arrays in a cell array that holds no structures, and their places in it."""
    if not isinstance(value, list) or not value or any(isinstance(item, Mapping) for item in value):
        return None
    parts = [(index, leaf) for index, item in enumerate(value) if (leaf := leaf_of(item)) is not None]
    return parts or None


def _of_element(value: Any, index: int | None) -> float | None:
    if not isinstance(value, list):
        return number_of(value)
    numbers = [number_of(item) for item in value]
    if index is not None and index < len(numbers):
        return numbers[index]
    return numbers[0] if len(set(numbers)) == 1 else None


def _saying(node: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The mappings beside arrays that say something of them and hold none: ``{meta: {fs: 20}, data: ...}``."""
    return [value for value in node.values() if isinstance(value, Mapping) and not _holds_numbers(value)]


def _holds_numbers(node: Any) -> bool:
    if isinstance(node, Mapping | list):
        return any(map(_holds_numbers, node.values() if isinstance(node, Mapping) else node))
    leaf = leaf_of(node)
    return leaf is not None and leaf.values.dtype.kind not in "USO"


def _units_beside(node: Mapping[str, Any]) -> dict[str, str]:
    """A mapping ``units`` beside the arrays gives their units by name."""
    found = dict[str, str]()
    for part in (*_saying(node), node):
        units = part.get("units", part.get("unit"))
        found |= {str(k): v for k, v in units.items() if isinstance(v, str)} if isinstance(units, Mapping) else {}
    return found


def _texts_beside(node: Mapping[str, Any], called: Set[str]) -> tuple[str, ...]:
    """A list of texts that is called names, or units, gives the columns of a matrix theirs."""
    for part in (node, *_saying(node)):
        for key, value in part.items():
            if str(key).casefold().strip() not in called:
                continue
            leaf = leaf_of(value)
            texts = texts_of(value if leaf is None else leaf.values.tolist())
            if texts and len(texts) == len(value if leaf is None else leaf.values):
                return texts
    return ()


def _without_common_prefix(found: list[Found], separator: str) -> tuple[list[Found], str]:
    head = ""
    while found and found[0].path and len({item.path[:1] for item in found}) == 1:
        head = joined(head, found[0].path[0], separator)
        found = [replace(item, path=item.path[1:]) for item in found]
    return found, head
