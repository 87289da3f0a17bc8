"""Parquet: units, references and descriptions in the metadata of each field."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sysid.ingest.headers import Header, parse_header
from sysid.ingest.options import FileOptions, RepairOptions
from sysid.ingest.readers.reader import Reader, damaged
from sysid.ingest.table import RawTable, array_column, recognise_time
from sysid.units import Reference


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    import pyarrow as pa
    from pyarrow import parquet

    try:
        table = parquet.ParquetFile(path).read()
    except (pa.ArrowException, OSError) as error:
        raise damaged(path, "Parquet", error) from error
    columns = []
    for field, chunks in zip(table.schema, table.columns, strict=True):
        meta = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
        unit = meta.get("unit", meta.get("units"))
        header = parse_header(field.name) if unit is None else Header(name=field.name, unit=unit)
        # A null becomes NaN by itself, in float columns and in integer ones; text stays text.
        array = np.asarray(chunks.to_numpy())
        if array.dtype.kind == "O" and pa.types.is_decimal(field.type):
            array = np.asarray(chunks.cast(pa.float64()).to_numpy())
        reference = meta.get("reference")
        columns.append(
            array_column(
                header.name,
                array,
                where=str(path),
                unit=header.unit,
                reference=Reference(reference) if reference in {r.value for r in Reference} else header.reference,
                description=meta.get("description", ""),
            )
        )
    metadata = {key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items() if key == b"sysid"}
    return RawTable(
        source=path, reader="parquet", columns=tuple(columns), time=recognise_time(columns), metadata=metadata
    )


READER = Reader(name="parquet", suffixes=(".parquet", ".pq"), read=_read)
