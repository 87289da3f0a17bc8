"""The store of tracked runs: made whole or not at all, written ahead, and nobody else's connections changed."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import create_engine, text

from sysid.errors import ConfigError
from sysid.workbench.tracking.sqlite_store import held

FULL, NORMAL = 2, 1
"""What ``PRAGMA synchronous`` says."""


def make(database: Path) -> None:
    with closing(sqlite3.connect(database)) as connection:
        connection.execute("CREATE TABLE runs (name TEXT)")
        connection.commit()


def journal(database: Path) -> str:
    with closing(sqlite3.connect(database)) as connection:
        return str(connection.execute("PRAGMA journal_mode").fetchone()[0])


def synchronous(database: Path) -> int:
    engine = create_engine(f"sqlite:///{database}")
    try:
        with engine.connect() as connection:
            return int(connection.execute(text("PRAGMA synchronous")).scalar_one())
    finally:
        engine.dispose()


@pytest.mark.parametrize("there_before", [False, True], ids=["new", "made by an older release"])
def test_a_store_is_written_ahead_and_commits_do_not_wait(tmp_path: Path, there_before: bool) -> None:
    database = tmp_path / "mlflow.db"
    if there_before:
        make(database)
        assert journal(database) == "delete"
    with held(database, make):
        assert database.is_file()
    assert journal(database) == "wal"
    assert synchronous(database) == NORMAL
    assert {file.name for file in tmp_path.iterdir()} <= {"mlflow.db", "mlflow.db.lock"}


def test_other_databases_of_the_process_are_left_alone(tmp_path: Path) -> None:
    other = tmp_path / "optuna.db"
    make(other)
    with held(tmp_path / "mlflow.db", make):
        pass
    assert (journal(other), synchronous(other)) == ("delete", FULL)


def test_a_store_in_use_stays_as_it_is(tmp_path: Path) -> None:
    database = tmp_path / "mlflow.db"
    make(database)
    with closing(sqlite3.connect(database)) as writer:
        writer.execute("BEGIN EXCLUSIVE")
        with held(database, make):
            pass
        writer.rollback()
    assert journal(database) == "delete"


def test_what_is_no_database_is_refused_at_once_and_left_as_it_is(tmp_path: Path) -> None:
    database = tmp_path / "mlflow.db"
    database.write_bytes(b"not a database at all" * 100)
    with pytest.raises(ConfigError, match="cannot be read") as error, held(database, make):
        pass
    assert "move it away" in str(error.value)
    assert database.read_bytes() == b"not a database at all" * 100


def test_what_cannot_be_opened_is_refused_at_once(tmp_path: Path) -> None:
    database = tmp_path / "mlflow.db"
    database.mkdir()
    with pytest.raises(ConfigError, match="cannot be opened") as error, held(database, make):
        pass
    assert error.value.got == "a folder"
