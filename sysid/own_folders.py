"""Where things are kept when neither the package's folder nor the user's home may be written to.

That is how programs run in containers, as services and on clusters: somebody else has installed the package, and there
is no home. Numba then refuses to compile what shall be kept, and nothing that computes could be imported.
"""

from __future__ import annotations

import os
import stat
import tempfile
from functools import cache
from pathlib import Path

from sysid.compilation import listen


def own_folder(name: str) -> Path:
    """A folder among those for temporary files that nobody else can write to.

    Args:
        name: What it is for.

    Returns:
        The same folder for each process of a user; another one where what has its name is not the user's alone.
    """
    user = os.getuid() if hasattr(os, "getuid") else None
    folder = Path(tempfile.gettempdir()) / f"sysid-{name}-{user}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError:  # a file has this name
        return Path(tempfile.mkdtemp(prefix=f"sysid-{name}-"))
    ours = user is None or (found.st_uid == user and stat.S_IMODE(found.st_mode) & 0o077 == 0)
    return folder if ours and stat.S_ISDIR(found.st_mode) else Path(tempfile.mkdtemp(prefix=f"sysid-{name}-"))


@cache
def keep_kernels_where_it_is_allowed() -> None:
    """Have Numba keep what it compiles in a folder of the user's own, where it has no other; asked once a process.

    Processes that begin later have the same folder. Who has set ``NUMBA_CACHE_DIR`` has chosen.
    """
    import numba

    try:
        numba.njit(cache=True)(_nothing)  # looks for its folder, and compiles nothing before it is called
    except RuntimeError:
        os.environ["NUMBA_CACHE_DIR"] = numba.config.CACHE_DIR = str(own_folder("kernels"))
    listen()


def _nothing() -> None:
    """What is asked with."""
