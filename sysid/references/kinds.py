"""The table of kinds of references: what each is loaded by. A kind is a file here and a row."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from sysid.references.config import ReferenceConfig

FORMAT = 2
"""Of what runs mean; a change makes all that are kept void."""


class RunError(Exception):
    """Why a run gave no record, in a sentence for people."""


class Loaded(Protocol):
    """A reference that can be run, in the process that runs it."""

    @property
    def digest(self) -> str:
        """SHA-256 of what runs, as far as it can be known."""

    def run(
        self, inputs: NDArray[np.float64], parameters: Mapping[str, float]
    ) -> tuple[NDArray[np.float64] | None, NDArray[np.float64]]:
        """Run it once.

        Args:
            inputs: Each held from its sample to the next, shape ``(n, n_inputs)``.
            parameters: All that are set, by name.

        Returns:
            The outputs before the first sample, shape ``(n_outputs,)``, or ``None`` where they are not known; and the
            outputs, shape ``(n, n_outputs)``.

        Raises:
            RunError: If there is no record.
        """


KINDS: Final[Mapping[str, str]] = {
    "fmu": "sysid.references.fmu:FmuReference",
    "python": "sysid.references.callable:CallableReference",
    "program": "sysid.references.program:ProgramReference",
}
"""The class of each kind, which takes a configuration, by its address: only what is used is imported."""


def load(config: ReferenceConfig) -> Loaded:
    """Load a reference: **its code runs from here on**.

    Args:
        config: What it is; its paths are whole.

    Returns:
        It.

    Raises:
        UserError: If it cannot be loaded.
    """
    module, _, name = KINDS[config.kind].partition(":")
    loaded: Loaded = getattr(import_module(module), name)(config)
    return loaded


def checked(values: object, config: ReferenceConfig, samples: int) -> NDArray[np.float64]:
    """Outputs as they have to be.

    Args:
        values: What a reference gave.
        config: What it is.
        samples: How many samples were asked for.

    Returns:
        Shape ``(samples, n_outputs)``, finite.

    Raises:
        RunError: Saying what is wrong, and where.
    """
    names = list(config.outputs)
    found = _numbers(_by_name(values, names))
    if found.ndim == 1 and len(names) == 1:
        found = found[:, np.newaxis]
    if found.shape != (samples, len(names)):
        raise RunError(
            f"it gave an array of shape {found.shape}, where ({samples}, {len(names)}) was expected: a row a sample, "
            f"a column for each of {', '.join(names)}"
        )
    bad = np.argwhere(~np.isfinite(found))
    if len(bad):
        row, column = (int(one) for one in bad[0])
        raise RunError(f"{names[column]} is {found[row, column]} at {row * config.sample_time:g} s")
    return found


def _by_name(values: object, names: Sequence[str]) -> object:
    """Columns that have names by these, whatever their order; what has none as it is."""
    if isinstance(values, Mapping):
        columns: Mapping[Any, Any] = values
    elif hasattr(values, "columns") and hasattr(values, "__getitem__"):
        columns = {name: values[name] for name in values.columns}
        if list(columns) == list(range(len(columns))):  # a frame whose columns have numbers for names
            return values
    else:
        return values
    missing = [name for name in names if name not in columns]
    if missing:
        raise RunError(f"it gave no column {missing[0]}, only {', '.join(map(str, columns)) or 'none'}")
    parts = [_numbers(columns[name]) for name in names]
    if len({one.shape for one in parts}) > 1 or parts[0].ndim != 1:
        shapes = ", ".join(str(one.shape) for one in parts)
        raise RunError(f"it gave columns of shapes {shapes}, where a number a sample was expected in each")
    return np.column_stack(parts)


def _numbers(values: object) -> NDArray[np.float64]:
    """Real numbers; a masked one is none. Text is not taken for numbers, nor part of a complex number for it."""
    if isinstance(values, np.ma.MaskedArray) and values.dtype.kind in "biuf":
        return np.ma.filled(values.astype(np.float64), np.nan)
    try:
        found = np.asarray(values)
        if found.dtype.kind == "c":
            if found.imag.any():
                raise RunError("it gave complex numbers, where real ones were expected")
            found = found.real
        elif found.dtype.kind == "O":  # numbers of several kinds, and None for a missing one
            found = np.array([np.nan if one is None else one for one in found.ravel()], dtype=object).reshape(
                found.shape
            )
            if any(isinstance(one, str | bytes) for one in found.ravel()):
                raise TypeError
        elif found.dtype.kind not in "biuf":
            raise TypeError
        return found.astype(np.float64)
    except (TypeError, ValueError):
        raise RunError(f"it gave no numbers but {type(values).__name__}") from None


def with_files(own: str, config: ReferenceConfig, files: Sequence[str]) -> str:
    """A digest of a reference and of files that its results depend on.

    Args:
        own: What else they depend on.
        config: The reference.
        files: Paths in its folder; words that are no files say nothing.

    Returns:
        64 hexadecimal digits.
    """
    sha = hashlib.sha256(own.encode())
    for word in files:
        file = Path(config.folder) / word
        if len(word) < 4096 and file.is_file():
            sha.update(hashlib.sha256(file.read_bytes()).digest())
    return sha.hexdigest()
