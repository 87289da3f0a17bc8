"""Which experiments somebody gave who has them in memory, and what the columns of each are called."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.ingest.memory.memory_table import no_samples
from sysid.ingest.tables.frames import as_column, check_labels, columns_by_name, index_of


def experiments_of(values: Any, channels: tuple[str, ...] | None) -> dict[str, Any]:
    """The experiments by name; a single one is called ``record``.

    Arrays of a single column or row are columns, as those of ``scipy.io.loadmat`` are.

    Args:
        values: What :func:`sysid.data` was given.
        channels: The channels that were named, by which a list of two columns can be two experiments.

    Returns:
        The records, in their order.

    Raises:
        ConfigError: If a list is of rows, or is the pair (u, y) by its look.
    """
    standing = isinstance(values, Mapping) and any(
        not isinstance(one, tuple | Mapping) and not _is_frame(one) and np.ndim(one) == 2 and 1 in np.shape(one)
        for one in values.values()
    )
    if isinstance(values, Mapping) and values and not standing and all(_is_record(one) for one in values.values()):
        return {str(label): one for label, one in values.items()}
    if isinstance(values, list) and values and not np.isscalar(values[0]):
        if channels is None and len(values) == 2 and all(_is_column(one) for one in values):
            raise ConfigError(
                "a list is of several experiments",
                expected="the pair (u, y), which is one experiment with an input",
                got="a list of two columns, which is two experiments without one",
                remedy='write sysid.data((u, y), ...); two records without input: outputs="y" beside the list',
            )
        _check_no_rows(values)
        return {f"record-{number}": one for number, one in enumerate(values, start=1)}
    return {"record": values}


def _check_no_rows(values: list[Any]) -> None:
    """Refuse a list of rows, which would be as many experiments of a few samples each."""
    few = len(values[0]) if isinstance(values[0], list | tuple) else 0
    if all(isinstance(one, Mapping) and all(map(np.isscalar, one.values())) for one in values):
        raise ConfigError(
            "a list is of several experiments",
            expected="records: pairs (u, y), frames, dicts of columns",
            got=f"{len(values)} rows, a dict each",
            remedy="one record of rows is a frame: pd.DataFrame(rows)",
        )
    rows = 0 < few < len(values) and all(
        isinstance(one, list | tuple) and len(one) == few and all(map(np.isscalar, one)) for one in values
    )
    if rows:
        raise ConfigError(
            "a list is of several experiments",
            expected="records: pairs (u, y), frames, dicts of columns",
            got=f"{len(values)} rows of {few} numbers",
            remedy="one record of rows is an array: np.array(rows)",
        )


def _is_column(value: Any) -> bool:
    """Whether a value is one bare column of numbers: neither a table nor a series, which has a name."""
    if isinstance(value, list):
        return bool(value) and bool(np.isscalar(value[0]))
    return (
        not hasattr(value, "to_frame")
        and getattr(value, "ndim", 0) == 1
        and getattr(value.dtype, "names", None) is None
    )


def _is_record(value: Any) -> bool:
    """Whether a value of a dict is a record of its own and not a column."""
    if isinstance(value, tuple):
        return not all(np.isscalar(entry) for entry in value)
    return isinstance(value, Mapping) or _is_frame(value) or getattr(value, "ndim", 1) == 2


def _is_frame(value: Any) -> bool:
    return any(hasattr(value, attribute) for attribute in ("get_columns", "data_vars")) or (
        hasattr(value, "columns") and hasattr(value, "index")
    )


def columns_of(
    one: Any, inputs: tuple[str, ...] | None, outputs: tuple[str, ...] | None, *, where: str
) -> dict[str, NDArray[Any]]:
    """The columns of one record; those of an array are the inputs and then the outputs.

    Args:
        one: A frame, a dict of columns, a pair of arrays, or an array.
        inputs: Names of the inputs, where they were given.
        outputs: Likewise.
        where: The record, for errors.

    Returns:
        The columns by name.

    Raises:
        ConfigError: If it is no record, or has another number of columns than names.
    """
    named = columns_by_name(one, where=where)
    if named is not None:
        return named
    if isinstance(one, tuple) and len(one) != 2 and not all(np.isscalar(part) for part in one):
        raise ConfigError(
            "a tuple is a pair",
            where=where,
            expected="(u, y)",
            got=f"{len(one)} parts",
            remedy='name the columns: {"t": t, "u": u, "y": y}; several experiments are a list of pairs',
        )
    if isinstance(one, tuple) and len(one) == 2:
        check_labels(one, ("u", "y"), where=where)
        u, y = (_two_dimensional(part, where=where) for part in one)
        return index_of(one) | dict(zip([*_given(inputs, u, "u"), *_given(outputs, y, "y")], [*u.T, *y.T], strict=True))
    return _of_matrix(_two_dimensional(one, where=where), inputs, outputs, where=where)


def _of_matrix(
    matrix: NDArray[Any], inputs: tuple[str, ...] | None, outputs: tuple[str, ...] | None, *, where: str
) -> dict[str, NDArray[Any]]:
    width = matrix.shape[1]
    if outputs is None and inputs is None and width > 1:
        raise ConfigError(
            "nothing tells inputs and outputs apart in an array of several columns",
            where=where,
            expected="inputs and outputs by name, in the order of the columns",
            got=f"{width} columns",
            remedy='write for example sysid.data(array, inputs=["u"], outputs=["y"]), or give the pair (u, y)',
        )
    outputs = outputs if outputs is not None else _given(None, matrix[:, len(inputs or ()) :], "y")
    inputs = inputs if inputs is not None else _given(None, matrix[:, : width - len(outputs)], "u")
    if len(inputs) + len(outputs) != width:
        raise ConfigError(
            "the array has another number of columns than there are channels",
            where=where,
            expected=f"{len(inputs)} inputs and {len(outputs)} outputs side by side",
            got=f"{width} columns",
            remedy="name every column, inputs first, or turn the array if its channels stand in rows",
        )
    return dict(zip([*inputs, *outputs], matrix.T, strict=True))


def _given(names: tuple[str, ...] | None, matrix: NDArray[Any], letter: str) -> tuple[str, ...]:
    """The names of columns: those that were given, or a letter with numbers."""
    width = matrix.shape[1]
    if names is None:
        return (letter,) if width == 1 else tuple(f"{letter}{number}" for number in range(1, width + 1))
    if len(names) != width:
        raise ConfigError(
            "names and columns do not match",
            expected=f"{width} names, one for each column",
            got=", ".join(names) or "none",
            remedy="name every column",
        )
    return names


def _two_dimensional(values: Any, *, where: str) -> NDArray[Any]:
    array = as_column(values)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or array.dtype.kind not in "buif":
        raise ConfigError(
            "not a record",
            where=where,
            expected="a frame, a dict of columns, a pair (u, y) of arrays, or an array of one or two dimensions",
            got=f"{type(values).__name__} of shape {np.shape(array)} and type {array.dtype}",
            remedy="give its real part, array.real, or both parts as channels of their own"
            if array.dtype.kind == "c"
            else "several experiments are a list of records: list(zip(u, y)) of arrays (experiment, sample, channel)"
            if array.ndim == 3
            else "give numbers; several experiments are a list of records",
        )
    if not len(array):
        raise no_samples(where)
    if array.shape[0] < array.shape[1]:
        raise ConfigError(
            "the array has more columns than rows",
            where=where,
            expected="samples in rows, channels in columns",
            got=f"shape {array.shape}",
            remedy="give its transpose (array.T) if channels stand in rows",
        )
    return array
