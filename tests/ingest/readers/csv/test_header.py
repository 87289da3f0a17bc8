"""Heads above numbers: between other marks than these, in two comments, or of numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.ingest import inspect_file

N = 20
U = np.repeat([1.0, 3.0, 2.0, 4.0], 5)
Y = np.round(np.convolve(U, 0.2 * 0.8 ** np.arange(N))[:N], 4)


def written(path: Path, mark: str, *head: str) -> Path:
    rows = (mark.join((f"{k / 10:.1f}", f"{U[k]}", f"{Y[k]}")) for k in range(N))
    path.write_text("\n".join([*head, *rows, ""]), encoding="utf-8")
    return path


@pytest.mark.filterwarnings("ignore::sysid.ingest.inspecting.undescribed.GuessedWarning")
@pytest.mark.parametrize(
    ("mark", "head", "names", "unit"),
    [
        (" ", ["t,u,y"], ["u", "y"], "1"),
        (";", ["t\tu\ty"], ["u", "y"], "1"),
        (" ", ["; t u y", "; s V V"], ["u", "y"], "V"),
        (",", [",100,200"], ["100", "200"], "1"),
        ("\t", ["\t0.25\t0.5"], ["0.25", "0.5"], "1"),
    ],
)
def test_a_head_is_found(tmp_path: Path, mark: str, head: list[str], names: list[str], unit: str) -> None:
    (trace,) = sysid.load(written(tmp_path / "a.txt", mark, *head)).traces
    assert [channel.name for channel in trace.channels] == names
    assert {channel.unit for channel in trace.channels} == {unit}
    assert trace.sample_time == pytest.approx(0.1)
    np.testing.assert_array_equal(trace[names[1]], Y)


def test_a_title_is_no_head_between_other_marks(tmp_path: Path) -> None:
    found = inspect_file(written(tmp_path / "a.csv", " ", "rig 4, second, second"))
    assert "second" not in [column.name for column in found.columns]


def test_a_table_between_strokes_may_have_any_name(tmp_path: Path) -> None:
    rows = (f"| {k / 10:.1f} | {U[k]} | {Y[k]} |" for k in range(N))
    (tmp_path / "notes.md").write_text("\n".join(["| t [s] | u [V] | y [V] |", "|---|---|---|", *rows, ""]))
    (trace,) = sysid.load(tmp_path / "notes.md").traces
    np.testing.assert_array_equal(trace["y"], Y)
