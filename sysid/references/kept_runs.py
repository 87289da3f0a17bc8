"""What came of runs of a reference, kept by the digest of all that they depend on: a note, and a record."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sysid.atomic import replacing
from sysid.ingest import TraceCache
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True)
class Note:
    """What came of a run, beside its record.

    Args:
        reason: Why there is no record.
        before: The outputs before its first sample, by name.
        cpu_s: Processor time of the run; nan where it is not known.
        wall_s: Its time by the clock, likewise.
    """

    reason: str | None
    before: Mapping[str, float] = field(default_factory=dict)
    cpu_s: float = float("nan")
    wall_s: float = float("nan")


@dataclass(frozen=True)
class KeptRuns:
    """Notes and records of runs.

    Args:
        folder: Where they are kept.
    """

    folder: Path

    def _place(self, key: str) -> Path:
        return self.folder / "references" / f"{key}.json"

    def note(self, key: str) -> Note | None:
        """What is noted of a run.

        Args:
            key: The digest.

        Returns:
            The note; ``None`` where there is none, or none that can be read.
        """
        try:
            note = json.loads(self._place(key).read_text(encoding="utf-8"))
            seconds = {name: float("nan") if note[name] is None else float(note[name]) for name in ("cpu_s", "wall_s")}
            reason = None if note["reason"] is None else str(note["reason"])
            return Note(reason=reason, before=dict(note["before"]), **seconds)
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def trace(self, key: str) -> Trace | None:
        """The record of a run.

        Args:
            key: The digest.

        Returns:
            The record; ``None`` where there is none.
        """
        return TraceCache(folder=self.folder).load(key)

    def keep(self, key: str, note: Note, trace: Trace | None) -> None:
        """Keep the record first, the note that it is there last.

        Args:
            key: The digest.
            note: What came of the run.
            trace: The record, if there is one.
        """
        if trace is not None:
            TraceCache(folder=self.folder).store(key, trace)
        written = {
            "reason": note.reason,
            "before": dict(note.before),
            "cpu_s": note.cpu_s if np.isfinite(note.cpu_s) else None,
            "wall_s": note.wall_s if np.isfinite(note.wall_s) else None,
        }
        with contextlib.suppress(OSError), replacing(self._place(key)) as draft:
            draft.write_text(json.dumps(written), encoding="utf-8")
