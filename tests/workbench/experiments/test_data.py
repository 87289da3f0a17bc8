"""A pipeline of kind ``experiment`` in the place of a data set: at the doors that name data, and asked for new runs."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from sysid.errors import ConfigError
from sysid.ingest import load_dataset
from sysid.reporting.kinds import read_run
from sysid.traces import Role
from sysid.workbench.commands.run import run_request
from sysid.workbench.experiments.data import ExperimentData
from sysid.workbench.fits.data import load_named, unmade_data
from sysid.workbench.kinds import RunRequest
from tests.workbench.experiments.test_run import DESIGN, REFERENCE, pipeline

FIT = {
    **{"name": "lagged", "data": "lag.yaml", "mapping": "u -> y", "start": "rest", "rest": {"y": 0.0}},
    "fits": [{"name": "arx", "structure": {"kind": "ARX", "na": 1, "nb": 1, "nk": 0}}],
}


@pytest.fixture(autouse=True)
def _cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)


def test_a_fit_names_the_experiment_and_gets_the_records_that_it_would_write(tmp_path: Path) -> None:
    reference = {**REFERENCE, "parameters": {}}
    file = pipeline(tmp_path, reference=reference)
    lacking = unmade_data(["lag.yaml"], beside=tmp_path)
    assert lacking is not None
    assert lacking.basis.startswith("6 traces to be made by the reference of lag")
    (tmp_path / "fit.yaml").write_text(yaml.safe_dump(FIT), encoding="utf-8")
    assert run_request(RunRequest(path=tmp_path / "fit.yaml", typed="fit", tracking=False)) == 0
    assert read_run(tmp_path / "runs" / "lagged").fits[0].name == "arx"
    assert unmade_data(["lag.yaml"], beside=tmp_path) is None
    assert run_request(RunRequest(path=file, typed="lag", tracking=False)) == 0
    written = load_dataset(tmp_path / "runs" / "lag" / "dataset.yaml")
    named = load_named("lag.yaml", tmp_path, progress=lambda *_: None)
    assert [one.digest for one in named] == [one.digest for one in written]
    assert named.roles == written.roles


def test_new_runs_are_none_of_its_own_and_each_round_has_others(tmp_path: Path) -> None:
    data = ExperimentData.at(pipeline(tmp_path))
    told: list[str] = []
    rounds = [data.new(number, 2, duration=10.0, progress=lambda name, *_: told.append(name)) for number in (0, 1, 1)]
    assert [len(trace) for some in rounds for trace in some] == [20] * 6
    assert [one.digest for one in rounds[1]] == [one.digest for one in rounds[2]]
    assert len({one["u"].tobytes() for some in rounds for one in some}) == 4
    assert sorted(set(told)) == ["G1N001", "G1N002", "HLD001", "HLD002"]
    assert data.unmade_new(1, 2, duration=10.0) is None
    assert data.unmade() is not None


def test_what_gave_no_record_is_told_with_its_reason_and_a_reference_that_gives_none_is_refused(tmp_path: Path) -> None:
    some = {**REFERENCE, "python": "slow_models:raises", "parameters": {}}
    design = {**DESIGN, "excitations": ["events"], "hold": [8, 8], "seed": 3}
    loaded = ExperimentData.at(pipeline(tmp_path, reference=some, experiment=design)).load()
    assert 0 < len(loaded) < 6
    assert "valve jammed" in loaded.source
    assert loaded.with_role(Role.ESTIMATION)
    every = {**some, "inputs": {"u": {"unit": "V", "range": [1.5, 2]}}}
    data = ExperimentData.at(pipeline(tmp_path, reference=every, experiment=design))
    with pytest.raises(ConfigError, match="no new experiment gave a record"):
        data.new(1, 2)


def test_a_pipeline_that_gives_no_data_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other.yaml").write_text("kind: auto\nname: a\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="a pipeline is named where data are asked for") as caught:
        load_named("other.yaml", tmp_path, progress=lambda *_: None)
    assert "experiment" in str(caught.value.expected)
