"""``sysid ui``: the MLflow server for this workspace, opened where fits are compared."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import webbrowser
from pathlib import Path
from typing import IO

from sysid.errors import SysidError
from sysid.plugins import entry_points
from sysid.workbench.runner.console import console
from sysid.workbench.tracking.landing import VARIABLE
from sysid.workbench.tracking.mlflow_store import QUIET, latest_experiment, store_uri
from sysid.workbench.tracking.mlflow_views import VIEW
from sysid.workbench.tracking.server import answers

APP = "sysid"
"""Name of our entry point for MLflow's server."""

START_LIMIT_S = 60.0
"""Seconds that a server may take; 8 to 10 s were measured on two cores."""


def ui_command(port: int, *, browser: bool) -> int:
    """Serve the tracking store until Ctrl-C."""
    uri, target = store_uri(Path.cwd()), console()
    experiment = latest_experiment(uri)
    if uri.startswith(("http://", "https://")):
        _open(f"{uri.rstrip('/')}/{page(experiment)}", browser=browser)
        return 0
    address = f"http://127.0.0.1:{free_port(port)}"
    target.print("Starting MLflow; this takes some ten seconds.")
    # What the server says is for those who look for a fault; it is kept until then and no longer.
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(  # noqa: S603 - our own words
            _server_command(uri, address),
            env=server_environment(page(experiment)),
            start_new_session=True,
            stdout=log,
            stderr=log,
        )
        # The end is asked for in several ways; all of them shall end the server with us.
        previous = signal.signal(signal.SIGTERM, _interrupt)
        try:
            _wait_until_up(process, address, log)
            _open(f"{address}/{page(experiment)}", browser=browser)
            target.print("Ctrl-C ends it.")
            return process.wait()
        except KeyboardInterrupt:
            return 0
        finally:
            signal.signal(signal.SIGTERM, previous)
            stop(process)


def page(experiment: str | None) -> str:
    """The page where fits are compared.

    Args:
        experiment: The experiment to open; ``None`` opens the list of all.

    Returns:
        The part of the address after the server.
    """
    # Without workflow_type MLflow opens in its mode for language models.
    if experiment is None:
        return "#/experiments?workflowType=machine_learning"
    return f"#/experiments/{experiment}/runs?viewStateShareKey={VIEW}&workflowType=machine_learning"


def _server_command(uri: str, address: str) -> list[str]:
    """The words that start the server on an address."""
    host, port = address.removeprefix("http://").split(":")
    return [
        *(sys.executable, "-m", "mlflow", "server", "--backend-store-uri", uri),
        *("--host", host, "--port", port, "--workers", "1"),
        # A checkout that was installed before it had this entry point goes without.
        *(("--app-name", APP) if APP in entry_points("mlflow.app").names else ()),
    ]


def server_environment(landing: str = "") -> dict[str, str]:
    """The environment of the server: no telemetry, and no job queue (measured: 11 processes and 2 GB with it).

    Args:
        landing: The page that the bare address leads to.

    Returns:
        Variables by name.
    """
    return {**QUIET, "MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false", VARIABLE: landing, **os.environ}


def free_port(first: int) -> int:
    """The first port from ``first`` on that nobody listens at.

    Args:
        first: Where to begin.

    Returns:
        The port.

    Raises:
        SysidError: If fifty ports in a row are taken.
    """
    for port in range(first, min(first + 50, 65536)):
        with socket.socket() as probe:
            # A server that ended a moment ago shall not count as one that listens.
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise SysidError("no port is free", expected=f"one from {first} on", remedy="name another one with --port")


def stop(process: subprocess.Popen[bytes]) -> None:
    """End the server and all that it has started.

    Args:
        process: The server, leader of its own group.
    """
    for sign, patience in ((signal.SIGTERM, 10.0), (signal.SIGKILL, 10.0)):
        if process.poll() is not None:
            return
        try:
            os.killpg(process.pid, sign)
            process.wait(patience)
        except (ProcessLookupError, subprocess.TimeoutExpired):
            # Gone already, or in need of the next, harder signal.
            continue


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _wait_until_up(process: subprocess.Popen[bytes], address: str, log: IO[bytes]) -> None:
    deadline = time.monotonic() + START_LIMIT_S
    while time.monotonic() < deadline and process.poll() is None:
        if not answers(address, patience_s=2.0):
            return
        time.sleep(0.2)
    log.seek(0)
    last = log.read().decode(errors="replace").strip().splitlines()[-5:]
    raise SysidError(
        "the MLflow server did not come up",
        where=address,
        expected=f"an answer within {START_LIMIT_S:.0f} s",
        got="no answer" if process.poll() is None else f"it ended with code {process.returncode}",
        remedy="its last words were: " + " | ".join(last) if last else "start it by hand: mlflow server",
    )


def _open(address: str, *, browser: bool) -> None:
    console().print(f"Compare fits at {address}", soft_wrap=True)
    if browser:
        webbrowser.open(address)
