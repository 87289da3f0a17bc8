"""A dry run of every pipeline that comes with the package, on a machine that has made no traces yet."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.workbench.cli import run_cli
from sysid.workbench.kinds import RunRequest, kind_of, kinds
from sysid.workbench.listeners import foresee
from tests.workbench.test_bad_inputs import contents

PIPELINES = sorted((Path(__file__).resolve().parents[2] / "pipelines").glob("*.yaml"))


@pytest.fixture
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder without runs, and no kept traces."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    return tmp_path


@pytest.mark.parametrize("file", PIPELINES, ids=lambda file: file.stem)
def test_every_pipeline_says_what_it_would_do(file: Path, empty: Path) -> None:
    request = RunRequest(path=file, typed=file.stem)
    planned = foresee(kinds()[kind_of(file)].load_program()(request), request)
    assert contents(empty) == {}
    assert planned
    assert len({step.name for step in planned}) == len(planned)
    assert not any(step.stored for step in planned)
    # A time, or that none is known: nothing in between.
    assert all(step.basis and (step.seconds is None or step.seconds >= 0.0) for step in planned)
    loading = [step for step in planned if step.step.startswith("Loading")]
    assert all(step.seconds is None for step in loading if "to be made by" in step.basis)


def test_it_is_shown(empty: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["run", "consequence", "--dry-run"]) == 0
    told = capsys.readouterr().out
    assert "sysid run valves" in told
    assert "Nothing was run." in told
