"""A reference in a process of its own: one that hangs or dies ends a run, and nothing else."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from typing import Any

from sysid.references.config import ReferenceConfig

STARTING_S = 120.0
"""Seconds that loading a reference may take."""


class ReferenceProcess:
    """A worker and the lines between it and us."""

    def __init__(self, config: ReferenceConfig) -> None:
        self.answers: queue.Queue[str] = queue.Queue()
        self.ran = False  # the first run loads and compiles what the others find
        self.errors = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        # It is ended in the middle of what it does: what it unpacked and wrote is cleared away from here.
        self.place = tempfile.TemporaryDirectory(prefix="sysid-worker-", ignore_cleanup_errors=True)
        # Our own module, and nothing of a user's but the configuration that names what is run.
        self.process = subprocess.Popen(
            [sys.executable, "-m", "sysid.references.worker"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=self.errors, text=True, encoding="utf-8", start_new_session=True, env=_environment(self.place.name),
        )  # fmt: skip
        threading.Thread(target=self._listen, daemon=True).start()
        self.send(config.model_dump_json())
        self.hello = self.receive(STARTING_S)

    def _listen(self) -> None:
        assert self.process.stdout is not None  # noqa: S101 - it is a pipe
        for line in self.process.stdout:
            self.answers.put(line)
        self.answers.put("")

    def send(self, line: str) -> None:
        """Pass a line on; one that has ended is found out when it does not answer."""
        assert self.process.stdin is not None  # noqa: S101 - it is a pipe
        with contextlib.suppress(OSError):
            self.process.stdin.write(line + "\n")
            self.process.stdin.flush()

    def receive(self, limit_s: float) -> dict[str, Any] | None:
        """The answer; ``None`` if the process has ended. ``TimeoutError`` if none came in time."""
        try:
            line = self.answers.get(timeout=limit_s)
        except queue.Empty:
            raise TimeoutError from None
        return dict(json.loads(line)) if line else None

    def kill(self) -> None:
        """Kill it and all that it started; who waits for its answer hears that it has ended."""
        if hasattr(os, "killpg"):
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signal.SIGKILL)
        else:
            self.process.kill()

    def end(self) -> str:
        """End it and all that it started; gives how it ended, in words."""
        code = self.process.poll()
        self.kill()
        code = self.process.wait() if code is None else code
        self.errors.seek(0)
        said = self.errors.read()[-2000:].decode(errors="replace").strip().splitlines()[-1:]
        for one in (self.process.stdin, self.process.stdout, self.errors):
            with contextlib.suppress(OSError):
                one.close()  # type: ignore[union-attr]
        self.place.cleanup()
        how = f"by signal {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
        return how + (f": {said[0]}" if said else "")


def _environment(place: str) -> dict[str, str]:
    """One thread a run, for there are as many runs as processors; and a folder of its own for temporary files."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**os.environ, **threads, **dict.fromkeys(("TMPDIR", "TEMP", "TMP"), place)}
