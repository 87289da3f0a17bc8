"""A look at an unknown file: its columns, units, time, gaps and missing values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.assembling.in_units import stamps_in_seconds
from sysid.ingest.assembling.timing import Timing, round_step, survey
from sysid.ingest.cells.blanks import blanks_mean, marks_in
from sysid.ingest.inspecting.attempts import Attempt, read_somehow
from sysid.ingest.inspecting.column_findings import column_finding
from sysid.ingest.inspecting.events import are_events
from sysid.ingest.inspecting.findings import CaseFinding, ColumnFinding, FileFinding, counted, listed
from sysid.ingest.inspecting.restarts import finer_than_clock, of_few_digits, records_by_clock
from sysid.ingest.inspecting.second_clocks import without_second_clocks
from sysid.ingest.inspecting.time_findings import (
    find_time,
    finite_of,
    longest_of_solver,
    needs_of_time,
    step_beside,
    without_copies,
)
from sysid.ingest.readers.trees.roles import role_of
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.options import FileOptions, RepairOptions, TimeOptions
from sysid.ingest.tables.over_frequency import frequencies_in, swept_beside
from sysid.ingest.tables.table import RawTable

_MOST_APART = 6  # records of other kinds that are told one by one


def inspect_file(path: str | Path, *, files: FileOptions | None = None) -> FileFinding:
    """Look at an unknown file.

    Args:
        path: The file.
        files: What is known about it already.

    Returns:
        What was found; :func:`~sysid.ingest.inspecting.proposal.propose_dataset` writes a description from it.

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


@dataclass(frozen=True, kw_only=True, eq=False)
class _Clock:
    """What the stamps of a file come to.

    Args:
        column: With the time; none where there is none.
        time: What says the time.
        told: What of it was guessed.
        timing: The stamps surveyed; none where there are none, or where the clock is coarser than the samples.
        step: Sample time in seconds.
        tolerance: How far stamps are rounded, where only that is uneven.
        longest_step: The longest step of stamps that are uneven by nature.
        unstamped: Samples without a stamp.
        distinct: Samples at times of their own.
        needs: The repairs of time.
    """

    column: str | None
    time: TimeOptions
    told: str
    step: float
    timing: Timing | None = None
    tolerance: float | None = None
    longest_step: float | None = None
    unstamped: int = 0
    distinct: int
    needs: Mapping[str, object] = field(default_factory=dict)

    @classmethod
    def of(cls, table: RawTable, attempt: Attempt) -> _Clock:
        time, told = find_time(table, attempt.files)
        if "zone" in attempt.guessed:
            told = f"guessed: the clock on the wall of {time.zone}, as it is put forward or back there"
        if "format" in attempt.guessed:
            told = f"guessed: {time.column} is the digits of dates, {time.format}"
        found = cls(column=time.column, time=time, told=told, step=time.step or 1.0, distinct=len(table))
        if time.step is not None:
            return found
        stamps = stamps_in_seconds(table, attempt.files.model_copy(update={"time": time}))
        known = finite_of(stamps)
        found = replace(found, unstamped=len(stamps) - len(known))
        if not len(known):
            return found
        timing = survey(known)
        step, needs, tolerance = needs_of_time(known, timing)
        longest = longest_of_solver(known, needs, by_solver=table.by_solver)
        if longest is not None:
            timing, needs = survey(known, longest_step=longest), {**needs, "gaps": None}
            step = round_step(float(np.ptp(known)) / (len(known) - 1) if table.by_solver else timing.step)
        if needs.get("duplicates") and are_events(stamps, [c for c in table.columns if c.name != time.column]):
            needs["duplicates"] = "last"
        finer = None if found.unstamped else finer_than_clock(known, timing)
        if finer is None and not found.unstamped and (needs.get("duplicates") or needs.get("jitter")):
            finer = of_few_digits(known)
        if finer is not None:
            by_rows, said = TimeOptions(step=finer[0]), f"guessed: {finer[1]}"
            return replace(found, time=by_rows, told=said, step=finer[0], tolerance=tolerance)
        distinct = _distinct(known, timing)
        found = replace(found, timing=timing, step=step, needs=needs, tolerance=tolerance, distinct=distinct)
        return replace(found, longest_step=longest)


def _finding(table: RawTable, attempt: Attempt) -> FileFinding:
    files, repairs, clock = attempt.files, attempt.repairs, _Clock.of(table, attempt)
    others = tuple(replace(column_finding(column), problem=_other(column, len(table))) for column in table.others)
    told_apart = without_second_clocks(table, clock.column).columns
    told_apart = without_copies(told_apart) if "names" in attempt.guessed else told_apart
    said = step_beside(table.columns) if files.time.step is None and clock.time.step is not None else None
    notes = table.notes
    if said is not None:
        told_apart = tuple(replace(c, aside="says the sample time") if c.name == said[0] else c for c in told_apart)
        if clock.time.step == said[1] and not table.step:
            notes = (*notes, f"sample time {clock.step:g} s, from column {said[0]}")
    frequencies = _told_of_frequencies(table, clock, files)
    notes = (*notes, frequencies) if frequencies else notes
    columns = tuple(column_finding(column) for column in told_apart if column.name != clock.column) + others
    needed = {
        "ragged": repairs.ragged,
        "stamps": "drop" if clock.unstamped else None,
        **clock.needs,
        **_repairs_of_values(table, [column for column in columns if not column.problem and not column.aside]),
    }
    return FileFinding(
        path=table.source,
        reader=table.reader,
        columns=columns,
        time=clock.time,
        time_told=clock.told,
        timing=clock.timing,
        sample_time=clock.step,
        samples=len(table),
        unstamped=clock.unstamped,
        tolerance=clock.tolerance,
        longest_step=clock.longest_step,
        distinct=clock.distinct,
        needed=RepairOptions.model_validate(needed),
        files=files,
        table=table,
        guessed=attempt.guessed,
        notes=notes,
        frequencies=frequencies,
    )


def _told_of_frequencies(table: RawTable, clock: _Clock, files: FileOptions) -> str:
    """What is said of rows that are frequencies; nothing where a person says the time of samples."""
    if files.time.step is not None or files.time.column is not None:
        return ""
    timed = clock.time.column is not None or table.step is not None
    found = swept_beside(table.columns) if timed else frequencies_in(table.columns)
    if found is None:
        return ""
    from sysid.ingest.tables.no_record import over_frequency  # here: a record needs no word of it

    return over_frequency(found)


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
    sizes = listed([f"{case.name} ({case.finding.samples} samples)" for case in chosen])
    told = [f"{counted(len(chosen), 'record')}: {sizes}"]
    told += [
        f"{case.name}: a record with other channels or another sample time: a data set of its own, with "
        + ", ".join(f"{key}: {value}" for key, value in case.options.items())
        for case in apart[:_MOST_APART]
    ]
    told += [f"{len(apart) - _MOST_APART} more such records"] if len(apart) > _MOST_APART else []
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
        longest_step=max((case.finding.longest_step or 0.0 for case in chosen), default=0.0) or None,
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
    # A solver's steps come onto any grid.
    step = None if found.table is not None and found.table.by_solver else found.sample_time
    return units, step, None if own_time else found.time.column, found.time.unit, own_time


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
