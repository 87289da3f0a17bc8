"""A look at an unknown file: its columns, units, time, gaps and missing values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.attempts import Attempt, read_somehow
from sysid.ingest.blanks import blanks_mean, marks_in
from sysid.ingest.clocks import clock_of
from sysid.ingest.columns import RawColumn
from sysid.ingest.events import are_events
from sysid.ingest.findings import CaseFinding, ColumnFinding, FileFinding, counted
from sysid.ingest.headers import is_unit, split_reference, unit_in_name
from sysid.ingest.in_units import stamps_in_seconds
from sysid.ingest.options import FileOptions, GridOptions, RepairOptions, TimeOptions
from sysid.ingest.readers.leaves import step_in
from sysid.ingest.readers.records import role_of
from sysid.ingest.restarts import finer_than_clock, records_by_clock
from sysid.ingest.second_clocks import counts_rows, is_counter, without_second_clocks
from sysid.ingest.table import RawTable
from sysid.ingest.time_columns import is_time_unit
from sysid.ingest.timing import Timing, even_step, round_step, rounded_step, survey
from sysid.traces.converter import coarse_step
from sysid.units import Reference, atmosphere_in, is_pressure

_RISING_SHARE = 0.98  # of the steps of a column that is taken for time though nothing says so
_EVEN_SHARE = 0.9  # of its steps, that are like the usual one
_EMPTY_SHARE = 0.8  # of a column, above which its missing values are no reason to leave samples out
_FEW_STATES = 6
_FAR, _FEW = 20.0, 0.2  # spans of all other values, and the share of samples that a mark of missing ones may have


def inspect_file(path: str | Path, *, files: FileOptions | None = None) -> FileFinding:
    """Look at an unknown file.

    Args:
        path: The file.
        files: What is known about it already.

    Returns:
        What was found; :func:`~sysid.ingest.proposal.propose_dataset` writes a description from it.

    Raises:
        ReaderError: If the file cannot be read at all.
        MissingExtraError: If its format needs a package that is not installed.
        UnitError: If its time column has a unit that is not one of time.
    """
    attempt = read_somehow(Path(path), files or FileOptions())
    attempt = replace(attempt, files=_written_down(attempt.files, attempt.table))
    found = _finding(attempt.table, attempt)
    if (
        not attempt.table.records
        and found.timing is not None
        and (len(found.timing.backward) or found.timing.missing > found.samples)
        and attempt.files.rows is None
    ):
        stamps = stamps_in_seconds(attempt.table, attempt.files.model_copy(update={"time": found.time}))
        attempt = replace(attempt, table=replace(attempt.table, records=records_by_clock(attempt.table, stamps)))
    return _of_records(found, attempt) if attempt.table.records else found


def _written_down(files: FileOptions, table: RawTable) -> FileOptions:
    """The options with those that had to be guessed from the numbers, so that a description says them."""
    guessed = {key: table.settings[key] for key in ("transpose", "sheet") if key in table.settings}
    return files.model_copy(update=guessed)


def _finding(table: RawTable, attempt: Attempt) -> FileFinding:
    files, repairs = attempt.files, attempt.repairs
    time, told = _time(table, files)
    clock = time.column
    if "zone" in attempt.guessed:
        told = f"guessed: the clock on the wall of {time.zone}, as it is put forward or back there"
    if "format" in attempt.guessed:
        told = f"guessed: {time.column} is the digits of dates, {time.format}"
    timing, unstamped, step, tolerance = None, 0, time.step or 1.0, None
    needs: dict[str, object] = {}
    if time.step is None:
        stamps = stamps_in_seconds(table, files.model_copy(update={"time": time}))
        known = _finite(stamps)
        unstamped = len(stamps) - len(known)
        timing = survey(known) if len(known) else None
        if timing is not None:
            step, needs, tolerance = _needs(known, timing)
            if needs.get("duplicates") and are_events(stamps, [c for c in table.columns if c.name != clock]):
                needs["duplicates"] = "last"
            finer = None if unstamped else finer_than_clock(known, timing)
            if finer is not None:
                step, needs, timing = finer[0], {}, None
                time, told = TimeOptions(step=step), f"guessed: {finer[1]}"
    others = tuple(replace(_column(column), problem=_other(column, len(table))) for column in table.others)
    told_apart = without_second_clocks(table, clock).columns
    told_apart = _without_copies(told_apart) if "names" in attempt.guessed else told_apart
    said = step_beside(table.columns) if files.time.step is None and time.step is not None else None
    notes = table.notes
    if said is not None:
        told_apart = tuple(replace(c, aside="says the sample time") if c.name == said[0] else c for c in told_apart)
        notes = (
            notes if time.step != said[1] or table.step else (*notes, f"sample time {step:g} s, from column {said[0]}")
        )
    columns = tuple(_column(column) for column in told_apart if column.name != clock) + others
    needed = {
        "ragged": repairs.ragged,
        "stamps": "drop" if unstamped else None,
        **needs,
        **_repairs_of_values(table, [column for column in columns if not column.problem and not column.aside]),
    }
    return FileFinding(
        path=table.source,
        reader=table.reader,
        columns=columns,
        time=time,
        time_told=told,
        timing=timing,
        sample_time=step,
        samples=len(table),
        unstamped=unstamped,
        tolerance=tolerance,
        distinct=len(table) if timing is None else _distinct(known, timing),
        needed=RepairOptions.model_validate(needed),
        files=files,
        table=table,
        guessed=attempt.guessed,
        notes=notes,
    )


def _repairs_of_values(table: RawTable, channels: Sequence[ColumnFinding]) -> dict[str, object]:
    """The repairs that the values of channels need: of marks, of what is missing, of what never changes."""
    blanks = {
        column.name: np.isin(found.values, marks_in(found.values)) | ~np.isfinite(found.values)
        for column in channels
        for found in (table.find(column.name),)
    }
    return {
        "marks": "missing" if any(blanks[c.name].sum() > c.missing for c in channels) else None,
        "nan": _nan({n: np.where(b, np.nan, table.find(n).values) for n, b in blanks.items() if b.any()}),
        "constant": "accept" if any(column.constant for column in channels) else None,
    }


def _distinct(known: NDArray[np.float64], timing: Timing) -> int:
    return len(known) if timing.in_order else len(np.unique(known))


def _other(column: RawColumn, usual: int) -> str:
    if column.problem is not None:
        return column.problem.what
    if len(column.values) == usual:
        return "stands beside the record, not in it"
    return f"{len(column.values)} samples, where the record has {usual}"


def _of_records(whole: FileFinding, attempt: Attempt) -> FileFinding:
    """The records of a file that go into one data set, and what all of them need."""
    cases = []
    for record in attempt.table.records:
        role, found = role_of(record.name), _finding(record.table, attempt)
        cases.append(
            CaseFinding(
                name=record.name,
                role=role or "estimation",
                role_guessed=role is None,
                options=_with_time(record.options, found.time.column),
                finding=found,
            )
        )
    kinds: dict[object, list[CaseFinding]] = {}
    for case in cases:
        if case.finding.channels:
            kinds.setdefault(_signature(case), []).append(case)
    if not kinds:
        return whole
    chosen = max(kinds.values(), key=len)
    apart = [case for case in cases if case not in chosen]
    sizes = ", ".join(f"{case.name} ({case.finding.samples} samples)" for case in chosen)
    told = [f"{counted(len(chosen), 'record')}: {sizes}"]
    told += [
        f"{case.name}: a record with other channels or another sample time: a data set of its own, with "
        + ", ".join(f"{key}: {value}" for key, value in case.options.items())
        for case in apart
    ]
    first = chosen[0].finding
    notes = dict.fromkeys([*told, *(note for case in chosen for note in case.finding.notes)])
    merged = {key: value for case in chosen for key, value in case.finding.needed.model_dump(exclude_none=True).items()}
    names = [column.name for column in first.channels]
    return replace(
        first,
        columns=tuple(_merged([_by_name(case.finding, name) for case in chosen]) for name in names),
        samples=min(case.finding.samples for case in chosen),
        distinct=min(case.finding.distinct for case in chosen),
        needed=RepairOptions.model_validate(merged),
        table=whole.table,
        notes=tuple(notes),
        cases=tuple(chosen),
    )


def _with_time(options: Mapping[str, Any], time: str | None) -> Mapping[str, Any]:
    """The options of a record, where one of its columns turned out to be time."""
    columns = dict(options.get("columns", {}))
    if time not in columns:
        return options
    stamps = columns.pop(time)
    return {**options, "columns": columns, "time": stamps}


def _signature(case: CaseFinding) -> object:
    found = case.finding
    units = tuple((column.name, None if column.unit_guessed else column.unit) for column in found.channels)
    own_time = "time" in case.options
    return units, found.sample_time, None if own_time else found.time.column, found.time.unit, own_time


def _by_name(found: FileFinding, name: str) -> ColumnFinding:
    return next(column for column in found.channels if column.name == name)


def _merged(columns: Sequence[ColumnFinding]) -> ColumnFinding:
    return replace(
        columns[0],
        minimum=min(column.minimum for column in columns),
        maximum=max(column.maximum for column in columns),
        missing=sum(column.missing for column in columns),
    )


def _nan(columns: Mapping[str, NDArray[np.float64]]) -> str | dict[str, str] | None:
    """What is done about missing values: one for all channels that have some, or one each."""
    repairs: dict[str, str] = {name: blanks_mean(values) for name, values in columns.items()}
    return repairs if len(set(repairs.values())) > 1 else next(iter(repairs.values()), None)


def _time(table: RawTable, files: FileOptions) -> tuple[TimeOptions, str]:
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
    if unit is not None:
        return TimeOptions(column=column.name, unit=unit), by_rising and f"guessed: {by_rising}"
    if clock is not None:
        return TimeOptions(column=column.name, unit=clock.unit), f"guessed: {name} counts {clock.told}, by its size"
    with np.errstate(invalid="ignore"):
        steps = np.diff(column.values[:100_000])
    step = float(np.median(steps[np.isfinite(steps)])) if np.isfinite(steps).any() else 0.0
    # Few records are sampled slower than every 5 s, and few clocks count finer than they sample.
    guess = "s" if step < 5.0 else "ms" if step < 5e3 else "us"
    why = f"the file says {said}, which is no unit of time" if said else "the file does not say its unit"
    first = f"{by_rising}; " if by_rising else ""
    why += "; it rises by 1, as a number of samples does" if len(steps) and bool((steps == 1.0).all()) else ""
    return TimeOptions(column=column.name, unit=guess), f"guessed: {first}{name} in {guess}; {why}"


def _without_copies(columns: Sequence[RawColumn]) -> tuple[RawColumn, ...]:
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
        known = np.unique(_finite(column.values))
        if len(known) == 1:
            step = step_in(f"{column.name} [{column.unit}]" if column.unit else column.name, float(known[0]))
            if step is not None:
                return column.name, step
    return None


def _finite(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The finite ones; the same array, not a copy, where all are."""
    known = np.isfinite(values)
    return values if known.all() else values[known]


