"""Files on disk in, a TraceSet in the units that were asked for out.

The way of a file: a reader (``readers/``, which understands ``cells/``) makes a :class:`RawTable` of it (``tables/``),
``assembling/`` selects the channels, converts units, makes the repairs that were asked for (and refuses what was not),
and brings the samples onto a uniform time grid; ``datasets/`` does so for every case of a ``dataset.yaml``, or has a
generator make the traces and keeps them in a cache; ``memory/`` does so for what is in memory already. ``inspecting/``
looks at a file of which nothing is known.
"""

from typing import TYPE_CHECKING

from sysid.lazy_names import imported_when_asked

if TYPE_CHECKING:
    from sysid.ingest.assembling.timing import Timing as Timing
    from sysid.ingest.assembling.timing import survey as survey
    from sysid.ingest.datasets.cache import TraceCache as TraceCache
    from sysid.ingest.datasets.cache import content_key as content_key
    from sysid.ingest.datasets.cache import default_cache_folder as default_cache_folder
    from sysid.ingest.datasets.dataset import Progress as Progress
    from sysid.ingest.datasets.dataset import find_dataset as find_dataset
    from sysid.ingest.datasets.dataset import load_dataset as load_dataset
    from sysid.ingest.datasets.dataset import load_described as load_described
    from sysid.ingest.datasets.description import DatasetDescription as DatasetDescription
    from sysid.ingest.datasets.description import read_description as read_description
    from sysid.ingest.datasets.generators import Generator as Generator
    from sysid.ingest.datasets.generators import find_generator as find_generator
    from sysid.ingest.inspecting.findings import ColumnFinding as ColumnFinding
    from sysid.ingest.inspecting.findings import FileFinding as FileFinding
    from sysid.ingest.inspecting.inspection import inspect_file as inspect_file
    from sysid.ingest.inspecting.proposal import propose_dataset as propose_dataset
    from sysid.ingest.readers import READERS as READERS
    from sysid.ingest.readers import Reader as Reader
    from sysid.ingest.reading import read_table as read_table
    from sysid.ingest.reading import read_trace as read_trace
    from sysid.ingest.tables.columns import RawColumn as RawColumn
    from sysid.ingest.tables.options import ColumnOptions as ColumnOptions
    from sysid.ingest.tables.options import FileOptions as FileOptions
    from sysid.ingest.tables.options import GridOptions as GridOptions
    from sysid.ingest.tables.options import RepairOptions as RepairOptions
    from sysid.ingest.tables.options import TimeOptions as TimeOptions
    from sysid.ingest.tables.table import RawTable as RawTable
    from sysid.ingest.writers import write_csv as write_csv
    from sysid.ingest.writers import write_parquet as write_parquet
    from sysid.ingest.writers import write_trace as write_trace

__getattr__, __all__ = imported_when_asked(__file__)
