"""``sysid init``: a workspace to begin with."""

from __future__ import annotations

from pathlib import Path

from sysid.workbench.runner.console import console
from sysid.workbench.workspace import make_workspace


def init_command(folder: Path) -> None:
    """Make a workspace and say what to do next.

    Args:
        folder: Where.

    Raises:
        ConfigError: If one is there already, or the folder cannot be written to.
    """
    files = make_workspace(folder)
    target = console()
    target.print(f"Made {len(files)} files in {folder}. Next:", soft_wrap=True)
    target.print(f"  cd {folder}\n  sysid run tank\n  sysid ui", soft_wrap=True)
