"""A real PostgreSQL server as the store of Optuna and of MLflow; skipped where none is installed."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from sysid.reporting.sweep_record import SweepRecord, Trial, TrialCase, write_sweep
from sysid.workbench.runner.events import SweepReady
from sysid.workbench.sweep.sampler import publish
from sysid.workbench.tracking.listener import Tracker

OWNER = "postgres"
"""PostgreSQL refuses to run as root; its package makes this user."""


def binary(name: str) -> str | None:
    places = [*sorted(str(p) for p in Path("/usr/lib/postgresql").glob("*/bin")), os.environ.get("PATH", "")]
    return shutil.which(name, path=os.pathsep.join(places))


def owner() -> str | None:
    """Whom the server runs as: nobody in particular, or the package's user where we are root."""
    if os.geteuid() != 0:
        return None
    return OWNER if any(user.pw_name == OWNER for user in pwd.getpwall()) else "missing"


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    """A server of our own, empty, on a port of its own; the address of its databases but for their name."""
    pytest.importorskip("psycopg")
    initdb, postgres, user = binary("initdb"), binary("postgres"), owner()
    if initdb is None or postgres is None or user == "missing":
        pytest.skip("no PostgreSQL server is installed")
    # Not below pytest's own folder: the server's user may not look into that.
    folder = Path(tempfile.mkdtemp(prefix="sysid-postgres-"))
    try:
        if user is not None:
            shutil.chown(folder, user, user)
        ours = {} if user is None else {"user": user, "group": user}
        data = folder / "data"
        subprocess.run([initdb, "-D", data, "-U", "sysid", "-A", "trust"], check=True, capture_output=True, **ours)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        options = ["-p", str(port), "-k", folder, "-c", "listen_addresses=127.0.0.1", "-c", "fsync=off"]
        with (folder / "log").open("wb") as log:
            process = subprocess.Popen([postgres, "-D", data, *options], stdout=log, stderr=log, **ours)
        try:
            wait_for(port)
            yield f"postgresql+psycopg://sysid@127.0.0.1:{port}"
        finally:
            # Fast: without waiting for clients that keep a connection open.
            process.send_signal(signal.SIGINT)
            process.wait(120)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def wait_for(port: int) -> None:
    import psycopg

    deadline = time.monotonic() + 60
    while True:
        try:
            with psycopg.connect(f"postgresql://sysid@127.0.0.1:{port}/postgres", autocommit=True) as connection:
                for name in ("mlflow", "optuna"):
                    connection.execute(f"CREATE DATABASE {name}")
            return
        except psycopg.OperationalError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.1)


def record() -> SweepRecord:
    case = TrialCase(role="validation", free_run_mse=0.1, one_step_mse=0.01, run_time_s=0.001)
    trials = [
        Trial(
            number=n,
            key=f"key {n}",
            label=f"NARX 1/1/{n}",
            structure={"kind": "NARX", "neurons": n},
            values={"neurons": n},
            status="CONVERGED",
            usable=True,
            operations=4 * n,
            selection_free_run_mse=1.0 / n,
            cases={"VAL01": case},
        )
        for n in range(1, 6)
    ]
    return SweepRecord(
        name="s",
        mapping="u -> y",
        unit="V",
        method="grid",
        points=5,
        ranges={"neurons": [1, 2, 3, 4, 5]},
        objectives=["free_run_mse", "operations"],
        choose_by="free_run_mse",
        choose_on="selection",
        chosen_by="Least.",
        workers=1,
        wall_s=1.0,
        winner=5,
        trials=trials,
    )


def test_a_sweeps_trials_reach_an_optuna_study_once(server: str) -> None:
    import optuna

    url = f"{server}/optuna"
    assert publish(record(), url) == 5
    assert publish(record(), url) == 0
    storage = optuna.storages.RDBStorage(url)
    study = optuna.load_study(study_name="s", storage=storage)
    assert sorted(trial.params["neurons"] for trial in study.best_trials) == [1, 2, 3, 4, 5]
    storage.remove_session()
    storage.engine.dispose()


@pytest.mark.slow
def test_a_sweeps_trials_reach_mlflow_once(server: str, tmp_path: Path) -> None:
    tracker = Tracker(uri=f"{server}/mlflow", artifacts=tmp_path / "artifacts", warn=pytest.fail)
    write_sweep(tmp_path, record())
    ready = SweepReady(record=record(), folder=tmp_path, command="sysid sweep s", data="d", seed=0)
    for _ in range(2):
        tracker(ready)
    experiment = tracker.client.get_experiment_by_name("u -> y · sweep s")
    kinds = [run.data.tags["kind"] for run in tracker.client.search_runs([experiment.experiment_id])]
    assert (kinds.count("trial"), kinds.count("summary")) == (5, 1)
