"""The run folder: every result on disk before it is announced, found again by what it depends on.

A finished step leaves a stamp: the key of everything it depended on, and the SHA-256 of each file it wrote.
A later run whose key is the same, and whose files are whole, takes the stored result; anything else is done
again. The stamp is written last, so that a killed run can leave files without a stamp but never a stamp
without its files.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
import platform
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from sysid import bounded_text
from sysid.atomic import clear_drafts, write_bytes
from sysid.errors import ConfigError, UserError

LINE = "line.json"
"""What an assembly with interpolation leaves in its run folder."""


class BusyError(UserError):
    """Another process is working in the same folder."""


def write_json(path: Path, value: object) -> None:
    """Write JSON values, indented; a number that JSON has no word for becomes a string.

    Args:
        path: The file.
        value: JSON values.
    """
    text = json.dumps(strict(value), indent=1, ensure_ascii=False, allow_nan=False)
    write_bytes(path, (text + "\n").encode())


def strict(value: Any) -> Any:
    """The same values with NaN and the infinities as strings that ``float`` reads.

    Args:
        value: JSON values.

    Returns:
        A copy.

    Example:
        >>> strict({"r": float("nan"), "mse": [1.0, float("inf")]})
        {'r': 'NaN', 'mse': [1.0, 'Infinity']}
    """
    if isinstance(value, Mapping):
        return {str(key): strict(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [strict(entry) for entry in value]
    if isinstance(value, float | np.floating) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    return value


def read_json(path: Path) -> Any:
    """The JSON values of a file."""
    return bounded_text.read_json(path)


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write named arrays as npz.

    Args:
        path: The file.
        arrays: Arrays by name; nothing that would have to be pickled.
    """
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    write_bytes(path, buffer.getvalue())


def read_arrays(path: Path) -> dict[str, NDArray[np.float64]]:
    """The arrays that :func:`write_arrays` wrote, by name."""
    with np.load(path, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}


def digest(value: object) -> str:
    """SHA-256 of JSON values, whatever the order of their keys.

    Args:
        value: JSON values.

    Returns:
        64 hexadecimal digits.

    Example:
        >>> digest({"a": 1, "b": 2}) == digest({"b": 2, "a": 1})
        True
    """
    return hashlib.sha256(json.dumps(value, sort_keys=True, ensure_ascii=True).encode()).hexdigest()


