"""Rows of a step as ONNX nodes, held within numbers, channels and each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.export.onnx.nodes import Nodes
from sysid.export.wide.blocks import Block, OwnLimit
from sysid.export.wide.whole import Group, WideForm


def held_rows(nodes: Nodes, form: WideForm, group: Group, total: str, parts: dict[str, str]) -> tuple[str, str]:
    """Rows within bounds and limits; and as they are before declared limits.

    Each is first held within its numbers, then below a channel, then above one. Not exactly, both sides are one node
    each where no channel can be below the lower number.
    """
    low, high = group.bounds("low"), group.bounds("high")
    if form.exact:
        bounds = model_bounds(group)
        raw = within(nodes, total, *bounds, name="within_bounds")
        value = raw if np.array_equal(bounds, (low, high)) else within(nodes, raw, low, high)
        for name, upper in (("upper", True), ("lower", False)):
            if name in parts:
                value = bounded(nodes, value, parts[name], f"{name}_held", upper=upper, exact=True)
        return _own_limits(nodes, group, value, parts, exact=True), raw
    if not parts.keys() & {"upper", "lower"}:
        return _own_limits(nodes, group, within(nodes, total, low, high), parts, exact=False), total
    value = total
    if "upper" in parts and not all(known := [_never_below(form, block, row) for block, row in group.rows]):
        value = nodes.add("Max", [value, nodes.column("low_first", np.where(known, -np.inf, low))], "held_first")
        low = np.where(known, low, -np.inf)  # where a channel comes below a number, it wins
    for operator, name, numbers in (("Min", "upper", high), ("Max", "lower", low)):
        sides = [nodes.column(f"{name}_numbers", numbers)] if np.isfinite(numbers).any() else []
        sides += [parts[name]] if name in parts else []
        value = nodes.add(operator, [value, *sides], f"{name}_held") if sides else value
    return _own_limits(nodes, group, value, parts, exact=False), total


def model_bounds(group: Group) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The bounds of the models themselves, of outputs; those of states as they are."""
    low, high = group.bounds("low"), group.bounds("high")
    for at, (block, _) in enumerate(group.rows[: group.n_outputs]):
        low[at], high[at] = block.stage.form.low, block.stage.form.high
    return low, high


def _never_below(form: WideForm, block: Block, row: int) -> bool:
    """Whether a channel that a row may not be above is never below what the row is held above before."""
    if row >= block.n_outputs or not np.isfinite(block.low[row]):
        return True
    at = block.stage.form.n_inputs + row
    low = block.low[row] * block.stage.form.scale[at] + block.stage.form.offset[at]
    return all(
        form.reach[side.column][0] >= low
        for side in block.stage.limits[row]
        if side.upper and side.column is not None and side.column not in block.stage.targets
    )


def within(nodes: Nodes, value: str, low: NDArray[np.float64], high: NDArray[np.float64], name: str = "held") -> str:
    """Rows within numbers of their own; no node where there are none. NaN stays NaN, as in the model.

    Args:
        nodes: The graph.
        value: Channels along the first axis.
        low: Of every channel.
        high: The same.
        name: Of what it gives.

    Returns:
        The name.
    """
    if len(set(low)) == len(set(high)) == 1:
        if not np.isfinite([low[0], high[0]]).any():
            return value
        return nodes.add(
            "Clip", [value, nodes.numbers(f"{name}_low", low[0]), nodes.numbers(f"{name}_high", high[0])], name
        )
    for side, operator, numbers in (("low", "Max", low), ("high", "Min", high)):
        if np.isfinite(numbers).any():
            value = nodes.add(operator, [value, nodes.column(f"{name}_{side}", numbers)], f"{name}_by_{side}")
    return value


def bounded(nodes: Nodes, value: str, limit: str, name: str, *, upper: bool, exact: bool) -> str:
    """Rows held by others. Exactly, a limit that is not a number holds nothing."""
    if not exact:
        return nodes.add("Min" if upper else "Max", [value, limit], name)
    beyond = nodes.add("Greater" if upper else "Less", [value, limit], f"{name}_beyond")
    return nodes.add("Where", [beyond, limit, value], name)


def _own_limits(nodes: Nodes, group: Group, value: str, parts: dict[str, str], *, exact: bool) -> str:
    """Limits within a stage, row by row; few have any."""
    own: dict[tuple[int, int], list[OwnLimit]] = {}
    for block in group.blocks:
        for limit in block.own:
            own.setdefault((id(block), limit.row), []).append(limit)
    if not own:
        return value
    count = len(group.rows)
    rows = nodes.cut(value, {f"row{i}": 1 for i in range(count)})
    lower = nodes.cut(parts["lower"], {f"lower{i}": 1 for i in range(count)}) if "lower" in parts else []
    places = {(id(block), row): at for at, (block, row) in enumerate(group.rows)}
    for (stage, row), limits in own.items():
        at = places[stage, row]
        for limit in limits:
            part = nodes.within(f"{nodes.prefix}own{at}_{'high' if limit.upper else 'low'}_")
            sloped = part.add("Mul", [rows[places[stage, limit.other]], part.numbers("slope", limit.slope)], "sloped")
            there = part.add("Add", [sloped, part.numbers("shift", limit.shift)], "limit")
            rows[at] = bounded(part, rows[at], there, "row", upper=limit.upper, exact=exact)
        if lower and all(limit.upper for limit in limits):
            part = nodes.within(f"{nodes.prefix}own{at}_")
            rows[at] = bounded(part, rows[at], lower[at], "row", upper=False, exact=exact)
    return nodes.add("Concat", rows, "rows_held", axis=0)
