"""The Python that other tools run in, apart from ours."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path


def python_with(name: str, pinned: Sequence[str]) -> Path:
    """The interpreter of an environment with some packages, made if it is not there."""
    folder = Path.home() / ".cache" / "sysid" / (f"{name}-" + "-".join(p.replace("==", "-") for p in pinned))
    python = folder / "bin" / "python"
    if not (folder / "complete").exists():
        print(f"making {folder} with {', '.join(pinned)}", flush=True)
        subprocess.run([sys.executable, "-m", "venv", "--clear", str(folder)], check=True)
        subprocess.run([str(python), "-m", "pip", "install", "-q", *pinned], check=True)
        (folder / "complete").touch()
    return python
