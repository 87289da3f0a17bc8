"""A workspace that was moved, renamed or copied: its store names files where they were, and is told where they are.

MLflow writes whole paths into its store. In a workspace that has moved it finds no picture and no model of before, and
puts what is new into the folder that is gone, which it makes again; in a copy, into the folder of the original.
"""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path
from urllib.parse import unquote, urlsplit

ARTIFACTS = "mlartifacts"
"""Folder beside the store for the files of its runs."""

PATHS = (
    ("experiments", "artifact_location"),
    ("runs", "artifact_uri"),
    ("logged_models", "artifact_location"),
    ("model_versions", "source"),
    ("model_versions", "storage_location"),
)
"""Columns in which MLflow keeps places of files; a store of another version may lack some."""


def follow(database: Path) -> None:
    """Have a store name the files beside it, where they have come along with it.

    Places elsewhere that somebody chose are left alone: only those under a folder ``mlartifacts`` are changed of which
    at least one experiment's files lie beside the store.

    Args:
        database: The store's file.
    """
    here = database.parent.resolve() / ARTIFACTS
    with closing(sqlite3.connect(database)) as connection:
        columns = [pair for pair in PATHS if pair[1] in _columns(connection, pair[0])]
        if PATHS[0] not in columns:
            return
        places = [place for (place,) in connection.execute("SELECT artifact_location FROM experiments") if place]
        for there in sorted({folder.parent for place in places if (folder := _moved(place, here)) is not None}):
            for old, new in ((there.as_uri(), here.as_uri()), (there.as_posix(), here.as_posix())):
                for table, column in columns:
                    connection.execute(
                        f"UPDATE {table} SET {column} = ? || substr({column}, ?) "  # noqa: S608 - our own names
                        f"WHERE substr({column}, 1, ?) = ?",
                        (new, len(old) + 1, len(old) + 1, f"{old}/"),
                    )
        connection.commit()


def _columns(connection: sqlite3.Connection, table: str) -> set[str]:
    return {str(row[1]) for row in connection.execute(f"PRAGMA table_info({table})")}


def _moved(place: str, here: Path) -> Path | None:
    """The folder that a store has for an experiment, where its files lie under the same name beside the store."""
    parts = urlsplit(place)
    if parts.scheme not in {"", "file"}:
        return None
    folder = Path(unquote(parts.path) if parts.scheme else place)
    known = folder.is_absolute() and folder.parent.name == ARTIFACTS and folder.parent != here
    if not known or not (here / folder.name).is_dir():
        return None
    try:  # by another name, as through a link, it is the same place
        same = folder.parent.samefile(here)
    except OSError:
        same = False
    return None if same else folder
