"""A surrogate whose structure is given in the pipeline of its experiments, in place of a search."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

import sysid
from sysid.errors import ConfigError
from sysid.yaml_files import read_yaml

pytest.importorskip("fmpy")
MODELS = Path(__file__).parents[2] / "references"


def pipeline(folder: Path, equations: str, **more: object) -> Path:
    structure = {"kind": "GreyBox", "equations": equations, "parameters": {"a": 0.5}, "initial": {"x": 0}}
    content = {
        "kind": "experiment", "name": "lag", "workers": 1,
        "reference": {
            "python": "slow_models:first_order", "folder": str(MODELS), "sample_time": 0.5,
            "inputs": {"u": {"unit": "V", "range": [0, 2], "start": 0}}, "outputs": {"y": {"unit": "V"}},
        },
        "experiment": {"duration": 40.0, "runs": {"estimation": 4, "selection": 1, "test": 1}},
        "fits": [{"name": "known", "structure": structure, "training": {"starts": 1}}],
        **more,
    }  # fmt: skip
    path = folder / "lag.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path


def test_equations_that_are_known_are_fitted_exported_and_proven(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    file = pipeline(tmp_path, "y = a*x + (1 - a)*u\nx[k+1] = y")
    made = sysid.surrogate(file, tmp_path / "out", minutes=1.0, proof=6)
    assert made.fmu is not None
    assert made.proof.errors.shape == (6, 1)
    assert made.proof.errors.max() < 1e-6
    assert made.proof.dropped is not None
    assert made.proof.dropped < 1e-9
    # What chooses counts as the proof does.
    chosen = read_yaml(tmp_path / "out" / "model" / "pipeline.yaml")
    assert chosen["tolerance"] == made.proof.tolerance


def test_what_does_not_go_together_is_refused_before_anything_is_run(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"\bw\b"):
        sysid.surrogate(pipeline(tmp_path, "y = a*x + w\nx[k+1] = y"), tmp_path / "out")
    known = "y = a*x + (1 - a)*u\nx[k+1] = y"
    with pytest.raises(ConfigError, match="grow around what a search"):
        sysid.surrogate(pipeline(tmp_path, known), tmp_path / "out", rounds=2)
    with pytest.raises(ConfigError, match="grow around what a search"):
        sysid.surrogate(pipeline(tmp_path, known, grow={"rounds": 2}), tmp_path / "out")
    for minutes in (0.0, 0.01, -1.0, float("nan"), float("inf")):
        with pytest.raises(ConfigError, match="there is no such time"):
            sysid.surrogate(pipeline(tmp_path, known), tmp_path / "out", minutes=minutes)
    assert not (tmp_path / "out").exists()


def test_an_output_that_never_moves_is_refused_before_a_model_is_looked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    file = pipeline(tmp_path, "y = a*x + (1 - a)*u\nx[k+1] = y")
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    content["reference"]["python"] = "slow_models:stands_still"
    file.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    with pytest.raises(ConfigError, match="y has one value in all experiments"):
        sysid.surrogate(file, tmp_path / "out", minutes=1.0)