def _rising(columns: Sequence[RawColumn]) -> str | None:
    """A column that rises like a clock: nearly always, and by much the same step."""
    for column in sorted(columns, key=lambda column: is_counter(column.name)):  # a clock goes before a counter
        with np.errstate(invalid="ignore"):
            steps = np.diff(column.values)
        if column.problem is not None or not len(steps) or np.mean(steps > 0.0) < _RISING_SHARE:
            continue
        usual = np.median(steps)
        if np.mean(np.abs(steps - usual) <= 0.25 * usual) >= _EVEN_SHARE:
            return column.name
    return None


def _needs(known: NDArray[np.float64], timing: Timing) -> tuple[float, dict[str, object], float | None]:
    """Sample time, the repairs of time that the stamps need, and how far they are rounded where only that is uneven."""
    known = known if timing.in_order else np.sort(known)
    clean = timing if timing.in_order else survey(known)
    if not clean.step > 0.0:
        return 1.0, {"duplicates": "drop" if len(clean.duplicates) else None}, None
    rising = np.delete(known, clean.duplicates) if len(clean.duplicates) else known
    surveyed = clean if rising is known else survey(rising)
    even = even_step(rising, surveyed, tolerance=GridOptions().tolerance)
    rounded = rounded_step(rising, surveyed) if even is None else None
    usual = float(np.mean(np.abs(np.diff(rising) - clean.median_step) <= 0.01 * clean.median_step))
    # A stamp or two that are wrong say nothing of the others' distance.
    uneven = round_step(clean.median_step if usual >= _EVEN_SHARE else clean.step)
    step, tolerance = (even or uneven, None) if rounded is None else rounded
    needs: dict[str, object] = {
        "backward": "sort" if len(timing.backward) else None,
        "duplicates": "drop" if len(clean.duplicates) else None,
        "gaps": "mask" if len(clean.gaps) else None,
        "jitter": "resample" if even is None and rounded is None else None,
    }
    return step, needs, tolerance


