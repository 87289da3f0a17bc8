"""Compiled recursions: free run and forward sensitivities.

Numba keeps what it compiled beside the source, and compiles it again when that file changes; that something has changed
which the function calls from another file, such as a kind of neuron, it does not see. So an index that is older than
the newest file of this room is taken away.
"""

import time
from pathlib import Path

from sysid.own_folders import keep_kernels_where_it_is_allowed


def forget_what_is_older(folder: Path, callers: Path | None = None) -> None:
    """Take away the indices of compiled functions that are older than some file of a folder.

    Args:
        folder: With the sources.
        callers: Where what calls them was compiled, in ``__pycache__`` folders; by default in the same folder. One that
            cannot be written keeps what it has.
    """
    # A file from the future, as after a wrong clock, would take everything away at every start.
    written = (file.stat().st_mtime for file in folder.rglob("*.py"))
    newest = max((when for when in written if when <= time.time()), default=0.0)
    for index in (callers or folder).rglob("__pycache__/*.nbi"):
        try:
            if index.stat().st_mtime < newest:
                index.unlink()
        except OSError:  # another process was faster, or the folder is read-only
            continue


forget_what_is_older(Path(__file__).parent, Path(__file__).parent.parent)
keep_kernels_where_it_is_allowed()