@dataclass(frozen=True, kw_only=True)
class RunFolder:
    """The folder of one pipeline's results.

    Args:
        path: ``runs/<pipeline>`` unless told otherwise.
    """

    path: Path

    @property
    def results(self) -> Path:
        """The machine-readable results."""
        return self.path / "results.json"

    def fit(self, slug: str) -> Path:
        """Folder of one fit."""
        return self.path / "fits" / slug

    @property
    def bundle(self) -> Path:
        """The frozen surrogate."""
        return self.path / "bundle"

    def put_aside_bundle(self) -> None:
        """Keep the bundle of an earlier run under another name: it is not that of the model that is there now."""
        if self.bundle.is_dir():
            before = self.bundle.with_name("bundle-before")
            shutil.rmtree(before, ignore_errors=True)
            self.bundle.rename(before)

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other runs out of the folder.

        The operating system lets go of the lock when its process ends, however it ends: a killed run
        leaves nothing to clear up.

        Yields:
            Nothing.

        Raises:
            BusyError: If another run holds the folder.
            ConfigError: If the folder cannot be written to.
        """
        steps = self.path / ".steps"
        holder = steps / "holder.json"
        try:
            steps.mkdir(parents=True, exist_ok=True)
            lock = FileLock(steps / "lock", timeout=0)
            lock.acquire()
        except Timeout:
            raise BusyError(
                "another run is at work in this folder",
                where=self.path,
                expected="one run at a time",
                got=_describe(holder),
                remedy="wait until it is done, or give this run a folder of its own with --out",
            ) from None
        except OSError as error:
            raise ConfigError(
                "the run folder cannot be written to",
                where=self.path,
                got=error,
                remedy="choose another folder with --out",
            ) from error
        try:
            write_json(holder, {"pid": os.getpid(), "host": platform.node(), "since": time.strftime("%H:%M:%S")})
            clear_drafts(self.path)
            yield
        finally:
            lock.release()

    def is_done(self, step: str, key: str) -> bool:
        """Whether a step's result is stored, whole, and still what would come out.

        Args:
            step: Name of the step.
            key: Digest of everything the step depends on.

        Returns:
            Whether it need not be done again.
        """
        try:
            stamp = read_json(self._stamp(step))
            return bool(stamp["key"] == key) and all(
                _sha256(self.path / name) == sha for name, sha in stamp["files"].items()
            )
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            # A stamp or a file that cannot be read is no stamp: the step is done again.
            return False

    def mark_done(self, step: str, key: str, files: Sequence[Path], **facts: object) -> None:
        """Stamp a step whose files are written.

        Args:
            step: Name of the step.
            key: Digest of everything it depended on.
            files: What it wrote, inside the folder.
            facts: JSON values to keep with the stamp.
        """
        names = {file.relative_to(self.path).as_posix(): _sha256(file) for file in files}
        write_json(self._stamp(step), {"step": step, "key": key, "files": names, **facts})

    def facts(self, step: str) -> dict[str, Any]:
        """What was kept with a step's stamp."""
        return dict(read_json(self._stamp(step)))

    def checkpoint(self, step: str, key: str) -> dict[str, Any]:
        """Where a step stood when it was cut off.

        Args:
            step: Name of the step.
            key: Digest of everything it depends on.

        Returns:
            What :meth:`keep_checkpoint` was given; nothing if there is none, or it is of another key.
        """
        try:
            kept = read_json(self._checkpoint(step))
            return dict(kept["values"]) if kept["key"] == key else {}
        except (OSError, ValueError, KeyError, TypeError):
            # None, or none that can be read: the step begins anew.
            return {}

    def keep_checkpoint(self, step: str, key: str, values: Mapping[str, Any]) -> None:
        """Write down where a step stands.

        Args:
            step: Name of the step.
            key: Digest of everything it depends on.
            values: JSON values.
        """
        write_json(self._checkpoint(step), {"key": key, "values": values})

    def drop_checkpoint(self, step: str) -> None:
        """Forget where a step stood: it is done."""
        self._checkpoint(step).unlink(missing_ok=True)

    def keep_time(self, step: str, seconds: float, *, amount: object = None) -> None:
        """Write down how long a step took.

        Args:
            step: Name of the step.
            seconds: How long.
            amount: JSON values that say how much work it was.
        """
        times = self._known_times()
        times[step] = {"seconds": seconds, "amount": None if amount is None else digest(strict(amount))}
        write_json(self._times, times)

    def last_time(self, step: str, *, amount: object = None) -> float | None:
        """How long a step took when it was done last.

        Args:
            step: Name of the step.
            amount: JSON values that say how much work it is; ``None`` takes any.

        Returns:
            Seconds; ``None`` if it was never done here, or was another amount of work.
        """
        try:
            known = self._known_times()[step]
            same = amount is None or known["amount"] == digest(strict(amount))
            return float(known["seconds"]) if same else None
        except (KeyError, ValueError, TypeError):
            return None

    @property
    def _times(self) -> Path:
        return self.path / ".steps" / "times.json"

    def _known_times(self) -> dict[str, Any]:
        try:
            return dict(read_json(self._times))
        except (OSError, ValueError, TypeError):
            # Times are told, not decided by.
            return {}

    def _checkpoint(self, step: str) -> Path:
        return self.path / ".steps" / "checkpoints" / f"{step}.json"

    def _stamp(self, step: str) -> Path:
        return self.path / ".steps" / f"{step}.json"


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _describe(holder: Path) -> str:
    try:
        facts = read_json(holder)
        return f"process {facts['pid']} on {facts['host']} since {facts['since']}"
    except (OSError, ValueError, KeyError):
        # Between taking the lock and writing its name a holder is anonymous.
        return "a process that has just begun"
