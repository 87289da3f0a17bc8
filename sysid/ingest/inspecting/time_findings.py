"""Which column of an unknown file is its time, and what its stamps need."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.assembling.timing import Timing, even_step, round_step, rounded_step, survey
from sysid.ingest.cells.headers import unit_in_name
from sysid.ingest.inspecting.restarts import of_few_digits
from sysid.ingest.inspecting.second_clocks import counts_rows
from sysid.ingest.readers.trees.leaves import step_in
from sysid.ingest.tables.clocks import clock_of, since_1970
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.options import FileOptions, GridOptions, TimeOptions
from sysid.ingest.tables.over_frequency import frequencies_in
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import is_counter, is_time_unit, unit_of_clock

_RISING_SHARE = 0.98  # of the steps of a column that is taken for time though nothing says so
_EVEN_SHARE = 0.9  # of its steps, that are like the usual one
_MOSTLY_ALIKE, _OFTEN, _MOST_UNEVEN = 0.5, 0.05, 20.0
_ARRAYS = {"matlab", "numpy"}
_MINUTE = 60.0
_MICROS, _MANY = 500.0, 20
"""From which step on a clock may count microseconds, and how many of its steps show in what it counts."""
_ENDS_IN_TIME = re.compile(r"time(?![a-z])", re.IGNORECASE)
_YEARS, _CALLED_YEAR = (1700.0, 2300.0), re.compile(r"year|jahr|date|année|año", re.IGNORECASE)


def find_time(table: RawTable, files: FileOptions) -> tuple[TimeOptions, str]:
    """The time column, and what of it or its unit had to be guessed."""
    asked = files.time
    if asked.step is not None:
        return asked, ""
    if table.settings.get("calendar") and table.time is not None:
        return TimeOptions(column=table.time, unit="datetime", format=asked.format, zone=asked.zone), ""
    name = asked.column or table.time or (_rising(table.columns) if table.step is None else None)
    if name is None and table.step is not None:
        return TimeOptions(step=table.step), ""
    column = None if name is None else table.find(name)
    counted = column is not None and name not in {asked.column, table.time} and counts_rows(column)
    if column is None or name is None or counted:
        beside = step_beside(table.columns)
        if beside is not None:
            return TimeOptions(step=beside[1]), ""
        why = f"{name} counts the rows and says no time" if counted else "no time stamps"
        return TimeOptions(step=1.0), f"guessed: {why}, 1 s between them"
    by_rising = "" if name in {asked.column, table.time} else f"{name} is taken for time, as it rises"
    clock = clock_of(column.values, column.name, origin=column.counted_from) if asked.unit is None else None
    said = None if clock is not None and "clock" in table.settings else column.unit
    unit = asked.unit or (said if said is not None and is_time_unit(said) else None) or unit_in_name(name)
    unit = unit or (unit_of_clock(name) if clock is None else None) or _years(column)
    if unit is not None:
        return TimeOptions(column=column.name, unit=unit), by_rising and f"guessed: {by_rising}"
    if clock is not None:
        return TimeOptions(column=column.name, unit=clock.unit), f"guessed: {name} counts {clock.told}, by its size"
    with np.errstate(invalid="ignore"):
        steps = np.diff(column.values[:100_000])
    steps = finite_of(steps)
    guess, other = _unit_by_step(steps, arrays=table.reader in _ARRAYS)
    why = f"the file says {said}, which is no unit of time" if said else "the file does not say its unit"
    first = f"{by_rising}; " if by_rising else ""
    why += "; it rises by 1, as a number of samples does" if len(steps) and bool((steps == 1.0).all()) else ""
    why += f"; if it is {other}, say so: unit: {other} (--time-unit {other})" if other else ""
    return TimeOptions(column=column.name, unit=guess), f"guessed: {first}{name} in {guess}; {why}"


def _years(column: RawColumn) -> str | None:
    """The unit of dates as parts of a year, 2001.0417, which say so by their name and size."""
    known = finite_of(column.values)
    dated = len(known) > 1 and known.min() > _YEARS[0] and known.max() < _YEARS[1] and column.unit is None
    return "year" if dated and _CALLED_YEAR.search(column.name) else None


def _unit_by_step(steps: NDArray[np.float64], *, arrays: bool) -> tuple[str, str]:
    """The unit of a clock that says none, and the other one that it may well be, or nothing."""
    step = float(np.median(steps)) if len(steps) else 0.0
    if _MICROS <= step < 5e3 and len(steps) > _MANY and _is_of_boards(steps):
        return "us", "ms"
    # Few records are sampled slower than every 5 s, but for those of whole minutes; few clocks count finer than they
    # sample.
    if step < 5.0:
        return "s", ""
    even = float(np.mean(np.abs(steps - step) <= 1e-6 * step)) >= _RISING_SHARE
    # What is computed with has its time in s, where a logger's clock is uneven.
    if (step >= _MINUTE and step % _MINUTE == 0.0) or (arrays and even and step < 1e3):
        return "s", "ms"
    if step < _MICROS:
        return "ms", "s"
    return ("ms", "us") if step < 5e3 else ("us", "ms")


def _is_of_boards(steps: NDArray[np.float64]) -> bool:
    """Whether all that uneven steps have in common is 4 or 8, as the microseconds of small boards do."""
    whole = np.rint(steps).astype(np.int64)
    return bool((whole == steps).all()) and int(np.gcd.reduce(whole)) in {4, 8} and bool((whole != whole[0]).any())


def without_copies(columns: Sequence[RawColumn]) -> tuple[RawColumn, ...]:
    """The columns of a file in which a name stood twice; what was written twice, numbers and all, is aside."""
    found: list[RawColumn] = []
    for column in columns:
        first = next((c for c in found if np.array_equal(c.values, column.values, equal_nan=True)), None)
        again = first is not None and not column.aside and column.name.startswith(f"{first.name} ")
        found.append(replace(column, aside=f"the same numbers as {first.name}") if first and again else column)
    return tuple(found)


def step_beside(columns: Sequence[RawColumn]) -> tuple[str, float] | None:
    """The column that says the sample time or a rate, as public benchmarks have it, ``Ts``, and the seconds."""
    for column in columns:
        known = np.unique(finite_of(column.values))
        if len(known) == 1:
            step = step_in(f"{column.name} [{column.unit}]" if column.unit else column.name, float(known[0]))
            if step is not None:
                return column.name, step
    return None


def finite_of(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The finite ones; the same array, not a copy, where all are."""
    known = np.isfinite(values)
    return values if known.all() else values[known]


