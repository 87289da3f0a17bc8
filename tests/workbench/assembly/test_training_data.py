"""Which data sets train and choose a whole, round by round."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from sysid.composite.rounds.round import JointRound
from sysid.errors import ConfigError
from sysid.workbench.fits.record import read_fit
from tests.workbench.assembly.test_runner import run


def test_training_data_without_selection_are_refused(workspace: Path) -> None:
    file = workspace / "datasets" / "tanks" / "dataset.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("role: selection", "role: validation"), encoding="utf-8")
    with pytest.raises(ConfigError, match="lack a role"):
        run(workspace)


def test_several_training_data_sets_are_dealt_in_turn(workspace: Path) -> None:
    shutil.copytree(workspace / "datasets" / "tanks", workspace / "datasets" / "more")
    file = workspace / "datasets" / "more" / "dataset.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("name: tanks", "name: more"), encoding="utf-8")
    pipeline = workspace / "pipelines" / "tanks.yaml"
    both = pipeline.read_text(encoding="utf-8").replace("training: tanks", "training: [tanks, more]")
    pipeline.write_text(both, encoding="utf-8")
    assert run(workspace) == 0
    results = json.loads((workspace / "runs" / "tanks" / "results.json").read_text(encoding="utf-8"))
    assert set(results["data"]["others"]) == {"more"}
    both_ways = [read_fit(workspace / "runs" / "tanks" / "fits" / "upper-lower-0").model.to_dict()["theta"]]
    pipeline.write_text(both.replace("[tanks, more]", "tanks"), encoding="utf-8")
    assert run(workspace) == 0
    both_ways.append(read_fit(workspace / "runs" / "tanks" / "fits" / "upper-lower-0").model.to_dict()["theta"])
    assert both_ways[0] != both_ways[1]  # twice the traces: another weight of the prior


def test_a_round_may_have_traces_that_no_stage_before_it_has(workspace: Path) -> None:
    more = workspace / "datasets" / "more"
    shutil.copytree(workspace / "datasets" / "tanks", more)
    file = more / "dataset.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("name: tanks", "name: more"), encoding="utf-8")
    pipeline = workspace / "pipelines" / "tanks.yaml"
    text = pipeline.read_text(encoding="utf-8").replace(
        "checkpoints: 2}\n", "checkpoints: 2}\n  again: [{traces: 4}]\n"
    )
    pipeline.write_text(text, encoding="utf-8")
    assert run(workspace) == 0
    folder = workspace / "runs" / "tanks"
    files = [*folder.rglob("fit.json"), folder / "together.json", folder / "together-2.json"]
    stamps = [one.stat().st_mtime_ns for one in files]
    # A is dealt in twice now: as many copies of the others' share as there are traces
    pipeline.write_text(text.replace("{traces: 4}", "{traces: 4, also: [more]}"), encoding="utf-8")
    assert run(workspace) == 0
    changed = [one.stat().st_mtime_ns != stamp for one, stamp in zip(files, stamps, strict=True)]
    assert changed == [False] * (len(files) - 1) + [True]
    results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    assert set(results["data"]["others"]) == {"more"}


def test_data_of_a_round_choose_as_well(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    chosen_by = []

    def of(config, asked, whole, *, estimation, selection):
        chosen_by.append(len(selection))
        return make(config, asked, whole, estimation=estimation, selection=selection)

    make = JointRound.of
    monkeypatch.setattr(JointRound, "of", of)
    shutil.copytree(workspace / "datasets" / "tanks", workspace / "datasets" / "more")
    pipeline = workspace / "pipelines" / "tanks.yaml"
    text = pipeline.read_text(encoding="utf-8")
    pipeline.write_text(
        text.replace("checkpoints: 2}\n", "checkpoints: 2}\n  again: [{also: [more]}]\n"), encoding="utf-8"
    )
    assert run(workspace) == 0
    assert chosen_by[1] == 2 * chosen_by[0] > 0


def test_data_of_a_round_without_estimation_traces_are_refused(workspace: Path) -> None:
    more = workspace / "datasets" / "more"
    shutil.copytree(workspace / "datasets" / "tanks", more)
    file = more / "dataset.yaml"
    text = file.read_text(encoding="utf-8").replace("name: tanks", "name: more")
    file.write_text(text.replace("role: estimation", "role: validation"), encoding="utf-8")
    pipeline = workspace / "pipelines" / "tanks.yaml"
    asked = pipeline.read_text(encoding="utf-8").replace("checkpoints: 2}\n", "checkpoints: 2}\n  also: [more]\n")
    pipeline.write_text(asked, encoding="utf-8")
    with pytest.raises(ConfigError, match="the data of a round lack a role"):
        run(workspace)
