"""The UI's server: the right page, the right flags, and nothing left behind."""

from __future__ import annotations

import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

from sysid.workbench.commands import ui


def test_the_page_is_the_view_of_an_experiment_that_shows_first_what_matters_first() -> None:
    assert ui.page("7") == "#/experiments/7/runs?viewStateShareKey=sysid&workflowType=machine_learning"
    assert ui.page(None) == "#/experiments?workflowType=machine_learning"


def test_a_port_that_is_taken_is_passed_over() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert ui.free_port(port) > port


def test_flags_can_be_overruled_by_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MLFLOW_SERVER_ENABLE_JOB_EXECUTION", raising=False)
    assert ui.server_environment()["MLFLOW_SERVER_ENABLE_JOB_EXECUTION"] == "false"
    assert ui.server_environment()["MLFLOW_DISABLE_TELEMETRY"] == "true"
    monkeypatch.setenv("MLFLOW_SERVER_ENABLE_JOB_EXECUTION", "true")
    assert ui.server_environment()["MLFLOW_SERVER_ENABLE_JOB_EXECUTION"] == "true"


@pytest.mark.slow
def test_the_server_answers_and_leaves_nothing_behind(workspace: Path, empty_store: Path) -> None:
    shutil.copyfile(empty_store, workspace / "mlflow.db")
    command = [str(Path(sys.executable).with_name("sysid")), "ui", "--no-browser"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    assert process.stdout is not None
    with process.stdout:
        address = ""
        while not address:
            line = process.stdout.readline()
            assert line, "the server ended before it told its address"
            address = line.partition("Compare fits at ")[2].strip()
        with urllib.request.urlopen(address.partition("#")[0], timeout=10) as answer:  # noqa: S310 - our own server
            assert answer.status == 200
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        assert children
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=30) == 0
    deadline = time.monotonic() + 10.0
    while time.monotonic() < deadline and any(Path(f"/proc/{pid}").exists() for pid in children):
        time.sleep(0.1)
    assert not [pid for pid in children if Path(f"/proc/{pid}").exists()]
