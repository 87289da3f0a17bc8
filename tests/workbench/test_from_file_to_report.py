"""What ``sysid ingest`` proposes runs as proposed: file, proposal, run and report, with nothing in between."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.reporting.results import read_results
from sysid.workbench.cli import run_cli
from tests.ingest.readers import test_zoo_binary as binary
from tests.ingest.readers import test_zoo_text as text

PIPELINE = """\
name: rig
data: rig
mapping: {{inputs: ["{u}"], output: "{y}"}}
fits: [{{name: ARX, structure: {{kind: ARX, na: 1, nb: [1], nk: [1]}}}}]
export: null
"""
TEXTS = ["semicolon, decimal comma, Windows", "Fortran, D exponents, a count above", "long table", "epoch in ms"]
BINARIES = [
    "MAT 5: two iddata", "MAT 7.3: vectors", "Modelica: binTrans", "HDF5: groups", "npz: EST and VAL",
    "JSON: rows", "Parquet", "xlsx: title, units row", "TDMS", "MDF 4: two rates",
]  # fmt: skip


def written(kind: str, folder: Path) -> tuple[Path, str, str]:
    """The file of a kind, and what its two channels are called."""
    if kind in text.ZOO:
        animal = text.ZOO[kind]
        path = folder / f"record{animal.suffix}"
        path.write_bytes(animal.text.encode(animal.encoding))
        return path, animal.u, animal.y
    name, make, (u, y), _ = binary.ZOO[kind]
    make(folder / name)
    return folder / name, u, y


@pytest.mark.parametrize("kind", [*TEXTS, *BINARIES])
def test_what_is_proposed_runs(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    # What a picture shows is tested where it is drawn.
    monkeypatch.setattr("sysid.workbench.commands.ingest._picture", lambda *_: "none")
    path, u, y = written(kind, tmp_path)
    assert run_cli(["ingest", str(path), "--propose", "datasets/rig/dataset.yaml"]) == 0
    (tmp_path / "pipelines").mkdir()
    (tmp_path / "pipelines" / "rig.yaml").write_text(PIPELINE.format(u=u, y=y), encoding="utf-8")
    assert run_cli(["run", "rig", "--no-tracking"]) == 0
    (fit,) = read_results(tmp_path / "runs" / "rig").fits
    # y is 0.8 of its last value and 0.2 of the last input, as good as the files keep it.
    assert min(case.free_run.nrmse_fit for case in fit.cases.values()) > 99.9
    assert (tmp_path / "runs" / "rig" / "report" / "index.html").stat().st_size > 10_000