def _column(column: RawColumn) -> ColumnFinding:
    finite = _finite(column.values)
    problem = "" if column.problem is None else _told(column, column.problem)
    if not problem and len(finite) < min(2, len(column.values)):
        problem = f"one value only, {finite[0]:g}" if len(finite) else "no values at all"
    if column.counted_from and not problem:
        problem = f"whole numbers of about {column.counted_from}, more than float64 can hold"
    in_file = column.unit if column.unit is not None and is_unit(column.unit) else None
    unit_text = in_file or unit_in_name(column.name) or "1"
    unit, in_name = split_reference(unit_text)
    reference = column.reference or in_name
    guess = _guess_reference(finite, unit) if reference is None else reference
    return ColumnFinding(
        name=column.name,
        unit=unit,
        unit_guessed=in_file is None,
        reference=guess,
        reference_guessed=column.reference is None and guess is not Reference.NONE,
        description=column.description,
        minimum=float(finite.min()) if len(finite) else float("nan"),
        maximum=float(finite.max()) if len(finite) else float("nan"),
        missing=len(column.values) - len(finite),
        problem=problem,
        aside=column.aside or _nearly_empty(column.values),
        said="" if in_file is not None or column.unit is None else column.unit,
        far=_far(finite),
        step=coarse_step(finite) or 0.0,
    )


