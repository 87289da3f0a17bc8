"""What the operating system refuses, in words: full disks, folders that are not ours, files in the way."""

from __future__ import annotations

import errno
from dataclasses import dataclass

from sysid.errors import SysidError, UserError


@dataclass(frozen=True, kw_only=True)
class _Refusal:
    what: str
    remedy: str
    got: str | None = None


_AGAIN = "the same command goes on from what is stored"
_FULL = _Refusal(what="the disk is full", remedy=f"free some space; {_AGAIN}")
_FORBIDDEN = _Refusal(what="the file or folder may not be written to", remedy="change its permissions, or name another")
_IN_THE_WAY = _Refusal(what="a file lies where a folder is needed", remedy="name another path, or move the file away")
_REFUSALS = {
    errno.ENOSPC: _FULL,
    errno.EDQUOT: _FULL,
    errno.EFBIG: _Refusal(
        what="the file would be larger than this process may write",
        remedy=f"raise the limit (ulimit -f unlimited); {_AGAIN}",
    ),
    errno.EACCES: _Refusal(what="access is not permitted", remedy="change the permissions, or name another path"),
    errno.EPERM: _FORBIDDEN,
    errno.EROFS: _FORBIDDEN,
    errno.ENOTDIR: _IN_THE_WAY,
    errno.EEXIST: _IN_THE_WAY,
    errno.EISDIR: _Refusal(what="a folder lies where a file is needed", remedy="name a file"),
    errno.ENOTEMPTY: _Refusal(what="a folder lies in the way", remedy="move it away, or name another path"),
    errno.ENAMETOOLONG: _Refusal(what="the path is too long", remedy="choose a shorter name"),
    errno.ENOENT: _Refusal(what="there is no such file or folder", remedy="check the path"),
    errno.EIO: _Refusal(what="the disk reports a fault", remedy=f"check the disk; {_AGAIN}"),
    errno.EMFILE: _Refusal(what="too many files are open", remedy="raise the limit (ulimit -n); " + _AGAIN),
}


_TRACKING = {"mlflow", "sqlalchemy", "alembic"}
"""Packages whose errors are about the tracking store; known by name, since nothing here may import them."""
_STORE = "mlflow.db in this folder, or what MLFLOW_TRACKING_URI names"
_TRACKED_LATER = "results are in runs/, and sysid run tracks them again"
_DATABASE = {
    "disk is full": _Refusal(
        what="the disk is full: the tracking store takes no more",
        got="no space left on the disk of the store",
        remedy=f"free some space; {_TRACKED_LATER}",
    ),
    "disk i/o error": _Refusal(
        what="the tracking store's disk is full, or reports a fault",
        got="an error of the disk",
        remedy=f"free some space, or check the disk; {_TRACKED_LATER}",
    ),
    "readonly database": _Refusal(
        what="the tracking store may not be written to",
        got="a store that is for reading alone",
        remedy=f"change the permissions of mlflow.db and of its folder; {_TRACKED_LATER}",
    ),
    "database is locked": _Refusal(
        what="the tracking store is held by another process",
        got="a store that is locked",
        remedy=f"wait until the other process is done, or stop it; {_TRACKED_LATER}",
    ),
    "out-of-date database schema": _Refusal(
        what="the tracking store was made by another version of MLflow",
        got="tables that this version does not have, or that it has more of",
        remedy="take the MLflow that made it; where this one is newer, copy mlflow.db and run mlflow db upgrade "
        f"sqlite:///mlflow.db; or move it away: {_TRACKED_LATER}",
    ),
}
"""What a database says where its disk or another process stands in the way: its own words, and ours."""


def refusal(error: BaseException) -> SysidError | None:
    """An error of the operating system in the house's words.

    Args:
        error: What was raised.

    Returns:
        The error to show, or ``None`` if it is none of the known refusals.

    Example:
        >>> print(refusal(OSError(errno.ENOSPC, "No space left on device", "runs/tank/results.json")))
        the disk is full
          where:    runs/tank/results.json
          got:      No space left on device
          remedy:   free some space; the same command goes on from what is stored
    """
    if isinstance(error, MemoryError):
        return UserError(
            "there is not enough memory",
            got=str(error) or None,
            remedy=f"use fewer starts or workers, a smaller structure, or another machine; {_AGAIN}",
        )
    if type(error).__module__.split(".")[0] in {*_TRACKING, "sqlite3"}:
        said = str(error).lower()
        if (known := next((known for words, known in _DATABASE.items() if words in said), None)) is not None:
            return UserError(known.what, where=_STORE, got=known.got, remedy=known.remedy)
        return UserError(
            "the tracking store cannot be used",
            where=_STORE,
            expected="a store that MLflow made",
            got=str(error).splitlines()[0] if str(error) else type(error).__name__,
            remedy="correct MLFLOW_TRACKING_URI, or move mlflow.db away: results are in runs/, and sysid run tracks "
            "them again",
        )
    if not isinstance(error, OSError) or error.errno not in _REFUSALS:
        return None
    known = _REFUSALS[error.errno]
    return UserError(known.what, where=error.filename, got=error.strerror, remedy=known.remedy)
