"""A file of traces without a description: read as what would be proposed for it, with what was guessed told."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence, Set
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sysid.errors import ReaderError, UnitError, UserError
from sysid.field_checks import check
from sysid.ingest.cells.words import UNKNOWN_DATES
from sysid.ingest.inspecting.findings import FileFinding, listed
from sysid.ingest.inspecting.inspection import inspect_file
from sysid.ingest.inspecting.proposal import propose_dataset
from sysid.ingest.inspecting.second_clocks import without_clocks
from sysid.ingest.memory.in_python import proposal_of, remedies_of_a_file, typed_options, with_guess
from sysid.ingest.readers.text_source import bare_stem
from sysid.ingest.reading import read_table, trace_of
from sysid.ingest.tables.no_record import over_frequency, refuse_frequencies
from sysid.ingest.tables.options import FileOptions, RepairOptions, TimeOptions
from sysid.ingest.tables.over_frequency import swept_beside
from sysid.ingest.tables.table import RawTable
from sysid.traces import Role, TraceSet


class GuessedWarning(UserWarning):
    """A file does not say all that a record needs, and what it leaves out was guessed."""


def load_file(path: Path) -> TraceSet:
    """Read one file of traces.

    What the file says is taken as it stands, but for second clocks and counters beside its time. What it leaves out
    (units, the column of time, its unit, how numbers are written, which rows are a record) is read as
    ``sysid ingest --propose`` would describe it, and told. Samples are never repaired: a gap or a missing value is
    refused, with the command that describes the file.

    Args:
        path: The file.

    Returns:
        Its record for estimation; or its records, where the file holds several.

    Raises:
        UserError: If it cannot be read, or its samples need repairs.

    Warns:
        GuessedWarning: If something was guessed or left out.
    """
    marked, notes = set[str](), tuple[str, ...]()
    try:
        held = [read_table(path)]
        marked, notes = {column.name for column in held[0].columns if column.strange}, held[0].notes
        if (swept := swept_beside(held[0].columns)) is not None:
            raise refuse_frequencies(over_frequency(swept), path)
        several = bool(held[0].records)
        others = [f"{column.name} ({len(column.values)} samples)" for column in held[0].others]
        words = any(c.words is not None and c.problem is not None for c in held[0].columns)
        # Words, and a date beside the time, are no samples; that they stood there is told.
        others += [f"{c.name} ({c.aside or c.problem.what})" for c in held[0].columns if c.problem is not None]
        trace = trace_of(held)
    except UserError as error:
        return _as_proposed(path, error, marked)
    if several:  # of which the trace is the first, or all of them side by side
        return _as_proposed(path)
    trace, clocks = without_clocks(trace)
    if told := list(_guessed_in(notes)):
        warnings.warn(f"{_told(path, told)}. {proposal_of(path)} writes this down", GuessedWarning, stacklevel=3)
    if left := [*clocks, *others]:
        more = f"; {proposal_of(path)} proposes numbers for states that are known" if words else ""
        warnings.warn(f"{path}: left out: {listed(left)}{more}", GuessedWarning, stacklevel=3)
    return TraceSet(name=bare_stem(path), traces=(trace,), roles={trace.name: Role.ESTIMATION}, source=str(path))


def _as_proposed(path: Path, error: UserError | None = None, marked: Set[str] = frozenset()) -> TraceSet:
    """The traces of the description that would be proposed, but for its repairs; where that fails, the error.

    The columns with marks among their numbers are named, where they are known.
    """
    try:
        found = inspect_file(path)
        # A channel that never changes is no fault of the samples: those that use it say what it is worth.
        left = replace(found, needed=RepairOptions(constant=found.needed.constant))
        proposed = None if found.frequencies else yaml.safe_load(propose_dataset(left))
    except UserError as also:  # which the command that describes a file comes to as well
        raise typed_options(also if error is None or isinstance(error, UnitError) else error, path) from None
    if proposed is None:
        raise refuse_frequencies(found.frequencies, path)
    if found.time.step is not None and found.time_guessed and (dated := _unread_dates(found)):
        raise typed_options(dated, path)
    with remedies_of_a_file(path):
        return _described(path, found, proposed, error, marked)


def _described(
    path: Path, found: FileFinding, proposed: dict[str, Any], error: UserError | None, marked: Set[str]
) -> TraceSet:
    """The traces of the description; where that fails, the error."""
    from sysid.ingest.datasets.dataset import load_described  # here: most files say what they hold
    from sysid.ingest.datasets.description import DatasetDescription

    # What was measured is not lost: a column in which words stand is said to be one, or to be left out, by a person.
    # Where marks are all that stands in a column, there was nothing measured.
    held = {c.name for c in found.table.columns if np.isfinite(c.values).any()} if found.table else marked
    lost = any(c.problem and not c.unit_guessed and c.name not in marked - held for c in found.columns)
    unsure = "states" in found.guessed or ("missing" in found.guessed and not (marked and marked.isdisjoint(held)))
    if isinstance(error, ReaderError) and (lost or unsure):
        raise error
    guesses = list(_guesses(found))
    known = {"name": bare_stem(path), "provenance": str(path), "inferred": guesses}
    described = check(DatasetDescription, {**proposed, **known}, where=path)
    try:
        traces = load_described(described, path, cache=False)
    except UserError as also:
        raised = also if error is None or isinstance(error, UnitError) else error
        raise with_guess(raised, found.time_told.removeprefix("guessed: ")) from None
    if guesses:
        told = f"{_told(path, guesses)}. {proposal_of(path)} writes this down, to be corrected"
        warnings.warn(told, GuessedWarning, stacklevel=5)
    return traces


def _unread_dates(found: FileFinding) -> UserError | None:
    """Why a column of dates could not be read; a record that has one is not 1 s apart for want of another clock."""
    columns = () if found.table is None else found.table.columns
    problems = (column.problem for column in columns if column.problem is not None)
    return next((problem for problem in problems if problem.what == UNKNOWN_DATES), None)


def guessed_time(table: RawTable, files: FileOptions, *, sample_time: float) -> FileOptions:
    """The options of a file's reader with its time, where the file does not say what that is.

    Args:
        table: The file as it was read.
        files: What is known.
        sample_time: Seconds between rows, where the file has no time stamps.

    Returns:
        The options; the same where the file says its time, or the options do.

    Raises:
        ReaderError: If the file cannot be read at all.

    Warns:
        GuessedWarning: If something was guessed.
    """
    # The unit of a column that is called time is told by the sample time that is asked for.
    if table.step is not None or table.time is not None or files.time != TimeOptions():
        return files
    found = inspect_file(table.source, files=files)
    if not found.time_guessed or found.cases:
        return files
    time, told = found.time, found.time_told.removeprefix("guessed: ")
    if time.step is not None:
        time, told = TimeOptions(step=sample_time), f"no time stamps, {sample_time:g} s between them"
    warnings.warn(_told(table.source, [told]), GuessedWarning, stacklevel=3)
    return files.model_copy(update={"time": time})


def _told(path: Path, guesses: Sequence[str]) -> str:
    return f"{path}: guessed, as the file does not say it: {'; '.join(guesses)}"


def _guessed_in(notes: Sequence[str]) -> Iterator[str]:
    """What a reader guessed by itself; of what is an option of its own it is said elsewhere."""
    yield from (note for note in notes if ", which is a guess" in note and "source.files" not in note)


def _guesses(found: FileFinding) -> Iterator[str]:
    """What is taken to be so and what is left out, one phrase each."""
    if found.time_told:
        yield found.time_told.removeprefix("guessed: ")
    without = [column.name for column in found.channels if column.unit_guessed and column.unit == "1"]
    if without:
        yield f"no unit for {listed(without)}"
    named = [
        f"{column.name} in {column.unit}" for column in found.channels if column.unit_guessed and column.unit != "1"
    ]
    if named:
        yield ", ".join(named)
    yield from (f"{c.name} is {c.reference.value} pressure" for c in found.channels if c.reference_guessed)
    yield from found.guesses
    if not found.cases:
        yield from _guessed_in(found.notes)
    if found.cases:
        yield from found.notes
        yield "roles " + listed([f"{case.name}: {case.role}" for case in found.cases])
    aside = [
        f"{column.name} ({column.problem or column.aside})" for column in found.columns if column not in found.channels
    ]
    if aside:
        yield f"left out: {listed(aside)}"