def _rising(columns: Sequence[RawColumn]) -> str | None:
    """A column that rises like a clock: nearly always, and by much the same step, or from 1970 on.

    One that is called so in a word of its own, ``cputime_pru``, need not be even.
    """
    frequencies = frequencies_in(columns)

    def rank(column: RawColumn) -> tuple[bool, bool, bool]:
        """A clock goes before a counter, and one that says the date before any."""
        counts = is_counter(column.name) or counts_rows(column)
        return not since_1970(column.values), counts, _ENDS_IN_TIME.search(column.name) is None

    for column in sorted(columns, key=rank):
        with np.errstate(invalid="ignore"):
            steps = np.diff(column.values)
        if (
            column is frequencies
            or column.problem is not None
            or not len(steps)
            or (np.mean(steps > 0.0) < _RISING_SHARE and not (column is columns[0] and _is_clock_of_few_digits(column)))
        ):
            continue
        usual = np.median(steps)
        named = _ENDS_IN_TIME.search(column.name) is not None and float(steps.min()) > 0.0
        even = usual > 0.0 and np.mean(np.abs(steps - usual) <= 0.25 * usual) >= _EVEN_SHARE
        if named or since_1970(column.values) or even or (column is columns[0] and _is_clock_of_few_digits(column)):
            return column.name
    return None


