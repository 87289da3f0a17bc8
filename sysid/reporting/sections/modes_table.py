"""The poles of a linear model as a table: time constants, natural frequencies and damping, with their intervals."""

from __future__ import annotations

import math

from sysid.estimation import FitResult
from sysid.estimation.linear.modes import Mode, modes
from sysid.reporting.numbers import number
from sysid.reporting.tables import Cell, Table, figure_cell

COLUMNS = (
    ("time_constant", "time constant", "s"),
    ("natural_frequency", "natural frequency", "rad/s"),
    ("damping", "damping ratio", ""),
)


def modes_table(name: str, fit: FitResult) -> Table | None:
    """The poles of one fit.

    Args:
        name: Of the fit.
        fit: The fit.

    Returns:
        The table; ``None`` where the model has no poles.
    """
    found = modes(fit.model, fit.uncertainty)
    if not found:
        return None
    several, unseen = any(mode.of for mode in found), any(mode.rate is None for mode in found)
    rows = tuple(_row(mode, several=several) for mode in found)
    known = (
        "In brackets: 95 % intervals." if any(mode.intervals for mode in found) else "Their uncertainty is not known."
    )
    note = (
        "A pole at zero or on the negative real axis has no continuous form: it changes sign from sample to sample, "
        "and mostly describes noise. "
    ) * unseen
    head = (*([("input", "")] if several else []), ("pole", ""), *((title, unit) for _, title, unit in COLUMNS))
    return Table(caption=f"{name}: poles, the slowest first. {known}", head=head, rows=rows, note=note.strip())


def _row(mode: Mode, *, several: bool) -> tuple[Cell, ...]:
    # Of fast sampling every pole is 1.00 by three digits: what counts is how far it is from the circle.
    away = abs(1.0 - abs(mode.pole))
    digits = min(max(3, 1 + math.ceil(-math.log10(away))), 9) if away > 0.0 else 3
    pair = f" ± {number(abs(mode.pole.imag), digits=digits)}i" if mode.pole.imag else ""
    said = "no continuous form" if mode.rate is None else "integrates" if mode.rate == 0.0 else ""
    said = said or ("grows" if mode.rate is not None and mode.rate.real > 0.0 else "")
    first = Cell(text=f"{number(mode.pole.real, digits=digits)}{pair}", header=not several, below=said)
    cells = [Cell(text=mode.of, header=True), first] if several else [first]
    for key, _, _ in COLUMNS:
        value, ends = getattr(mode, key), mode.intervals.get(key)
        below = "" if ends is None else f"({number(ends[0])} to {number(ends[1])})"
        cells.append(Cell(text="") if value is None else figure_cell(value, below=below))
    return tuple(cells)
