"""Where the names stand among the lines above a table: not always in the last one.

Loggers write a line of kinds or of marks between names and numbers (Campbell's TOA5, ``[Data]``), oscilloscopes a label
before the values of each column (``TraceName,CH1,CH2``), or words and numbers of the whole record behind the names.
"""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

from sysid.ingest.cells.headers import parse_header
from sysid.ingest.readers.csv.cells import BLANKS, DATA, Kind, Row, is_units, kind_of, trimmed
from sysid.ingest.readers.csv.split import Split
from sysid.ingest.tables.time_columns import is_called_time

_LOOKED = 4
"""Lines above the numbers among which the names are looked for."""
_NAMES = re.compile(r"(?:trace|signal|channel)?[ _]?names?|traces?|sources?|signals?|channels?", re.IGNORECASE)
NO_UNITS = frozenset({"TS", "RN", "Sequence"})
"""What stands in a line of units over a stamp or a number of rows."""
_MARKS = "%!;/*"
"""What stands before a line that is a comment, where ``#`` does not."""
_SECTION = re.compile(r"\[[^\]]+\]")
"""What begins a part of a file, ``[data]``."""
_UNITS = re.compile(r"(?:v|y|vertical|signal|channel)?[ _]?units?", re.IGNORECASE)


def names_last(above: list[Row], split: Split) -> tuple[list[Row], list[str]]:
    """The lines above a table, so that its names stand in the last one, or above a line of units.

    Args:
        above: The lines above the numbers.
        split: The rows of the file.

    Returns:
        The lines up to the names and their units, as they are where nothing speaks against the last one; and
        what else was said there of the record, ``word,number``.
    """
    labelled = _labelled(above, split)
    if labelled:
        return labelled, [split.separator.join(row.cells) for row in above]
    above, said = _without_pairs(_unmarked(above, split), split)
    if (head := _above_what_all_share(above, split)) is not None:
        return head, said
    if len(above) > 1 and _is_mark(above[-1], split) and _is_full(above[-2], split):
        return above[:-1], said
    for index in range(len(above) - 1, max(len(above) - 1 - _LOOKED, -1), -1):
        row = above[index]
        if _is_full(row, split) and any(is_called_time(parse_header(cell).name) for cell in row.cells):
            below = above[index + 1 :]
            if len(below) > 1 or (below and not _is_full(below[0], split)):
                return [*above[: index + 1], *[one for one in below[:1] if _is_of_units(one)]], said
            return _with_labelled_units(above, split), said
        if len(trimmed(row.cells, split.width)) != split.width or (index == len(above) - 1 and _is_full(row, split)):
            break
    return above, said


def _above_what_all_share(above: list[Row], split: Split) -> list[Row] | None:
    """Up to the names and their units, where lines about each channel stand below, as amplifiers' programs write them.

    The last of these says the same of all columns, and can be no head.
    """
    if not above or split.width < 3 or len(trimmed(above[-1].cells, split.width)) != split.width:
        return None
    if len({cell.strip() for cell in above[-1].cells}) > 1:
        return None
    for index, (row, below) in enumerate(pairwise(above)):
        if _is_full(row, split) and len(trimmed(below.cells, split.width)) == split.width and _is_of_units(below):
            return above[: index + 2]
    return None


def _unmarked(above: list[Row], split: Split) -> list[Row]:
    """Without the mark of a comment before a line (``! t u y``).

    Of such lines those of a word a column are a head, up to one that names a time.
    """
    if split.separator != BLANKS:
        return above
    found, timed = list[Row](), False
    for row in above:
        if len(row.cells) < 2 or not row.cells[0] or row.cells[0].strip(_MARKS):
            found.append(row)
        elif len(row.cells) == split.width + 1 and not timed:
            found.append(replace(row, cells=row.cells[1:]))
            timed = any(is_called_time(parse_header(cell).name) for cell in row.cells)
        elif len(row.cells) == split.width + 1 and is_units(row.cells[1:]):
            found.append(replace(row, cells=row.cells[1:]))
    return found


def _with_labelled_units(above: list[Row], split: Split) -> list[Row]:
    """With a line of units below the names, where one further above begins with that word: ``Vertical Units,V,V``."""
    found = [row for row in above[:-1] if len(row.cells) == split.width and _UNITS.fullmatch(row.cells[0].strip())]
    if len(found) != 1 or split.kinds[0] not in DATA or not is_units(found[0].cells[1:]):
        return above
    return [*above, Row(line=found[0].line, cells=["", *found[0].cells[1:]])]


def _is_full(row: Row, split: Split) -> bool:
    """Whether each column has another word in this line."""
    cells = [cell.strip() for cell in trimmed(row.cells, split.width)]
    wanted = [kind is not Kind.NOTHING for kind in split.kinds]
    filled = [cell for cell, is_wanted in zip(cells, wanted, strict=False) if is_wanted]
    return (
        len(cells) == split.width
        and all(filled)
        and len(set(filled)) == len(filled)
        and not any(kind_of(cell) in DATA for cell in filled)
    )


def _is_of_units(row: Row) -> bool:
    """Whether a line is one of units; TOA5 says of the stamp and of the number of the record that they are those."""
    return is_units([cell for cell in row.cells if cell.strip() not in NO_UNITS])


def _is_mark(row: Row, split: Split) -> bool:
    filled = [cell.strip() for cell in row.cells if cell.strip()]
    if len(filled) != 1 or split.width < 2:
        return False
    return bool(_SECTION.fullmatch(filled[0])) or (split.width > 2 and split.separator != BLANKS)


def _without_pairs(above: list[Row], split: Split) -> tuple[list[Row], list[str]]:
    """Two lines whose cells behind the columns are words above their numbers: ``X,CH1,Start,Increment``."""
    if len(above) < 2 or split.separator == BLANKS:
        return above, []
    upper, lower = ([cell.strip() for cell in row.cells] for row in above[-2:])
    width = 1 + max(index for index, kind in enumerate(split.kinds) if kind is not Kind.NOTHING)
    pairs = list(zip(upper[width:], lower[width:], strict=False))
    if not pairs or len(upper) < len(lower) or any(kind_of(word) is not Kind.WORD for word, _ in pairs):
        return above, []
    if any(kind_of(number) is not Kind.NUMBER for _, number in pairs):
        return above, []
    blank = [""] * (split.width - width)
    cut = [Row(line=row.line, cells=[*row.cells[:width], *blank]) for row in above[-2:]]
    return [*above[:-2], *cut], [f"{word},{number}" for word, number in pairs]


def _labelled(above: list[Row], split: Split) -> list[Row]:
    """The lines of names and units where each line above begins with what it says, over a column of nothing."""
    if split.width < 2 or split.kinds[0] is not Kind.NOTHING:
        return []
    lines = [(row.cells[0].strip(), row) for row in above if len(trimmed(row.cells, split.width)) == split.width]
    names = [row for label, row in lines if _NAMES.fullmatch(label)]
    units = [row for label, row in lines if _UNITS.fullmatch(label)]
    if len(names) != 1:
        return []
    return [Row(line=row.line, cells=["", *row.cells[1:]]) for row in (*names, *units[:1])]
