"""Where content lies."""

from __future__ import annotations

from pathlib import Path

import pytest

import sysid
from sysid.content import content_folders, nearest_file, nearest_name


def test_the_workspace_comes_first_then_the_checkout_then_the_wheel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "site" / "sysid"
    for folder in (package / "content" / "datasets", package.parent / "datasets", tmp_path / "work" / "datasets"):
        folder.mkdir(parents=True)
    monkeypatch.setattr(sysid, "__file__", str(package / "__init__.py"))
    assert content_folders("datasets", workspace=tmp_path / "work") == (
        tmp_path / "work" / "datasets",
        package.parent / "datasets",
        package / "content" / "datasets",
    )
    monkeypatch.chdir(package.parent)
    assert content_folders("datasets") == (package.parent / "datasets", package / "content" / "datasets")
    assert content_folders("pipelines") == ()


def test_a_name_of_ones_own_goes_before_a_nearer_one_that_is_built_in() -> None:
    assert nearest_name("tanks", [["tank"], ["tanks-2"]]) == "tank"
    assert nearest_name("tanks", [["pump"], ["tanks-2"]]) == "tanks-2"
    assert nearest_name("tanks", [["pump"], []]) is None


@pytest.mark.parametrize(
    ("asked", "meant"),
    [("nofile.csv", None), ("rn-1.csv", "run-1.csv"), ("run-1.cvs", "run-1.csv"), ("run-1.mat", "run-1.csv")],
)
def test_the_nearest_file_is_near_without_its_ending(tmp_path: Path, asked: str, meant: str | None) -> None:
    for name in ("o3.csv", "run-1.csv", "run-1.txt", "nofile.docx"):
        (tmp_path / name).write_text("x")
    assert nearest_file(tmp_path / asked, {".csv", ".mat"}) == (None if meant is None else tmp_path / meant)


def test_no_file_is_near_in_a_folder_that_is_not_there(tmp_path: Path) -> None:
    assert nearest_file(tmp_path / "none" / "a.csv", {".csv"}) is None
