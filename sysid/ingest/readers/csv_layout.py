"""What a text file does not say about itself: separator, decimal mark, where the numbers begin, and their header.

The numbers are found first: the rows that go on, of one width and one kind in each column. The header is the last
line before them, a line of units aside; what stands above it is a preamble.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress, pairwise
from pathlib import Path

from sysid.errors import ReaderError, shortened
from sysid.ingest.headers import parse_header
from sysid.ingest.numbers import NumberFormat
from sysid.ingest.options import FileOptions
from sysid.ingest.readers.csv_cells import (
    BLANKS,
    DATA,
    Kind,
    Row,
    is_units,
    kind_of,
    kinds_of,
    split_rows,
    suffix_of,
    trimmed,
)
from sysid.ingest.table import is_called_time

SEPARATORS = ("\t", ";", ",", "|", BLANKS)
"""What may stand between cells; the earlier one wins where two fit."""

MOST_COLUMNS = 4096
_SEP_LINE = re.compile(r'"?sep=(?P<mark>.)"?\s*', re.IGNORECASE)
_COMMA = re.compile(r"[+-]?[0-9]*(?:[.' ][0-9]{3})*,[0-9]+(?:[eEdD][+-]?[0-9]+)?")
_POINT = re.compile(r"[+-]?[0-9]*(?:[,' ][0-9]{3})*\.[0-9]+(?:[eEdD][+-]?[0-9]+)?")
_BRACKET = re.compile(r"(?P<name>.*?)\s*(?P<unit>[\[(<][^\])>]*[\])>])")
_MARKS = "#%!;/*'\" \t"


@dataclass(frozen=True, kw_only=True)
class Layout:
    """How a text file is laid out.

    Args:
        separator: What stands between cells; a blank is a run of blanks.
        numbers: How numbers are written.
        names: Texts of the header, one a column; empty where there is none.
        units: Texts of the line of units, or ``None``.
        kinds: What each column holds, as far as its first rows tell.
        skip: How many lines stand before the first row of numbers.
        header: Line of the header, or ``None``.
        preamble: Rows before the header.
        comments: Comments before the numbers, without their mark.
        suffixes: The unit behind every number of a column, or the empty text.
        notes: What was recognised and should be told.
    """

    separator: str
    numbers: NumberFormat
    names: tuple[str, ...]
    units: tuple[str, ...] | None
    kinds: tuple[Kind, ...]
    skip: int
    header: int | None
    preamble: tuple[Row, ...]
    comments: tuple[str, ...]
    suffixes: tuple[str, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class _Split:
    """The first rows of a file by one separator, and the longest run of rows of numbers among them."""

    separator: str
    rows: list[Row]
    lines: Sequence[str] = ()
    kinds: tuple[Kind, ...] = ()
    score: float = 0.0
    _told: dict[tuple[Kind, ...], bool] = field(default_factory=dict, init=False)

    @property
    def width(self) -> int:
        return len(self.kinds)

    def fits(self, row: Row) -> bool:
        """Whether a row goes on as the run does."""
        return self.goes_on(kinds_of(trimmed(row.cells, self.width)))

    @cached_property
    def fitting(self) -> list[bool]:
        """Which rows do."""
        return [self.fits(row) for row in self.rows]

    def run(self, first: int = 0) -> list[Row]:
        """Those of them from one on."""
        return list(compress(self.rows[first:], self.fitting[first:]))

    def goes_on(self, kinds: tuple[Kind, ...]) -> bool:
        """Whether cells of these kinds go on as the run does."""
        if kinds not in self._told:  # rows are many, and their kinds few
            goes = len(kinds) == self.width and _merged(self.kinds, kinds) is not None
            self._told[kinds] = goes and any(kind in DATA for kind in kinds)
        return self._told[kinds]


@dataclass(kw_only=True)
class _Header:
    names: Sequence[str] = ()
    units: Sequence[str] | None = None
    line: int | None = None
    units_line: int | None = None
    notes: list[str] = field(default_factory=list)


def recognise(lines: Sequence[str], options: FileOptions, path: Path, *, whole: bool) -> Layout:
    """The layout of a text file; what the options say is not guessed.

    Args:
        lines: Its first lines, without their ends.
        options: What is known already.
        path: The file, for errors.
        whole: Whether these are all its lines.

    Returns:
        The layout.

    Raises:
        ReaderError: If there are no numbers, the decimal mark cannot be told, or there are too many columns.
    """
    lines, told = _without_marks(lines, options)
    comments = [
        (i + 1, t[len(options.comment) :].strip()) for i, t in enumerate(lines) if t.startswith(options.comment)
    ]
    split = _best(lines, options.separator or told, options, path, whole=whole)
    _check_width(split, path)
    first = _first(split, options)
    numbers = NumberFormat(
        decimal=options.decimal or _decimal(split.run(first), path, options),
        thousands=options.thousands,
        missing=options.missing,
    )
    top = split.rows[first].first_line - 1
    above = [(line, text) for line, text in comments if line <= top]
    header = _header(split, first, above, options)
    above_header = [row for row in split.rows[:first] if header.line is None or row.line < header.line]
    preamble = [row for row in above_header if row.line != header.units_line]
    if preamble:
        shown = split.separator.join(preamble[0].cells).replace("\t", " ").strip()[:60]
        header.notes.append(f"{_lines(len(preamble))} before the header left out, the first: {shown!r}")
    return Layout(
        separator=split.separator,
        numbers=numbers,
        names=tuple(header.names),
        units=None if header.units is None else tuple(header.units),
        kinds=split.kinds,
        skip=top,
        header=header.line,
        preamble=tuple(preamble),
        comments=tuple(text for _, text in above),
        suffixes=_suffixes(split, first),
        notes=tuple(header.notes),
    )


def _lines(count: int) -> str:
    return "1 line" if count == 1 else f"{count} lines"


def _without_marks(lines: Sequence[str], options: FileOptions) -> tuple[list[str], str | None]:
    """The lines with those to be skipped made blank, and the separator that a first line ``sep=;`` names."""
    kept = ["" if i < options.skip_lines else text for i, text in enumerate(lines)]
    for index, text in enumerate(kept):
        match = _SEP_LINE.fullmatch(text)
        if match:
            kept[index] = ""
            return kept, match["mark"] if match["mark"] in SEPARATORS else None
        if text.strip():
            break
    return kept, None


def _best(lines: list[str], given: str | None, options: FileOptions, path: Path, *, whole: bool) -> _Split:
    best: _Split | None = None
    problem: ReaderError | None = None
    absent = False
    for separator in (given,) if given else SEPARATORS:
        if separator != BLANKS and not any(separator in text for text in lines):
            if absent:  # nor does this one divide anything
                continue
            absent = True
        try:
            ended = (f"{text}\n" for text in lines)
            rows = split_rows(ended, separator, line=1, comment=options.comment, path=path, whole=whole)
            found = replace(_runs(separator, list(rows), options), lines=lines)
        except ReaderError as error:
            problem = problem or error
            continue
        if best is None or found.score > best.score + 1e-9:
            best = found
    if best is not None and _has_decimal_commas(best):
        rows = split_rows((f"{t}\n" for t in lines), ";", line=1, comment=options.comment, path=path, whole=whole)
        best = replace(_runs(";", list(rows), options), lines=lines)
    if best is None or (best.width < 2 and problem is not None):
        raise problem or ReaderError("the file cannot be split into cells", where=path)
    if not best.kinds:
        shown = next((text.strip() for text in reversed(lines) if text.strip()), "")
        raise ReaderError(
            "the file holds no samples",
            where=path,
            expected="a header line and rows of numbers",
            got=f"no row of numbers; the last line looked at is {shown[:80]!r}" if shown else "no line but blank ones",
            remedy="check that the recording was saved, and the options separator, decimal, comment and skip_lines",
        )
    return best


def _has_decimal_commas(split: _Split) -> bool:
    """Whether what looks like two columns of whole numbers is one with a decimal comma, as its header has one cell."""
    first = next((i for i, fits in enumerate(split.fitting) if fits), 0)
    if split.separator != "," or split.width != 2 or first == 0 or len(split.rows[first - 1].cells) != 1:
        return False
    plain = all("." not in cell and '"' not in cell for row in split.rows[first:] for cell in row.cells)
    return plain and parse_header(split.rows[first - 1].cells[0]).unit is not None


def _runs(separator: str, rows: list[Row], options: FileOptions) -> _Split:
    """The longest run of rows of one width and one kind in each column; the more numbers in a row, the better."""
    best: tuple[Kind, ...] = ()
    run: tuple[Kind, ...] = ()
    best_score = 0.0
    length = 0
    found = [kinds_of(row.cells, options.missing) for row in rows]
    numeric = 0.0
    for kinds in found:
        merged = run if kinds == run else _merged(run, kinds)
        length, going = (1, kinds) if merged is None else (length + 1, merged)
        if going is not run:
            run, numeric = going, _numeric(going) ** 2
        score = length * numeric
        if score > best_score:
            best, best_score = run, score
    split = _Split(separator=separator, rows=rows, kinds=best)
    if not best:
        return split
    fits = [
        split.goes_on(kinds) if len(kinds) == len(best) and not options.missing else split.fits(row)
        for row, kinds in zip(rows, found, strict=True)
    ]
    fitting = sum(fits) * _numeric(best) ** 2 * (1.0 if len(best) > 1 else 0.5)
    alike = sum(len(trimmed(row.cells, len(best))) == len(best) > 1 for row in rows)
    return replace(split, score=(fitting + 0.25 * alike) / len(rows))


def _numeric(kinds: Sequence[Kind]) -> float:
    """The share of numbers in what a row holds."""
    return sum(kind in DATA for kind in kinds) / max(sum(kind is not Kind.NOTHING for kind in kinds), 1)


def _merged(run: Sequence[Kind], kinds: Sequence[Kind]) -> tuple[Kind, ...] | None:
    """What two rows hold together, or ``None`` if they do not go on from each other."""
    if len(run) != len(kinds):
        return None
    if run == kinds:
        return tuple(run)
    merged = []
    for known, new in zip(run, kinds, strict=True):
        if known is new or new is Kind.NOTHING:
            merged.append(known)
        elif known is Kind.NOTHING:
            merged.append(new)
        elif {known, new} == {Kind.NUMBER, Kind.WHOLE}:
            merged.append(Kind.WHOLE)
        else:
            return None
    return tuple(merged)


def _check_width(split: _Split, path: Path) -> None:
    if split.width <= MOST_COLUMNS:
        return
    raise ReaderError(
        f"the file has {split.width:,} columns",
        where=f"{path}, line {split.rows[-1].line}",
        expected=f"at most {MOST_COLUMNS:,}: a column per signal, a line per sample",
        got=f"{split.width:,}",
        remedy=f"cut out those that are needed: cut -d '{split.separator}' -f 1-{MOST_COLUMNS} '{path}' > cut.csv",
    )


def _first(split: _Split, options: FileOptions) -> int:
    """Index of the first row of numbers."""
    if options.header is False:
        return next(i for i, row in enumerate(split.rows) if len(trimmed(row.cells, split.width)) == split.width)
    first = split.fitting.index(True)
    if options.header and first == 0 and len(split.rows) > 1:
        return 1
    top = first
    while top > 0 and _is_spoilt(split, top - 1):
        top -= 1
    # Below a row of words only: what else stands above the numbers may have numbers in it, too.
    return top if 0 < top < first and _numbers_in(split, top - 1) == 0 else first


def _is_spoilt(split: _Split, index: int) -> bool:
    """Whether a row that does not fit is one of numbers with a bad cell."""
    return 2 * _numbers_in(split, index) >= sum(kind in DATA for kind in split.kinds)


def _numbers_in(split: _Split, index: int) -> int:
    """How many cells of a row are data; -1 for a row of another width."""
    cells = trimmed(split.rows[index].cells, split.width)
    return sum(kind_of(cell) in DATA for cell in cells) if len(cells) == split.width else -1


def _suffixes(split: _Split, first: int) -> tuple[str, ...]:
    rows = [trimmed(row.cells, split.width) for row in split.run(first)]

    def suffix(index: int) -> str:
        cells = (row[index].strip() for row in rows)
        suffixes = (suffix_of(cell) for cell in cells if cell and kind_of(cell) is Kind.NUMBER)
        one = next(suffixes, "")
        return one if one and all(other == one for other in suffixes) else ""  # most numbers have none: one tells

    return tuple(suffix(index) for index in range(split.width))


def _decimal(rows: Sequence[Row], path: Path, options: FileOptions) -> str:
    if options.thousands == ",":
        return "."
    commas = next((row for row in rows for cell in row.cells if "," in cell and _COMMA.fullmatch(cell.strip())), None)
    points = next((row for row in rows for cell in row.cells if "." in cell and _POINT.fullmatch(cell.strip())), None)
    if commas and points and options.thousands is None:
        raise ReaderError(
            "the file holds numbers with a decimal comma and numbers with a decimal point",
            where=f"{path}, lines {commas.line} and {points.line}",
            expected="one decimal mark",
            got=f"{commas.cells} and {points.cells}",
            remedy="name it (decimal: ',' or decimal: '.'), and what separates thousands (thousands: '.')",
        )
    return "," if commas else "."


def _header(split: _Split, first: int, comments: list[tuple[int, str]], options: FileOptions) -> _Header:
    """Names and units: the last lines before the numbers, else the last comment before them."""
    found = _Header()
    if options.header is False:
        return found
    above = _heads_joined(list(split.rows[:first]), split)
    if options.units_line is None and len(above) > 1 and _units_above(above, split):
        found.units_line = above[-2].line
        found.units = _to_width(above.pop(-2), split)
    elif options.units_line or (options.units_line is None and len(above) > 1 and _is_units(above, split)):
        found.units = _to_width(above.pop(), split)
    if above:
        row = above[-1]
        cells = _to_width(row, split)
        repeats = cells is not None and len({cell.strip() for cell in cells if cell.strip()}) < sum(map(_filled, cells))
        upper = _to_width(above[-2], split) if repeats and len(above) > 1 else None
        grouped = None if upper is None or cells is None else _in_groups(upper, cells)
        if grouped is not None:
            row, cells = above[-2], grouped
        elif upper is not None:  # a line of types or of numbers of channels below the names
            row, cells = above[-2], upper
        if cells is not None:
            found.names, found.line = [re.sub(r"^(?:%|//|!|;|\*)+\s*(?=\S)", "", cells[0]), *cells[1:]], row.line
            return found
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
    for line, text in comments[-1:]:
        bare = text.split(split.separator) if split.separator != BLANKS else text.split()
        cells = _to_width(Row(line=line, cells=bare), split)
        if cells is not None and (split.width > 1 or len(text.split()) == 1):
            found.names, found.line = [cell.strip(_MARKS) for cell in cells], line
            found.notes.append(f"names from the comment in line {line}")
    return found


def _heads_joined(above: list[Row], split: _Split) -> list[Row]:
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


def _is_units(above: list[Row], split: _Split) -> bool:
    units, names = (_to_width(row, split) for row in (above[-1], above[-2]))
    if units is None or names is None or not is_units(units):
        return False
    # Short names are units too (t, u, V): without brackets it is the line above that must look like names.
    if any(is_called_time(cell) for cell in units[:1]) and not any(map(is_called_time, names)) and _rises(split):
        return False
    return sum(map(_filled, names)) >= sum(map(_filled, units)) and not any(kind_of(cell) in DATA for cell in names[:1])


def _rises(split: _Split) -> bool:
    """Whether the first column goes up from row to row, as time does."""
    try:
        values = [float(row.cells[0].replace(",", ".")) for row in compress(split.rows[:100], split.fitting)]
    except ValueError:
        return False
    return len(values) > 2 and all(after > before for before, after in pairwise(values))


def _counts(split: _Split) -> bool:
    """Whether the first column numbers the rows in quotes, as R writes names of rows and gives them no head."""
    rows = split.run()[:100]
    numbers = [row.cells[0].strip() for row in rows]
    if len(rows) < 2 or not numbers[0].isdecimal():
        return False
    quoted = all(split.lines[row.line - 1].lstrip().startswith('"') for row in rows)
    return quoted and numbers == [str(int(numbers[0]) + k) for k in range(len(rows))]


def _units_above(above: list[Row], split: _Split) -> bool:
    """Whether the line of units stands above the names: names as short as t and u are units too."""
    names, units = (_to_width(row, split) for row in (above[-1], above[-2]))
    if names is None or units is None:
        return False
    shares = [sum(is_units([cell]) for cell in cells) / max(sum(map(_filled, cells)), 1) for cells in (units, names)]
    return shares[0] == 1.0 and shares[1] < 1.0


def _to_width(row: Row, split: _Split) -> list[str] | None:
    """A header brought to the width of the numbers, or ``None`` if it does not fit them."""
    cells, width = trimmed(row.cells, split.width), split.width
    if len(cells) == width - 1 > 1 and _counts(split):
        return ["row", *cells]
    if split.separator == BLANKS and len(cells) != width:
        text = split.lines[row.line - 1].strip().strip(_MARKS)
        for cut in (
            re.sub(r"\s+(?=[\[(<])", "", text).split(),  # t [s]  u [V]
            re.split(r"\t|\s{2,}", text),
            text.split(),
        ):
            if len(cut) == width:
                return cut
    if len(cells) == width - 1 > 0 and split.kinds[-1] is Kind.NOTHING:
        cells = [*cells, ""]
    return cells if len(cells) == width else None
