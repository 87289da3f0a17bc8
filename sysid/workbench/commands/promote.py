"""``sysid promote``: the candidate, or another version, becomes the champion."""

from __future__ import annotations

from pathlib import Path

from sysid.workbench.runner.console import console
from sysid.workbench.tracking.mlflow_store import connect, store_uri
from sysid.workbench.tracking.registry import promote


def promote_command(name: str, *, version: str | None) -> None:
    """Promote a version and say how to load it."""
    done = promote(connect(store_uri(Path.cwd())), name, version)
    target = console()
    before = "" if done.before in {None, done.version} else f", in place of version {done.before}"
    target.print(f"{done.name}: version {done.version} ({done.fit}) is the champion{before}.", soft_wrap=True)
    target.print(f'Load it with mlflow.pyfunc.load_model("{done.uri}").', soft_wrap=True)
