"""Records that are stacked in arrays of three dimensions, ``(record, sample, channel)``, taken apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from sysid.ingest.readers.trees.leaves import Leaf, leaf_of

_ORDINALS = ("first", "second", "last")


def taken_apart(node: Mapping[str, Any], notes: list[str]) -> dict[str, Any] | None:
    """The records of a mapping whose arrays are stacks of them.

    Samples lie along the side that is as long as a vector beside it, else along the longest one. Records lie along
    the side that all stacks share; where that leaves two, they come first, if samples come second. Nothing else is
    guessed: one ``(sample, ?, ?)`` alone may be anything, and a signal that is a matrix has its samples last.

    Args:
        node: Names to arrays, leaves, texts and further mappings.
        notes: Where it is told what was taken for what.

    Returns:
        The mapping with ``record``, a list of one mapping for each record, in place of what it was made of;
        ``None`` where nothing is stacked.
    """
    leaves = {str(key): leaf for key, value in node.items() if (leaf := _numbers(value)) is not None}
    stacks = {key: leaf for key, leaf in leaves.items() if leaf.values.ndim == 3 and leaf.values.squeeze().ndim > 1}
    clocks = {len(leaf.values) for leaf in leaves.values() if leaf.values.ndim == 1}
    sides = {_time_side(leaf.values.shape, clocks) for leaf in stacks.values()}
    time = sides.pop() if len(sides) == 1 else None
    if not stacks or time is None:
        return None
    side = _record_side([leaf.values.shape for leaf in leaves.values() if leaf.values.ndim == 2], stacks, time)
    if side is None:
        return None
    first = next(iter(stacks))
    count, samples = (stacks[first].values.shape[axis] for axis in (side, time))
    apart = {key: parts for key, leaf in leaves.items() if (parts := _parts(leaf, side, time, count, samples))}
    shared = {key: value for key, value in node.items() if str(key) not in leaves or _is_shared(value, samples)}
    records = [{**shared, **{key: parts[index] for key, parts in apart.items()}} for index in range(count)]
    shape = " x ".join(map(str, stacks[first].values.shape))
    notes.append(f"{', '.join(apart)}: {count} records along the {_ORDINALS[side]} side, as {first} is {shape}")
    left = {key: value for key, value in node.items() if str(key) not in apart and key not in shared}
    return {**left, "record": records}


def _numbers(value: Any) -> Leaf | None:
    leaf = Leaf(values=value) if isinstance(value, np.ndarray) else value
    if not isinstance(leaf, Leaf) or leaf.problem is not None or leaf.values.dtype.kind not in "buif":
        return None
    if leaf.values.ndim == 2 and 1 in leaf.values.shape:
        leaf = replace(leaf, values=leaf.values.reshape(-1))
    return leaf if leaf.values.size > 1 else None


def _time_side(shape: tuple[int, ...], clocks: set[int]) -> int | None:
    timed = [axis for axis, length in enumerate(shape) if length in clocks]
    if len(timed) == 1:
        return timed[0]
    longest = [axis for axis, length in enumerate(shape) if length == max(shape)]
    return longest[0] if len(longest) == 1 else None


def _record_side(beside: list[tuple[int, ...]], stacks: Mapping[str, Leaf], time: int) -> int | None:
    """The side of the records; a matrix beside the stacks, of samples by records, tells it as well."""
    shapes = [leaf.values.shape for leaf in stacks.values()]
    shared = [axis for axis in range(3) if axis != time and len({shape[axis] for shape in shapes}) == 1]
    told = [axis for axis in shared if any(set(matrix) == {shapes[0][axis], shapes[0][time]} for matrix in beside)]
    sides = told if len(told) == 1 else shared
    side = sides[0] if len(sides) == 1 else 0 if 0 in sides and time == 1 else None
    return side if side is not None and shapes[0][side] > 1 else None


def _parts(leaf: Leaf, side: int, time: int, count: int, samples: int) -> list[Leaf]:
    """What of an array belongs to each record; none of one that is no stack."""
    array = leaf.values
    if array.ndim == 3 and array.shape[side] == count:
        channels = ({0, 1, 2} - {side, time}).pop()
        array = array.transpose(side, time, channels)
    elif array.ndim == 2 and array.shape == ((samples, count) if time < side else (count, samples)):
        array = array.T if time < side else array
    else:
        return []
    return [replace(leaf, values=part) for part in array]


def _is_shared(value: Any, samples: int) -> bool:
    """A clock of all records, and numbers that say something of them."""
    leaf = leaf_of(value)
    return leaf is None or (leaf.problem is None and leaf.vector and len(leaf.values) == samples)
