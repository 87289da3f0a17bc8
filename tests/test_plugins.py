"""What installed packages bring: looked for once, found by name, and refused in words."""

from __future__ import annotations

import importlib.metadata

import pytest

from sysid import plugins
from sysid.errors import ConfigError


def test_installed_packages_are_gone_through_once_for_a_group(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = importlib.metadata.EntryPoint(name="here", value="math:pi", group="sysid.things")
    asked = []

    def installed(*, group: str) -> importlib.metadata.EntryPoints:
        asked.append(group)
        return importlib.metadata.EntryPoints([entry]).select(group=group)

    monkeypatch.setattr(importlib.metadata, "entry_points", installed)
    assert plugins.find_plugin("sysid.things", "here", what="thing", where="x") == pytest.approx(3.14159265)
    assert plugins.find_entry("sysid.things", "here", what="thing", where="x") == entry
    with pytest.raises(ConfigError, match=r"(?s)no thing named her is installed.*one of here.*did you mean here"):
        plugins.find_entry("sysid.things", "her", what="thing", where="x")
    with pytest.raises(ConfigError, match="there is none at all"):
        plugins.find_entry("sysid.others", "here", what="other", where="x")
    assert asked == ["sysid.things", "sysid.others"]
