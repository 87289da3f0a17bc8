"""What memory holds as columns: frames, dicts, tensors, arrays of objects.

A table is known by what it can do and not by its type, so that no library has to be there: pandas and polars frames,
Arrow tables, xarray data sets, NumPy arrays (structured ones too), torch tensors, plain lists.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import UTC, date, datetime, time, timedelta
from decimal import Decimal
from itertools import pairwise
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, ReaderError, shortened
from sysid.ingest.cells.calendar import is_calendar
from sysid.ingest.cells.headers import parse_header, unit_in_name
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.time_columns import is_time_unit, recognise_time, time_unit
from sysid.units import convert

INDEX = "(index)"
"""Name of the column that a frame's index becomes where it is time; no file can have it by chance."""

Columns = dict[str, NDArray[Any]]


def columns_by_name(values: Any, *, where: str = "the table") -> Columns | None:
    """The columns of a table that has names for them.

    Args:
        values: A frame, a dict of columns, a structured array, or anything else.
        where: Named in errors.

    Returns:
        The columns by name; a frame's index is among them where it is time. ``None`` for what has no names.

    Raises:
        ConfigError: If two columns have one name, series of a dict have different labels, or labels are time as text.
    """
    pairs: list[tuple[str, Any]]
    if isinstance(values, Mapping):
        check_labels(list(values.values()), list(values), where=where)
        pairs = [*index_of(list(values.values())).items(), *((str(key), one) for key, one in values.items())]
        # scipy.io.loadmat puts what it says of the file beside the columns.
        pairs = [(key, one) for key, one in pairs if not (key.startswith("__") and key.endswith("__"))]
    elif hasattr(values, "get_columns"):  # polars
        pairs = [(str(column.name), column.to_numpy()) for column in values.get_columns()]
    elif hasattr(values, "data_vars"):  # xarray.Dataset
        keys = [key for key in (*values.coords, *values.data_vars) if values[key].ndim == 1]
        pairs = [(str(key), values[key].values) for key in keys]
    elif hasattr(values, "column_names") and hasattr(values, "itercolumns"):  # pyarrow.Table
        pairs = list(zip(values.column_names, values.itercolumns(), strict=True))
    elif hasattr(values, "columns") and hasattr(values, "index"):  # pandas.DataFrame
        pairs = [*_index(values.index).items(), *((_label(key), column) for key, column in values.items())]
    elif hasattr(values, "to_frame") and hasattr(values, "index"):  # pandas.Series
        pairs = [*_index(values.index).items(), (str(values.name if values.name is not None else "y"), values)]
    else:
        fields = getattr(getattr(values, "dtype", None), "names", None)
        return {name: values[name] for name in fields} if fields else None
    check_distinct([key for key, _ in pairs], where=where)
    return {key: as_column(column) for key, column in pairs}


def check_distinct(names: Sequence[str], *, where: str) -> None:
    """Refuse two columns of one name: which of them is meant, nobody can know.

    Args:
        names: The names.
        where: Named in errors.

    Raises:
        ConfigError: If one comes twice.
    """
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise ConfigError(
            f"two columns are named {', '.join(twice)}",
            where=where,
            expected="a different name for each column",
            got=", ".join(names),
            remedy='rename one, for example frame.columns = ["t", "u", "u_2", "y"]',
        )


def _is_labelled(part: object) -> bool:
    """Whether an object has a label for each of its rows, as a series or a frame of pandas has."""
    return hasattr(getattr(part, "index", None), "equals")


def index_of(parts: Sequence[Any]) -> Columns:
    """The index of parts that go side by side, where it is time.

    Args:
        parts: Series, frames or arrays, whose labels are alike.

    Returns:
        The column, or none.
    """
    return next((_index(one.index) for one in parts if _is_labelled(one)), {})


