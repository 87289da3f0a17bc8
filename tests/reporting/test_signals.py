"""Stored signals: read as written, refused where damaged, never unpickled."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.reporting import read_signals

PARTS = ("time", "target", "simulated", "predicted")


def _write(folder: Path, **arrays: object) -> None:
    full = {f"A/{part}": np.arange(3.0) for part in PARTS} | arrays
    np.savez(folder / "signals.npz", **{key: value for key, value in full.items() if value is not None})  # type: ignore[arg-type]  # names are free


def test_signals_come_back_case_by_case(tmp_path: Path) -> None:
    _write(tmp_path, **{"A/simulated": np.array([0.0, 3.0, np.inf])})
    case = read_signals(tmp_path, ["A"])["A"]
    assert case.time.tolist() == [0.0, 1.0, 2.0]
    np.testing.assert_array_equal(case.error, [0.0, 2.0, np.nan])


def _no_file(folder: Path) -> None:
    pass


def _no_archive(folder: Path) -> None:
    (folder / "signals.npz").write_bytes(b"not an archive")


def _cut_off(folder: Path) -> None:
    _write(folder)
    data = (folder / "signals.npz").read_bytes()
    (folder / "signals.npz").write_bytes(data[: len(data) // 2])


def _other_case(folder: Path) -> None:
    np.savez(folder / "signals.npz", **{"B/time": np.arange(3.0)})  # type: ignore[arg-type]  # names are free


def _missing_part(folder: Path) -> None:
    _write(folder, **{"A/simulated": None})


def _unequal(folder: Path) -> None:
    _write(folder, **{"A/target": np.arange(4.0)})


def _empty(folder: Path) -> None:
    _write(folder, **{f"A/{part}": np.empty(0) for part in PARTS})


def _pickled(folder: Path) -> None:
    _write(folder, **{"A/time": np.array([object()], dtype=object)})


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        pytest.param(_no_file, "no such file", id="no-file"),
        pytest.param(_no_archive, "npz archive", id="no-archive"),
        pytest.param(_cut_off, "npz archive", id="cut-off"),
        pytest.param(_other_case, "arrays of B", id="case-not-stored"),
        pytest.param(_missing_part, "A/simulated", id="part-not-stored"),
        pytest.param(_unequal, "one and the same length", id="unequal-lengths"),
        pytest.param(_empty, "one and the same length", id="no-samples"),
        pytest.param(_pickled, "npz archive", id="pickled-objects"),
    ],
)
def test_damaged_signals_are_refused(tmp_path: Path, damage: Callable[[Path], None], words: str) -> None:
    damage(tmp_path)
    with pytest.raises(ConfigError, match=words):
        read_signals(tmp_path, ["A"])


def test_an_assembly_has_no_run_one_step_ahead_and_its_outputs_stand_apart(tmp_path: Path) -> None:
    arrays = {f"{output}/A/{part}": np.arange(3.0) + k for k, output in enumerate("yz") for part in PARTS[:3]}
    np.savez(tmp_path / "signals.npz", **arrays)  # type: ignore[arg-type]  # names are free
    found = read_signals(tmp_path, ["A"], of="z")["A"]
    assert found.predicted is None
    assert found.target.tolist() == [1.0, 2.0, 3.0]
