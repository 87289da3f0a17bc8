"""Two tanks that feed each other, as a data set of CSV files and an assembly over it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sysid.reporting.assembly.results import AssemblyResults
from sysid.reporting.kinds import read_run

ROLES = {"A": "estimation", "B": "estimation", "S": "selection", "V": "validation"}

PIPELINE = """\
kind: assembly
name: tanks
data: tanks
training: tanks
outputs: [upper, lower]
seed: 3
stability: {count: 60, choose: false}
limits:
  lower: {low: 0}
definitions:
  short: &short {loop: closed, pretraining: 400, pretraining_iterations: 30, max_iterations: 10, workers: 1}
members:
  - mapping: pump+lower -> upper
    structure: {kind: NARX, input_delays: [[0, 1], [1]], output_delays: 1, neurons: 3}
    rest: 0
    candidates: 2
    training: *short
  - mapping: upper -> lower
    structure: {kind: NARX, input_delays: [0], output_delays: 1, neurons: 3}
    rest: 0
    training: *short
retrain: {members: [lower], max_iterations: 5}
together:
  targets: {upper: 0.1, lower: 0.1}
  training: {max_iterations: 4, stride: 2, checkpoints: 2}
monte_carlo: {data: tanks, output: lower, within: 0.5}
published:
  lower: {source: Table 1, target: 0.5, mse: {V: 0.4}}
export: null
"""


def levels(pump: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The upper tank drains into the lower one, and the less the fuller that is."""
    upper, lower = np.zeros(len(pump)), np.zeros(len(pump))
    for t in range(1, len(pump)):
        down = 0.15 * np.sqrt(max(upper[t - 1] - 0.3 * lower[t - 1], 0.0))
        upper[t] = upper[t - 1] + 0.1 * pump[t] - down
        lower[t] = lower[t - 1] + down - 0.08 * lower[t - 1]
    return upper, lower


def write_tanks(folder: Path, seed: int = 0) -> None:
    """The data set; with another seed, other sequences of the same tanks."""
    folder.mkdir(parents=True)
    cases = []
    for number, (name, role) in enumerate(ROLES.items(), start=seed):
        pump = np.repeat(np.random.default_rng(number).uniform(0.0, 2.0, 15), 20)
        pump[:5] = 0.0
        rows = np.column_stack([np.arange(len(pump)) * 1.0, pump, *levels(pump)])
        np.savetxt(
            folder / f"{name}.csv", rows, delimiter=",", header="time [s],pump [cm],upper [cm],lower [cm]", comments=""
        )
        cases.append(f"  {name}: {{role: {role}, file: {name}.csv}}")
    channels = "\n".join(f"  - {{name: {name}, unit: cm}}" for name in ("pump", "upper", "lower"))
    text = f"name: tanks\nsample_time: 1\nchannels:\n{channels}\nsource: {{files: {{}}}}\ncases:\n" + "\n".join(cases)
    (folder / "dataset.yaml").write_text(text + "\n", encoding="utf-8")


def fill(folder: Path) -> None:
    """A workspace with both."""
    write_tanks(folder / "datasets" / "tanks")
    (folder / "pipelines").mkdir()
    (folder / "pipelines" / "tanks.yaml").write_text(PIPELINE, encoding="utf-8")


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """One, the current folder."""
    fill(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def assembly_results(folder: Path) -> AssemblyResults:
    """What a run of an assembly stored."""
    results = read_run(folder)
    assert isinstance(results, AssemblyResults)
    return results
