"""The results of an assembly of two tanks, as a run stores them, with everything that a run can have."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.reporting.assembly.results import AssemblyResults

LOOK = {"within": 0.5, "median": 0.2, "p99": 0.9}


def document() -> dict[str, Any]:
    """The contents of results.json."""
    found: dict[str, Any] = json.loads(Path(__file__).with_name("tanks.json").read_text(encoding="utf-8"))
    return found


@pytest.fixture
def results() -> AssemblyResults:
    """As it is read."""
    return AssemblyResults.model_validate(document())


def write_run(folder: Path, stored: dict[str, Any]) -> Path:
    """A run folder with the signals that belong to it."""
    folder.mkdir(parents=True)
    (folder / "results.json").write_text(json.dumps(stored), encoding="utf-8")
    time = np.arange(300.0)
    for file, names in (("signals.npz", ("A", "V")), ("monte-carlo.npz", ("R7",))):
        parts = {"time": time, "target": np.sin(time / 20), "simulated": np.sin(time / 20 + 0.1)}
        arrays = {f"lower/{name}/{part}": values for name in names for part, values in parts.items()}
        np.savez(folder / file, **arrays)
    return folder


@pytest.fixture
def run_folder(tmp_path: Path) -> Path:
    """A finished run."""
    return write_run(tmp_path / "runs" / "tanks", document())
