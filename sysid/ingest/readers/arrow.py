"""Arrow's tables: Parquet, Feather and the IPC formats, with units, references and descriptions in field metadata."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.extras import need
from sysid.ingest.cells.headers import Header, parse_header
from sysid.ingest.readers.bounds import check_claim
from sysid.ingest.readers.reader import Reader, damaged
from sysid.ingest.tables.columns import RawColumn, array_column, distinct
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import recognise_time
from sysid.units import Reference


def _parquet(path: Path) -> tuple[Any, int, Iterator[Any]]:
    from pyarrow import parquet

    file = parquet.ParquetFile(path)
    groups = (file.read_row_group(index) for index in range(file.num_row_groups))
    return file.schema_arrow, int(file.metadata.num_rows), groups


def _ipc(path: Path) -> tuple[Any, int, Iterator[Any]]:
    import pyarrow as pa

    source = pa.memory_map(str(path))
    with path.open("rb") as raw:
        head = raw.read(6)
    if head.startswith(b"FEA1"):
        from pyarrow import feather

        table = feather.read_table(path)
        return table.schema, len(table), iter([table])
    if head == b"ARROW1":
        file = pa.ipc.open_file(source)
        batches = (file.get_batch(index) for index in range(file.num_record_batches))
        rows = sum(file.get_batch(index).num_rows for index in range(file.num_record_batches))
        return file.schema, rows, (pa.Table.from_batches([batch]) for batch in batches)
    stream = pa.ipc.open_stream(source)
    table = stream.read_all()
    return table.schema, len(table), iter([table])


def _reads(kind: str, opened: Callable[[Path], tuple[Any, int, Iterator[Any]]]) -> Callable[..., RawTable]:
    def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
        need("pyarrow", f"reading {path.name}")
        import pyarrow as pa

        try:
            schema, rows, parts = opened(path)
            schema = _flat(schema.empty_table()).schema
            check_claim(path, [("the table", (rows, len(schema)))])
            arrays = _arrays(schema, rows, parts)
        except (pa.ArrowException, OSError) as error:
            raise damaged(path, kind, error) from error
        pa.default_memory_pool().release_unused()
        columns, notes = distinct([_column(field, array, path) for field, array in zip(schema, arrays, strict=True)])
        meta = {key.decode(): value.decode() for key, value in (schema.metadata or {}).items() if key == b"sysid"}
        return RawTable(
            source=path,
            reader=kind.lower(),
            columns=tuple(columns),
            time=recognise_time(columns),
            notes=tuple(notes),
            metadata=meta,
        )

    return _read


def _flat(table: Any) -> Any:
    """A table whose columns of structures are a column for each of their fields, ``imu.gyro.x``."""
    import pyarrow as pa

    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    return table


def _arrays(schema: Any, rows: int, parts: Iterator[Any]) -> list[NDArray[Any]]:
    """Every column as one array: plain numbers are put in their place part by part, so that one copy is held."""
    import pyarrow as pa

    plain = [_is_plain(field.type) for field in schema]
    whole: list[Any] = [np.empty(rows) if is_plain else [] for is_plain in plain]
    at = 0
    for part in parts:
        for index, chunks in enumerate(_flat(part).columns):
            if plain[index]:
                # A null becomes NaN by itself, in float columns and in integer ones.
                begin = at
                for chunk in chunks.chunks:
                    whole[index][begin : begin + len(chunk)] = chunk.to_numpy(zero_copy_only=False)
                    begin += len(chunk)
            else:
                whole[index].append(chunks)
        at += len(part)
    return [
        array
        if is_plain
        else _others(pa.chunked_array([c for chunks in array for c in chunks.chunks], type=field.type))
        for field, array, is_plain in zip(schema, whole, plain, strict=True)
    ]


def _is_plain(kind: Any) -> bool:
    """Whether float64 holds every value."""
    import pyarrow as pa

    return bool(pa.types.is_floating(kind) or (pa.types.is_integer(kind) and kind.bit_width <= 32))


def _others(chunks: Any) -> NDArray[Any]:
    import pyarrow as pa

    if pa.types.is_decimal(chunks.type):
        return np.asarray(chunks.cast(pa.float64()).to_numpy())
    if pa.types.is_dictionary(chunks.type):
        chunks = chunks.cast(chunks.type.value_type)
    array = np.asarray(chunks.to_numpy())  # text stays text
    if array.dtype.kind == "O" and pa.types.is_boolean(chunks.type):
        return np.array([np.nan if value is None else float(value) for value in array])
    return array


def _column(field: Any, array: NDArray[Any], path: Path) -> RawColumn:
    meta = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
    unit = meta.get("unit", meta.get("units"))
    header = parse_header(field.name) if unit is None else Header(name=field.name, unit=unit)
    reference = meta.get("reference")
    return array_column(
        header.name,
        array,
        where=str(path),
        unit=header.unit,
        reference=Reference(reference) if reference in {r.value for r in Reference} else header.reference,
        description=meta.get("description", ""),
    )


PARQUET = Reader(
    name="parquet",
    suffixes=(".parquet", ".pq"),
    read=_reads("Parquet", _parquet),
    is_mine=lambda head: head.startswith(b"PAR1"),
)
FEATHER = Reader(
    name="feather",
    suffixes=(".feather", ".arrow", ".ipc", ".arrows"),
    read=_reads("Feather", _ipc),
    # A stream has no name of its own, only the mark that each of its messages begins with.
    is_mine=lambda head: head.startswith((b"ARROW1", b"FEA1", b"\xff\xff\xff\xff")),
)
