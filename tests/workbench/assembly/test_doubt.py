"""``doubt`` of a pipeline: what is exported says where it does not know, by what the library makes of the same."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sysid.composite import doubting
from sysid.errors import ConfigError
from sysid.export import read_bundle
from sysid.ingest import load_dataset
from sysid.workbench.assembly.proof_config import DoubtConfig
from sysid.workbench.assembly.runner import read_assembly
from sysid.workbench.cli import app
from sysid.yaml_files import parse_yaml, yaml_text
from tests.workbench.assembly.conftest import write_tanks
from tests.workbench.assembly.test_warm_start import FIRST, SECOND, first_whole, run, trained  # noqa: F401

DOUBT = (
    "doubt: {output: lower, error: 0.05, data: calm, "
    "perturb: [{channel: upper, by: 0.1}], beside: [../runs/tanks/bundle]}\n"
)


@pytest.mark.usefixtures("trained")
def test_the_bundle_doubts_and_answers_as_before(workspace: Path) -> None:
    write_tanks(workspace / "datasets" / "calm", seed=50)
    text = SECOND.replace("export: null", "export: {formats: [c]}") + DOUBT
    assert "export: {formats: [c]}" in text
    folder = run(workspace, "further", text)
    whole, bundle = read_assembly(folder), read_bundle(folder / "bundle").model
    asked = DoubtConfig(output="lower", error=0.05, data="calm", perturb=[{"channel": "upper", "by": 0.1}])
    beside = [read_bundle(workspace / "runs" / "tanks" / "bundle").model]
    by_hand = doubting(whole, asked.asked(), tuple(load_dataset("calm")), beside=beside)
    assert json.loads(json.dumps(bundle.to_dict())) == json.loads(json.dumps(by_hand.whole.to_dict()))
    assert "lower_apart_2" in bundle.outputs
    assert by_hand.sentence.split(";")[0] in (folder / "log.txt").read_text(encoding="utf-8")
    assert by_hand.sentence in (folder / "bundle" / "MODEL_CARD.md").read_text(encoding="utf-8")
    assert by_hand.sentence in (folder / "results.json").read_text(encoding="utf-8")


@pytest.mark.usefixtures("trained")
def test_a_bundle_doubts_by_command_as_it_does_by_pipeline(workspace: Path) -> None:
    write_tanks(workspace / "datasets" / "calm", seed=50)
    text = SECOND.replace("export: null", "export: {formats: [c]}")
    made = run(workspace, "further", text + DOUBT)
    plain = run(workspace, "plain", text.replace("name: further", "name: plain"))
    (workspace / "pipelines" / "doubt.yaml").write_text(
        yaml_text(parse_yaml(DOUBT, where="")["doubt"]), encoding="utf-8"
    )
    asked = ["export", str(plain / "bundle"), "--doubt", str(workspace / "pipelines" / "doubt.yaml")]
    assert CliRunner().invoke(app, asked).exit_code == 0
    by_command, by_pipeline = read_bundle(plain / "bundle-doubting"), read_bundle(made / "bundle")
    assert by_command.model.to_dict() == by_pipeline.model.to_dict()
    alike = ("structure", "stages", "model", "n_parameters", "state", "outputs", "inputs", "initialisation")
    for name in alike:
        assert by_command.metadata[name] == by_pipeline.metadata[name], name
    assert by_command.metadata["provenance"]["doubt"] == by_pipeline.metadata["provenance"]["doubt"]
    assert not read_bundle(plain / "bundle").metadata["provenance"].get("doubt")


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        (("data: calm", "data: tanks"), "found on what was trained on"),
        (("output: lower", "output: middle"), "doubt, output names middle"),
        ((", perturb: [{channel: upper, by: 0.1}], beside: [../runs/tanks/bundle]", ""), "nobody doubts"),
        (("by: 0.1", "by: -0.1"), "by"),
    ],
)
def test_what_cannot_be_doubted_is_said_before_anything_is_trained(
    workspace: Path, changed: tuple[str, str], complaint: str
) -> None:
    with pytest.raises(ConfigError, match=complaint):
        run(workspace, "tanks", FIRST + DOUBT.replace(*changed))
    assert not (workspace / "runs" / "tanks" / "together.json").exists()
