"""Named arrays inside named groups (MATLAB structures) to columns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.headers import parse_header
from sysid.ingest.table import RawColumn, array_column


def columns_of(tree: Mapping[str, Any], *, where: str, group: str | None) -> list[RawColumn]:
    """Every vector, and every column of every matrix, in a tree of mappings.

    A mapping ``units`` beside the arrays gives their units by name. The form that Simulink calls
    structure with time (``time`` and ``signals``) is understood.

    Args:
        tree: Names to arrays, texts or further mappings.
        where: The file, for errors.
        group: Name of the mapping to look in, dotted; ``None`` is the whole tree.

    Returns:
        The columns; the names of nested ones are dotted, without what all of them share.

    Raises:
        ReaderError: If there is no such group.
    """
    for part in group.split(".") if group else ():
        inner = tree.get(part)
        if not isinstance(inner, Mapping):
            raise ReaderError(
                f"there is no group {group}",
                where=where,
                expected=f"one of {', '.join(key for key, value in tree.items() if isinstance(value, Mapping))}",
                got=group,
                remedy="correct group",
            )
        tree = inner
    found = _walk(tree, "", where=where)
    prefix = _common_prefix([column.name for column in found])
    if not prefix:
        return found
    return [_renamed(column, column.name.removeprefix(prefix)) for column in found]


def matrix_columns(
    name: str, array: NDArray[Any], *, where: str, unit: str | None = None, description: str = ""
) -> list[RawColumn]:
    """The columns of a vector or a matrix.

    Args:
        name: Name of the array; a header with a unit is understood.
        array: One- or two-dimensional. A matrix of one row is a vector.
        where: The file, for errors.
        unit: Its unit, if the file says.
        description: As found in the file.

    Returns:
        One column for a vector, ``name_1`` to ``name_m`` for a matrix, none for scalars and for
        arrays of more dimensions.
    """
    header = parse_header(name)
    array = array.reshape(-1) if array.ndim == 2 and 1 in array.shape else array
    if array.size < 2 or array.ndim > 2:
        return []
    parts = [(header.name, array)]
    if array.ndim == 2:
        parts = [(f"{header.name}_{index + 1}", array[:, index]) for index in range(array.shape[1])]
    return [
        array_column(
            part,
            values,
            where=where,
            unit=unit or header.unit,
            reference=header.reference,
            description=description,
        )
        for part, values in parts
    ]


def _walk(tree: Mapping[str, Any], prefix: str, *, where: str) -> list[RawColumn]:
    units = tree.get("units", tree.get("unit"))
    units = units if isinstance(units, Mapping) else {}
    if "time" in tree and "signals" in tree:
        return _structure_with_time(tree, prefix, where=where)
    columns = []
    for key, value in tree.items():
        if isinstance(value, Mapping):
            columns += _walk(value, f"{prefix}{key}.", where=where)
        elif isinstance(value, np.ndarray | list | tuple):
            unit = units.get(key)
            columns += matrix_columns(
                f"{prefix}{key}", np.asarray(value), where=where, unit=unit if isinstance(unit, str) else None
            )
    return columns


def _structure_with_time(tree: Mapping[str, Any], prefix: str, *, where: str) -> list[RawColumn]:
    signals = tree["signals"] if isinstance(tree["signals"], list | tuple | np.ndarray) else [tree["signals"]]
    columns = matrix_columns(f"{prefix}time", np.asarray(tree["time"]), where=where, unit="s")
    for index, signal in enumerate(signals):
        if isinstance(signal, Mapping) and "values" in signal:
            label = signal.get("label")
            name = label if isinstance(label, str) and label else f"signal_{index + 1}"
            columns += matrix_columns(f"{prefix}{name}", np.asarray(signal["values"]), where=where)
    return columns


def _common_prefix(names: list[str]) -> str:
    heads = {name.rpartition(".")[0] for name in names}
    return f"{heads.pop()}." if len(heads) == 1 and "" not in heads else ""


def _renamed(column: RawColumn, name: str) -> RawColumn:
    return RawColumn(
        name=name,
        values=column.values,
        unit=column.unit,
        reference=column.reference,
        description=column.description,
        problem=column.problem,
    )
