"""The options of a data set on disk, as they stand in ``dataset.yaml`` under ``source``."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from sysid.field_checks import FieldError
from sysid.ingest.cells.headers import parse_header
from sysid.ingest.tables.mask_options import Masks
from sysid.ingest.tables.option_group import Options
from sysid.ingest.tables.time_columns import is_time_unit
from sysid.units import Reference


class ColumnOptions(Options):
    """A column of the file; the short form is its header, ``P_pipe`` or ``P_pipe [kPa]``.

    Args:
        column: Its name in the file.
        unit: Its unit, where the file says none or a wrong one.
        reference: ``gauge`` or ``absolute``, where the file does not say.
    """

    column: str
    unit: str | None = None
    reference: Reference | None = None


class TimeOptions(Options):
    """The time column; the short form is its header, ``t [ms]``.

    Args:
        column: Its name in the file; ``None`` is the column that is recognised as time.
        unit: ``s``, ``ms``, ``min``, ``ds`` ..., or ``datetime`` for calendar time.
        format: For ``datetime``: as for ``datetime.strptime``; ``None`` recognises what is usual.
        zone: For calendar time: the zone of the clock (``Europe/Berlin``), whose hours come twice or never.
        step: For a file without time stamps: seconds between its rows.
    """

    column: str | None = None
    unit: str | None = None
    format: str | None = None
    zone: str | None = None
    step: Annotated[float, Field(gt=0)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _unit_behind_the_name(cls, given: Any) -> Any:
        # ``--time 't [ms]'`` and ``column: t [ms]`` say what ``time: t [ms]`` says.
        if isinstance(given, dict) and isinstance(given.get("column"), str) and not given.get("unit"):
            header = parse_header(given["column"])
            if header.unit is not None and is_time_unit(header.unit):
                return {**given, "column": header.name, "unit": header.unit}
        return given

    @model_validator(mode="after")
    def _consistent(self) -> TimeOptions:
        if self.step is not None and (self.column is not None or self.unit is not None):
            raise FieldError(
                "time.step and a time column exclude each other",
                expected="step for a file without time stamps, column and unit for one with them",
                got=f"step: {self.step}, column: {self.column}, unit: {self.unit}",
                remedy="remove one of them",
            )
        if self.format is not None and self.unit != "datetime":
            raise FieldError(
                "time.format is for calendar time",
                expected="unit: datetime beside it",
                got=f"unit: {self.unit}",
                remedy="write unit: datetime, or remove format",
            )
        if self.zone is not None and (self.step is not None or self.unit not in {None, "datetime"}):
            raise FieldError(
                "time.zone is for calendar time",
                expected="unit: datetime beside it, or no unit",
                got=f"unit: {self.unit}",
                remedy="write unit: datetime, or remove zone",
            )
        return self


class LongOptions(Options):
    """Where a long table (time, signal, value) has its names and values.

    Args:
        names: The column that says which signal a row is of.
        values: The column of the values.
        units: The column of the units, if there is one.
    """

    names: str
    values: str
    units: str | None = None


def _column_short(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    header = parse_header(value)
    return {"column": header.name, "unit": header.unit, "reference": header.reference}


def _time_short(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    header = parse_header(value)
    return {"column": header.name, "unit": header.unit}


ColumnOption = Annotated[ColumnOptions, BeforeValidator(_column_short, json_schema_input_type=str | ColumnOptions)]
TimeOption = Annotated[TimeOptions, BeforeValidator(_time_short, json_schema_input_type=str | TimeOptions)]


def _rows_short(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    match = re.fullmatch(r"\s*(\d{1,18})\s*[:,-]\s*(\d{1,18})?\s*", value)
    if match is None:
        raise FieldError(
            "rows is not a first and a last row",
            expected="rows: [101, 200], '101:200', or '101:' up to the end",
            got=value,
            remedy="write first and last row, counted from 1",
        )
    return [int(match[1]), int(match[2]) if match[2] else None]


Rows = Annotated[
    tuple[Annotated[int, Field(ge=1)], Annotated[int, Field(ge=1)] | None],
    BeforeValidator(_rows_short, json_schema_input_type=str | tuple[int, int | None]),
]
"""First and last row, counted from 1; the short form is ``101:200``."""


def _state_words(value: Any) -> Any:
    """YAML takes a bare true for a truth value; as the name of a state it stands for the word."""
    if not isinstance(value, dict):
        return value
    words: dict[Any, Any] = {}
    for key, number in value.items():
        if isinstance(number, dict):
            words[str(key)] = _state_words(number)
        elif isinstance(key, bool):
            words |= dict.fromkeys((str(key), str(key).lower(), str(key).upper()), number)
        else:
            words[str(key)] = number
    return words


class FileOptions(Options):
    """How the files of a data set are read. What is not given is recognised from the file.

    Args:
        reader: Name of the reader, where the suffix does not tell.
        time: The time column.
        columns: Column of each channel, where its name in the file is another.
        units: Unit of each column that has none in the file: one for all, or by channel.
        references: ``gauge`` or ``absolute``: one for all pressures, or by channel.
        separator: CSV: ``,``, ``;``, ``|``, a tab, or a blank, which stands for a run of blanks.
        decimal: CSV, and numbers typed as text in Excel: ``.`` or ``,``.
        thousands: CSV, Excel: what separates groups of three digits. Equal to ``decimal``, the last one in a
            number is the decimal one (``1.003.000`` is 1003).
        comment: CSV: what a comment line begins with.
        encoding: CSV: for example ``utf-8``, ``cp1252``.
        skip_lines: CSV, Excel: lines before the header.
        header: CSV, Excel: whether there is a header line.
        units_line: CSV, Excel: whether a line of units follows the header.
        names: CSV, Excel: names of all columns, instead of the header's.
        missing: CSV, Excel: texts that stand for a missing value, besides empty cells and ``nan``.
        states: Numbers that words stand for: ``{OFF: 0, ON: 1}`` for all columns, ``{valve: {shut: 0, open: 1}}`` for
            one. TRUE and FALSE are 1 and 0 by themselves.
        long: For a long table (time, signal, value): its columns of names and of values.
        group: HDF5, MDF, TDMS, MATLAB, NPZ, JSON, LVM: the group, structure or segment that holds the columns.
        sheet: Excel: name of the sheet.
        rows: First and last row of the record, counted from 1, both included; ``null`` is the end.
        transpose: MATLAB, HDF5, NPY, NPZ, JSON: whether the channels of a matrix stand in its rows;
            ``None`` takes the longer side for time.
    """

    reader: str | None = None
    time: TimeOption = TimeOptions()
    columns: dict[str, ColumnOption] = Field(default={})
    units: str | dict[str, str] = Field(default={})
    references: Reference | dict[str, Reference] = Field(default={})
    separator: Literal[",", ";", "\t", "|", " "] | None = None
    decimal: Literal[".", ","] | None = None
    thousands: Literal[".", ",", "'", " "] | None = None
    comment: Annotated[str, Field(min_length=1)] = "#"
    encoding: str | None = None
    skip_lines: Annotated[int, Field(ge=0)] = 0
    header: bool | None = None
    units_line: bool | None = None
    names: tuple[str, ...] | None = None
    missing: tuple[str, ...] = ()
    states: Annotated[dict[str, float | dict[str, float]], BeforeValidator(_state_words)] = Field(default={})
    long: LongOptions | None = None
    group: str | None = None
    sheet: str | None = None
    rows: Rows | None = None
    transpose: bool | None = None

    @model_validator(mode="after")
    def _consistent(self) -> FileOptions:
        if self.separator is not None and self.separator == self.decimal:
            raise FieldError(
                "separator and decimal are the same",
                expected="two different characters",
                got=repr(self.separator),
                remedy="a decimal comma goes with separator: ';' or a tab",
            )
        return self

    def without(self, channels: Collection[str]) -> FileOptions:
        """The same without what is said of some channels.

        Args:
            channels: Their names.

        Returns:
            The options.
        """
        each = {name: getattr(self, name) for name in ("columns", "units", "references")}
        kept = {
            name: {channel: one for channel, one in said.items() if channel not in channels}
            for name, said in each.items()
            if isinstance(said, dict)
        }
        return self.model_copy(update=kept)


class GridOptions(Options):
    """How samples come onto the uniform grid of the data set's sample time.

    Without ``method``, stamps must lie on that grid already.

    Args:
        method: ``linear`` (between neighbours), ``hold`` (the last value), or ``average`` (the mean
            of the samples in each interval, which is how a fast recording is decimated).
        tolerance: How far a stamp may lie from its place on the grid and still be taken as lying on
            it, as a fraction of the sample time.
        longest_step: Seconds between two stamps above which samples are missing; ``None`` is one and a
            half times the median step.
        fewest_samples: A record with fewer is refused.
    """

    method: Literal["linear", "hold", "average"] | None = None
    tolerance: Annotated[float, Field(ge=0, lt=0.5)] = 0.01
    longest_step: Annotated[float, Field(gt=0)] | None = None
    fewest_samples: Annotated[int, Field(ge=2)] = 10


NanRepair = Literal["interpolate", "hold", "mask"]


class RepairOptions(Options):
    """The repairs that are asked for; each one that is made is recorded in the trace's provenance.

    Args:
        ragged: ``drop`` the rows of a CSV that have too many or too few cells.
        stamps: ``drop`` the samples whose time stamp is empty.
        backward: ``sort`` the samples by time, or ``drop`` those that step back.
        duplicates: ``drop`` all but the first sample of a time stamp, keep the ``last`` (what a simulation has after an
            event), or ``average`` them.
        gaps: Fill by ``linear`` or ``hold``; ``mask`` fills and marks the samples as not usable.
        nan: ``interpolate`` missing values, ``hold`` the value before (a blank means: as before), or ``mask`` their
            samples as not usable; one for all, or by channel.
        marks: Numbers such as -9999 far outside all else in a column are ``missing`` values, or values to ``accept``.
        mask: Stretches of time whose cells are emptied and do not count, each with ``start``, ``stop``, or both, in
            seconds of the file's time: of one ``channel``, of some ``cases``, or of all.
        repeats: ``mask`` the samples of a channel that repeat the value before, by channel: it is measured more slowly
            than it is recorded.
        drift: ``line`` takes the straight line through the samples of a channel off them, by channel; their mean stays.
        jitter: ``resample`` uneven time stamps by ``grid.method``.
        constant: ``accept`` channels that never change.
    """

    ragged: Literal["drop"] | None = None
    stamps: Literal["drop"] | None = None
    backward: Literal["sort", "drop"] | None = None
    duplicates: Literal["drop", "last", "average"] | None = None
    gaps: Literal["linear", "hold", "mask"] | None = None
    nan: NanRepair | dict[str, NanRepair] | None = None
    marks: Literal["missing", "accept"] | None = None
    mask: Masks | None = None
    repeats: dict[str, Literal["mask"]] | None = None
    drift: dict[str, Literal["line"]] | None = None
    jitter: Literal["resample"] | None = None
    constant: Literal["accept"] | None = None
