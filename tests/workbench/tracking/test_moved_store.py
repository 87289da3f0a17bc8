"""A workspace that was moved or copied has its files where they are now, and none where they were."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from sysid.workbench.tracking import mlflow_store as tracking
from sysid.workbench.tracking.moved_store import ARTIFACTS, PATHS, follow

BEFORE, AFTER = "first place #1", "später, 100 % moved"


@pytest.fixture
def before(tmp_path: Path, empty_store: Path) -> tuple[Path, str]:
    """A workspace in which a run has left a file, and the run."""
    folder = tmp_path / BEFORE
    folder.mkdir()
    shutil.copyfile(empty_store, folder / "mlflow.db")
    client = connected(folder)
    run = client.create_run(tracking.experiment_of(client, "u -> y", folder / ARTIFACTS, about="Fits."))
    # By hand: MLflow remembers in a process where the files of a run are.
    files = folder / ARTIFACTS / "u-y" / run.info.run_id / "artifacts"
    assert run.info.artifact_uri == files.as_uri()
    files.mkdir(parents=True)
    (files / "note.txt").write_text("whole")
    return folder, run.info.run_id


def connected(folder: Path) -> Any:
    return tracking.connect(f"sqlite:///{folder / 'mlflow.db'}")


@pytest.mark.parametrize("take", [shutil.move, shutil.copytree], ids=["moved", "copied"])
def test_old_files_are_found_and_new_ones_lie_beside_them(
    take: Callable[[Path, Path], object], before: tuple[Path, str]
) -> None:
    old, run_id = before
    new = old.with_name(AFTER)
    take(old, new)
    was = sorted(old.rglob("*"))
    client = connected(new)
    client.log_text(run_id, "more", "second.txt")
    assert {file.path for file in client.list_artifacts(run_id)} == {"note.txt", "second.txt"}
    assert Path(client.download_artifacts(run_id, "note.txt")).read_text() == "whole"
    assert sorted(old.rglob("*")) == was
    (experiment,) = {one.experiment_id for one in client.search_experiments()} - {"0"}
    client.log_text(client.create_run(experiment).info.run_id, "new", "third.txt")
    assert sorted(old.rglob("*")) == was
    assert len(list((new / ARTIFACTS).rglob("third.txt"))) == 1


def test_a_place_that_somebody_chose_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / ARTIFACTS / "a").mkdir(parents=True)
    (tmp_path / "link").symlink_to(tmp_path / ARTIFACTS)
    chosen = ["s3://bucket/mlartifacts/a", "/data/shared/a", "/data/mlartifacts/b", "mlartifacts/a"]
    chosen += [(tmp_path / ARTIFACTS / "a").as_uri(), f"{tmp_path}/link/../{ARTIFACTS}/a"]
    database = tmp_path / "mlflow.db"
    table, column = PATHS[0]
    with closing(sqlite3.connect(database)) as store:
        store.execute(f"CREATE TABLE {table} ({column} TEXT)")
        store.executemany(f"INSERT INTO {table} VALUES (?)", [(place,) for place in chosen])  # noqa: S608 - our own names
        store.commit()
        follow(database)
        assert [place for (place,) in store.execute(f"SELECT {column} FROM {table}")] == chosen  # noqa: S608 - likewise
