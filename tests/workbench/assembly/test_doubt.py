"""``doubt`` of a pipeline: what is exported says where it does not know, by what the library makes of the same."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sysid.composite import doubting
from sysid.errors import ConfigError
from sysid.export import read_bundle
from sysid.ingest import load_dataset
from sysid.workbench.assembly.proof_config import DoubtConfig
from sysid.workbench.assembly.runner import read_assembly
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
