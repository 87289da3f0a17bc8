"""Files that hold a tree, as MATLAB's and HDF5 do: what looks for the columns in one is imported with the first.

Most files are tables, and a look at one of them should not take longer for what is not in it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sysid.ingest.tables.options import FileOptions
from sysid.ingest.tables.table import RawTable


def table_of(
    tree: Mapping[str, Any],
    *,
    path: Path,
    reader: str,
    options: FileOptions,
    separator: str = ".",
    short: bool = True,
    metadata: Mapping[str, str] | None = None,
    notes: Sequence[str] = (),
) -> RawTable:
    """The columns in a tree; see :func:`sysid.ingest.readers.tree.table_of`."""
    from sysid.ingest.readers import tree as trees

    how: dict[str, Any] = {"path": path, "reader": reader, "options": options, "separator": separator}
    return trees.table_of(tree, **how, short=short, metadata=metadata, notes=notes)
