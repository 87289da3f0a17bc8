"""Active learning in a run: each round is a stage, found again by a second run, and the report has its curve."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from sysid.composite.rounds.round import JointRound
from sysid.errors import ConfigError
from sysid.workbench.assembly.stage_config import ActiveLearningConfig
from sysid.workbench.commands.run import run_request
from sysid.workbench.kinds import RunRequest
from tests.references import slow_models
from tests.workbench.assembly.conftest import PIPELINE, assembly_results, write_tanks
from tests.workbench.assembly.test_config import config

ASKED = {"data": "pool", "outputs": ("AR", "BP"), "within": 0.1, "add": 3, "rounds": 4}


def test_a_round_may_add_as_many_as_it_names():
    assert ActiveLearningConfig.model_validate(ASKED | {"add": [10, 20, 40], "rounds": None}).additions == (10, 20, 40)
    assert ActiveLearningConfig.model_validate(ASKED).additions == (3, 3, 3, 3)
    assert ActiveLearningConfig(data="pool", outputs=("BC",), within=1.0).additions == (20,) * 5


GROWN = (
    "active_learning: {data: pool, outputs: [lower], within: 0.001, add: 1, rounds: 2, train: [{max_iterations: 2}]}\n"
)
LEAN = (
    PIPELINE.replace("candidates: 2", "candidates: 1")
    .replace("retrain: {members: [lower], max_iterations: 5}\n", "")
    .replace("checkpoints: 2}\n", "checkpoints: 2}\n  traces: 1\n", 1)
    .replace("monte_carlo: {data: tanks, output: lower, within: 0.5}\n", GROWN)
)
"""Trained end to end on one trace, then trained on the two too of the pool."""


@pytest.fixture
def pooled(workspace: Path) -> Path:
    """The workspace with a pool, other tanks of the same kind."""
    write_tanks(workspace / "datasets" / "pool", seed=10)
    file = workspace / "datasets" / "pool" / "dataset.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("name: tanks", "name: pool"), encoding="utf-8")
    return workspace


def run(workspace: Path, text: str, name: str = "tanks"):
    file = workspace / "pipelines" / f"{name}.yaml"
    file.write_text(text.replace("name: tanks", f"name: {name}"), encoding="utf-8")
    assert run_request(RunRequest(path=file, typed=name, tracking=False)) == 0
    return assembly_results(workspace / "runs" / name)


def test_a_run_grows_resumes_and_reports(pooled: Path) -> None:
    results = run(pooled, LEAN)
    stages = ["each alone", "trained end to end", "active learning, round 1", "active learning, round 2"]
    assert [one.name for one in results.stages] == stages
    (found,) = results.active_learning
    counts = [(len(one.added), one.traces, one.samples) for one in found.rounds]
    assert counts == [(0, 1, 300), (1, 2, 600), (1, 3, 900)]
    assert [(one.name, one.traces) for one in results.rounds] == [
        ("1", 1),
        ("1 of active learning", 2),
        ("2 of active learning", 3),
    ]
    assert found.pick == "worst"
    # The stages' score and the curve's are one figure: by the selection traces and those of the pool.
    assert [one.selection for one in results.stages[1:]] == [one.selection for one in found.rounds]

    files = [
        pooled / "runs" / "tanks" / f"{name}.json" for name in ("together", "active-learning-1", "active-learning-2")
    ]
    stamps = [one.stat().st_mtime_ns for one in files]
    assert run(pooled, LEAN).stages == results.stages
    assert [one.stat().st_mtime_ns for one in files] == stamps, "nothing is trained again"
    run(pooled, LEAN.replace("add: 1, rounds: 2", "add: [1, 1], pick: next"))
    assert files[0].stat().st_mtime_ns == stamps[0], "active learning leaves what was before it"


def test_where_there_is_a_stress_each_round_is_put_to_it(pooled: Path) -> None:
    text = LEAN + "monte_carlo: {data: tanks, output: lower, within: 0.5}\n"
    results = run(pooled, text)
    (chosen,) = [one for one in results.active_learning[0].rounds if one.stage == results.whole.stage]
    assert chosen.monte_carlo is not None
    assert results.monte_carlo is not None
    assert chosen.monte_carlo.p99 == pytest.approx(results.monte_carlo.quantiles[0.99])
    assert chosen.monte_carlo.within == results.monte_carlo.within


def test_each_round_goes_through_several_trainings_that_have_all_that_was_added(
    pooled: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple] = []

    def of(config, one, whole, *, estimation, selection):
        asked.append((one.members, tuple(one.measured), one.training.max_iterations, len(estimation), len(selection)))
        return make(config, one, whole, estimation=estimation, selection=selection)

    make = JointRound.of
    monkeypatch.setattr(JointRound, "of", of)
    two = "[{members: [upper], measured: [lower], targets: {upper: 0.1}, max_iterations: 1}, {max_iterations: 2}]"
    results = run(pooled, LEAN.replace("train: [{max_iterations: 2}]", f"train: {two}"))
    # The pool's sequence that trains nothing chooses with the other one as soon as the pool's train.
    assert asked == [
        (None, (), 4, 1, 1),
        (("upper",), ("lower",), 1, 2, 2),
        (("upper",), ("lower",), 2, 2, 2),
        (("upper",), ("lower",), 1, 3, 2),
        (("upper",), ("lower",), 2, 3, 2),
    ]
    assert [one.name for one in results.rounds[1:]] == [
        f"{one} of active learning" for one in ("1.1", "1.2", "2.1", "2.2")
    ]
    assert (pooled / "runs" / "tanks" / "active-learning-2-2.json").is_file()


def test_what_is_begun_from_another_whole_grows_too(pooled: Path) -> None:
    run(pooled, LEAN.replace("export: null", "export: {formats: [c]}").replace(GROWN, ""))
    results = run(pooled, LEAN.replace("seed: 3", "seed: 3\nwarm_start: ../runs/tanks/bundle"), "further")
    stages = ["as it was begun from", "trained end to end", "active learning, round 1", "active learning, round 2"]
    assert [one.name for one in results.stages] == stages


def test_a_pool_without_sequences_that_train_nothing_is_refused(pooled: Path) -> None:
    file = pooled / "datasets" / "pool" / "dataset.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("selection", "validation"), encoding="utf-8")
    with pytest.raises(ConfigError, match="the pool lacks a role"):
        run(pooled, LEAN)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("data: pool", "data: tanks", "the pool of active_learning is used otherwise: tanks is under training"),
        ("training: tanks", "training: [tanks, pool]", "pool is under training"),
        ("data: tanks\n", "data: pool\n", "pool is under data"),
        ("outputs: [lower], within", "outputs: [level], within", "active_learning, outputs names level"),
        ("{max_iterations: 2}]", "{members: [level]}]", "active_learning, train, members names level"),
        ("{max_iterations: 2}]", "{targets: {level: 1}}]", "active_learning, train, targets names level"),
        ("{max_iterations: 2}]", "{measured: [lower]}]", "lower is to be as measured, and trained or judged"),
        ("{max_iterations: 2}]", "{share_weights: true}]", "that shares weights names no members"),
        ("{max_iterations: 2}]", "{traces: 2}]", "traces"),
        ("{max_iterations: 2}]", "{reads: {upper: {lower: 2}}}]", "reads"),
        ("{max_iterations: 2}]", "]", "train"),
        ("rounds: 2", "rounds: 2, pick: best", "pick"),
        ("add: 1, rounds: 2", "add: [1, 2], rounds: 3", "3 rounds of active learning, and what to add in 2"),
        ("add: 1", "add: 0", "add"),
    ],
)
def test_what_cannot_be_grown_is_refused(workspace: Path, old: str, new: str, complaint: str) -> None:
    assert old in LEAN
    with pytest.raises(ConfigError, match=complaint):
        run(workspace, LEAN.replace(old, new, 1))


def test_active_learning_goes_on_from_training_end_to_end(workspace: Path) -> None:
    before, _, behind = LEAN.partition("together:")
    with pytest.raises(ConfigError, match="active learning without training end to end"):
        run(workspace, before + behind[behind.index("active_learning:") :])


def test_the_rounds_of_active_learning_are_the_last_one_before_but_for_what_they_name():
    text = LEAN.replace("train: [{max_iterations: 2}]", "train: [{max_iterations: 2}, {targets: {lower: 0.3}}]")
    asked = config(text)
    last = asked.joint[-1]
    first, second = asked.learning_rounds
    assert (first.targets, second.targets) == (last.targets, {"lower": 0.3})
    assert [one.training.max_iterations for one in (last, first, second)] == [4, 2, 2]
    assert first.traces == second.traces == 1
    assert config(LEAN.replace(", train: [{max_iterations: 2}]", "")).learning_rounds == (last,)


def test_a_share_of_none_is_nothing_to_aim_at():
    with pytest.raises(ValidationError, match="until"):
        ActiveLearningConfig(data="pool", outputs=("BC",), within=1.0, until=0.0)


ASKED_FOR = """\
kind: experiment
name: tank-runs
reference:
  python: {module}:tanks
  folder: {folder}
  sample_time: 1.0
  inputs: {{pump: {{unit: cm, range: [0, 2], start: 0}}}}
  outputs: {{upper: {{unit: cm}}, lower: {{unit: cm}}}}
