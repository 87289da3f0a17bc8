"""Digests that are kept: as long as no file of the package changes, and never where they would not hold."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from sysid.kept_digests import kept_or_taken, state_of

FIRST, SECOND = "1" * 64, "2" * 64


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package, of which bytecode is kept, whatever the environment says."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    monkeypatch.setattr(sys, "pycache_prefix", None)
    folder = tmp_path / "plant"
    (folder / "inner").mkdir(parents=True)
    for name in ("__init__.py", "run.py", "inner/__init__.py", "inner/valve.py"):
        (folder / name).write_text("level = 1\n", encoding="utf-8")
    (folder / "templates").mkdir()
    return folder


def kept(home: Path) -> Path:
    (file,) = (home / "__pycache__").glob("*.json")
    return file


def test_a_digest_is_taken_once(home: Path) -> None:
    assert kept_or_taken(home, "run", lambda: FIRST) == FIRST
    assert kept_or_taken(home, "run", lambda: SECOND) == FIRST
    assert kept_or_taken(home, "other", lambda: SECOND) == SECOND
    assert kept_or_taken(home, "run", lambda: SECOND) == FIRST


def written(home: Path) -> None:
    file = home / "inner" / "valve.py"
    before = file.stat()
    file.write_text("level = 2\n", encoding="utf-8")  # of the same length
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns + 1))


def replaced(home: Path) -> None:
    """As an installer does that gives files the time that they had where they were packed."""
    old, new = home / "run.py", home / "new"
    new.write_text("level = 2\n", encoding="utf-8")
    os.utime(new, ns=(old.stat().st_atime_ns, old.stat().st_mtime_ns))
    new.replace(old)


@pytest.mark.parametrize(
    "change",
    [
        written,
        replaced,
        lambda home: (home / "inner" / "more.py").touch(),
        lambda home: (home / "run.py").unlink(),
        lambda home: (home / "run.py").rename(home / "walk.py"),
        lambda home: kept(home).write_text('{"state": "', encoding="utf-8"),
        lambda home: kept(home).write_text("[]", encoding="utf-8"),
        lambda home: kept(home).write_text(kept(home).read_text().replace(FIRST, "no digest"), encoding="utf-8"),
        lambda home: kept(home).write_text(kept(home).read_text().replace(FIRST[:2], "\\n1"), encoding="utf-8"),
    ],
    ids=["written", "replaced", "added", "removed", "renamed", "cut off", "a list", "no digest", "no hexadecimals"],
)
def test_it_is_taken_anew_where_it_may_not_hold(home: Path, change: Callable[[Path], None]) -> None:
    kept_or_taken(home, "run", lambda: FIRST)
    change(home)
    assert kept_or_taken(home, "run", lambda: SECOND) == SECOND
    assert kept_or_taken(home, "run", lambda: FIRST) == SECOND


def test_what_is_no_code_does_not_count(home: Path) -> None:
    before = state_of(home)
    (home / "templates" / "page.html").touch()
    (home / "__pycache__").mkdir()
    (home / "__pycache__" / "run.py").touch()
    assert state_of(home) == before


def test_nothing_is_written_where_no_bytecode_is(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    assert kept_or_taken(home, "run", lambda: FIRST) == FIRST
    assert not (home / "__pycache__").exists()


def test_nothing_is_kept_of_code_that_is_written_meanwhile(home: Path) -> None:
    def take() -> str:
        written(home)
        return FIRST

    assert kept_or_taken(home, "run", take) == FIRST
    assert kept_or_taken(home, "run", lambda: SECOND) == SECOND


def test_a_folder_that_cannot_be_written_costs_nothing_but_time(home: Path) -> None:
    (home / "__pycache__").write_text("a file in its place", encoding="utf-8")
    assert kept_or_taken(home, "run", lambda: FIRST) == FIRST
    assert kept_or_taken(home, "run", lambda: SECOND) == SECOND