def check_labels(parts: Sequence[Any], names: Sequence[object], *, where: str) -> None:
    """Refuse parts that go side by side row by row though their labels say otherwise.

    Args:
        parts: Series, frames or arrays; only what has labels is looked at.
        names: How each is called.
        where: Named in errors.

    Raises:
        ConfigError: If two have different labels.
    """
    labelled = [(str(name), part.index) for name, part in zip(names, parts, strict=True) if _is_labelled(part)]
    for (first, one), (second, other) in pairwise(labelled):
        if not one.equals(other):
            raise ConfigError(
                f"{first} and {second} have different indexes",
                where=where,
                expected="the same label in each row: they are taken in the order in which they stand",
                got=f"{[str(label) for label in one[:3]]} ... and {[str(label) for label in other[:3]]} ...",
                remedy="put them into one frame, which joins them by their labels, or give each as to_numpy()",
            )


def check_rows(table: Any, *, where: str) -> None:
    """Refuse rows that do not follow each other, as far as their labels tell, where nothing else tells the time.

    Rows that were dropped, shuffled, or put behind those of another record are no samples at equal distances.

    Args:
        table: A frame, a series, or a dict of series; what has no labels of rows is taken as it stands.
        where: Named in errors.

    Raises:
        ConfigError: If the labels are of several levels, or do not count evenly.
    """
    if isinstance(table, Mapping):
        table = next(filter(_is_labelled, table.values()), None)
    if not _is_labelled(table):
        return
    if getattr(table.index, "nlevels", 1) > 1:
        raise ConfigError(
            "the rows have labels of several levels",
            where=where,
            expected="one record a frame; several are a dict of them by name",
            got=", ".join(str(name) for name in table.index.names),
            remedy="write {str(key): part.droplevel(0) for key, part in frame.groupby(level=0)}",
        )
    labels = as_column(table.index)
    steps = np.diff(labels) if labels.dtype.kind in "iu" else labels[:0]
    uneven = np.flatnonzero((steps != steps[0]) | (steps < 0)) if len(steps) else steps
    if len(uneven):
        row = int(uneven[0])
        raise ConfigError(
            "the rows do not follow each other: their labels do not count up evenly",
            where=f"{where}, row {row + 1}",
            expected=f"label {labels[row] + abs(steps[0])} after {labels[row]}",
            got=str(labels[row + 1]),
            remedy="rows that were dropped: frame.reindex(range(first, last + 1)) with repairs={'nan': 'mask'}; rows "
            "out of order: frame.sort_index(); several records: a list of frames; none of these: "
            "frame.reset_index(drop=True)",
        )


def as_array(values: Any) -> NDArray[Any]:
    """Any array-like as NumPy: a tensor lets go of its gradients, what a masked array masks is missing.

    Args:
        values: Anything.

    Returns:
        The array; numbers in an array of objects become float64 where all of them are numbers or missing.

    Raises:
        ConfigError: If it is a list of lists of different lengths.
    """
    if isinstance(values, np.ma.MaskedArray) and values.dtype.kind in "buif":
        return np.asarray(np.ma.filled(values.astype(np.float64), np.nan))
    if not hasattr(values, "detach"):
        try:
            return _of_objects(np.asarray(values))
        except ValueError:
            raise ConfigError(
                "a list holds lists of different lengths",
                expected="numbers, or rows of one length",
                got=f"{type(values).__name__} of {len(values)} entries",
                remedy="experiments of different lengths are a list of records: [(u1, y1), (u2, y2)]",
            ) from None
    plain = values.detach().cpu()
    try:
        return np.asarray(plain)
    except TypeError:  # sparse, or of a type that NumPy has not: bfloat16
        return np.asarray(plain.to_dense().double())


def as_column(column: Any) -> NDArray[Any]:
    """One column as NumPy; calendar time of a zone counts from the same origin as any other.

    Args:
        column: A column or an index of a frame, an array, a list.

    Returns:
        The array; one of a single column lies flat, and one of a single row too: one sample is no record.
    """
    if hasattr(column, "to_timestamp") and not hasattr(column, "index"):  # pandas.PeriodIndex
        column = column.to_timestamp()
    if getattr(getattr(column, "dtype", None), "tz", None) is not None:
        column = getattr(column, "dt", column).tz_convert(None)
    array = as_array(column.to_numpy() if hasattr(column, "to_numpy") else column)
    return array.reshape(-1) if array.ndim == 2 and 1 in array.shape else array


