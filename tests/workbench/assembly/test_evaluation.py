"""What a frozen assembly says of itself: what it was trained and chosen on, apart from what it was scored on."""

from __future__ import annotations

import json
import re
from pathlib import Path

import jsonschema
import pytest

from sysid.export import read_bundle
from sysid.export.manifest import schema_text
from sysid.workbench.commands.run import run_request
from sysid.workbench.kinds import RunRequest
from tests.workbench.assembly.conftest import PIPELINE, assembly_results, write_tanks

QUICK = (
    PIPELINE.replace("candidates: 2", "candidates: 1")
    .replace("retrain: {members: [lower], max_iterations: 5}\n", "")
    .replace("export: null", "export: {formats: [c], tolerance: 1.0e-6}")
)
GROW = (
    "active_learning: {data: pool, outputs: [lower], within: 0.001, add: 1, rounds: 1, train: [{max_iterations: 2}]}\n"
)


def write_data(folder: Path, without: str) -> None:
    """The tanks once more under another name, without the cases of a role."""
    write_tanks(folder)
    file = folder / "dataset.yaml"
    text = file.read_text(encoding="utf-8").replace("name: tanks", f"name: {folder.name}")
    file.write_text(text.replace(f"role: {without}", "role: test"), encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new", "fitted", "chosen"),
    [
        pytest.param("", "", ["tanks"], ["tanks"], id="one data set"),
        pytest.param(
            "training: tanks", "training: [tanks, plain]", ["tanks", "plain"], ["tanks"], id="two to train on"
        ),
        pytest.param("seed: 3", "seed: 3\nselection: judge", ["tanks"], ["tanks", "judge"], id="one that chooses"),
        pytest.param(
            "checkpoints: 2}\n", "checkpoints: 2}\n  also: [plain]\n", ["tanks", "plain"], ["tanks"], id="of a round"
        ),
        pytest.param("monte_carlo:", f"{GROW}monte_carlo:", ["tanks", "pool"], ["tanks", "pool"], id="a pool"),
    ],
)
def test_a_bundle_names_what_it_was_trained_and_chosen_on(
    workspace: Path, old: str, new: str, fitted: list[str], chosen: list[str]
) -> None:
    for name, without in (("plain", "selection"), ("judge", "estimation"), ("pool", "test")):
        write_data(workspace / "datasets" / name, without)
    file = workspace / "pipelines" / "tanks.yaml"
    file.write_text(QUICK.replace(old, new, 1), encoding="utf-8")
    assert run_request(RunRequest(path=file, typed="tanks", tracking=False)) == 0

    folder = workspace / "runs" / "tanks"
    results = assembly_results(folder)
    digests = {results.data.name: results.data.digest, **results.data.others}
    manifest = read_bundle(folder / "bundle").metadata
    jsonschema.validate(manifest, json.loads(schema_text()))
    told = manifest["provenance"]["training"]
    assert told["fitted"] == [{"name": name, "sha256": digests[name]} for name in fitted]
    assert told["chosen"] == [{"name": name, "sha256": digests[name]} for name in chosen]

    card = (folder / "bundle" / "MODEL_CARD.md").read_text(encoding="utf-8")
    training, scored = re.search(r"## Training\n(.*)## Scored on\n(.*)## Accuracy", card, flags=re.DOTALL).groups()
    assert re.findall(r"Trained on data set (\w+), SHA-256 `(\w+)`", training) == [(n, digests[n]) for n in fitted]
    assert re.findall(r"Chosen on data set (\w+), SHA-256 `(\w+)`", training) == [(n, digests[n]) for n in chosen]
    assert f"- Data set tanks, SHA-256 `{digests['tanks']}`" in scored
    assert "| V | validation |" in scored


def test_a_bundle_says_how_its_whole_came_about(workspace: Path) -> None:
    """A whole that was begun from another one was trained on that one's data too: its first line says which."""
    file, further = workspace / "pipelines" / "tanks.yaml", workspace / "pipelines" / "further.yaml"
    file.write_text(QUICK, encoding="utf-8")
    further.write_text(QUICK.replace("name: tanks\n", "name: further\nwarm_start: ../runs/tanks/bundle\n", 1), "utf-8")
    for one in (file, further):
        assert run_request(RunRequest(path=one, typed=one.stem, tracking=False)) == 0
    bundle = workspace / "runs" / "further" / "bundle"
    (note,) = read_bundle(bundle).metadata["provenance"]["training"]["notes"]
    assert note.startswith("Begun from the networks of bundle (sysid run tanks; digest ")
    assert f"## Training\n\n- {note}\n- Trained on data set tanks" in (bundle / "MODEL_CARD.md").read_text("utf-8")
