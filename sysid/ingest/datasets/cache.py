"""Traces kept on disk under the hash of everything that they were made from.

An entry is two files: the samples (npz) and a sidecar (JSON) with channels, provenance and a digest of
both. An entry whose digest does not fit is not trusted: the trace is made again.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import logging
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sysid.atomic import replacing
from sysid.errors import TraceError
from sysid.traces import Channel, Trace
from sysid.units import Reference

_FORMAT = 1
_log = logging.getLogger(__name__)


def default_cache_folder() -> Path:
    """``$SYSID_CACHE`` if it is set, else ``~/.cache/sysid``; for who has no home a folder for temporary files."""
    given = os.environ.get("SYSID_CACHE")
    try:
        return Path(given) if given else Path.home() / ".cache" / "sysid"
    except RuntimeError:  # a user without a name, as in a container
        from sysid.own_folders import own_folder

        return own_folder("cache")


def content_key(content: Mapping[str, Any]) -> str:
    """SHA-256 over plain data, whatever the order of its keys.

    Args:
        content: Everything that determines the result.

    Returns:
        64 hexadecimal digits.

    Example:
        >>> content_key({"a": 1, "b": 2}) == content_key({"b": 2, "a": 1})
        True
    """
    text = json.dumps({"format": _FORMAT, "content": content}, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True, kw_only=True)
class TraceCache:
    """A folder of traces by content key.

    Args:
        folder: Made when the first trace is stored.
    """

    folder: Path

    def load(self, key: str) -> Trace | None:
        """The trace of a key.

        Args:
            key: From :func:`content_key`.

        Returns:
            The trace, or ``None`` if there is none or its files are damaged.
        """
        samples, sidecar = self._files(key)
        try:
            raw, head = samples.read_bytes(), json.loads(sidecar.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            _log.warning("the cached trace %s cannot be read (%s) and is made again", sidecar, error)
            return None
        try:
            if head["digest"] != _digest(raw, head["trace"]):
                _log.warning("the cached trace %s is damaged and is made again", samples)
                return None
            return _unpack(raw, head["trace"])
        except (KeyError, TypeError, ValueError, zipfile.BadZipFile, TraceError) as error:
            _log.warning("the cached trace %s is damaged (%s) and is made again", samples, error)
            return None

    def has(self, key: str) -> bool:
        """Whether there is a trace, damaged or not.

        Args:
            key: From :func:`content_key`.

        Returns:
            Whether its files are there.
        """
        return all(file.is_file() for file in self._files(key))

    def note_time(self, generator: str, seconds: float) -> None:
        """Keep how long a generator took for a trace.

        Args:
            generator: Its name.
            seconds: How long.
        """
        times = self._times()
        before = times.get(generator, {"seconds": 0.0, "traces": 0})
        times[generator] = {"seconds": before["seconds"] + seconds, "traces": before["traces"] + 1}
        with contextlib.suppress(OSError), replacing(self._times_file) as draft:  # told, not decided by
            draft.write_text(json.dumps(times), encoding="utf-8")

    def mean_time(self, generator: str) -> float | None:
        """How long a generator takes for a trace on this machine.

        Args:
            generator: Its name.

        Returns:
            Seconds, the mean of those that it has made; ``None`` if it has made none.
        """
        known = self._times().get(generator)
        return None if known is None else float(known["seconds"]) / float(known["traces"])

    @property
    def _times_file(self) -> Path:
        return self.folder / "times.json"

    def _times(self) -> dict[str, Any]:
        try:
            return dict(json.loads(self._times_file.read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError):
            return {}

    def store(self, key: str, trace: Trace) -> None:
        """Keep a trace; a folder that cannot be written to is reported and otherwise ignored.

        Args:
            key: From :func:`content_key`.
            trace: The trace.
        """
        samples, sidecar = self._files(key)
        raw, head = _pack(trace)
        try:
            with replacing(samples) as draft:
                draft.write_bytes(raw)
            with replacing(sidecar) as draft:
                draft.write_text(json.dumps({"digest": _digest(raw, head), "trace": head}), encoding="utf-8")
        except OSError as error:
            # The trace is there; only the next call has to make it again.
            _log.warning("the trace %s was not cached in %s: %s", trace.name, self.folder, error)

    def _files(self, key: str) -> tuple[Path, Path]:
        return self.folder / "traces" / f"{key}.npz", self.folder / "traces" / f"{key}.json"


def _digest(raw: bytes, head: Mapping[str, Any]) -> str:
    return hashlib.sha256(raw + json.dumps(head, sort_keys=True).encode()).hexdigest()


def _pack(trace: Trace) -> tuple[bytes, dict[str, Any]]:
    buffer = io.BytesIO()
    arrays = {"values": trace.values} | ({} if trace.usable is None else {"usable": trace.usable})
    np.savez(buffer, allow_pickle=False, **arrays)
    head = {
        "name": trace.name,
        "sample_time": trace.sample_time,
        "start_time": trace.start_time,
        "channels": [[c.name, c.unit, c.reference.value, c.description] for c in trace.channels],
        "provenance": list(trace.provenance),
        "digest": trace.digest,
    }
    return buffer.getvalue(), head


def _unpack(raw: bytes, head: Mapping[str, Any]) -> Trace | None:
    with np.load(io.BytesIO(raw), allow_pickle=False) as arrays:
        values, usable = arrays["values"], arrays.get("usable")
    trace = Trace(
        name=head["name"],
        sample_time=head["sample_time"],
        start_time=head["start_time"],
        channels=tuple(
            Channel(name=name, unit=unit, reference=Reference(reference), description=text)
            for name, unit, reference, text in head["channels"]
        ),
        values=values,
        usable=usable,
        provenance=tuple(head["provenance"]),
    )
    return trace if trace.digest == head["digest"] else None
