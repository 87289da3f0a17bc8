"""Trials on disk: one file a job, written whole or not at all, found again by everything that it depends on."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sysid.workbench.runner.store import read_json, write_json

TRIALS = "trials"
"""In the folder of a sweep: its trials."""


@dataclass(frozen=True, kw_only=True)
class TrialStore:
    """The trials of a sweep.

    Args:
        path: Folder of the trials, inside the run folder.
    """

    path: Path

    def file(self, key: str) -> Path:
        """Where a job's result lies.

        Args:
            key: The job's key.

        Returns:
            The file; two letters of the key make its folder, as a thousand files in one are slow to list.
        """
        return self.path / key[:2] / f"{key}.json"

    def read(self, key: str) -> dict[str, Any] | None:
        """A job's result.

        Args:
            key: The job's key.

        Returns:
            JSON values; ``None`` if it is not there, or not whole.
        """
        try:
            stored = read_json(self.file(key))
        except (OSError, ValueError):
            # A file that cannot be read is no result: the job is done again.
            return None
        return stored if isinstance(stored, dict) and stored.get("key") == key else None

    def write(self, outcome: dict[str, Any]) -> None:
        """Store a job's result, before anybody hears of it.

        Args:
            outcome: What :func:`sysid.workbench.sweep.trial.run_job` gave.
        """
        write_json(self.file(outcome["key"]), outcome)

    def count(self) -> int:
        """Results that are stored."""
        return sum(1 for _ in self.path.glob("*/*.json")) if self.path.is_dir() else 0

    @property
    def _clock(self) -> Path:
        return self.path / "clock.json"

    @property
    def seconds(self) -> float:
        """Wall time that all sessions took."""
        try:
            return float(read_json(self._clock)["wall_s"])
        except (OSError, ValueError, KeyError, TypeError):
            # No session yet, or a clock that was torn by a power cut: time is told, not decided by.
            return 0.0

    def stopped_clock(self) -> Clock:
        """The time that this sweep took, for who only looks at it."""
        return Clock(file=self._clock, before=self.seconds, began=time.perf_counter())

    @contextmanager
    def clock(self) -> Iterator[Clock]:
        """The time that this sweep takes, over all its sessions.

        Yields:
            The clock, which is running.
        """
        clock = self.stopped_clock()
        try:
            yield clock
        finally:
            clock.keep()


@dataclass(frozen=True, kw_only=True)
class Clock:
    """Wall time of a sweep.

    Args:
        file: Where it is kept between sessions.
        before: Seconds of earlier sessions.
        began: When this one began.
    """

    file: Path
    before: float
    began: float

    @property
    def session(self) -> float:
        """Seconds of this session."""
        return time.perf_counter() - self.began

    @property
    def total(self) -> float:
        """Seconds of all sessions."""
        return self.before + self.session

    def keep(self) -> None:
        """Write the time down, after each trial: a killed session's is known to within one."""
        write_json(self.file, {"wall_s": self.total})
