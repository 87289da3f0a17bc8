"""Growth in a run: each round is a stage, a second run finds every round again, and the report has its curve."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from sysid.composite.active_learning import Look
from sysid.composite.round import JointRound
from sysid.errors import ConfigError
from sysid.reporting.judging.results import read_judgement_results
from sysid.workbench.assembly.runner import run_assembly
from sysid.workbench.assembly.stage_config import GrowConfig
from sysid.workbench.assembly.views import growth_charts, growth_table
from sysid.workbench.kinds import RunRequest
from tests.composite.test_active_learning import Trained
from tests.workbench.assembly.conftest import PIPELINE, write_tanks
from tests.workbench.assembly.test_config import config

ASKED = {"data": "pool", "outputs": ("AR", "BP"), "within": 0.1, "add": 3, "rounds": 4}


def test_a_round_may_add_as_many_as_it_names():
    assert GrowConfig.model_validate(ASKED | {"add": [10, 20, 40], "rounds": None}).additions == (10, 20, 40)
    assert GrowConfig.model_validate(ASKED).additions == (3, 3, 3, 3)
    assert GrowConfig(data="pool", outputs=("BC",), within=1.0).additions == (20,) * 5


def test_the_table_counts_what_is_counted_and_the_curves_have_a_point_for_each_round():
    found = Trained(right_after=(2,)).found
    table = growth_table(found, "grown, round 2")
    assert [row[0] for row in table["rows"]] == ["0", "1", "2 (chosen)"]
    counts = [row[1:4] for row in table["rows"]]
    assert counts == [[0, 2, 120], [3, 5, 300], [3, 8, 480]]
    assert all(type(value) is int for row in counts for value in row)
    assert [row[4] for row in table["rows"]] == [None, 2.5, 2.5]
    assert table["rows"][2][5] == 100.0
    assert [head[0] for head in table["head"][5:6]] == ["Under 0.1 psi"]
    error, share = growth_charts(found)
    assert error["y"] == "root mean square error of a sequence (psi)"
    assert (error["logarithmic"], share["logarithmic"]) == (True, "x")
    for chart in (error, share):
        assert all(line["x"] == [120.0, 300.0, 480.0] for line in chart["lines"])
        assert [line["points"] for line in chart["lines"]] == [not line["target"] for line in chart["lines"]]
    assert error["lines"][0]["y"] == [each.look.rare for each in found.rounds]
    assert share["lines"][0]["y"] == [100.0 * each.look.within for each in found.rounds]


def test_stages_on_random_sequences_stand_beside_what_the_pool_says():
    found = Trained(right_after=(2,)).found
    looks = {one.stage: Look(within=0.1 * one.number, median=0.0, rare=5.0 - one.number) for one in found.rounds}
    table = growth_table(found, "grown, round 2", looks)
    assert all(len(row) == len(table["head"]) for row in table["rows"])
    assert [row[-2:] for row in table["rows"]] == [[0.0, 5.0], [pytest.approx(10.0), 4.0], [pytest.approx(20.0), 3.0]]
    lines = {line["name"]: line["y"] for line in growth_charts(found, looks)[0]["lines"]}
    assert lines["99 % of the random sequences under"] == [5.0, 4.0, 3.0]
    # A stage that was not run on them has no figure, and the curve none at all.
    partial = {stage: look for stage, look in looks.items() if look.rare < 5.0}
    assert growth_table(found, "grown, round 2", partial)["rows"][0][-2:] == [None, None]
    assert all("random" not in line["name"] for line in growth_charts(found, partial)[0]["lines"])


GROWN = "grow: {data: pool, outputs: [lower], within: 0.001, add: 1, rounds: 2, train: [{max_iterations: 2}]}\n"
LEAN = (
    PIPELINE.replace("candidates: 2", "candidates: 1")
    .replace("retrain: {members: [lower], max_iterations: 5}\n", "")
    .replace("looks: 2}\n", "looks: 2}\n  traces: 1\n", 1)
    .replace("stress: {data: tanks, output: lower, within: 0.5}\n", GROWN)
)
"""Trained end to end on one trace, then grown by the two of the pool."""


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
    assert run_assembly(RunRequest(path=file, typed=name, tracking=False)) == 0
    found = read_judgement_results(workspace / "runs" / name)
    assert found is not None
    return found


def test_a_run_grows_resumes_and_reports(pooled: Path) -> None:
    results = run(pooled, LEAN)
    stages = ["each alone", "trained end to end", "grown, round 1", "grown, round 2"]
    assert [one.name for one in results.subjects] == stages
    found = results.judgement
    assert [row[0].removesuffix(" (chosen)") for row in found.tables[0].rows[: len(stages)]] == stages
    assert [one.title for one in found.charts][:2] == ["Error over data", "Share over data"]
    rows = next(one.rows for one in found.tables if one.caption.startswith("How much data"))
    assert [row[1:4] for row in rows] == [[0, 1, 300], [1, 2, 600], [1, 3, 900]]
    rounds = next(one.rows for one in found.tables if one.caption.startswith("Training end to end"))
    assert [(row[0], row[3]) for row in rounds] == [("1", 1), ("1 of growth", 2), ("2 of growth", 3)]
    assert any("Grown over 2 rounds by 2 sequences, at which the whole was worst" in one for one in found.sentences)
    # The stages' score and the curve's are one figure: by the selection traces and those of the pool.
    assert [row[-1] for row in found.tables[0].rows[1 : len(stages)]] == [row[-1] for row in rows]

    files = [pooled / "runs" / "tanks" / f"{name}.json" for name in ("together", "grown-1", "grown-2")]
    stamps = [one.stat().st_mtime_ns for one in files]
    assert run(pooled, LEAN).judgement.tables[0] == found.tables[0]
    assert [one.stat().st_mtime_ns for one in files] == stamps, "nothing is trained again"
    run(pooled, LEAN.replace("add: 1, rounds: 2", "add: [1, 1], pick: next"))
    assert files[0].stat().st_mtime_ns == stamps[0], "growth leaves what was before it"


def test_where_there_is_a_stress_each_round_is_put_to_it(pooled: Path) -> None:
    text = LEAN + "stress: {data: tanks, output: lower, within: 0.5}\n"
    found = run(pooled, text).judgement
    growth = next(one for one in found.tables if one.caption.startswith("How much data"))
    stress = next(one for one in found.tables if "random sequences of the reference" in one.caption)
    assert growth.head[-2:] == [("Random sequences", "% under their limit"), ("99 % of them", "under")]
    (chosen,) = [row for row in growth.rows if str(row[0]).endswith("(chosen)")]
    quantiles = {str(row[0]): row[1] for row in stress.rows}
    assert chosen[-1] == pytest.approx(quantiles["99 % of the sequences at most, cm"])


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
    rounds = next(one for one in results.judgement.tables if one.caption.startswith("Training end to end"))
    assert [row[0] for row in rounds.rows][1:] == [f"{one} of growth" for one in ("1.1", "1.2", "2.1", "2.2")]
    assert any(one.startswith("Round 1.2 of growth: ") for one in rounds.folded)
    assert (pooled / "runs" / "tanks" / "grown-2-2.json").is_file()


def test_what_is_begun_from_another_whole_grows_too(pooled: Path) -> None:
    run(pooled, LEAN.replace("export: null", "export: {formats: [c]}").replace(GROWN, ""))
    results = run(pooled, LEAN.replace("seed: 3", "seed: 3\nbegin: ../runs/tanks/bundle"), "further")
    stages = ["as it was begun from", "trained end to end", "grown, round 1", "grown, round 2"]
    assert [one.name for one in results.subjects] == stages


def test_a_pool_without_sequences_that_train_nothing_is_refused(pooled: Path) -> None:
    file = pooled / "datasets" / "pool" / "dataset.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("selection", "validation"), encoding="utf-8")
    with pytest.raises(ConfigError, match="the pool lacks a role"):
        run(pooled, LEAN)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("data: pool", "data: tanks", "the pool to grow by is used otherwise: tanks is under training"),
        ("training: tanks", "training: [tanks, pool]", "pool is under training"),
        ("data: tanks\n", "data: pool\n", "pool is under data"),
        ("outputs: [lower], within", "outputs: [level], within", "grow, outputs names level"),
        ("{max_iterations: 2}]", "{members: [level]}]", "grow, train, members names level"),
        ("{max_iterations: 2}]", "{targets: {level: 1}}]", "grow, train, targets names level"),
        ("{max_iterations: 2}]", "{measured: [lower]}]", "lower is to be as measured, and trained or judged"),
        ("{max_iterations: 2}]", "{everywhere: true}]", "that shares weights names no members"),
        ("{max_iterations: 2}]", "{traces: 2}]", "traces"),
        ("{max_iterations: 2}]", "{reads: {upper: {lower: 2}}}]", "reads"),
        ("{max_iterations: 2}]", "]", "train"),
        ("rounds: 2", "rounds: 2, pick: best", "pick"),
        ("add: 1, rounds: 2", "add: [1, 2], rounds: 3", "3 rounds of growth, and what to add in 2"),
        ("add: 1", "add: 0", "add"),
    ],
)
def test_what_cannot_be_grown_is_refused(workspace: Path, old: str, new: str, complaint: str) -> None:
    assert old in LEAN
    with pytest.raises(ConfigError, match=complaint):
        run(workspace, LEAN.replace(old, new, 1))


def test_growth_goes_on_from_training_end_to_end(workspace: Path) -> None:
    before, _, behind = LEAN.partition("together:")
    with pytest.raises(ConfigError, match="growth without training end to end"):
        run(workspace, before + behind[behind.index("grow:") :])


def test_the_rounds_of_growth_are_the_last_one_before_but_for_what_they_name():
    text = LEAN.replace("train: [{max_iterations: 2}]", "train: [{max_iterations: 2}, {targets: {lower: 0.3}}]")
    asked = config(text)
    last = asked.joint[-1]
    first, second = asked.growing
    assert (first.targets, second.targets) == (last.targets, {"lower": 0.3})
    assert [one.training.max_iterations for one in (last, first, second)] == [4, 2, 2]
    assert first.traces == second.traces == 1
    assert config(LEAN.replace(", train: [{max_iterations: 2}]", "")).growing == (last,)


def test_a_share_of_none_is_nothing_to_aim_at():
    with pytest.raises(ValidationError, match="until"):
        GrowConfig(data="pool", outputs=("BC",), within=1.0, until=0.0)
