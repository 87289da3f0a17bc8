"""A tracking server that is down is said to be so at once; one that answers, whatever it says, is there."""

from __future__ import annotations

import socket
import threading
import time
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from sysid.errors import ConfigError
from sysid.workbench.tracking.mlflow_store import connect
from sysid.workbench.tracking.server import answers


def free() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"http://127.0.0.1:{probe.getsockname()[1]}"


def test_a_server_that_is_down_is_not_asked_for_minutes() -> None:
    began = time.monotonic()
    with pytest.raises(ConfigError, match="does not answer") as refused:
        connect(free())
    assert "MLFLOW_TRACKING_URI" in refused.value.remedy
    assert time.monotonic() - began < 5.0


@pytest.mark.parametrize("code", [200, 401, 503])
def test_whatever_it_says_it_is_there(code: int) -> None:
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(code)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Nothing on the screen."""

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.handle_request, daemon=True).start()
        assert answers(f"http://127.0.0.1:{server.server_port}/") == ""


def test_one_that_never_speaks_is_given_up() -> None:
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        assert "timed out" in answers(f"http://127.0.0.1:{silent.getsockname()[1]}", patience_s=0.05)
    assert answers("no address")
