"""Growth: the worst sequences are added, the best round is kept, and a second run finds every round again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.reporting.judgement_report import read_judgement_results
from sysid.workbench.assembly.growth import Look, grow, sequence_errors
from sysid.workbench.assembly.members import assembled
from sysid.workbench.assembly.runner import run_assembly
from sysid.workbench.kinds import RunRequest
from tests.workbench.assembly.conftest import PIPELINE
from tests.workbench.assembly.test_members import TWO_PLACES, config, models, trace

GROW = "grow: {data: pool, outputs: [AR, BP], within: 0.1, members: [BP, AR], add: 3, rounds: 4, patience: 2}\n"


def grown(better_in: tuple[int, ...], pool: int = 20, text: str = GROW):
    """A growth whose trainings are told apart by their round, with the whole right in some rounds and wrong else."""
    asked, good = config(TWO_PLACES + text), models()
    run = assembled(asked, good).simulate_trace
    sequences = [truth(run, seed) for seed in range(pool + 8)]
    bad = {name: _worse(model) for name, model in good.items()}
    seen = []

    def fit(member, now, traces, number, key):
        name = member.mapping.output
        seen.append((number, name, [one.name for one in traces], member.traces))
        return (good if number in better_in else bad)[name], f"{key}>{number}{name}"

    found = grow(
        asked, bad, "start", fit, estimation=sequences[:2], selection=sequences[2:4], pool=sequences[8:],
        held_out=sequences[4:8],
    )  # fmt: skip
    return found, seen, bad, sequences[8:], asked


def truth(run, seed: int):
    one = trace(n=60, seed=seed)
    out = run(one)
    return replace(one, name=f"T{seed}", values=np.column_stack([out[name] for name in one.channel_names]))


def _worse(model):
    return replace(model, theta=model.theta * 1.05)


def test_the_worst_sequences_of_the_pool_are_added_and_none_twice():
    found, seen, bad, pool, asked = grown(better_in=())
    errors = sequence_errors(assembled(asked, bad), pool, ("AR", "BP"))
    order = [pool[i].name for i in np.argsort(-errors)]
    assert found.rounds[1].added == tuple(order[:3])
    assert found.rounds[2].added == tuple(order[3:6])
    assert found.rounds[0].added == ()
    assert [one.samples for one in found.rounds] == [120, 300, 480]
    # Each member in its turn, on what was there before and everything added so far.
    assert [(number, name) for number, name, _, _ in seen] == [(1, "BP"), (1, "AR"), (2, "BP"), (2, "AR")]
    assert seen[-1][2] == ["T0", "T1", *order[:6]]
    assert all(cut is None for *_, cut in seen)


def test_the_best_round_is_kept_and_growth_ends_when_nothing_improves():
    found, *_ = grown(better_in=())
    assert (len(found.rounds), found.best, found.key) == (3, 0, "start")
    assert found.added == frozenset(), "what did not help is not trained on later either"
    found, *_ = grown(better_in=(2,), text=GROW.replace("patience: 2", "patience: 2, until: 1.0"))
    assert found.best == 2
    assert found.rounds[2].look.within == 1.0
    assert len(found.rounds) == 3, "the figure holds: no further round"
    assert found.key == "start>1BP>1AR>2BP>2AR"
    assert found.added == {name for one in found.rounds[1:] for name in one.added}
    assert "round 2 is kept" in found.sentence
    assert "6 sequences added" in found.sentence


def test_growth_ends_when_the_pool_is_empty():
    found, *_ = grown(better_in=(), pool=4, text=GROW.replace("patience: 2", "patience: 9"))
    assert [len(one.added) for one in found.rounds] == [0, 3, 1]


def test_of_an_error_per_sequence_the_largest_output_counts():
    whole = assembled(config(), models())
    sequence = trace(seed=3)
    run = whole.simulate_trace(sequence)
    errors = {name: np.sqrt(np.mean((run[name] - sequence[name]) ** 2)) for name in ("BP", "AR")}
    assert sequence_errors(whole, [sequence], ("BP", "AR"))[0] == pytest.approx(max(errors.values()))
    assert sequence_errors(whole, [sequence], ("AR",))[0] == pytest.approx(errors["AR"])


def test_more_sequences_within_the_limit_are_better_and_else_smaller_rare_errors():
    few, many = Look(within=0.5, median=0.0, rare=0.0), Look(within=0.6, median=1.0, rare=9.0)
    assert many.better_than(few)
    assert not few.better_than(many)
    assert Look(within=0.6, median=1.0, rare=8.0).better_than(many)
    assert Look.at(np.array([0.0, 1.0, 2.0, 3.0]), limit=1.5) == Look(within=0.5, median=1.5, rare=pytest.approx(2.97))


def test_a_run_grows_resumes_and_reports(workspace: Path) -> None:
    file = workspace / "pipelines" / "tanks.yaml"
    lean = PIPELINE.replace("candidates: 2", "candidates: 1").split("retrain:")[0]
    rounds = (
        "grow: {data: tanks, outputs: [lower], within: 0.001, members: [lower], add: 1, rounds: 2, max_iterations: 4}\n"
    )
    file.write_text(f"{lean}{rounds}export: null\n", encoding="utf-8")

    def run() -> list[list]:
        assert run_assembly(RunRequest(path=file, typed="tanks", fresh=False, tracking=False)) == 0
        found = read_judgement_results(workspace / "runs" / "tanks")
        assert found is not None
        assert [one.name for one in found.subjects] == ["each alone", "grown"]
        assert any(chart.title == "Error over data" for chart in found.judgement.charts)
        return next(table.rows for table in found.judgement.tables if table.caption.startswith("How much data"))

    rows = run()
    assert [row[1] for row in rows] == [0.0, 1.0, 1.0]
    assert [row[2] for row in rows] == [600.0, 900.0, 1200.0]
    stamps = {one: one.stat().st_mtime_ns for one in workspace.rglob("fit.json")}
    assert sum("grown" in str(one) for one in stamps) == 2
    assert run() == rows
    assert {one: one.stat().st_mtime_ns for one in workspace.rglob("fit.json")} == stamps, "nothing is fitted again"


def test_a_pool_without_sequences_that_train_nothing_is_refused(workspace: Path) -> None:
    file, data = workspace / "pipelines" / "tanks.yaml", workspace / "datasets" / "tanks" / "dataset.yaml"
    pool = workspace / "datasets" / "pool"
    pool.mkdir()
    for one in data.parent.glob("*.csv"):
        (pool / one.name).write_bytes(one.read_bytes())
    text = data.read_text(encoding="utf-8").replace("name: tanks", "name: pool").replace("selection", "validation")
    (pool / "dataset.yaml").write_text(text, encoding="utf-8")
    lean = PIPELINE.replace("candidates: 2", "candidates: 1").split("retrain:")[0]
    rounds = "grow: {data: pool, outputs: [lower], within: 0.1, members: [lower]}\n"
    file.write_text(f"{lean}{rounds}export: null\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="the pool lacks a role"):
        run_assembly(RunRequest(path=file, typed="tanks", fresh=False, tracking=False))
