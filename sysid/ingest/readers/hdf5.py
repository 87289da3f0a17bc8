"""HDF5: every one- or two-dimensional data set, with its unit in an attribute ``units`` or ``unit``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ReaderError
from sysid.ingest.options import FileOptions, RepairOptions
from sysid.ingest.readers.nested import matrix_columns
from sysid.ingest.readers.reader import Reader, damaged
from sysid.ingest.table import RawColumn, RawTable, array_column, of_one_length, recognise_time
from sysid.units import Reference


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    import h5py

    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise damaged(path, "HDF5", error) from error
    with file:
        root = _group(file, options.group, path)
        columns: list[RawColumn] = []

        def visit(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset):
                columns.extend(_columns(name, item, path))

        root.visititems(visit)
        metadata = {"sysid": text} if (text := _attribute(file, "sysid")) else {}
    alike = of_one_length(columns, where=str(path))
    return RawTable(source=path, reader="hdf5", columns=alike, time=recognise_time(alike), metadata=metadata)


READER = Reader(name="hdf5", suffixes=(".h5", ".hdf5", ".hdf"), read=_read, options=frozenset({"group"}))


def _group(file: Any, name: str | None, path: Path) -> Any:
    import h5py

    if name is None:
        return file
    group = file.get(name)
    if not isinstance(group, h5py.Group):
        groups: list[str] = []
        file.visititems(lambda key, item: groups.append(key) if isinstance(item, h5py.Group) else None)
        raise ReaderError(
            f"there is no group {name}",
            where=path,
            expected=f"one of {', '.join(groups) or 'none: all data sets stand at the top'}",
            got=name,
            remedy="correct group, or leave it out",
        )
    return group


def _columns(name: str, dataset: Any, path: Path) -> list[RawColumn]:
    if dataset.dtype.names:  # a table: one column per field
        table = dataset[()]
        return [array_column(f"{field}", table[field], where=str(path)) for field in dataset.dtype.names]
    if dataset.dtype.kind not in "buif":
        return []
    unit = _attribute(dataset, "units") or _attribute(dataset, "unit")
    description = _attribute(dataset, "description") or _attribute(dataset, "long_name") or ""
    columns = matrix_columns(name, np.asarray(dataset[()]), where=str(path), unit=unit, description=description)
    reference = _attribute(dataset, "reference")
    if reference not in {item.value for item in Reference}:
        return columns
    return [
        array_column(
            column.name,
            column.values,
            where=str(path),
            unit=column.unit,
            reference=Reference(reference),
            description=description,
        )
        for column in columns
    ]


def _attribute(item: Any, name: str) -> str | None:
    value = item.attrs.get(name)
    if isinstance(value, bytes):
        return value.decode("utf-8", errors="replace")
    return value if isinstance(value, str) else None
