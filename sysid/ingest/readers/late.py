"""Files that hold a tree, as MATLAB's and HDF5 do: what looks for the columns in one is imported with the first.

Most files are tables, and a look at one of them should not take longer for what is not in it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sysid.ingest.readers.trees.tree import table_of
else:

    def table_of(tree: Any, **how: Any) -> Any:
        """The columns in a tree; see :func:`sysid.ingest.readers.trees.tree.table_of`."""
        from sysid.ingest.readers.trees import tree as trees

        return trees.table_of(tree, **how)


__all__ = ["table_of"]
