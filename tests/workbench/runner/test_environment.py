"""The machine and the packages that a result was made with."""

from __future__ import annotations

import pytest

from sysid.workbench.runner import environment as room
from sysid.workbench.runner.environment import environment


def test_the_machine_is_looked_at_once_and_every_run_may_keep_what_was_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """To ask git and each package anew took a run of a small pipeline longer than its fits."""

    def asked_again(*_: object) -> None:
        raise AssertionError

    first = environment()
    assert first["packages"]["numpy"]
    first["packages"]["numpy"] = "written over"
    for name in ("_commit", "_version", "_cpu"):
        monkeypatch.setattr(room, name, asked_again)
    assert environment()["packages"]["numpy"] != "written over"
