"""Where content lies."""

from __future__ import annotations

from pathlib import Path

import pytest

import sysid
from sysid.content import content_folders


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
