"""Which of several columns of calendar time is the clock of the record, once they were read."""

from __future__ import annotations

from collections.abc import Sequence

from sysid.errors import ReaderError
from sysid.ingest.readers.csv.body import AnyColumn, Stamps
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.time_columns import going_on_beside


def running_on(columns: Sequence[AnyColumn], calendar: int | None) -> int | None:
    """The column of calendar time that runs on through the record, where the one called time begins anew in it.

    Args:
        columns: As they were read.
        calendar: Which of them is called time.

    Returns:
        It, or that other one.
    """
    stamped = [i for i, column in enumerate(columns) if isinstance(column, Stamps) and column.problem is None]
    if calendar not in stamped or len(stamped) == 1:
        return calendar
    there = {i: clock for i in stamped if (clock := _clock_of(columns[i], str(i))) is not None}
    if calendar not in there:
        return calendar
    other = going_on_beside(there.pop(calendar), list(there.values()))
    return calendar if other is None else int(other.name)


def _clock_of(column: AnyColumn, name: str) -> RawColumn | None:
    """Stamps in seconds; ``None`` of days alone, and of what no stamps can be."""
    if not isinstance(column, Stamps) or not column.calendar.has_clock:
        return None
    try:
        return RawColumn(name=name, values=column.calendar.finish()[0])
    except ReaderError:
        return None
