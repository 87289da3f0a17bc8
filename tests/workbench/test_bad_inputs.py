"""Every bad input of the catalogue is named, costs no work that was done before, and shows no trace unasked."""

from __future__ import annotations

import hashlib
import shlex
import shutil
from pathlib import Path

import pytest

from sysid.workbench.cli import run_cli
from tests.workbench.bad_inputs import CATALOGUE, Bad

REWRITTEN = {"log.txt", "holder.json", "pipeline.yaml", "environment.json", "times.json"}
"""What every run writes anew: what was asked for last, by whom, and how long it took."""


def contents(folder: Path) -> dict[str, str]:
    """SHA-256 of each file that a person would miss."""
    return {
        file.relative_to(folder).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file() and file.name not in REWRITTEN
    }


def prepare(bad: Bad, workspace: Path) -> None:
    """Put the bad input into the workspace."""
    for name, text in bad.files.items():
        path = workspace / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text.encode() if isinstance(text, str) else text)
    for name, (old, new) in bad.edits.items():
        text = (workspace / name).read_text(encoding="utf-8")
        assert old in text, "the row changes nothing"
        (workspace / name).write_text(text.replace(old, new), encoding="utf-8")


def test_the_catalogue_is_long_and_its_rows_differ() -> None:
    assert len(CATALOGUE) >= 60
    assert len({bad.id for bad in CATALOGUE}) == len(CATALOGUE)


@pytest.mark.parametrize("bad", CATALOGUE, ids=lambda bad: bad.id)
def test_it_is_named_and_costs_nothing(
    bad: Bad, done: Path, empty_store: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if bad.tracked:
        shutil.copyfile(empty_store, done / "mlflow.db")
    prepare(bad, done)
    before = contents(done)
    arguments = shlex.split(bad.command)
    assert run_cli(arguments) == bad.code
    told = capsys.readouterr().err
    assert told.startswith("error: ")
    assert "  remedy:   " in told
    assert [words for words in bad.says if words not in told] == [], told
    assert "Traceback" not in told
    after = contents(done)
    assert {name: after.get(name) for name in before} == before
    # Nothing half-made is left behind either.
    assert [name for name in after if name not in before and "runs/" not in name and "mlflow" not in name] == []


@pytest.mark.parametrize("bad", CATALOGUE[::10], ids=lambda bad: bad.id)
def test_debug_shows_the_whole_trace(bad: Bad, done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    prepare(bad, done)
    assert run_cli([*shlex.split(bad.command), "--debug"]) == bad.code
    told = capsys.readouterr().err
    assert told.startswith("Traceback (most recent call last)")
    assert [words for words in bad.says if words not in told] == []
