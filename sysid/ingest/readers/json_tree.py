"""JSON and JSON lines: columns by name, rows as records, or the layouts that pandas writes."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from datetime import datetime
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ReaderError
from sysid.ingest.cells.calendar import is_calendar
from sysid.ingest.readers.bounds import too_large
from sysid.ingest.readers.json_series import series_in
from sysid.ingest.readers.late import table_of
from sysid.ingest.readers.reader import damaged
from sysid.ingest.readers.trees.leaves import Leaf, number_of, step_in
from sysid.ingest.tables.options import FileOptions
from sysid.ingest.tables.table import RawTable

_MOST_BYTES = 2**30
"""Of Python objects, which JSON becomes before it is numbers."""
_OPENING, _ITEM = 96, 40  # bytes that a list or a mapping takes, and an item in one
_DEEPEST = 64
_STAMP = re.compile(r"[0-9]+(?:\.[0-9]+)?")
_KEPT = 2**24  # bytes of a file that is kept, as it was read last
_VALUES = {"values", "data", "samples", "value"}


def read(path: Path, options: FileOptions) -> RawTable:
    """The values of a file of JSON or JSON lines.

    Args:
        path: The file.
        options: How it is read.

    Returns:
        Its table.

    Raises:
        ReaderError: If it is none, or would take more memory than a file may.
    """
    state = path.stat()
    # Ninety records of one file would read it ninety times.
    tree = (_again if state.st_size < _KEPT else _tree_in)(path, (state.st_size, state.st_mtime_ns))
    if not isinstance(tree, dict):
        records = isinstance(tree, list) and all(isinstance(item, dict) for item in tree)
        tree = {"record" if records else "column": tree}
    return table_of(tree, path=path, reader="json", options=options)


def _tree_in(path: Path, _: tuple[int, int]) -> Any:
    raw = path.read_bytes()
    _check_size(raw, path)
    try:
        return _tree(series_in(_content(raw.decode("utf-8-sig"))), 0)
    except (ValueError, RecursionError) as error:
        raise damaged(path, "JSON", error) from error


_again = lru_cache(maxsize=1)(_tree_in)


def _check_size(raw: bytes, path: Path) -> None:
    """Refuse what would take more memory as objects than a file may, by counting its marks."""
    openings = raw.count(b"[") + raw.count(b"{")
    claimed = _OPENING * openings + _ITEM * (raw.count(b",") + openings)
    if claimed > _MOST_BYTES:
        raise too_large(path, f"about {claimed / 2**20:.0f} MB of lists and numbers", _MOST_BYTES)
    begin = np.frombuffer(raw[: 2**16], dtype=np.uint8)
    steps = np.isin(begin, list(b"[{")).astype(np.int64) - np.isin(begin, list(b"]}"))
    deepest = int(np.cumsum(steps).max(initial=0))
    if deepest > _DEEPEST:
        raise ReaderError(
            "the file nests its lists too deep",
            where=path,
            expected=f"at most {_DEEPEST} levels",
            got=f"{deepest} levels in its first 65,536 bytes",
            remedy="export the records as a list of objects, or one list of numbers by name",
        )


def _content(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        lines = [line for line in text.splitlines() if line.strip()]
        if len(lines) < 2 or error.lineno < 2:
            raise
        return [json.loads(line) for line in lines]


def _tree(node: Any, depth: int) -> Any:
    if isinstance(node, Mapping):
        return _mapping(node, depth)
    if not isinstance(node, list):
        return node
    if node and all(isinstance(item, Mapping) for item in node):
        return _objects(node, depth)
    if node and all(isinstance(item, list) for item in node):
        return _matrix(node)
    return _vector(node)


def _mapping(node: Mapping[str, Any], depth: int) -> Any:
    data = node.get("data", node.get("values"))  # InfluxDB has columns and values
    if isinstance(data, list) and isinstance(node.get("columns"), list):
        names = [str(name) for name in node["columns"]]  # pandas, orient="split"
        if not all(isinstance(row, list) and len(row) == len(names) for row in data):
            raise ValueError("the rows of data are not as long as columns")
        columns = {name: _vector([row[at] for row in data]) for at, name in enumerate(names)}
        index = node.get("index")
        return _with_index(index, columns) if isinstance(index, list) and len(index) == len(data) else columns
    if isinstance(data, list) and isinstance(node.get("schema"), Mapping):
        return _tree(data, depth + 1)  # pandas, orient="table"
    series = list(node.values())
    by_row = all(isinstance(part, Mapping) and _is_by_row(part) for part in series)
    if series and by_row and len({tuple(part) for part in series}) == 1:  # pandas by default: by column and index
        columns = {str(key): _vector(list(part.values())) for key, part in node.items()}
        return _with_index(list(series[0]), columns)
    if _are_named_rows(node):  # pandas, orient="index"
        names = list(series[0])
        return _with_index(list(node), {name: _vector([row[name] for row in series]) for name in names})
    if _is_by_row(node):
        return _vector(list(node.values()))
    signal = _signal(node)
    return {str(key): _tree(value, depth + 1) for key, value in node.items()} if signal is None else signal


def _is_by_row(node: Mapping[str, Any]) -> bool:
    """Whether the keys are row numbers, or stamps: what pandas writes by default."""
    return (
        len(node) > 1
        and (all(map(_STAMP.fullmatch, map(str, node))) or all(is_calendar(str(key)) for key in node))
        and not any(isinstance(value, list | Mapping) for value in node.values())
    )


def _are_named_rows(node: Mapping[str, Any]) -> bool:
    """Whether the keys are row numbers, or stamps, and each of them has the same few values by name."""
    rows = list(node.values())
    if not rows or not all(isinstance(row, Mapping) for row in rows) or len({tuple(row) for row in rows}) != 1:
        return False
    return _is_by_row(dict.fromkeys(node)) and not any(isinstance(v, list | Mapping) for v in rows[0].values())


def _with_index(index: list[Any], columns: dict[str, Any]) -> dict[str, Any]:
    """Columns behind their index, where it says more than the number of the row."""
    if [str(item) for item in index] == [str(row) for row in range(len(index))]:
        return columns
    numbers = all(isinstance(item, int) or (isinstance(item, str) and _STAMP.fullmatch(item)) for item in index)
    return {"index": _vector([float(item) for item in index] if numbers else index), **columns}


def _signal(node: Mapping[str, Any]) -> Leaf | None:
    """The values of one signal and what is said about them."""
    lists = [key for key, value in node.items() if isinstance(value, list)]
    if len(lists) != 1 or lists[0].casefold() not in _VALUES or not ({"unit", "units", "name"} & set(node)):
        return None
    values = _vector(node[lists[0]])
    if not isinstance(values, np.ndarray):
        return values if isinstance(values, Leaf) else None
    unit, about = node.get("unit", node.get("units")), node.get("description")
    return Leaf(
        values=values,
        unit=unit if isinstance(unit, str) and unit else None,
        description=about if isinstance(about, str) else "",
        step=next((step for key, value in node.items() if (step := step_in(str(key), number_of(value)))), None),
    )


def _objects(items: list[Any], depth: int) -> Any:
    """Rows as records, signals with a name each, or several records."""
    signals = [_signal(item) if isinstance(item.get("name"), str) else None for item in items]
    if all(signal is not None for signal in signals):
        return {item["name"]: signal for item, signal in zip(items, signals, strict=True)}
    items = [_flat(item) for item in items] if _are_rows(items) else items
    names = list(dict.fromkeys(str(key) for item in items for key in item))
    if any(isinstance(value, list | Mapping) for item in items for value in item.values()):
        return [_tree(item, depth + 1) for item in items]
    return {name: _vector([item.get(name) for item in items]) for name in names}


def _are_rows(items: list[Any]) -> bool:
    """Whether objects in objects hold one value by each name, as messages do: a row each, and no records."""

    def single(node: Any) -> bool:
        return all(map(single, node.values())) if isinstance(node, Mapping) else not isinstance(node, list)

    nested = any(isinstance(value, Mapping) for item in items for value in item.values())
    return nested and len(items) > 1 and all(map(single, items))


def _flat(item: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in item.items():
        name = f"{prefix}{key}"
        flat |= _flat(value, f"{name}.") if isinstance(value, Mapping) else {name: value}
    return flat


def _matrix(rows: list[list[Any]]) -> Any:
    widths = {len(row) for row in rows}
    flat = not any(isinstance(item, list | Mapping) for row in rows for item in row)
    if len(widths) == 1 and flat:
        if rows[0] and all(isinstance(item, str) for item in rows[0]) and len(rows) > 2:
            return {str(name): _vector([row[at] for row in rows[1:]]) for at, name in enumerate(rows[0])}
        columns = [_vector([row[at] for row in rows]) for at in range(widths.pop())]
        if columns and all(isinstance(column, np.ndarray) and column.dtype.kind == "f" for column in columns):
            return np.column_stack(columns)
    return [_vector(row) if flat else _tree(row, 0) for row in rows]


def _vector(items: list[Any]) -> Any:
    """Numbers as an array (null is missing), dates and times as such, texts as they are."""
    known = [item for item in items if item is not None]
    if known and all(isinstance(item, bool | int | float) for item in known):
        try:
            return np.array([np.nan if item is None else float(item) for item in items])
        except OverflowError:
            return np.array(items, dtype=np.str_)
    if known and all(isinstance(item, str) for item in known):
        stamps = _stamps(items)
        return np.array([item or "" for item in items]) if stamps is None else stamps
    plain = all(isinstance(item, str | bool | int | float) for item in known)
    return np.array(items, dtype=object) if len(known) > 1 and plain else items


def _stamps(texts: list[Any]) -> Any:
    try:
        stamps = [None if text is None else datetime.fromisoformat(text) for text in texts]
        first = next(stamp for stamp in stamps if stamp is not None)
        seconds = [np.nan if stamp is None else (stamp - first).total_seconds() for stamp in stamps]
    except (ValueError, TypeError, StopIteration):
        return None
    return Leaf(values=np.array(seconds), unit="s")
