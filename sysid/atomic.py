"""Files and folders that are there whole or not at all."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LEFT_S = 3600.0
"""Seconds after which a draft counts as left by a process that was killed."""
_DRAFT = re.compile(r"\.(?P<of>.*)\.[a-z0-9_]{8}(?P<ending>\.[^.]*)?", re.DOTALL)
"""Names of drafts: those of :mod:`tempfile`."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside ``path`` that takes its place when the block ends without an error.

    Whoever reads ``path`` meanwhile, and whatever happens inside the block, sees the old file or the
    new one, never half of it. The folder is made if it is not there.

    Args:
        path: The file to write.

    Yields:
        The path to write to, with the same ending.

    Example:
        >>> folder = Path(tempfile.mkdtemp())
        >>> with replacing(folder / "a.txt") as draft:
        ...     written = draft.write_text("whole")
        >>> [file.name for file in folder.iterdir()]
        ['a.txt']
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = _draft(path)
    try:
        yield draft
    except OSError as error:
        _name(error, draft, path)
        raise
    else:
        # mkstemp keeps others out; the finished file has the permissions that any other would have.
        mask = os.umask(0)
        os.umask(mask)
        draft.chmod(0o666 & ~mask)
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file so that readers see the old one or the new one, never a part.

    Args:
        path: The file; its folder is made if it is not there.
        data: Its contents.
    """
    with replacing(path) as draft:
        draft.write_bytes(data)


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """A new folder that takes the place of ``path``, with all that is in it, when the block ends without an error.

    What killed processes have left of earlier drafts goes with it.

    Args:
        path: The folder to fill; one that is there is put back where the new one cannot take its place.

    Yields:
        An empty folder.

    Raises:
        OSError: What the system refuses, with the name of ``path`` for that of the draft, which nobody knows.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    workplace = str(path.parent)
    try:
        with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as workplace:
            draft, old = Path(workplace) / "new", Path(workplace) / "old"
            draft.mkdir()
            yield draft
            if path.exists():
                path.rename(old)
            try:
                draft.rename(path)
            except OSError:
                if old.exists():
                    old.rename(path)
                raise
            shutil.rmtree(old, ignore_errors=True)
    except OSError as error:
        _name(error, Path(workplace), path)
        raise
    for left in path.parent.glob(".*"):
        if left.is_dir() and _is_left(left, of=path.name):
            shutil.rmtree(left, ignore_errors=True)


def clear_drafts(folder: Path) -> None:
    """Remove the drafts of files that killed processes have left somewhere in a folder.

    Args:
        folder: The folder, which nobody else writes to.
    """
    for file in folder.rglob(".*.*"):
        if _is_left(file) and file.is_file():
            file.unlink(missing_ok=True)


def _is_left(draft: Path, of: str | None = None) -> bool:
    """Whether this is a draft, old enough that nobody is at it any more."""
    named = _DRAFT.fullmatch(draft.name)
    if named is None or (of is not None and (named["of"] != of or named["ending"])):
        return False
    try:
        return time.time() - draft.stat().st_mtime > LEFT_S
    except OSError:  # gone meanwhile
        return False


def _name(error: OSError, draft: Path, path: Path) -> None:
    """Have an error name what was to be written: it names nothing, or the draft, which nobody knows."""
    named = [Path(str(name)) for name in (error.filename, error.filename2) if name is not None]
    if not named or any(one.is_relative_to(draft) for one in named):
        error.filename = str(path)
        del error.filename2  # a None would be told as a name


def _draft(path: Path) -> Path:
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}.", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        error.filename = str(path)
        raise
    os.close(handle)
    return Path(name)
