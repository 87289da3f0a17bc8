"""The run folder: whole files, stamps that can be trusted, one run at a time."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from sysid.atomic import write_bytes
from sysid.workbench.runner.store import (
    BusyError,
    RunFolder,
    read_arrays,
    read_json,
    strict,
    write_arrays,
    write_json,
)


def test_a_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    write_json(file, {"whole": True})
    with pytest.raises(TypeError):
        write_json(file, {"whole": object()})
    assert read_json(file) == {"whole": True}
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.json"]


def test_numbers_without_a_word_in_json_come_back(tmp_path: Path) -> None:
    write_json(tmp_path / "a.json", {"values": [math.inf, -math.inf, math.nan, 0.1]})
    back = np.array([float(value) for value in read_json(tmp_path / "a.json")["values"]])
    np.testing.assert_array_equal(back, [math.inf, -math.inf, math.nan, 0.1])
    json.loads((tmp_path / "a.json").read_text(), parse_constant=lambda word: pytest.fail(f"{word} is not JSON"))


def test_strict_leaves_other_values_alone() -> None:
    assert strict({1: (True, None, "x", 2)}) == {"1": [True, None, "x", 2]}


def test_arrays_come_back_exactly(tmp_path: Path) -> None:
    arrays = {"VAL 1/time": np.linspace(0.0, 1.0, 7), "VAL 1/target": np.array([np.nan, np.inf, 1e-300])}
    write_arrays(tmp_path / "a.npz", arrays)
    back = read_arrays(tmp_path / "a.npz")
    assert list(back) == list(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(back[name], array)


@pytest.fixture
def stamped(tmp_path: Path) -> RunFolder:
    store = RunFolder(path=tmp_path)
    write_bytes(tmp_path / "fits" / "a.txt", b"result")
    store.mark_done("fit-a", "key", [tmp_path / "fits" / "a.txt"], seconds=2.5)
    return store


def test_a_stamp_is_trusted_while_everything_is_as_it_was(stamped: RunFolder) -> None:
    assert stamped.is_done("fit-a", "key")
    assert stamped.facts("fit-a")["seconds"] == 2.5
    assert not stamped.is_done("fit-a", "another key")
    assert not stamped.is_done("fit-b", "key")


@pytest.mark.parametrize(
    ("file", "content"),
    [
        pytest.param("fits/a.txt", None, id="file gone"),
        pytest.param("fits/a.txt", "resul", id="file cut short"),
        pytest.param(".steps/fit-a.json", None, id="stamp gone"),
        pytest.param(".steps/fit-a.json", "{", id="stamp cut short"),
        pytest.param(".steps/fit-a.json", "[]", id="stamp of another kind"),
        pytest.param(".steps/fit-a.json", '{"key": "key"}', id="stamp without files"),
        pytest.param(".steps/fit-a.json", '{"key": "key", "files": []}', id="stamp with files of another kind"),
    ],
)
def test_damage_means_not_done(stamped: RunFolder, file: str, content: str | None) -> None:
    damaged = stamped.path / file
    damaged.unlink() if content is None else damaged.write_text(content, encoding="utf-8")
    assert not stamped.is_done("fit-a", "key")


def test_two_at_once_are_refused(tmp_path: Path) -> None:
    store = RunFolder(path=tmp_path)
    with store.locked(), pytest.raises(BusyError, match=rf"process {os.getpid()} on") as caught, store.locked():
        pytest.fail("the second one got in")
    assert caught.value.exit_code == 2
    with store.locked():
        pass


def test_a_killed_holder_lets_go(tmp_path: Path) -> None:
    script = (
        "import sys, time; from pathlib import Path; from sysid.workbench.runner.store import RunFolder\n"
        "with RunFolder(path=Path(sys.argv[1])).locked():\n    print('held', flush=True); time.sleep(60)"
    )
    holder = subprocess.Popen([sys.executable, "-c", script, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert holder.stdout is not None
    with holder.stdout:
        assert holder.stdout.readline() == "held\n"
    store = RunFolder(path=tmp_path)
    with pytest.raises(BusyError, match=f"process {holder.pid}"), store.locked():
        pytest.fail("a lock that is held was given away")
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    began = time.monotonic()
    with store.locked():
        assert time.monotonic() - began < 1.0
