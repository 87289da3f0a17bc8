"""The stored signals of a run: target, free run and one-step prediction of every case."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError

SIGNALS_FILE: Final = "signals.npz"
MONTE_CARLO_FILE: Final = "monte-carlo.npz"
"""Of an assembly: the random sequences that it is worst on."""

_PARTS: Final = ("time", "target", "simulated")
_OPTIONAL: Final = ("predicted", "low", "high", "counts")


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseSignals:
    """One fit on one case, sample by sample.

    Args:
        time: Seconds, shape ``(n_samples,)``.
        target: Measured output, shape ``(n_samples,)``.
        simulated: Free run, shape ``(n_samples,)``.
        predicted: One step ahead, shape ``(n_samples,)``; ``None`` of an assembly, which has no such run.
        low: Lower end of the free run's interval, shape ``(n_samples,)``; ``None`` where there is none.
        high: Upper end of it.
        counts: 1 where figures count the sample, 0 where it is masked; ``None`` where all count.
    """

    time: NDArray[np.float64]
    target: NDArray[np.float64]
    simulated: NDArray[np.float64]
    predicted: NDArray[np.float64] | None = None
    low: NDArray[np.float64] | None = None
    high: NDArray[np.float64] | None = None
    counts: NDArray[np.float64] | None = None

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Which samples figures count, shape ``(n_samples,)``: not those that are masked."""
        return np.ones(len(self.target), dtype=np.bool_) if self.counts is None else np.asarray(self.counts > 0.0)

    @property
    def error(self) -> NDArray[np.float64]:
        """Free run minus target, shape ``(n_samples,)``; NaN where the free run is not finite."""
        simulated = np.where(np.isfinite(self.simulated), self.simulated, np.nan)
        return np.asarray(simulated - self.target)


def read_signals(folder: Path, cases: list[str], *, of: str = "", file: str = SIGNALS_FILE) -> dict[str, CaseSignals]:
    """Read the signals of one fit, or of an output of an assembly.

    Args:
        folder: The fit's folder, or the run folder of an assembly.
        cases: Names of the cases that are wanted.
        of: The output, of an assembly.
        file: Name of the file.

    Returns:
        The signals by case, in the order asked for.

    Raises:
        ConfigError: If the file is missing or damaged, or a case is not in it.
    """
    path, before = Path(folder) / file, f"{of}/" if of else ""
    try:
        # Opened here: NumPy leaves its own file open when the archive turns out to be damaged.
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as stored:
            return {case: _case(stored, f"{before}{case}", path) for case in cases}
    except FileNotFoundError as error:
        raise _damaged(path, "the signals of the run", "no such file") from error
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise _damaged(path, "a NumPy .npz archive of plain arrays", error) from error


def _case(stored: np.lib.npyio.NpzFile, case: str, path: Path) -> CaseSignals:
    missing = [f"{case}/{part}" for part in _PARTS if f"{case}/{part}" not in stored.files]
    if missing:
        raise _damaged(path, ", ".join(missing), f"arrays of {_present(stored)}")
    kept = [*_PARTS, *(part for part in _OPTIONAL if f"{case}/{part}" in stored.files)]
    parts = {part: np.asarray(stored[f"{case}/{part}"], dtype=np.float64) for part in kept}
    shapes = {array.shape for array in parts.values()}
    if len(shapes) != 1 or len(next(iter(shapes))) != 1 or next(iter(shapes)) == (0,):
        raise _damaged(path, f"arrays of case {case} with one and the same length", sorted(shapes))
    # A model that predicts nothing from measured output has stored so.
    return CaseSignals(**{part: array for part, array in parts.items() if part in _PARTS or not np.isnan(array).all()})


def _present(stored: np.lib.npyio.NpzFile) -> str:
    return ", ".join(dict.fromkeys(name.partition("/")[0] for name in stored.files)) or "no case"


def _damaged(path: Path, expected: object, got: object) -> ConfigError:
    return ConfigError(
        "the stored signals cannot be read",
        where=path,
        expected=expected,
        got=got,
        remedy="run the pipeline again; it resumes from what is finished",
    )
