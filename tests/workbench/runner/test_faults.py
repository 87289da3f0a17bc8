"""What the operating system and a database refuse, in words."""

from __future__ import annotations

import errno
import os
import sqlite3

import pytest
from mlflow.exceptions import MlflowException
from sqlalchemy.exc import OperationalError

from sysid.workbench.runner.faults import refusal

SAID = {
    "database or disk is full": ("the disk is full", "free some space"),
    "disk I/O error": ("full, or reports a fault", "free some space"),
    "attempt to write a readonly database": ("may not be written to", "permissions"),
    "database is locked": ("held by another process", "wait"),
    "Detected out-of-date database schema (found version a, but expected b)": ("another version", "mlflow db upgrade"),
}
STATEMENT = "UPDATE runs SET status=? WHERE runs.run_uuid = ?"


@pytest.mark.parametrize("said", SAID)
def test_a_database_that_cannot_write_says_so_without_its_own_text(said: str) -> None:
    what, remedy = SAID[said]
    raw = sqlite3.OperationalError(said)
    for error in (raw, OperationalError(STATEMENT, {}, raw), MlflowException(f"(sqlite3.OperationalError) {said}")):
        known = refusal(error)
        assert known is not None
        assert what in known.what
        assert remedy in str(known.remedy)
        assert "sqlite3" not in str(known)
        assert STATEMENT not in str(known)


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EACCES, errno.EROFS, errno.EMFILE])
def test_what_the_system_refuses_has_a_remedy(number: int) -> None:
    known = refusal(OSError(number, os.strerror(number), "runs/a.json"))
    assert known is not None
    assert known.where == "runs/a.json"
    assert known.remedy


def test_a_fault_of_ours_stays_one() -> None:
    assert refusal(KeyError("a")) is None
