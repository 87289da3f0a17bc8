"""Cells of text to float64: decimal comma, thousands separators, and nothing guessed.

A cell is a number or it is refused. ``1.5`` in a file whose thousands separator is the point is
refused, not read as 15: groups of thousands have three digits.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray

MISSING = ("", "nan", "-nan", "+nan", "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#ind", "1.#ind")
"""Texts that stand for a missing value in every file, whatever their case: how C, MATLAB and Fortran write NaN."""

USUAL_MISSING = frozenset(
    {"na", "n/a", "#n/a", "n.a.", "null", "none", "nil", "nodata", "no data", "-", "--", "---", "----", "?", "???", "*"}
    | {"err", "error", "bad", "bad input", "i/o timeout", "invalid", "overrange", "ovf", "ol", "open circuit", "fault"}
    | {"#value!", "#num!", "#div/0!", "#ref!", "#name?", "#null!", "****", "*****", "missing", "inval"}
    | {"1.#inf", "-1.#inf", "1.#inf00", "-1.#inf00"}
)
"""Texts that mostly stand for a missing value: proposed as ``missing``, and never taken so by themselves."""


def usually_missing(text: str) -> bool:
    """Whether a text mostly stands for a missing value, as ``n/a``, ``---`` and ``****`` do.

    Args:
        text: A cell that is no number.

    Returns:
        True if it does.
    """
    return text.casefold() in USUAL_MISSING or (len(text) > 0 and not text.strip("*#?-_."))


_MARKS = dict.fromkeys(map(ord, "\u00a0\u2007\u2009\u202f"), " ") | {0x2019: "'"}

HEXADECIMAL = re.compile(r"[+-]?0[xX][0-9a-fA-F]{1,13}")
"""Counts as converters and buses write them; more digits are more than float64 holds."""

MOST_WORDS = 64
"""Different texts that are no numbers, above which a column is one of remarks."""


@dataclass(frozen=True, kw_only=True)
class NumberFormat:
    """How numbers are written in a file.

    Args:
        decimal: ``"."`` or ``","``.
        thousands: What separates groups of three digits, or ``None``. If it equals ``decimal``, the
            last one in a number is the decimal one: some loggers write 1003 ms as ``1.003.000``.
        missing: Further texts that stand for a missing value.
        states: Words that stand for numbers.
        suffix: The unit behind every number, which is taken off.
    """

    decimal: str = "."
    thousands: str | None = None
    missing: tuple[str, ...] = ()
    states: Mapping[str, float] = field(default_factory=dict)
    suffix: str = ""

    def parse(self, cell: str) -> float | None:
        """One cell.

        Args:
            cell: Its text.

        Returns:
            The number, NaN for a missing value, or ``None`` if the cell is not a number. In brackets it is negative,
            as accountants and spreadsheets write it.

        Example:
            >>> NumberFormat(decimal=".", thousands=".").parse("1.003.000")
            1003.0
            >>> NumberFormat(decimal=",", thousands=".").parse("1.5") is None
            True
            >>> NumberFormat().parse("(12.3)")
            -12.3
        """
        text = spaced(cell.strip()) if self.thousands in {" ", "'"} else cell.strip()
        if self.suffix:
            text = text.removesuffix(self.suffix).rstrip()
        if text.lower() in MISSING or text in self.missing:
            return float("nan")
        if text in self.states:
            return self.states[text]
        if text[:1] == "(" and text[-1:] == ")" and text[1:2].isdigit():
            value = self.parse(text[1:-1])
            return None if value is None else -value
        if not _pattern(self.decimal, self.thousands).fullmatch(text):
            return float(int(text, 16)) if HEXADECIMAL.fullmatch(text) else None
        if self.thousands == self.decimal:
            head, _, tail = text.rpartition(self.decimal)
            text = f"{head.replace(self.decimal, '')}.{tail}" if head or tail != text else text
            return _float(text)
        if self.thousands:
            text = text.replace(self.thousands, "")
        return _float(text.replace(self.decimal, "."))

    @property
    def missing_numbers(self) -> tuple[float, ...]:
        """Those of the texts that stand for a missing value that are numbers themselves."""
        bare = NumberFormat(decimal=self.decimal, thousands=self.thousands)
        parsed = [bare.parse(text) for text in self.missing]
        return tuple(value for value in parsed if value is not None and np.isfinite(value))

    def column(self, cells: Sequence[str]) -> NDArray[np.float64] | int:
        """A whole column.

        Args:
            cells: Texts.

        Returns:
            Shape ``(len(cells),)``, or the index of the first cell that is not a number.
        """
        values, strange = self.column_with_words(cells)
        return next(iter(strange.values())) if strange else values

    def column_with_words(self, cells: Sequence[str]) -> tuple[NDArray[np.float64], dict[str, int]]:
        """A whole column, whatever is in it.

        Args:
            cells: Texts.

        Returns:
            Shape ``(len(cells),)``, NaN where a cell is not a number; and the texts of such cells (the first
            ``MOST_WORDS`` different ones), each with the index of the first cell that holds it.
        """
        fast = self._fast(cells)
        if fast is not None:
            return fast, {}
        values = np.full(len(cells), np.nan)
        strange: dict[str, int] = {}
        for index, cell in enumerate(cells):
            value = self.parse(cell)
            if value is not None:
                values[index] = value
            elif len(strange) < MOST_WORDS:
                strange.setdefault(cell.strip(), index)
        return values, strange

    def _fast(self, cells: Sequence[str]) -> NDArray[np.float64] | None:
        # float() knows more than the pattern does (1_0, 1.5 with a decimal comma, other scripts'
        # digits); a column without such characters can go through it at once.
        if self.thousands is not None or self.suffix or not cells:
            return None
        joined = "\n".join(cells)
        foreign = ("_", "." if self.decimal == "," else ",", "n", "N")
        if not joined.isascii() or any(mark in joined for mark in foreign):
            return None
        try:
            return np.array([float(cell) for cell in joined.replace(self.decimal, ".").split("\n")])
        except ValueError:
            return None


def spaced(text: str) -> str:
    r"""A text with a plain blank, or a plain apostrophe, for each that typographers use between thousands.

    Args:
        text: Of a cell.

    Returns:
        The text.

    Example:
        >>> spaced("1\u202f000\xa0000"), spaced("1\u2019000")
        ('1 000 000', "1'000")
    """
    return text.translate(_MARKS)


def _float(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float(text.lower().replace("d", "e"))  # 1.0D+03, as Fortran writes it


@cache
def _pattern(decimal: str, thousands: str | None) -> re.Pattern[str]:
    point = re.escape(decimal)
    exponent = r"(?:[eEdD][+-]?[0-9]+)?"
    infinite = r"[+-]?inf(?:inity)?"
    if thousands is None:
        body = rf"(?:[0-9]+(?:{point}[0-9]*)?|{point}[0-9]+)"
    elif thousands == decimal:
        body = rf"(?:[0-9]+|(?:[0-9]{{1,3}}(?:{point}[0-9]{{3}})*|[0-9]+){point}[0-9]*)"
    else:
        group = re.escape(thousands)
        body = rf"(?:[0-9]{{1,3}}(?:{group}[0-9]{{3}})+|[0-9]+)(?:{point}[0-9]*)?"
    return re.compile(rf"[+-]?{body}{exponent}|(?i:{infinite})")
