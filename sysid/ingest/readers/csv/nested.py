"""Exports in which tables stand in tables, each level a column further in, as those of battery testers do.

Above stand the heads of all levels, one below the other; a row of an inner level belongs to the row of the outer one
above it. The innermost rows are the samples.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sysid.ingest.readers.csv.cells import Kind, kind_of

_MARKS = ("\t", ";", ",")
_DEEPEST = 3
_SHARE = 0.5
"""Of the lines, how many are of the innermost level at least."""


def depth_of(lines: Sequence[str]) -> tuple[str, int] | None:
    """What stands between the cells of such a file, and how far its innermost level stands in.

    Args:
        lines: The first lines.

    Returns:
        Both; ``None`` where the file is none of these.

    Example:
        >>> depth_of(["Cycle,Cap", ",Record,U,I", "1,5", ",1,3.6,0.1", ",2,3.7,0.1"]), depth_of(["t,u", "1,2"])
        ((',', 1), None)
    """
    kept = [line for line in lines if line.strip(" \t,;")]
    for mark in _MARKS:
        heads = [line.split(mark) for line in kept[: _DEEPEST + 1]]
        depth = next((k for k, cells in enumerate(heads) if _leading(cells) != k), len(heads)) - 1
        if depth < 1 or len(kept) <= depth + 1:
            continue
        words = all(kind_of(cell) in {Kind.WORD, Kind.NOTHING} for cells in heads[: depth + 1] for cell in cells)
        levels = [_leading(line.split(mark)) for line in kept[depth + 1 :]]
        if words and set(levels) == set(range(depth + 1)) and levels.count(depth) >= _SHARE * len(levels):
            return mark, depth
    return None


def innermost(lines: Iterable[str], mark: str, depth: int) -> tuple[list[str], list[str]]:
    """Such a file with its innermost level alone; the other lines are blank, so that all keep their numbers.

    Args:
        lines: All of them.
        mark: What stands between cells.
        depth: How far that level stands in.

    Returns:
        The lines, and what should be told.
    """
    found = [line if _leading(line.split(mark, depth + 1)) == depth else "" for line in lines]
    return found, [f"the samples are the rows of the innermost of {depth + 1} levels; those further out are left out"]


def _leading(cells: Sequence[str]) -> int:
    """How many empty cells stand in front."""
    return next((place for place, cell in enumerate(cells) if cell.strip()), len(cells))
