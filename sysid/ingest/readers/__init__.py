"""The readers: one file per format, one table of them all.

Adding a reader is one file with a ``READER`` in it, one line here, and one row in the contract table
of ``tests/ingest/readers/test_readers.py``.
"""

from sysid.ingest.readers import (
    arrow,
    codesys,
    comtrade,
    excel,
    hdf5,
    json_text,
    lvm,
    matlab,
    mdf4,
    numpy_arrays,
    spice,
    tdms,
    touchstone,
)
from sysid.ingest.readers.csv import text as csv_text
from sysid.ingest.readers.reader import Reader, choose_reader, read_with

READERS: tuple[Reader, ...] = (
    csv_text.READER,
    arrow.PARQUET,
    arrow.FEATHER,
    matlab.READER,
    hdf5.READER,
    mdf4.READER,
    tdms.READER,
    numpy_arrays.READER,
    json_text.READER,
    lvm.READER,
    codesys.READER,
    excel.READER,
    spice.READER,
    comtrade.READER,
    touchstone.READER,
)
"""Every reader; a file is read by the one that knows its first bytes, else by the one that claims its suffix."""

__all__ = ["READERS", "Reader", "choose_reader", "read_with"]
