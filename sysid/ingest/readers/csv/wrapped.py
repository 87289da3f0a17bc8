"""One signal over many lines, a few of its samples in each: seismograms and accelerograms, whose head says how many."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from sysid.errors import ReaderError, shortened
from sysid.ingest.cells.numbers import NumberFormat
from sysid.ingest.tables.rates import said_step

_WHOLE = re.compile(r"(?<![\w.+-])[0-9]{1,9}(?![\w.]*[0-9])")
_RATE = re.compile(r"(?P<number>[0-9]+(?:\.[0-9]+)?)\s*(?P<unit>sps|hz|samples/s)\b", re.IGNORECASE)
_STEP = re.compile(r"\bdt\s*[=:]\s*(?P<number>[0-9]*\.?[0-9]+(?:e[+-]?[0-9]+)?)", re.IGNORECASE)
_MOST_HEAD, _FEWEST, _LONGEST = 40, 2, 1000
_TOUCHING = re.compile(r"(?<=[0-9.])(?=-[0-9.])")


def count_in_head(lines: Sequence[str]) -> tuple[int, frozenset[int]] | None:
    """Where the numbers of such a file begin, and how many samples there may be by what it says.

    Args:
        lines: The first lines; lines of as many numbers each follow on the head.

    Returns:
        Index of the first line of numbers, and the whole numbers that may be the count; ``None`` where the head has
        none that can be one.

    Example:
        >>> count_in_head(["TIMESERIES, 10 samples, 40 sps", "1 2 3 4", "5 6 7 8", "9 10"])
        (1, frozenset({40, 10}))
        >>> count_in_head(["t u", "0 1", "1 2"])
    """
    first = next((k for k, line in enumerate(lines) if _numbers(line) > 1), None)
    if not first or first > _MOST_HEAD or len(lines) <= first + 1:
        return None
    width, above = _numbers(lines[first]), lines[first - 1].split()
    if len(above) == width and not any(map(str.isdigit, "".join(above))):
        return None  # names of columns
    whole = [line for line in lines[first:-1] if line.strip()]
    block = next((k for k, line in enumerate(whole) if _numbers(line) == 0), len(whole))
    again = block < len(whole) and whole[block].split()[0] == lines[0].split()[0]
    if block < 2 or any(_numbers(line) != width for line in whole[: block - 1]) or (block < len(whole) and not again):
        return None
    lines = lines if block == len(whole) else [*lines[:first], *whole[:block]]
    counts = {int(one) for line in lines[:first] for one in _WHOLE.findall(line)}
    least = max(sum(map(_numbers, lines[first:])), width * _FEWEST)
    found = frozenset(one for one in counts if one >= least)
    return (first, found) if found else None


def unwrapped(
    lines: Iterable[str], first: int, counts: frozenset[int], path: Path
) -> tuple[list[str], list[str]] | None:
    """Such a file with a sample in each line.

    Args:
        lines: All of them.
        first: Index of the first line of numbers.
        counts: How many samples there may be.
        path: The file, for errors.

    Returns:
        The lines, below them of the head, and what should be told; ``None`` where there are not so many.

    Raises:
        ReaderError: If several signals stand one below the other.
    """
    kept = list(lines)
    if other := next(
        (k for k, line in enumerate(kept[first:], first) if line.strip() and not _cells_are_numbers(line)), 0
    ):
        raise ReaderError(
            "several signals stand one below the other, each over many lines",
            where=f"{path}, line {other + 1}",
            expected="one signal, or a column for each",
            got=shortened(kept[other].strip()),
            remedy="cut the file where the next begins, and name one file for each channel (file: [a.txt, b.txt])",
        )
    cells = [cell for line in kept[first:] for cell in _cells(line)]
    if len(cells) not in counts:
        return None
    head = [line for line in kept[:first] if line.strip()]
    said = {_hertz(line) for line in head} - {None}
    step = said_step(head) or (said.pop() if len(said) == 1 else None)
    above = [*head, *([f"dt = {step!r} s"] if step else [])]
    return [*above, "signal", *cells], [
        f"one signal of {len(cells)} samples, of which a line has several, as the head says"
    ]


def _hertz(line: str) -> float | None:
    """The sample time that stands in a line among others: ``40 sps``, ``NPTS= 4000, DT= .0050 SEC``."""
    rate, step = _RATE.search(line), _STEP.search(line)
    number = float(rate["number"]) if rate else float(step["number"]) if step else 0.0
    if not number > 0.0:
        return None
    return 1.0 / number if rate else number


def _cells_are_numbers(line: str) -> bool:
    return _numbers(line) > 0 or len(line) >= _LONGEST


def _cells(line: str) -> list[str]:
    return _TOUCHING.sub(" ", line).split()


def _numbers(line: str) -> int:
    """How many numbers a line is, 0 where anything else stands in it."""
    cells = _cells(line) if len(line) < _LONGEST else []
    plain = NumberFormat(decimal=".")
    return len(cells) if cells and all(plain.parse(cell) is not None for cell in cells) else 0
