"""``sysid schema``: what editors need to complete and check the YAML."""

from __future__ import annotations

from pathlib import Path

from sysid.workbench.runner.console import console
from sysid.workbench.schemas import write_schemas


def schema_command(folder: Path) -> None:
    """Write the schemas of data sets and pipelines into a workspace, in place of older ones.

    Args:
        folder: The workspace.
    """
    for file in write_schemas(folder):
        console().print(f"Wrote {file}", soft_wrap=True)
