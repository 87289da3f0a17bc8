"""Stores of tracked runs: made once, whoever comes first, and opened where the newest run is."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sysid.workbench.tracking import mlflow_store as tracking
from sysid.workbench.tracking import mlflow_views as views
from sysid.workbench.tracking.sweep_run import TRIALS_TAG


def test_processes_may_touch_a_new_store_at_once(tmp_path: Path) -> None:
    script = (
        "import sys; from sysid.workbench.tracking.mlflow_store import connect; "
        "connect(sys.argv[1]).search_experiments()"
    )
    uri = f"sqlite:///{tmp_path / 'mlflow.db'}"
    processes = [subprocess.Popen([sys.executable, "-c", script, uri], stderr=subprocess.PIPE) for _ in range(2)]
    told = [process.communicate()[1].decode() for process in processes]
    assert [process.returncode for process in processes] == [0, 0], told


def test_a_store_whose_making_was_stopped_is_made_again(
    tmp_path: Path, empty_store: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(draft: Path) -> None:
        draft.write_bytes(empty_store.read_bytes()[:8192])
        raise KeyboardInterrupt

    uri = f"sqlite:///{tmp_path / 'mlflow.db'}"
    monkeypatch.setattr(tracking, "_make_store", stopped)
    with pytest.raises(KeyboardInterrupt):
        tracking.connect(uri)
    assert not (tmp_path / "mlflow.db").exists()
    monkeypatch.setattr(tracking, "_make_store", lambda draft: shutil.copyfile(empty_store, draft))
    assert [experiment.name for experiment in tracking.connect(uri).search_experiments()] == ["Default"]


def test_an_experiment_made_by_other_means_gets_the_view_when_it_is_opened(tmp_path: Path, empty_store: Path) -> None:
    shutil.copyfile(empty_store, tmp_path / "mlflow.db")
    client = tracking.connect(f"sqlite:///{tmp_path / 'mlflow.db'}")
    experiment = client.create_experiment("other", artifact_location=(tmp_path / "files").as_uri())
    client.create_run(experiment)
    assert tracking.latest_experiment(f"sqlite:///{tmp_path / 'mlflow.db'}") == experiment
    assert views.TAG in client.get_experiment(experiment).tags


def test_fits_are_opened_first_though_trials_are_newer(tmp_path: Path, empty_store: Path) -> None:
    shutil.copyfile(empty_store, tmp_path / "mlflow.db")
    uri = f"sqlite:///{tmp_path / 'mlflow.db'}"
    client = tracking.connect(uri)
    trials, fits = (
        client.create_experiment(name, artifact_location=(tmp_path / name).as_uri()) for name in ("trials", "fits")
    )
    client.set_experiment_tag(trials, TRIALS_TAG, "a search")
    client.create_run(trials, start_time=1)
    assert tracking.latest_experiment(uri) == trials  # there are no fits yet
    client.create_run(fits, start_time=2)
    client.create_run(trials, start_time=3)
    assert tracking.latest_experiment(uri) == fits
