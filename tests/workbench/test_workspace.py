"""A new workspace: made whole, gone on with after a kill, and never over what is there."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.workbench import workspace
from sysid.workbench.cli import run_cli
from sysid.workbench.workspace import make_workspace


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Records of a few samples."""
    tank = workspace.tank
    monkeypatch.setattr(workspace, "tank", lambda case: tank(case, 20))


@pytest.mark.parametrize("fall", [1, 3, 7])
def test_one_whose_making_was_stopped_is_gone_on_with(
    fall: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left, replace = [fall], Path.replace

    def stop(self: Path, target: Path) -> Path:
        left[0] -= 1
        if left[0] == 0:
            raise KeyboardInterrupt
        return replace(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", stop)
        with pytest.raises(KeyboardInterrupt):
            make_workspace(tmp_path / "ours")
    assert make_workspace(tmp_path / "ours") == [
        tmp_path / "ours" / file.relative_to(tmp_path / "whole") for file in make_workspace(tmp_path / "whole")
    ]
    files = [
        sorted((str(file.relative_to(folder)), file.read_bytes()) for file in folder.rglob("*") if file.is_file())
        for folder in (tmp_path / "ours", tmp_path / "whole")
    ]
    assert files[0] == files[1]


def test_nothing_that_is_there_is_written_over(tmp_path: Path) -> None:
    files = make_workspace(tmp_path)
    with pytest.raises(ConfigError, match="already"):
        make_workspace(tmp_path)
    files[0].write_text("mine")
    files[-1].unlink()
    with pytest.raises(ConfigError, match="already") as error:
        make_workspace(tmp_path)
    assert str(error.value.got) == str(files[0].relative_to(tmp_path))
    shutil.rmtree(tmp_path / "datasets")
    assert files[0].read_text() == "mine"


def test_what_comes_next_is_what_can_be_typed_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_cli(["init", "."]) == 0
    told = capsys.readouterr().out
    assert "files here. Next:" in told
    assert "cd ." not in told
    assert run_cli(["init", "other"]) == 0
    assert "cd other" in capsys.readouterr().out


def test_a_full_disk_is_named_and_the_same_call_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(source: object, target: object) -> None:
        raise OSError(28, "No space left on device", str(source), None, str(target))

    with monkeypatch.context() as patch:
        patch.setattr(shutil, "copyfile", full)
        assert run_cli(["init", str(tmp_path / "ours")]) == 2
    told = capsys.readouterr().err
    assert "the disk is full" in told
    assert "ours" in told
    assert "template" not in told
    assert run_cli(["init", str(tmp_path / "ours")]) == 0
