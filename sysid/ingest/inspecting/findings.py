"""What was found in an unknown file, and what a data set of it has to deal with, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from sysid.ingest.assembling.timing import Timing
from sysid.ingest.tables.options import FileOptions, RepairOptions, TimeOptions
from sysid.ingest.tables.table import RawTable
from sysid.units import Reference


@dataclass(frozen=True, kw_only=True)
class ColumnFinding:
    """What was found in a column.

    Args:
        name: Its name.
        unit: Its unit; ``"1"`` if neither the file nor the name says one.
        unit_guessed: Whether the unit is not from the file.
        reference: For pressures, what they are measured from.
        reference_guessed: Whether the reference is not from the file.
        description: As found in the file.
        said: The unit that the file says, where it is none that is known.
        minimum: Smallest finite value, in its unit; NaN if there is none.
        maximum: Largest finite value, in its unit; NaN if there is none.
        missing: How many values are empty, NaN or infinite.
        problem: Why it cannot be a channel, or the empty text.
        aside: Why it is not proposed as one, or the empty text.
        far: Values far from all others, which may mark missing ones, in words; or the empty text.
        step: The step of its converter where that is coarse, in its unit; 0 where it is not.
    """

    name: str
    unit: str
    unit_guessed: bool
    reference: Reference
    reference_guessed: bool
    description: str
    minimum: float
    maximum: float
    missing: int
    problem: str = ""
    aside: str = ""
    said: str = ""
    far: str = ""
    step: float = 0.0

    @property
    def constant(self) -> bool:
        """Whether it never changes."""
        return self.minimum == self.maximum


@dataclass(frozen=True, kw_only=True, eq=False)
class FileFinding:
    """What was found in a file.

    Args:
        path: The file.
        reader: Name of the reader.
        columns: What is in each column but time.
        time: The time column and its unit; its ``step`` if the file has no time stamps.
        time_told: What is guessed of time, for people; empty if the file says it.
        timing: The survey of the time stamps as they stand; ``None`` without time stamps.
        sample_time: Seconds between samples as proposed.
        samples: How many rows the file has.
        unstamped: How many of them have no time stamp.
        tolerance: How far off the grid stamps may lie that were rounded when they were written, as a fraction of the
            sample time; ``None`` where the usual will do.
        longest_step: The longest step of stamps that are uneven by nature, as a solver's are; none of them is a gap.
        distinct: How many different time stamps there are; rows without stamps are all different.
        needed: The repairs that the file needs, with the gentlest choice of each.
        files: The reader options that the file was read with, where they are not recognised by itself.
        guessed: The reader options among them that are guesses.
        table: The file as it was read.
        notes: What the reader recognised.
        cases: The records that the file holds, where they are several; their channels are then those of all.
        frequencies: What is said of a column of frequencies that makes the rows no samples over time; empty without.
    """

    path: Path
    reader: str
    columns: tuple[ColumnFinding, ...]
    time: TimeOptions
    time_told: str
    timing: Timing | None
    sample_time: float
    samples: int
    unstamped: int
    distinct: int
    needed: RepairOptions
    files: FileOptions
    table: RawTable = field(repr=False)
    tolerance: float | None = None
    longest_step: float | None = None
    guessed: frozenset[str] = frozenset()
    notes: tuple[str, ...] = field(default=())
    cases: tuple[CaseFinding, ...] = field(default=())
    frequencies: str = ""

    @property
    def time_guessed(self) -> bool:
        """Whether column or unit of time is not from the file."""
        return bool(self.time_told)

    @property
    def channels(self) -> tuple[ColumnFinding, ...]:
        """The columns that are proposed as channels."""
        return tuple(column for column in self.columns if not column.problem and not column.aside)

    @property
    def of_time(self) -> list[str]:
        """What is the matter with the time stamps, one phrase each."""
        timing = self.timing
        if timing is None:
            return []
        found = [counted(len(timing.backward), "backward time stamp")] if len(timing.backward) else []
        after = ", as of events: the value after each counts" if self.needed.duplicates == "last" else ""
        found += [counted(len(timing.duplicates), "duplicate time stamp") + after] if len(timing.duplicates) else []
        gaps = counted(len(timing.gaps), "gap")
        found += [f"{counted(timing.missing, 'sample')} missing in {gaps}"] if timing.missing else []
        found += [f"time stamps are rounded, up to {timing.jitter:.2g} s off an even clock"] if self.tolerance else []
        found += [f"uneven time stamps, up to {timing.jitter:.3g} s off"] if self.needed.jitter else []
        if timing.missing > self.samples:
            found.append("a gap is longer than what was recorded: a clock that was set anew, or records of their own")
        return found

    @property
    def guesses(self) -> list[str]:
        """How the file is taken to be written, one phrase for each guess."""
        return [told for _, told in self._guessed_options]

    @property
    def _guessed_options(self) -> list[tuple[str, str]]:
        given = self.files.model_dump(exclude_none=True)
        names = sorted(self.guessed - {"zone", "format"})
        return [(name, _guess(name, given[name])) for name in names if name in given]

    @property
    def problems(self) -> tuple[str, ...]:
        """What a data set of this file has to deal with, one phrase each."""
        found = [
            *self.notes,
            *(
                f"{told}, which is a guess: source.files.{name} in dataset.yaml says it"
                for name, told in self._guessed_options
            ),
        ]
        found += [f"{counted(self.unstamped, 'sample')} without a time stamp"] if self.unstamped else []
        if self.timing is None:
            found += [self.time_told if self.table.time else "no time stamps"] if self.time_guessed else []
        found += self.of_time
        for case in self.cases[1:]:  # the first is this one
            found += [f"{case.name}: {one}" for one in case.finding.of_time if one not in self.of_time]
        of_columns: dict[str, list[str]] = {}
        for column in self.columns:
            for told in _of_column(column):
                of_columns.setdefault(told, []).append(column.name)
        return (*found, *(f"{listed(names, 12)}: {told}" for told, names in of_columns.items()))


def _of_column(column: ColumnFinding) -> list[str]:
    """What is the matter with a column, one phrase each."""
    if column.problem:
        return [column.problem]
    found = [counted(column.missing, "missing value")] if column.missing else []
    found += [column.far] if column.far and not column.aside else []
    found += ["never changes"] if column.constant and not column.aside else []
    return [*found, f"the file says {column.said}, which is no unit that is known"] if column.said else found


def _guess(name: str, value: object) -> str:
    """What was guessed of how a file is written."""
    shown = ", ".join(map(repr, value)) if isinstance(value, list | tuple) else repr(value)
    return {
        "decimal": f"{shown} is taken for the decimal mark",
        "thousands": f"{shown} is taken for the mark between thousands",
        "missing": f"{shown} is taken for a missing value",
        "states": "words are taken for states",
        "transpose": "rows are taken for columns",
        "names": f"a name stands twice, so columns are called {shown}",
    }.get(name, f"{name} is taken to be {shown}")


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseFinding:
    """What was found in one of several records of a file.

    Args:
        name: What its case may be called.
        role: What it may be used for.
        role_guessed: Whether nothing in the file says so.
        options: What the case says to read it: ``columns``, ``group``, ``sheet``, ``time``.
        finding: What is in it.
    """

    name: str
    role: str
    role_guessed: bool
    options: Mapping[str, object]
    finding: FileFinding


def counted(number: int, what: str) -> str:
    """So many of something, in words.

    Args:
        number: How many.
        what: One of them; its plural ends in s.

    Returns:
        The words.

    Example:
        >>> counted(1, "gap"), counted(2, "gap")
        ('1 gap', '2 gaps')
    """
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def listed(names: Sequence[str], most: int = 6) -> str:
    """The first of some names, and how many more there are.

    Args:
        names: The names.
        most: How many are shown.

    Returns:
        The words.

    Example:
        >>> listed(["u", "y", "z"], 2)
        'u, y and 1 more'
    """
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
