"""The header of a text file: names, units and titles in the lines above its numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from sysid.errors import ReaderError, shortened
from sysid.ingest.cells.headers import parse_header
from sysid.ingest.readers.csv.above import names_last
from sysid.ingest.readers.csv.cells import BLANKS, DATA, Kind, Row, is_units, kind_of, trimmed
from sysid.ingest.readers.csv.split import SEPARATORS, Split
from sysid.ingest.readers.csv.widths import has_no_column, rises, without_name
from sysid.ingest.tables.options import FileOptions
from sysid.ingest.tables.time_columns import is_called_time, is_time_unit

_BRACKET = re.compile(r"(?P<name>.*?)\s*(?P<unit>[\[(<][^\])>]*[\])>])")

_WORTH = re.compile(r"[+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?\s*[A-Za-zµ°%][A-Za-z0-9µ°%/^*.-]{0,11}")
_DATE = re.compile(r"\d+([-./])\d+\1\d+.*")
_MARKS = "#%!;/*'\" \t"


@dataclass(kw_only=True)
class Header:
    """What stands above the numbers.

    Args:
        names: One text a column; empty where none were found.
        units: Texts of the line of units, or ``None``.
        line: Line of the names, or ``None``.
        units_line: Line of the units, where it stands above the names.
        said: Words and numbers of the record that stand behind the names, ``"Increment,0.001"``.
        notes: What was recognised and should be told.
        labels: How many columns at the left are such words, beside the first rows of numbers.
    """

    names: Sequence[str] = ()
    units: Sequence[str] | None = None
    line: int | None = None
    units_line: int | None = None
    said: Sequence[str] = ()
    labels: int = 0
    notes: list[str] = field(default_factory=list)


def header_of(split: Split, first: int, comments: list[tuple[int, str]], options: FileOptions) -> Header:
    """Names and units: the last lines before the numbers, else the last comment before them.

    Args:
        split: The rows of the file.
        first: Index of the first row of numbers.
        comments: Line and text of the comments before it.
        options: Whether there are a header and a line of units, where that is known.

    Returns:
        The header; an empty one where there is none.

    Raises:
        ReaderError: If a comma seems to divide the numbers themselves.
    """
    found = Header()
    if options.header is False:
        return found
    above, found.said = names_last(_heads_joined(list(split.rows[:first]), split), split)
    if options.units_line is None and len(above) > 1 and _units_above(above, split):
        found.units_line = above[-2].line
        found.units = _to_width(above.pop(-2), split)
    elif options.units_line or (options.units_line is None and len(above) > 1 and _is_units(above, split)):
        found.units = _to_width(above.pop(), split)
    if above and _take_names(found, above, split):
        return found
    _take_comment(found, comments[-4:], split)
    return found


def labelled_header(split: Split, first: int) -> Header | None:
    """What the words beside the first rows of numbers say, as older oscilloscopes write them.

    Args:
        split: The rows of the file.
        first: Index of the first row of numbers.

    Returns:
        Names and units of a clock and one signal, where there are no more; ``None`` where no words stand so.
    """
    if not split.labelled or first > 0:
        return None
    labels = next(index for index, kind in enumerate(split.kinds) if kind in DATA)
    pairs = {row.cells[0].strip(): row.cells[1].strip() for row in split.rows if row.cells[0].strip() and labels > 1}
    columns = [index for index, kind in enumerate(split.kinds) if kind in DATA]
    names = [""] * split.width
    if len(columns) == 2 and "Source" in pairs:
        clock, signal = columns
        names[clock] = f"time [{pairs.get('Horizontal Units', 's')}]"
        names[signal] = (
            f"{pairs['Source']} [{pairs['Vertical Units']}]" if pairs.get("Vertical Units") else pairs["Source"]
        )
    told = f"{len(pairs)} words and values beside the first rows are none of the table's"
    return Header(names=names, said=[f"{k},{v}" for k, v in pairs.items()], notes=[told], labels=labels)


def _take_comment(found: Header, comments: list[tuple[int, str]], split: Split) -> None:
    """Names from the last comment, or from one before, where the last says their units, or that one names a time."""
    rows = list[tuple[int, list[str]]]()
    for line, text in comments:
        bare = text.split(split.separator) if split.separator != BLANKS else text.split()
        cells = _to_width(Row(line=line, cells=bare), split)
        rows += [] if cells is None else [(line, [cell.strip(_MARKS) for cell in cells])]
    if split.width == 1 and comments and len(comments[-1][1].split()) > 1:
        return
    timed = [k for k, (_, cells) in enumerate(rows) if any(is_called_time(parse_header(cell).name) for cell in cells)]
    if timed:
        units = [row for row in rows[timed[-1] + 1 :][:1] if is_units(row[1])]
        rows = [*rows[: timed[-1] + 1], *units]
    elif not rows or rows[-1][0] != comments[-1][0]:
        return
    if len(rows) > 1 and is_units(rows[-1][1]) and len(set(rows[-1][1])) < len(set(rows[0][1])) == split.width:
        found.units = rows.pop()[1]
    found.line, found.names = rows[-1]
    found.notes.append(f"names from the comment in line {found.line}")


def _take_names(found: Header, above: list[Row], split: Split) -> bool:
    """Whether the last line before the numbers, or before their units, has a name for each column; they are taken."""
    row = above[-1]
    cells = _to_width(row, split)
    repeats = cells is not None and len({cell.strip() for cell in cells if cell.strip()}) < sum(map(_filled, cells))
    upper = _to_width(above[-2], split) if repeats and len(above) > 1 else None
    grouped = None if upper is None or cells is None else _in_groups(upper, cells)
    if grouped is not None:
        row, cells = above[-2], grouped
    elif upper is not None and not _heads(upper, cells):  # a line of types or of numbers of channels below the names
        row, cells = above[-2], upper
    if cells is not None:
        found.names, found.line = [re.sub(r"^(?:%|//|!|;|\*)+\s*(?=\S)", "", cells[0]), *cells[1:]], row.line
        _tell_width(found, row, split)
        return True
    if split.separator == "," and len(row.cells) > 1 and 2 * len(row.cells) == split.width:
        raise ReaderError(
            "every row has twice as many cells as the header has names: a comma may stand in each number",
            where=f"line {row.line}",
            expected="another mark between the columns than in the numbers",
            got=f"{len(row.cells)} names over {split.width} cells: {shortened(','.join(row.cells))}",
            remedy="export with semicolons between the columns, or with decimal points; if these are whole numbers "
            "in columns of their own, leave the header out and name them (skip_lines, names: [...])",
        )
    if split.separator != BLANKS and len(row.cells) > 1:
        found.notes.append(
            f"line {row.line} before the numbers has {len(row.cells)} cells for {split.width} columns, "
            "which are numbered; names: [...] names them"
        )
    return False


def _heads(upper: list[str], cells: list[str] | None) -> bool:
    """Whether the lower of two lines has the names, though one comes again: it says units, or the upper repeats."""
    above, below = ([cell.strip() for cell in row or [] if _filled(cell)] for row in (upper, cells))
    own = all(parse_header(cell).unit for cell in below) and not any(parse_header(cell).unit for cell in above)
    return own or len(set(above)) < len(above)


def _tell_width(found: Header, row: Row, split: Split) -> None:
    """Say which column has no name, or which name no column, and call the first what it is."""
    written = trimmed(row.cells, split.width)
    first = without_name(written, row, split) if len(written) == split.width - 1 and not found.names[0] else None
    if first is not None:
        found.names = [first, *found.names[1:]]
        found.notes.append(f"line {row.line} has no name for the first column")
    elif len(written) == split.width + 1 and written[1:] == [*found.names]:
        found.notes.append(f"line {row.line} begins with {shortened(written[0].strip())}, for which there is no column")


def _heads_joined(above: list[Row], split: Split) -> list[Row]:
    """Two lines that are one head, as merged cells leave them, made one: titles over some columns, names over others.

    Of such a pair each column has a name in one line or in both, and some have it in only one of them, either way.
    """
    for last in (len(above), len(above) - 1):  # a line of units may stand below
        if last < 2:
            break
        upper, lower = (_to_width(row, split) for row in above[last - 2 : last])
        joined = None if upper is None or lower is None else _one_head(upper, lower)
        if joined is not None:
            return [*above[: last - 2], replace(above[last - 2], cells=joined), *above[last:]]
    return above


def _one_head(upper: list[str], lower: list[str]) -> list[str] | None:
    pairs = list(zip(map(_filled, upper), map(_filled, lower), strict=True))
    if not {(True, False), (False, True), (True, True)} <= set(pairs) or (False, False) in pairs:
        return None
    joined, title = list[str](), ""
    for above, below in zip(upper, lower, strict=True):
        title = above.strip() or title
        if not _filled(below):
            joined, title = [*joined, above], ""
            continue
        named = _BRACKET.fullmatch(title)
        unit = f" {named['unit']}" if named and _BRACKET.fullmatch(below.strip()) is None else ""
        joined.append(f"{named['name'] if named else title} {below.strip()}{unit}".strip())
    return joined if len(set(joined)) == len(joined) else None


def _in_groups(upper: list[str], cells: list[str]) -> list[str] | None:
    """Names that come again under a title for some columns each, with their title: ``Inlet p``, ``Outlet p``."""
    if sum(map(_filled, upper)) >= sum(map(_filled, cells)):
        return None
    titles, title = [], ""
    for above in upper:
        title = above.strip() or title
        titles.append(title)
    again = {cell.strip() for cell in cells if _filled(cell) and sum(c.strip() == cell.strip() for c in cells) > 1}
    found = [f"{t} {c.strip()}".strip() if c.strip() in again else c for t, c in zip(titles, cells, strict=True)]
    named = [name for name in found if _filled(name)]
    return found if len(set(named)) == len(named) else None


def _filled(cell: str) -> bool:
    return bool(cell.strip())


def _is_units(above: list[Row], split: Split) -> bool:
    units, names = (_to_width(row, split) for row in (above[-1], above[-2]))
    if units is None or names is None or not is_units(units):
        return False
    # Short names are units too (t, u, V): without brackets it is the line above that must look like names.
    if any(is_called_time(cell) for cell in units[:1]) and not any(map(is_called_time, names)) and rises(split):
        return False
    if _says_of_record(names):
        return False
    # A clock needs no name where its unit says what it is.
    clock = not _filled(names[0]) and is_time_unit(units[0].strip())
    named = sum(map(_filled, names)) + clock
    return named >= sum(map(_filled, units)) and not any(kind_of(cell) in DATA for cell in names[:1])


def _says_of_record(cells: list[str]) -> bool:
    """Whether a line is a word and what it is worth, a number with a unit or a date: no names of columns."""
    filled = [cell.strip() for cell in cells if _filled(cell)]
    if len(filled) != 2:
        return False
    return bool(_DATE.fullmatch(filled[1]) or (_WORTH.fullmatch(filled[1]) and not is_called_time(filled[0])))


def _units_above(above: list[Row], split: Split) -> bool:
    """Whether the line of units stands above the names: names as short as t and u are units too."""
    names, units = (_to_width(row, split) for row in (above[-1], above[-2]))
    if names is None or units is None:
        return False
    shares = [sum(is_units([cell]) for cell in cells) / max(sum(map(_filled, cells)), 1) for cells in (units, names)]
    return shares[0] == 1.0 and shares[1] < 1.0


def _by_other_mark(row: Row, split: Split) -> list[str] | None:
    """A head whose names stand between other marks than its numbers do: ``t,u,y`` over blanks."""
    text = split.lines[row.line - 1]
    for mark in SEPARATORS:
        cells = [] if mark in {BLANKS, split.separator} else [cell.strip() for cell in text.strip(mark).split(mark)]
        if len(set(cells)) == len(cells) == split.width and all(kind_of(cell) is Kind.WORD for cell in cells):
            return cells
    return None


def _to_width(row: Row, split: Split) -> list[str] | None:
    """A header brought to the width of the numbers, or ``None`` if it does not fit them."""
    cells, width = trimmed(row.cells, split.width), split.width
    if split.separator == BLANKS and len(cells) != width:
        text = split.lines[row.line - 1].strip().strip(_MARKS)
        for cut in (
            re.sub(r"\s+(?=[\[(<])", "", text).split(),  # t [s]  u [V]
            re.split(r"\t|\s{2,}", text),
            text.split(),
        ):
            if len(cut) == width:
                return cut
    if len(cells) != width > 1 and (other := _by_other_mark(row, split)) is not None:
        return other
    if 0 < len(cells) < width and all(kind is Kind.NOTHING for kind in split.kinds[len(cells) :]):
        return [*cells, *[""] * (width - len(cells))]
    if len(cells) == width - 1 > 1 and without_name(cells, row, split) is not None:
        return ["", *cells]
    if len(cells) == width + 1 > 2 and has_no_column(cells, split):
        return cells[1:]
    return cells if len(cells) == width else None
