"""A run is named by its folder, or by its name alone, at every door that takes one."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.workbench.cli import run_cli


def test_a_run_is_found_by_its_name_at_every_door(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["report", "first"]) == 0
    assert run_cli(["report", "first", "--against", "first"]) == 0
    assert run_cli(["publish", "first", "--into", "pages"]) == 0
    assert (done / "pages" / "first" / "README.md").is_file()
    (done / "u.csv").write_text("time [s],inlet [1],valve [1]\n0,0,0\n1,1,1\n")
    assert run_cli(["simulate", "first", "u.csv"]) == 2  # found: the file is of another sample time
    assert "there is no model.json" not in capsys.readouterr().err


@pytest.mark.usefixtures("done")
def test_the_bundle_of_a_run_is_written_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["export", "runs/first", "--formats", "c", "--out", str(tmp_path / "again")]) == 0
    assert list((tmp_path / "again").glob("*.c"))
    assert run_cli(["export", "nosuch"]) == 2
    assert "--fit" not in capsys.readouterr().err