experiment: {{duration: 150, runs: {{estimation: 2, selection: 1, test: 0}}, excitations: [events], hold: [10, 30]}}
workers: 1
"""
ASKING = GROWN.replace("{data: pool,", "{data: tank-runs.yaml, candidates: 2, held_out: 2, duration: 100,")


def test_it_adds_new_runs_that_a_reference_is_asked_for(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(workspace / "cache"))
    (workspace / "pipelines" / "tank-runs.yaml").write_text(
        ASKED_FOR.format(module=Path(slow_models.__file__).stem, folder=Path(slow_models.__file__).parent),
        encoding="utf-8",
    )
    text = LEAN.replace(GROWN, ASKING).replace("training: tanks", "training: tank-runs.yaml")
    results = run(workspace, text)
    (found,) = results.active_learning
    assert [one.added for one in found.rounds[:1]] == [[]]
    # The second round looks at what the first has left, too; 150 samples were fitted first, 100 are added each time.
    assert all(name[:3] in {"G1N", "G2N"} for one in found.rounds[1:] for name in one.added)
    assert [one.samples for one in found.rounds] == [150, 250, 350]
    assert found.held_out == 2
    kept = {one: one.stat().st_mtime_ns for one in (workspace / "cache").rglob("*") if one.is_file()}
    assert run(workspace, text).stages == results.stages
    assert {one: one.stat().st_mtime_ns for one in kept} == kept, "nothing is run again"


def test_only_a_reference_is_asked_for_new_runs_and_how_many_is_said(pooled: Path) -> None:
    with pytest.raises(ConfigError, match="only a pipeline of kind experiment can be asked"):
        run(pooled, LEAN.replace(GROWN, ASKING.replace("tank-runs.yaml", "tanks")))
    with pytest.raises(ValidationError, match="told how many of each"):
        ActiveLearningConfig.model_validate(ASKED | {"candidates": 3})
