"""A workspace as a user has one: CSV files of their own, other names and units than the project's, 0.05 s apart."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest

from sysid.ingest.readers.csv.layout import Layout, recognise
from sysid.ingest.tables.options import FileOptions
from sysid.reporting.charts import Chart, chart_figure
from sysid.reporting.figures.svg import svg

DATASET = """\
name: rig
sample_time: 0.05
channels:
  - {name: inlet, unit: kPa, reference: gauge}
  - {name: valve, unit: V}
  - {name: outlet, unit: kPa, reference: gauge}
source: {files: {references: gauge}}
cases:
  run-1: {role: estimation, file: run-1.csv}
  run-2: {role: selection, file: run-2.csv}
  run-3: {role: validation, file: run-3.csv}
"""

PIPELINE = """\
name: first
data: rig
mapping: inlet+valve -> outlet
start: rest
rest: {outlet: 100}
seed: 3
fits:
  - {name: ARX, structure: {kind: ARX, na: 1, nb: [1, 1], nk: [1, 1]}}
  - name: open loop
    structure: {kind: NARX, input_delays: 1, output_delays: 1, neurons: 2}
    training: {loop: open, max_iterations: 8}
  - name: closed loop
    structure: {kind: NARX, input_delays: 1, output_delays: 1, neurons: 2}
    training: {loop: closed, max_iterations: 8}
    initial: open loop
export: null
stability: {count: 20}
"""
"""A check on the thousand sequences of the default takes longer than these fits; the tests of stability have it."""


def rig_record(seed: int, n_samples: int = 400) -> tuple[np.ndarray, ...]:
    """Time [s], inlet [kPa], valve [V], outlet [kPa]: a volume filled through a valve, saturating."""
    rng = np.random.default_rng(seed)
    inlet = np.repeat(rng.uniform(200.0, 600.0, n_samples // 40 + 1), 40)[:n_samples]
    valve = np.repeat(rng.uniform(0.0, 5.0, n_samples // 25 + 1), 25)[:n_samples]
    outlet = np.empty(n_samples)
    pressure = 100.0
    for n in range(n_samples):
        outlet[n] = pressure
        pressure += 0.05 * valve[n] * np.tanh((inlet[n] - pressure) / 200.0) * 40.0 - 0.02 * (pressure - 100.0)
    return 0.05 * np.arange(n_samples), inlet, valve, outlet


def fill(folder: Path) -> None:
    """The data set and the pipeline of a workspace."""
    data = folder / "datasets" / "rig"
    data.mkdir(parents=True)
    (data / "dataset.yaml").write_text(DATASET, encoding="utf-8")
    for seed in (1, 2, 3):
        rows = [",".join(f"{value:.6f}" for value in row) for row in zip(*rig_record(seed), strict=True)]
        header = "t [s],inlet [kPa],valve [V],outlet [kPa]"
        (data / f"run-{seed}.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    (folder / "pipelines").mkdir()
    (folder / "pipelines" / "first.yaml").write_text(PIPELINE, encoding="utf-8")


@pytest.fixture(scope="module", autouse=True)
def undrawn_pages(blank_picture: Callable[..., str], blank_chart: Callable[[Chart], None]) -> Iterator[None]:
    """Pages of runs have empty pictures, but for the tests that ask for ``drawn`` and for processes of their own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sysid.reporting.parts.svg", blank_picture)
        patch.setattr("sysid.reporting.charts.chart_figure", blank_chart)
        yield


@pytest.fixture(scope="session", autouse=True)
def layouts_told_once() -> Iterator[None]:
    """These tests read the same small files again and again: how each is laid out is told once; its rows are read."""
    found: dict[tuple[object, ...], Layout] = {}

    def told(lines: Sequence[str], options: FileOptions, path: Path, *, whole: bool) -> Layout:
        key = (tuple(lines), repr(options), whole)
        if key not in found:
            found[key] = recognise(lines, options, path, whole=whole)
        return found[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sysid.ingest.readers.csv.text.recognise", told)
        yield


@pytest.fixture(scope="session", autouse=True)
def quiet_machine() -> Iterator[None]:
    """No machine is looked at before work of which the time is told: a fifth of a second each time, to be busy in."""
    with pytest.MonkeyPatch.context() as patch:
        for room in ("auto.budget", "auto.finish", "surrogates.told", "surrogates.work"):
            patch.setattr(f"sysid.workbench.{room}.slowness", lambda: 1.0)
        yield


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests of the pictures."""
    monkeypatch.setattr("sysid.reporting.parts.svg", svg)
    monkeypatch.setattr("sysid.reporting.charts.chart_figure", chart_figure)


@pytest.fixture(scope="session")
def write_rig() -> Callable[[Path], None]:
    """Fills a folder with a user's data set and pipeline."""
    return fill


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's workspace, and the current folder."""
    fill(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    return tmp_path


@pytest.fixture(scope="session")
def empty_store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tracking store without runs; making one takes seconds, copying it nothing."""
    from sysid.workbench.tracking.mlflow_store import connect

    database = tmp_path_factory.mktemp("store") / "mlflow.db"
    connect(f"sqlite:///{database}")
    return database


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace whose pipeline has been run and its best network exported, to be copied."""
    from sysid.workbench.fits.config import Pipeline, PipelineConfig
    from sysid.workbench.fits.run import program_of
    from sysid.workbench.runner.program import carry_out

    folder = tmp_path_factory.mktemp("finished")
    fill(folder)
    file = folder / "pipelines" / "first.yaml"
    file.write_text(PIPELINE.replace("export: null", "export: {fit: closed loop, formats: [onnx]}"), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sysid.reporting.report.write_report", stub_report)
        carry_out(program_of(Pipeline.read(PipelineConfig, file)), folder / "runs" / "first", command="sysid run first")
    return folder


def stub_report(folder: Path) -> Path:
    """The report costs seconds, and most of what is tested here is not about it."""
    page = folder / "report" / "index.html"
    page.parent.mkdir(exist_ok=True)
    page.write_text("no report", encoding="utf-8")
    return page


@pytest.fixture(scope="session")
def report_stub() -> Callable[[Path], Path]:
    """Writes a stub for a report."""
    return stub_report


@pytest.fixture
def quick_report(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs write a stub for a report."""
    monkeypatch.setattr("sysid.reporting.report.write_report", stub_report)


@pytest.fixture
def done(finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of that workspace, and the current folder."""
    folder = tmp_path / "done"
    shutil.copytree(finished, folder)
    monkeypatch.chdir(folder)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    return folder
