"""Small files with known dirt, and a data set around each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.traces import Channel, Trace


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str, str | bytes], Path]:
    """Write a file and return its path."""

    def _write(name: str, content: str | bytes) -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return _write


class RampGenerator:
    """A generator for tests: a ramp of ``slope``, scaled by the option ``gain``; it counts its calls."""

    def __init__(self) -> None:
        self.calls: list[str] = []

    def __call__(
        self,
        *,
        case: str,
        recipe: Mapping[str, Any],
        options: Mapping[str, Any],
        channels: tuple[Channel, ...],
        sample_time: float,
    ) -> Trace:
        self.calls.append(case)
        slope = recipe["slope"] * options.get("gain", 1.0)
        values = np.outer(np.arange(50) * sample_time, slope * np.arange(1, len(channels) + 1)) / 3.0
        return Trace(name=case, sample_time=sample_time, channels=channels, values=values, provenance=("a ramp",))


@pytest.fixture
def ramp(monkeypatch: pytest.MonkeyPatch) -> RampGenerator:
    """The only generator that is installed is called ``ramp``."""
    generator = RampGenerator()

    class Entry:
        name = "ramp"
        dist = None

        def load(self) -> RampGenerator:
            return generator

    monkeypatch.setattr("sysid.plugins.entry_points", lambda _: [Entry()])
    return generator


@pytest.fixture
def ramp_dataset(tmp_path: Path) -> Path:
    """A data set that the generator ``ramp`` makes."""
    path = tmp_path / "datasets" / "ramps" / "dataset.yaml"
    path.parent.mkdir(parents=True)
    path.write_text(
        """
name: ramps
sample_time: 0.1
channels:
  - {name: u, unit: V, decimals: 2}
  - {name: y, unit: kPa, reference: gauge}
source:
  generator: ramp
  options: {gain: 2.0}
cases:
  EST: {role: estimation, recipe: {slope: 1.0}}
  VAL: {role: validation, recipe: {slope: 3.0}}
provenance: made for a test
inferred: [the slope]
"""
    )
    return path
