"""Pipelines of kind ``experiment``: a slow model is run as designed, and a data set comes of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

import sysid
from sysid.errors import ConfigError
from sysid.ingest import load_dataset
from sysid.traces import Role
from sysid.workbench.cli import app

MODELS = Path(__file__).parents[2] / "references"
REFERENCE = {
    **{"python": "slow_models:first_order", "folder": str(MODELS), "sample_time": 0.5, "cost": 2.0},
    "inputs": {"u": {"unit": "V", "range": [0, 2]}},
    "parameters": {"tau": {"unit": "s", "range": [1, 4]}},
    "outputs": {"y": {"unit": "V"}},
}
DESIGN = {"duration": 20.0, "runs": {"estimation": 4, "selection": 1, "test": 1}}


@pytest.fixture(autouse=True)
def _cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)


def pipeline(folder: Path, **fields: object) -> Path:
    file = folder / "lag.yaml"
    content = {"kind": "experiment", "name": "lag", "reference": REFERENCE, "experiment": DESIGN, **fields}
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    return file


def test_a_pipeline_says_what_it_costs_runs_and_is_found_again(tmp_path: Path) -> None:
    file, command = pipeline(tmp_path), CliRunner()
    told = command.invoke(app, ["run", str(file), "--dry-run"])
    assert told.exit_code == 0, told.output
    assert "6 of 6 runs to make" in " ".join(told.output.split())
    assert not (tmp_path / "runs").exists()
    done = command.invoke(app, ["run", str(file)])
    assert done.exit_code == 0, done.output
    traces = load_dataset(tmp_path / "runs" / "lag" / "dataset.yaml")
    assert [len(traces.with_role(role)) for role in (Role.ESTIMATION, Role.SELECTION, Role.TEST)] == [4, 1, 1]
    assert [channel.label for channel in traces.channels] == ["u [V]", "tau [s]", "y [V]"]
    assert all(np.ptp(trace["tau"]) == 0.0 for trace in traces)
    again = command.invoke(app, ["run", str(file)])
    assert "6 runs, 6 of them stored" in " ".join(again.output.split())


def test_what_failed_is_said_with_its_reason_and_is_not_in_the_data_set() -> None:
    some = {**REFERENCE, "python": "slow_models:raises", "parameters": {}}
    traces = sysid.experiment(some, {**DESIGN, "excitations": ["events"], "hold": [8, 8], "seed": 3}, workers=1)
    assert 0 < len(traces) < 6
    assert max(trace["u"].max() for trace in traces) <= 1.0
    every = {**some, "inputs": {"u": {"unit": "V", "range": [1.5, 2]}}}
    with pytest.raises(ConfigError, match="no run of the reference gave a record") as caught:
        sysid.experiment(every, DESIGN, workers=1)
    assert "valve jammed" in str(caught.value.got)


def test_a_record_is_what_the_function_gave() -> None:
    for trace in sysid.experiment(REFERENCE, DESIGN, workers=1):
        a = np.exp(-0.5 / trace["tau"][0])
        expected = a * trace["y"][:-1] + (1.0 - a) * trace["u"][1:]
        np.testing.assert_allclose(trace["y"][1:], expected, atol=1e-12)