def _told(column: RawColumn, problem: ReaderError) -> str:
    """Why a column cannot be used; words that might be states are quoted."""
    words = column.words
    if words is None or not words.complete or not 1 < len(words.texts) <= _FEW_STATES:
        return problem.what
    quoted = ", ".join(f"{text[:20]!r}" for text in words.texts)
    return f"{problem.what} ({quoted}): source.files.states says which number each is"


def _far(values: NDArray[np.float64]) -> str:
    """That a value at an end of a column is far from all others, as those are that mark missing ones; or nothing."""
    found = []
    for end in (values.min(), values.max()) if len(values) else ():
        rest = values[values != end]
        count = len(values) - len(rest)
        span = float(np.ptp(rest)) if len(rest) else 0.0
        if span > 0 and _FAR * span < float(np.abs(rest - end).min()) and count <= _FEW * len(values):
            found.append(f"{end:g} ({counted(count, 'sample')})")
    if not found:
        return ""
    said = "is" if len(found) == 1 else "are"
    return (
        f"{' and '.join(found)} {said} far from all other values: a mark of missing ones, or a fault of the recording"
    )


def _nearly_empty(values: NDArray[np.float64]) -> str:
    """Why a column is none of the record: nearly all of it is missing, and would mark the samples of all others."""
    missing = len(values) - int(np.isfinite(values).sum())
    if missing <= _EMPTY_SHARE * len(values) or blanks_mean(values) == "hold":
        return ""
    return f"{missing} of {len(values)} values are missing"


def _guess_reference(values: NDArray[np.float64], unit: str) -> Reference:
    if not is_pressure(unit):
        return Reference.NONE
    if not len(values):
        return Reference.GAUGE
    # An absolute record that is ever at rest shows the atmosphere as its smallest value.
    near_atmosphere = 0.8 < float(values.min()) / atmosphere_in(unit) < 1.15
    return Reference.ABSOLUTE if near_atmosphere else Reference.GAUGE