def not_numbers(name: str, array: NDArray[Any], *, where: str) -> ReaderError | None:
    """Why a column that is no number cannot be a channel, and what its owner can do about it in Python.

    Args:
        name: Its name.
        array: Shape ``(n_rows,)``.
        where: Named in the error.

    Returns:
        The error, or ``None`` for numbers and times.
    """
    if array.dtype.kind not in "OSU":
        return None
    odd = [cell for cell in array.tolist() if _number(cell) is None]
    return ReaderError(
        "a column is not numeric",
        where=f"{where}, column {name}",
        expected="real numbers",
        got=", ".join(repr(cell)[:40] for cell in odd[:3]),
        remedy="numbers as text: pd.to_numeric(column.str.replace(',', '.')); times as text: pd.to_datetime(column); "
        "states: (column == 'ON')",
    )


def _of_objects(array: NDArray[Any]) -> NDArray[Any]:
    """An array of objects as what its cells are: numbers, of which some may be missing, or times."""
    if array.dtype.kind != "O" or not array.size:
        return array
    cells = array.ravel().tolist()
    there = [cell for cell in cells if not _is_missing(cell)]
    if there and all(isinstance(cell, date | time | timedelta) for cell in there):
        return _of_times(cells, there).reshape(array.shape)
    numbers = [_number(cell) for cell in cells]
    return array if None in numbers else np.array(numbers, dtype=np.float64).reshape(array.shape)


def _of_times(cells: list[Any], there: list[Any]) -> NDArray[Any]:
    """Calendar times and days as such; durations, and times of day since midnight, as spans of time."""
    spans = isinstance(there[0], time | timedelta)
    if any(isinstance(cell, time | timedelta) != spans for cell in there):
        return np.array(cells, dtype=object)
    kind = "timedelta64[ns]" if spans else "datetime64[ns]"
    return np.array([None if _is_missing(cell) else _plain_time(cell) for cell in cells], dtype=kind)


def _plain_time(cell: date | time | timedelta) -> date | timedelta:
    if isinstance(cell, time):
        return datetime.combine(date.min, cell.replace(tzinfo=None)) - datetime.min
    return cell.astimezone(UTC).replace(tzinfo=None) if isinstance(cell, datetime) and cell.tzinfo else cell


def _is_missing(cell: object) -> bool:
    """Whether a cell says that there is nothing: None, and what pandas has for it."""
    return cell is None or type(cell).__name__ in {"NAType", "NaTType"}


def _number(cell: object) -> float | None:
    if _is_missing(cell):
        return float("nan")
    if isinstance(cell, int) and abs(cell) > 2**53:
        return None
    return float(cell) if isinstance(cell, Real | Decimal | np.bool_) else None


def _label(key: object) -> str:
    """A frame's column by name; of several levels, joined by dots."""
    return ".".join(str(part) for part in key) if isinstance(key, tuple) else str(key)


def _index(index: Any) -> Columns:
    """A frame's index where it is time: calendar time, spans of time, or numbers that are not just counted."""
    if getattr(index, "nlevels", 1) > 1:
        return {}
    array = as_column(index)
    if array.dtype.kind in "mM":
        return {INDEX: array}
    if array.dtype.kind in "OSU" and len(array) and all(is_calendar(str(label)) for label in array[:2].tolist()):
        raise ConfigError(
            "the labels of the rows are time as text",
            where="the index",
            expected="time stamps, or no time",
            got=shortened(array[0]),
            remedy="frame.index = pd.to_datetime(frame.index), or parse_dates=True where the file is read; if they are "
            "no time, frame.reset_index(drop=True)",
        )
    header = parse_header(str(index.name or ""))
    unit = header.unit or unit_in_name(header.name)
    if array.dtype.kind not in "iuf" or (unit is not None and not is_time_unit(unit)):  # a way in mm, say
        return {}
    column = RawColumn(name=header.name, values=np.zeros(1), unit=unit)
    if array.dtype.kind != "f" and recognise_time([column]) is None:
        return {}
    return {INDEX: array if unit is None else convert(array.astype(np.float64), time_unit(unit), "s")}
