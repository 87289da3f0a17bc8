"""Kinds of pipelines."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import BaseModel

from sysid.errors import ConfigError
from sysid.workbench.kinds import KINDS, kind_of, kinds


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_has_a_strict_configuration_and_a_program(name: str) -> None:
    config = KINDS[name].load_config()
    assert issubclass(config, BaseModel)
    assert config.model_config["extra"] == "forbid"
    assert callable(KINDS[name].load_program())


@pytest.mark.parametrize(("text", "kind"), [("name: a", "fits"), ("kind: fits\nname: a", "fits")])
def test_a_pipeline_without_a_kind_fits(tmp_path: Path, text: str, kind: str) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(text, encoding="utf-8")
    assert kind_of(file) == kind


def test_a_misspelt_kind_is_named(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("kind: fit\nname: a", encoding="utf-8")
    with pytest.raises(ConfigError, match="did you mean fits"):
        kind_of(file)


def test_a_pipeline_that_extends_another_says_its_kind(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("name: a\nextends: b.yaml", encoding="utf-8")
    with pytest.raises(ConfigError, match="add kind: assembly") as caught:
        kind_of(file)
    assert caught.value.where == f"{file}, line 2, field extends"


@pytest.mark.parametrize("name", sorted(set(kinds()) - set(KINDS)))
def test_a_kind_that_a_package_brings_is_as_strict(name: str) -> None:
    config = kinds()[name].load_config()
    assert config.model_config["extra"] == "forbid"
    assert callable(kinds()[name].load_program())


def test_the_kinds_of_the_packages_that_are_installed_are_known() -> None:
    assert {"consequence", "drive-cycles"} <= set(kinds())
