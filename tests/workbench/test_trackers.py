"""Trackers of other packages: a folder and an entry point; what fails in them costs no run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sysid.workbench import trackers
from sysid.workbench.cli import run_cli
from sysid.workbench.runner.events import Event, FitReady, RunStarted

pytestmark = pytest.mark.usefixtures("quick_report")


class Notebook:
    """A tracker that keeps the names of fits in a file."""

    compare = "cat fits.txt"

    def __init__(self, workspace: Path, _: Callable[[str], None]) -> None:
        self.file = workspace / "fits.txt"

    def __call__(self, event: Event) -> None:
        if isinstance(event, FitReady):
            with self.file.open("a", encoding="utf-8") as file:
                file.write(f"{event.config.name}\n")


class Broken(Notebook):
    def __call__(self, event: Event) -> None:
        if isinstance(event, RunStarted):
            raise OSError("the notebook is wet")


class Entry:
    def __init__(self, name: str, made: Any) -> None:
        self.name, self.made = name, made

    def load(self) -> Any:
        if isinstance(self.made, Exception):
            raise self.made
        return self.made


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> Callable[[str, Any], None]:
    def install(name: str, made: Any) -> None:
        monkeypatch.setattr(trackers, "has", lambda _: False)
        monkeypatch.setattr(trackers, "entry_points", lambda _: [Entry(name, made)])

    return install


def test_it_hears_of_every_fit(
    workspace: Path, installed: Callable[[str, Any], None], capsys: pytest.CaptureFixture[str]
) -> None:
    installed("notebook", Notebook)
    assert run_cli(["run", "first"]) == 0
    assert (workspace / "fits.txt").read_text(encoding="utf-8").split("\n")[:-1] == ["ARX", "open loop", "closed loop"]
    told = capsys.readouterr().out
    assert "Compare: cat fits.txt" in told
    assert "MLflow, which is not installed" in told


def test_what_fails_in_it_is_told_and_costs_no_run(
    workspace: Path, installed: Callable[[str, Any], None], capsys: pytest.CaptureFixture[str]
) -> None:
    installed("notebook", Broken)
    assert run_cli(["run", "first"]) == 1
    told = capsys.readouterr().out
    assert "not tracked in notebook (RunStarted: OSError: the notebook is wet)" in told.replace("\n", " ")
    assert "not all of it is tracked in notebook" in told.replace("\n", " ")
    assert (workspace / "runs" / "first" / "results.json").is_file()


def test_one_that_cannot_be_loaded_is_told(
    workspace: Path, installed: Callable[[str, Any], None], capsys: pytest.CaptureFixture[str]
) -> None:
    installed("notebook", ImportError("no paper"))
    assert run_cli(["run", "first"]) == 0
    assert "the tracker notebook cannot be used (ImportError: no paper)" in capsys.readouterr().out.replace("\n", " ")


def test_an_untracked_run_asks_none(workspace: Path, installed: Callable[[str, Any], None]) -> None:
    installed("notebook", Notebook)
    assert run_cli(["run", "first", "--no-tracking"]) == 0
    assert not (workspace / "fits.txt").exists()
