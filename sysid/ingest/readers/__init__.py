"""The readers: one file per format, one table of them all.

Adding a reader is one file with a ``READER`` in it, one line here, and one row in the contract table
of ``tests/ingest/test_readers.py``.
"""

from sysid.ingest.readers import csv_text, hdf5, matlab, mdf4, parquet, tdms
from sysid.ingest.readers.reader import Reader, choose_reader, read_with

READERS: tuple[Reader, ...] = (
    csv_text.READER,
    parquet.READER,
    matlab.READER,
    hdf5.READER,
    mdf4.READER,
    tdms.READER,
)
"""Every reader; a file is read by the one that claims its suffix."""

__all__ = ["READERS", "Reader", "choose_reader", "read_with"]
