"""SQLite as the store of tracked runs: made by one process at a time, and written without waiting for the disk."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from filelock import FileLock

from sysid.atomic import replacing
from sysid.errors import ConfigError

SQLITE = "sqlite:///"
"""How the address of such a store begins."""


@contextmanager
def held(database: Path, make: Callable[[Path], None]) -> Iterator[None]:
    """Have a store that no other process touches meanwhile.

    Processes that touch a new store at the same moment break each other's migrations (measured: 7 of 8 failed), and so
    does one that is killed among them: it is made under another name, by one, and renamed.

    Args:
        database: Its file.
        make: Makes a new one at a path.

    Yields:
        Nothing; the store is there.

    Raises:
        ConfigError: If its file is no database, or cannot be opened: MLflow would try for 102 s before it says so.
    """
    with FileLock(database.with_name(f"{database.name}.lock")):
        if not database.exists():
            with replacing(database) as draft:
                make(draft)
                _on_disk(draft)
        _write_ahead(database)
        _do_not_wait()
        yield


def _on_disk(file: Path) -> None:
    """Wait once, before it is renamed, until a file is on the disk."""
    with file.open("rb+") as written:
        os.fsync(written.fileno())


@contextmanager
def unhurried_disk() -> Iterator[None]:
    """Have no new connection wait for the disk: for a draft, which is begun anew if it is cut off.

    MLflow makes its tables in some sixty migrations, each of which otherwise waits for the disk several times.

    Yields:
        Nothing.
    """
    from sqlalchemy import event
    from sqlalchemy.engine import Engine

    event.listen(Engine, "connect", _unsafe)
    try:
        yield
    finally:
        event.remove(Engine, "connect", _unsafe)


def _unsafe(connection: Any, _: object) -> None:
    """Called with every new connection of every engine while a draft is made; other databases are left alone."""
    if isinstance(connection, sqlite3.Connection):
        connection.execute("PRAGMA synchronous=OFF")
        connection.execute("PRAGMA journal_mode=MEMORY")


def _write_ahead(database: Path) -> None:
    """Write what is new into a log beside the store, which stays so for whoever opens it after us.

    With the journal that is SQLite's default each commit waits for the disk several times, and a trial of a sweep takes
    six commits.
    """
    try:
        with closing(sqlite3.connect(database, timeout=0.0)) as connection:
            connection.execute("PRAGMA journal_mode=WAL")
    except sqlite3.OperationalError as error:
        if "unable to open" in str(error):
            raise ConfigError(
                "the store of tracked runs cannot be opened",
                where=str(database),
                expected="a file, in a folder that may be written to",
                got="a folder" if database.is_dir() else str(error),
                remedy="change the permissions of the file and of its folder, or move away what lies there",
            ) from error
        # In use or read-only: it stays as it is, and what opens it next says what is wrong.
        return
    except sqlite3.DatabaseError as error:
        raise ConfigError(
            "the store of tracked runs cannot be read",
            where=str(database),
            expected="an SQLite database that MLflow has made",
            got=str(error),
            remedy="move it away: the next run makes a new one, and tracks again what its folder holds",
        ) from error


def _do_not_wait() -> None:
    """Let this process's commits into write-ahead logs reach the disk when the system sees fit.

    A power cut can then cost what was tracked last, which the next run of the same command tracks again, but never the
    store: https://www.sqlite.org/pragma.html#pragma_synchronous.
    """
    from sqlalchemy import event
    from sqlalchemy.engine import Engine

    if not event.contains(Engine, "connect", _relax):
        event.listen(Engine, "connect", _relax)


def _relax(connection: Any, _: object) -> None:
    """Called with every new connection of every engine; others than SQLite's with such a log are left alone."""
    if isinstance(connection, sqlite3.Connection):
        (mode,) = connection.execute("PRAGMA journal_mode").fetchone()
        if mode == "wal":
            connection.execute("PRAGMA synchronous=NORMAL")
