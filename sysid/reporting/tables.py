"""Tables: rows of cells that carry the exact number beside its printed form; the template only lays them out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sysid.reporting.numbers import number
from sysid.validation.metrics import Merit

DIVERGED = "diverged"


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One cell.

    Args:
        text: As printed.
        value: The exact number, where it is one.
        below: A second, smaller line.
        header: Whether it names its row.
        mark: A class for emphasis: ``best``, ``published``, ``number`` or nothing.
    """

    text: str
    value: float | None = None
    below: str = ""
    header: bool = False
    mark: str = ""


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table.

    Args:
        caption: What it shows, units included.
        head: Names of the columns, each with a second line (may be empty).
        rows: The rows.
        note: A sentence below it.
        folded: Sentences that are folded away below that.
    """

    caption: str
    head: tuple[tuple[str, str], ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""
    folded: tuple[str, ...] = ()


def figure_cell(
    value: float, *, missing: str = "not defined", below: str = "", mark: str = "number", digits: int = 3
) -> Cell:
    """A cell with a number in a few significant digits."""
    return Cell(text=number(value, missing=missing, digits=digits), value=value, below=below, mark=mark)


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column of figures.

    Args:
        key: Which figure.
        heading: Its head.
        below: Stands below the heading, such as its unit.
        digits: Significant digits that are printed.
        decimals: Digits behind the point, where those say more.
    """

    key: str
    heading: str
    below: str = ""
    digits: int = 3
    decimals: int | None = None

    @classmethod
    def of(cls, merit: Merit, unit: str) -> Column:
        """The column of a figure of merit.

        Args:
            merit: The figure.
            unit: The output's unit.

        Returns:
            The column.
        """
        return cls(
            key=merit.key,
            heading=merit.heading,
            below=merit.said(unit),
            digits=merit.digits,
            decimals=merit.decimals,
        )

    def cell(self, value: float, *, missing: str = "-") -> Cell:
        """A figure as it is printed everywhere.

        Args:
            value: The figure.
            missing: What to say where it is no number.

        Returns:
            The cell.
        """
        if self.decimals is not None and math.isfinite(value):
            return Cell(text=f"{value:.{self.decimals}f}".replace("-", "−"), value=value, mark="number")
        return figure_cell(value, digits=self.digits, missing=missing)


def plain_table(
    caption: str,
    head: Sequence[tuple[str, str]],
    rows: Sequence[Sequence[int | float | str | None]],
    *,
    note: str = "",
    folded: Sequence[str] = (),
) -> Table:
    """A table of counts, numbers, words, and ``None`` or NaN for what there is not; the first word names its row.

    Args:
        caption: What it shows, units included.
        head: Names of the columns, each with a second line.
        rows: The rows, one value a column.
        note: A sentence below it.
        folded: Sentences that are folded away below that.

    Returns:
        The table.
    """
    cells = tuple(tuple(plain_cell(value, first=k == 0) for k, value in enumerate(row)) for row in rows)
    return Table(caption=caption, head=tuple(head), rows=cells, note=note, folded=tuple(folded))


def plain_cell(value: float | str | None, *, first: bool = False) -> Cell:
    """A count, a number, a word or nothing as a cell.

    Args:
        value: The value.
        first: Whether it is the first of its row, which a word then names.

    Returns:
        The cell.
    """
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return Cell(text="")
    if isinstance(value, int):  # a count has no significant digits
        return Cell(text=str(value), value=value, mark="number")
    return Cell(text=value, header=first) if isinstance(value, str) else figure_cell(value)


def facts(fields: dict[str, Any]) -> list[tuple[str, str]]:
    """Plain data as names and texts, nested names joined.

    Args:
        fields: Plain data.

    Returns:
        Pairs, in order.

    Example:
        >>> facts({"cores": 2, "packages": {"numpy": "2.2", "scipy": "1.15"}, "commit": None})
        [('cores', '2'), ('packages', 'numpy 2.2, scipy 1.15')]
    """
    return [(key.replace("_", " "), _words(value)) for key, value in fields.items() if value is not None]


def _words(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_words(entry)}" for key, entry in value.items() if entry is not None)
    if isinstance(value, list | tuple):
        return ", ".join(_words(entry) for entry in value)
    return number(value) if isinstance(value, float) else str(value)
