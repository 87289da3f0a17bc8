"""The reader of HDF5 and netCDF; what looks for arrays in them is imported with the first."""

from __future__ import annotations

from pathlib import Path

from sysid.ingest.readers.marks import NETCDF_3
from sysid.ingest.readers.reader import Reader
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    from sysid.ingest.readers.hdf5_arrays import read  # here: most files are none of such

    return read(path, options)


def _is_mine(head: bytes) -> bool:
    signature = b"\x89HDF\r\n\x1a\n"
    return any(head[at : at + 8] == signature for at in (0, 512, 1024, 2048)) or (
        head[:3] == NETCDF_3 and head[3:4] in {b"\x01", b"\x02", b"\x05"}
    )


READER = Reader(
    name="hdf5",
    suffixes=(".h5", ".hdf5", ".hdf", ".he5", ".nc", ".nc4", ".cdf", ".netcdf"),
    read=_read,
    options=frozenset({"group", "transpose"}),
    is_mine=_is_mine,
)
