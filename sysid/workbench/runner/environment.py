"""The machine and the packages that a result was made with."""

from __future__ import annotations

import os
import platform
import subprocess
from copy import deepcopy
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import sysid

PACKAGES = ("numpy", "scipy", "numba", "torch", "onnx", "onnxruntime", "mlflow", "optuna", "pandas", "control")
"""Packages whose version can change a number or a file."""


def environment() -> dict[str, Any]:
    """Versions, processor and commit as JSON values.

    They are looked up once in a process: what runs is what was imported then, whatever is installed or committed
    meanwhile.

    Returns:
        ``sysid``, ``python``, ``packages``, ``cpu``, ``cores``, ``platform`` and ``commit`` (``None`` outside a
        checkout).

    Example:
        >>> environment()["sysid"] == sysid.__version__
        True
    """
    return deepcopy(_environment())


@cache
def _environment() -> dict[str, Any]:
    return {
        "sysid": sysid.__version__,
        "python": platform.python_version(),
        "packages": {name: version for name in PACKAGES if (version := _version(name))},
        "cpu": _cpu(),
        "cores": os.cpu_count(),
        "platform": platform.platform(),
        "commit": _commit(),
    }


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def _cpu() -> str:
    """Model of the processor; platform.processor() is empty on most Linux machines."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _commit() -> str | None:
    """The commit of the checkout this code runs from, with ``+`` where files differ from it."""
    checkout = Path(sysid.__file__).resolve().parent.parent
    if not (checkout / ".git").exists():
        return None
    try:
        commit = _git(checkout, "rev-parse", "HEAD")
        return commit + ("+" if _git(checkout, "status", "--porcelain", "--untracked-files=no") else "")
    except (OSError, subprocess.SubprocessError):
        # No git on this machine: the result is still good, only less well labelled.
        return None


def _git(checkout: Path, *arguments: str) -> str:
    command = ["git", "-C", str(checkout), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10)  # noqa: S603 - fixed words
    return done.stdout.strip()