def _is_clock_of_few_digits(column: RawColumn) -> bool:
    """Whether a column is an even clock of which few digits were written: 606, 606, 606 of 605.7, 605.8, 606.0."""
    known = column.values
    return bool(np.isfinite(known).all()) and of_few_digits(known) is not None


def longest_of_solver(
    known: NDArray[np.float64], needs: Mapping[str, object], *, by_solver: bool = False
) -> float | None:
    """The longest step of stamps that are uneven by nature, as a solver's are: none of their steps is a gap.

    Args:
        known: Time stamps in seconds, all finite.
        needs: The repairs of time that they seem to need.
        by_solver: Whether the file says that a solver wrote it.

    Returns:
        Seconds, in three digits; ``None`` where steps are alike mostly, or some are far longer than all others.
    """
    if not needs.get("gaps") or not needs.get("jitter"):
        return None
    steps = np.diff(np.unique(known))
    usual, longest = float(np.median(steps)), float(steps.max())
    alike = float(np.mean(np.abs(steps - usual) <= 0.1 * usual))
    often = float(np.mean(steps > 1.5 * usual))
    if not by_solver and (alike >= _MOSTLY_ALIKE or often < _OFTEN or longest > _MOST_UNEVEN * usual):
        return None
    return float(f"{1.005 * longest:.3g}")


def _is_plain(rising: NDArray[np.float64], clean: Timing) -> bool:
    """Whether the usual step is the clock's, though others are common: gaps, or events between even stamps."""
    step = clean.median_step
    if float(np.mean(np.abs(np.diff(rising) - step) <= 1e-6 * step)) < _MOSTLY_ALIKE:
        return False
    even = rising[0] + step * np.arange(min(int((rising[-1] - rising[0]) / step + 1e-6) + 1, 2 * len(rising)))
    nearest = np.searchsorted(rising, even - 1e-3 * step).clip(max=len(rising) - 1)
    return bool(len(clean.gaps)) or float(np.mean(np.abs(rising[nearest] - even) <= 2e-3 * step)) >= _EVEN_SHARE


def needs_of_time(known: NDArray[np.float64], timing: Timing) -> tuple[float, dict[str, object], float | None]:
    """Sample time, the repairs of time that the stamps need, and how far they are rounded where only that is uneven."""
    known = known if timing.in_order else np.sort(known)
    clean = timing if timing.in_order else survey(known)
    if not clean.step > 0.0:
        return 1.0, {"duplicates": "drop" if len(clean.duplicates) else None}, None
    rising = np.delete(known, clean.duplicates) if len(clean.duplicates) else known
    surveyed = clean if rising is known else survey(rising)
    strict = GridOptions().tolerance
    even = even_step(rising, surveyed, tolerance=strict)
    rounded = rounded_step(rising, surveyed) if even is None else None
    if even is None and rounded is None and surveyed.jitter <= strict * surveyed.step:
        # The first stamp may be off itself: from there the others are up to twice as far off an even clock as it is.
        nearly = even_step(rising, surveyed, tolerance=2.0 * strict)
        rounded = None if nearly is None else (nearly, 2.0 * strict)
    usual = float(np.mean(np.abs(np.diff(rising) - clean.median_step) <= 0.01 * clean.median_step))
    # A stamp or two that are wrong say nothing of the others' distance.
    by_most = usual >= _EVEN_SHARE or _is_plain(rising, clean)
    uneven = round_step(clean.median_step if by_most else clean.step)
    step, tolerance = (even or uneven, None) if rounded is None else rounded
    needs: dict[str, object] = {
        "backward": "sort" if len(timing.backward) else None,
        "duplicates": "drop" if len(clean.duplicates) else None,
        "gaps": "mask" if len(clean.gaps) else None,
        "jitter": "resample" if even is None and rounded is None else None,
    }
    return step, needs, tolerance
