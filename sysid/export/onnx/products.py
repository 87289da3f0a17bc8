"""Tables times what is laid before a group: in one product, or so that what is times zero is not read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.export.onnx.nodes import Nodes


def product(nodes: Nodes, table: NDArray[np.float64], value: str, name: str) -> str:
    """A table times a value, in one node.

    Args:
        nodes: The graph.
        table: Its constants last.
        value: One row fewer than the table has columns.
        name: Of what it gives.

    Returns:
        The name.
    """
    sides = [nodes.numbers(f"{name}_weights", table[:, :-1]), value, nodes.numbers(f"{name}_constant", table[:, -1:])]
    return nodes.add("Gemm", sides, name)


def row_by_row(nodes: Nodes, table: NDArray[np.float64], value: str, name: str) -> str:
    """As :func:`product`, for tables with few numbers a row: what is times zero is not read.

    In a product a number that is not one would be in every row.

    Args:
        nodes: The graph.
        table: Its constants last.
        value: One row fewer than the table has columns.
        name: Of what it gives.

    Returns:
        The name; where nothing is read, of one column for all cars.
    """
    weights, constants = table[:, :-1], table[:, -1:]
    own = [np.flatnonzero(row) for row in weights]
    reading = [i for i, columns in enumerate(own) if len(columns)]
    if not reading:
        return nodes.column(f"{name}_constants", constants)
    total = nodes.column(f"{name}_constants", constants[reading, 0])
    for turn in range(max(map(len, own))):
        # A row that has no more reads its first once more, times zero.
        columns = [own[i][turn if turn < len(own[i]) else 0] for i in reading]
        shares = [weights[i, at] if turn < len(own[i]) else 0.0 for i, at in zip(reading, columns, strict=True)]
        read = nodes.add("Gather", [value, nodes.integers(columns)], f"{name}_read{turn}", axis=0)
        part = nodes.add("Mul", [read, nodes.column(f"{name}_share{turn}", shares)], f"{name}_part{turn}")
        total = nodes.add("Add", [total, part], f"{name}_sum{turn}")
    if len(reading) == len(own):
        return total
    # Of those that read nothing the constants; what they are added to is a number or is not looked at.
    places = {row: at for at, row in enumerate(reading)}
    spread = nodes.add(
        "Gather", [total, nodes.integers([places.get(i, 0) for i in range(len(own))])], f"{name}_spread", axis=0
    )
    reads = nodes.truths(f"{name}_reads", [i in places for i in range(len(own))])
    return nodes.add("Where", [reads, spread, nodes.numbers(f"{name}_constant", constants)], name)


def over(table: NDArray[np.float64], selection: NDArray[np.float64]) -> NDArray[np.float64]:
    """A table over terms as one over readings; infinite constants stay what they are.

    Args:
        table: Its constants last.
        selection: From readings to terms, constants last in both.

    Returns:
        Constants last.
    """
    finite = np.isfinite(table[:, -1])
    whole = np.where(np.isfinite(table), table, 0.0) @ selection
    whole[~finite, -1] = table[~finite, -1]
    return np.asarray(whole)


def parts_of(nodes: Nodes, tables: dict[str, NDArray[np.float64]], z: str) -> dict[str, str]:
    """Tables times what is laid before a group, in one product that is cut.

    Args:
        nodes: The graph.
        tables: By name, constants last.
        z: What is laid before the group.

    Returns:
        Names, by those of the tables.
    """
    whole = product(nodes, np.concatenate(list(tables.values())), z, "sums")
    names = nodes.cut(whole, {f"{name}_part": len(table) for name, table in tables.items()})
    return dict(zip(tables, names, strict=True))


def exact_parts(nodes: Nodes, tables: dict[str, NDArray[np.float64]], z: str) -> dict[str, str]:
    """The same, without what only a limit reads in the product of the model, and each limit by itself.

    Args:
        nodes: The graph.
        tables: By name, constants last.
        z: What is laid before the group.

    Returns:
        Names, by those of the tables.
    """
    limits = {name: tables[name] for name in ("upper", "lower") if name in tables}
    model = {name: table for name, table in tables.items() if name not in limits}
    whole = np.concatenate(list(model.values()))
    alone = np.any([table[:, :-1].any(axis=0) for table in limits.values()], axis=0) & ~whole[:, :-1].any(axis=0)
    if limits and alone.any():
        kept = np.flatnonzero(~alone)
        model = {name: table[:, [*kept, -1]] for name, table in model.items()}
        found = parts_of(nodes, model, nodes.rows(z, kept.tolist(), len(alone), "model_readings"))
    else:
        found = parts_of(nodes, model, z)
    return found | {name: row_by_row(nodes, table, z, f"{name}_part") for name, table in limits.items()}
