"""Files on disk in, a TraceSet in the units that were asked for out.

The way of a file: a reader (``readers/``) makes a :class:`RawTable` of it, ``assemble`` selects the
channels, converts units, makes the repairs that were asked for (and refuses what was not), and brings
the samples onto a uniform time grid; ``dataset`` does so for every case of a ``dataset.yaml``, or has
a generator make the traces and keeps them in a cache.
"""

from typing import TYPE_CHECKING

from sysid.lazy_names import imported_when_asked

if TYPE_CHECKING:
    from sysid.ingest.cache import TraceCache, content_key, default_cache_folder
    from sysid.ingest.columns import RawColumn
    from sysid.ingest.dataset import Progress, find_dataset, load_dataset, load_described
    from sysid.ingest.description import DatasetDescription, read_description
    from sysid.ingest.findings import ColumnFinding, FileFinding
    from sysid.ingest.generators import Generator, find_generator
    from sysid.ingest.inspection import inspect_file
    from sysid.ingest.options import ColumnOptions, FileOptions, GridOptions, RepairOptions, TimeOptions
    from sysid.ingest.proposal import propose_dataset
    from sysid.ingest.readers import READERS, Reader
    from sysid.ingest.reading import read_table, read_trace
    from sysid.ingest.table import RawTable
    from sysid.ingest.timing import Timing, survey
    from sysid.ingest.writers import write_csv, write_parquet, write_trace

__all__ = [
    "READERS",
    "ColumnFinding",
    "ColumnOptions",
    "DatasetDescription",
    "FileFinding",
    "FileOptions",
    "Generator",
    "GridOptions",
    "Progress",
    "RawColumn",
    "RawTable",
    "Reader",
    "RepairOptions",
    "TimeOptions",
    "Timing",
    "TraceCache",
    "content_key",
    "default_cache_folder",
    "find_dataset",
    "find_generator",
    "inspect_file",
    "load_dataset",
    "load_described",
    "propose_dataset",
    "read_description",
    "read_table",
    "read_trace",
    "survey",
    "write_csv",
    "write_parquet",
    "write_trace",
]

__getattr__ = imported_when_asked(
    {
        "sysid.ingest.cache": ("TraceCache", "content_key", "default_cache_folder"),
        "sysid.ingest.columns": ("RawColumn",),
        "sysid.ingest.dataset": ("Progress", "find_dataset", "load_dataset", "load_described"),
        "sysid.ingest.description": ("DatasetDescription", "read_description"),
        "sysid.ingest.findings": ("ColumnFinding", "FileFinding"),
        "sysid.ingest.generators": ("Generator", "find_generator"),
        "sysid.ingest.inspection": ("inspect_file",),
        "sysid.ingest.options": ("ColumnOptions", "FileOptions", "GridOptions", "RepairOptions", "TimeOptions"),
        "sysid.ingest.proposal": ("propose_dataset",),
        "sysid.ingest.readers": ("READERS", "Reader"),
        "sysid.ingest.reading": ("read_table", "read_trace"),
        "sysid.ingest.table": ("RawTable",),
        "sysid.ingest.timing": ("Timing", "survey"),
        "sysid.ingest.writers": ("write_csv", "write_parquet", "write_trace"),
    }
)
