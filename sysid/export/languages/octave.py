"""Octave, which runs what is written for MATLAB: one process, asked again and again, because it starts slowly."""

from __future__ import annotations

import atexit
import os
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, SysidError

NAMES = ("octave-cli", "octave")


class OctaveError(SysidError):
    """A function that we wrote and that Octave refuses."""


def octave() -> str:
    """The program.

    Raises:
        ConfigError: If it is not there.
    """
    for name in (os.environ.get("OCTAVE", ""), *NAMES):
        if name and (found := shutil.which(name)):
            return found
    raise ConfigError(
        "the format matlab is run by Octave before it is published, and Octave is not there",
        expected="the program octave-cli",
        got="no such program",
        remedy="install GNU Octave (apt-get install octave), set OCTAVE, or leave the format matlab out",
    )


class Octave:
    """A process that runs functions on arrays; names are ours, numbers go by files."""

    def __init__(self) -> None:
        self.workplace = tempfile.TemporaryDirectory()
        self.folder = Path(self.workplace.name)
        text = files("sysid.export").joinpath("templates", "serve.m").read_text(encoding="utf-8")
        (self.folder / "serve.m").write_text(text, encoding="utf-8")
        self.lock, self.loaded = threading.Lock(), 0
        self.process = subprocess.Popen(  # noqa: S603 - the program that was found, on a file of ours
            [octave(), "--norc", "--quiet", "--no-history", "--eval", "serve"],
            cwd=self.folder,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        atexit.register(self.close)

    def add(self, sources: Sequence[Path]) -> str:
        """Take a copy of some functions.

        Args:
            sources: Their files.

        Returns:
            The name by which :meth:`run` knows them.
        """
        with self.lock:
            self.loaded += 1
            place = f"m{self.loaded}"
        (self.folder / place).mkdir()
        for source in sources:
            (self.folder / place / source.name).write_bytes(source.read_bytes())
        return place

    def run(
        self, place: str, function: str, inputs: NDArray[np.float64], state: NDArray[np.float64] | None, n_outputs: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Run ``[y, state, flags] = function(u, state)``.

        Args:
            place: Where the function was put.
            function: Its name, an identifier.
            inputs: Shape ``(n_samples, n_inputs)``.
            state: Shape ``(n_state,)``; ``None`` for a function that begins by itself.
            n_outputs: Number of outputs.

        Returns:
            Outputs ``(n_samples, n_outputs)``, state and flags ``(n_samples,)``.

        Raises:
            OctaveError: If the function fails.
        """
        n, m = inputs.shape
        with self.lock:
            (self.folder / place / "in").write_bytes(
                np.concatenate([inputs.ravel(), [] if state is None else state]).astype("<f8", copy=False).tobytes()
            )
            answer = self._ask(f"{place} {function} {n} {m} {-1 if state is None else len(state)}")
            if answer != "done":
                raise OctaveError(
                    "Octave refuses an exported function",
                    where=function,
                    got=answer[:2000],
                    remedy="please report this with the version of Octave",
                )
            found = np.fromfile(self.folder / place / "out", dtype="<f8")
        y, after, flags = np.split(found, [n * n_outputs, len(found) - n])
        return y.reshape(n, n_outputs), after, flags

    def _ask(self, line: str) -> str:
        (self.folder / "asked").write_text(line, encoding="ascii")
        (self.folder / "asked").replace(self.folder / "ask")
        return self._answers.readline().strip() or "it has ended"

    @property
    def _answers(self) -> IO[str]:
        if self.process.stdout is None:
            raise OctaveError("Octave cannot be heard", got="no pipe")
        return self.process.stdout

    def close(self) -> None:
        """End the process."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._answers.close()
        self.workplace.cleanup()


def session() -> Octave:
    """The process of this one; a new one where the last has ended."""
    found = _session(os.getpid())
    if found.process.poll() is not None:
        _session.cache_clear()
        found = _session(os.getpid())
    return found


@cache
def _session(_: int) -> Octave:
    return Octave()
