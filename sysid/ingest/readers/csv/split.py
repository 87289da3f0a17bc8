"""Where the numbers of a text file are: the separator that divides it best, and the run of rows of numbers by it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress, pairwise
from pathlib import Path

from sysid.errors import ReaderError
from sysid.ingest.cells.headers import parse_header
from sysid.ingest.readers.csv.cells import BLANKS, DATA, Kind, Row, kind_of, kinds_of, split_rows, trimmed
from sysid.ingest.tables.options import FileOptions

SEPARATORS = ("\t", ";", ",", "|", BLANKS)
"""What may stand between cells; the earlier one wins where two fit."""


MOST_COLUMNS = 4096
_FEW = 50
_MOST_LABELS, _FEWEST_BLANK = 64, 8
"""Rows with a label beside or above the numbers at most, and rows without one below them at least."""
_SURELY_COUNTED = 6
"""Cells of a first line that no sample of as many channels would have: 1, 2, 3, 4, 5, 6."""
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


@dataclass(frozen=True, kw_only=True)
class Split:
    """The first rows of a file by one separator, and the longest run of rows of numbers among them."""

    separator: str
    rows: list[Row]
    lines: Sequence[str] = ()
    kinds: tuple[Kind, ...] = ()
    score: float = 0.0
    labelled: bool = False
    _told: dict[tuple[Kind, ...], bool] = field(default_factory=dict, init=False)

    @property
    def width(self) -> int:
        """How many columns the run has."""
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

    def has_its_numbers(self, row: Row) -> bool:
        """Whether a row has a number wherever the run has one, whatever stands beside them."""
        kinds = kinds_of(trimmed(row.cells, self.width))
        return len(kinds) == self.width and all(
            one in DATA for one, own in zip(kinds, self.kinds, strict=True) if own in DATA
        )

    def goes_on(self, kinds: tuple[Kind, ...]) -> bool:
        """Whether cells of these kinds go on as the run does."""
        if kinds not in self._told:  # rows are many, and their kinds few
            goes = len(kinds) == self.width and _merged(self.kinds, kinds) is not None
            # Labels beside the first rows are no part of the table, though its first column be one of nothing.
            label = self.labelled and bool(kinds) and kinds[0] is not Kind.NOTHING
            self._told[kinds] = goes and not label and any(kind in DATA for kind in kinds)
        return self._told[kinds]


def best_split(lines: list[str], given: str | None, options: FileOptions, path: Path, *, whole: bool) -> Split:
    """The lines by the separator that makes the most rows of numbers of them.

    Args:
        lines: The first lines of the file, without their ends.
        given: The separator, where it is known.
        options: What else is known.
        path: The file, for errors.
        whole: Whether these are all its lines.

    Returns:
        Rows, and the run of numbers among them.

    Raises:
        ReaderError: If no separator leaves a row of numbers, or there are too many columns.
    """
    best: Split | None = None
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
        if (
            best is not None
            and separator == BLANKS
            and best.separator == "\t"
            and sum(best.fitting) > sum(found.fitting)
        ):
            continue  # rows with an empty cell between tabs are rows of numbers, too
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
    _check_width(best, path)
    return best


def _check_width(split: Split, path: Path) -> None:
    if split.width <= MOST_COLUMNS:
        return
    raise ReaderError(
        f"the file has {split.width:,} columns",
        where=f"{path}, line {split.rows[-1].line}",
        expected=f"at most {MOST_COLUMNS:,}: a column per signal, a line per sample",
        got=f"{split.width:,}",
        remedy=f"cut out those that are needed: cut -d '{split.separator}' -f 1-{MOST_COLUMNS} '{path}' > cut.csv",
    )


def first_row(split: Split, options: FileOptions) -> int:
    """Where the numbers begin; a row of them with a bad cell is one, too.

    Args:
        split: The rows.
        options: Whether there is a header, where that is known.

    Returns:
        Index of the first row of numbers.
    """
    if options.header is False:
        return next(i for i, row in enumerate(split.rows) if len(trimmed(row.cells, split.width)) == split.width)
    first = split.fitting.index(True)
    if first == 0 and len(split.rows) > 1 and (options.header or numbers_columns(split)):
        return 1
    if split.labelled and all(split.has_its_numbers(row) for row in split.rows[:first]):
        return 0
    top = first
    while top > 0 and _is_spoilt(split, top - 1) and not _is_second_head(split, top - 1):
        top -= 1
    # Below a row of words only: what else stands above the numbers may have numbers in it, too.
    return top if 0 < top < first and _numbers_in(split, top - 1) == 0 else first


def numbers_columns(split: Split) -> bool:
    """Whether the first row is a head of numbers, as pandas writes it for columns that nobody named.

    Its cells are 0, 1, 2 ... or 1, 2, 3 ... above numbers with decimals or a clock that begins anew, or enough of them
    that no sample would have them, or whole numbers behind an empty cell that stands over the index, or over dates.

    Args:
        split: The rows of a file without another head.

    Returns:
        Whether it is.
    """
    head, *rows = ([cell.strip() for cell in row.cells] for row in split.rows[:_FEW])
    rows = [row for row in rows if len(row) == len(head)]
    if len(rows) < 2 or len(head) < 2 or len(set(head)) < len(head):
        return False
    if not head[0]:
        index = [row[0] for row in rows]
        dated = all(kind_of(cell) is Kind.TIME for cell in index)
        if all(map(_is_count, head[1:])) and (dated or index == [str(k) for k in range(len(rows))]):
            return True
        return _stands_over_a_clock(head[1:], rows)
    counts = [[str(k + begin) for k in range(len(head))] for begin in (0, 1)]
    if head not in counts:
        return False
    if len(head) >= _SURELY_COUNTED and not any(row in counts for row in rows):
        return True
    anew = [row[0].replace(",", ".") for row in rows[:2]]
    begins = all(_NUMBER.fullmatch(cell) for cell in anew) and float(anew[0]) == 0.0 < float(anew[1])
    by_decimals = len(head) > 2 or head == counts[0]
    return begins or (by_decimals and not any(_is_count(cell) for row in rows for cell in row[1:]))


def _stands_over_a_clock(places: list[str], rows: list[list[str]]) -> bool:
    """Whether places, such as 100, 200, 300, stand in order over signals beside a clock that begins at 0."""
    cells = [[cell.replace(",", ".") for cell in row] for row in (places, *rows)]
    if len(places) < 2 or not all(_NUMBER.fullmatch(row[0]) for row in cells[1:]):
        return False
    if not all(map(_NUMBER.fullmatch, cells[0])):
        return False
    heads, clock = ([float(cell) for cell in column] for column in (cells[0], [row[0] for row in cells[1:]]))
    rises = all(all(low < high for low, high in pairwise(numbers)) for numbers in (heads, clock))
    return rises and clock[0] == 0.0


def _is_count(cell: str) -> bool:
    return cell.isascii() and cell.isdigit()


def _has_decimal_commas(split: Split) -> bool:
    """Whether what looks like two columns of whole numbers is one with a decimal comma, as its header has one cell."""
    first = next((i for i, fits in enumerate(split.fitting) if fits), 0)
    if split.separator != "," or split.width != 2 or first == 0 or len(split.rows[first - 1].cells) != 1:
        return False
    plain = all("." not in cell and '"' not in cell for row in split.rows[first:] for cell in row.cells)
    return plain and parse_header(split.rows[first - 1].cells[0]).unit is not None


def _runs(separator: str, rows: list[Row], options: FileOptions) -> Split:
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
    if not best:
        return Split(separator=separator, rows=rows, kinds=best)
    labelled = _has_labels(found, best)
    best = (Kind.NOTHING, *best[1:]) if labelled else best
    split = Split(separator=separator, rows=rows, kinds=best, labelled=labelled)
    fits = [
        split.goes_on(kinds) if len(kinds) == len(best) and not options.missing else split.fits(row)
        for row, kinds in zip(rows, found, strict=True)
    ]
    fitting = sum(fits) * _numeric(best) ** 2 * (1.0 if len(best) > 1 else 0.5)
    alike = sum(len(trimmed(row.cells, len(best))) == len(best) > 1 for row in rows)
    return replace(split, score=(fitting + 0.25 * alike) / len(rows))


def _has_labels(found: Sequence[tuple[Kind, ...]], best: tuple[Kind, ...]) -> bool:
    """Whether words stand in the first column beside the first rows, or above the table, and nothing from there on."""
    if best[0] not in {Kind.WORD, Kind.NOTHING}:
        return False
    first = [kinds[0] for kinds in found if len(kinds) == len(best)]
    last = max((index for index, kind in enumerate(first) if kind is not Kind.NOTHING), default=-1)
    return 0 < last < min(_MOST_LABELS, len(first) - _FEWEST_BLANK)


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


def _is_spoilt(split: Split, index: int) -> bool:
    """Whether a row that does not fit is one of numbers with a bad cell."""
    cells = trimmed(split.rows[index].cells, split.width)
    own = [kind_of(cell) in DATA for cell, kind in zip(cells, split.kinds, strict=False) if kind in DATA]
    return len(cells) == split.width and 2 * sum(own) >= len(own)


def _is_second_head(split: Split, index: int) -> bool:
    """Whether a row says what tells names apart that stand twice above it, as heights do: a word stands over dates."""
    cells = trimmed(split.rows[index].cells, split.width)
    above = [cell.strip() for cell in split.rows[index - 1].cells] if index else []
    over_dates = split.kinds[0] is Kind.TIME and len(cells) == split.width and kind_of(cells[0]) is Kind.WORD
    return over_dates and len(above) == split.width and len(set(above)) < len(above)


def _numbers_in(split: Split, index: int) -> int:
    """How many cells of a row are data; -1 for a row of another width."""
    cells = trimmed(split.rows[index].cells, split.width)
    return sum(kind_of(cell) in DATA for cell in cells) if len(cells) == split.width else -1
