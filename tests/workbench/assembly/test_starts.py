"""A whole trained from several starts: each on disk, the best or a committee of them chosen on the selection traces."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from sysid.composite.members import score_of
from sysid.errors import ConfigError
from sysid.reporting.judging.results import JudgementResults, read_judgement_results
from sysid.traces import Channel, Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.runner import read_assembly, run_assembly
from sysid.workbench.assembly.starts import committee
from sysid.workbench.kinds import RunRequest
from sysid.yaml_files import check, read_yaml
from tests.workbench.assembly.conftest import PIPELINE, levels


def trace(target: np.ndarray) -> Trace:
    return Trace(name="T", sample_time=1.0, channels=(Channel(name="y", unit="V"),), values=target[:, None])


def with_errors(target: np.ndarray, *errors: np.ndarray) -> list[list[np.ndarray]]:
    return [[(target + error)[:, None]] for error in errors]


T = np.linspace(0.0, 1.0, 50)
RIPPLE = np.sin(40.0 * T)


class TestCommittee:
    """Which starts are averaged."""

    def test_errors_that_cancel_are_taken_together(self) -> None:
        wholes = with_errors(T, RIPPLE + 0.1, 2.0 * np.cos(3.0 * T), 0.05 - RIPPLE)
        assert sorted(committee(wholes, [trace(T)], ["y"], 3)) == [0, 2]

    def test_the_first_is_the_best_and_each_further_one_makes_the_mean_better(self) -> None:
        rng = np.random.default_rng(0)
        wholes = with_errors(T, *(scale * rng.standard_normal(50) for scale in (3.0, 1.0, 1.2, 0.9, 20.0)))
        chosen = committee(wholes, [trace(T)], ["y"], 5)
        assert chosen[0] == 3
        assert 4 not in chosen
        means = [
            score_of([np.mean([wholes[i][0] for i in chosen[:size]], axis=0)], [trace(T)], ["y"])
            for size in range(1, len(chosen) + 1)
        ]
        assert means == sorted(means, reverse=True)

    @pytest.mark.parametrize(("most", "expected"), [(1, [1]), (2, [1, 0])])
    def test_it_is_no_larger_than_asked(self, most: int, expected: list[int]) -> None:
        wholes = with_errors(T, RIPPLE + 0.2, -RIPPLE, np.roll(RIPPLE, 9))
        assert committee(wholes, [trace(T)], ["y"], most) == expected


QUICK = PIPELINE.replace("candidates: 2", "candidates: 1").replace(
    "retrain: {members: [lower], max_iterations: 5}\n", ""
)
LINE = "line: {channel: upper, knots: {upper: 1, lower: 2}, outputs: [lower], data: tanks}\n"


def write(workspace: Path, asked: str) -> Path:
    file = workspace / "pipelines" / "tanks.yaml"
    file.write_text(QUICK.replace("seed: 3\n", f"seed: 3\n{asked}"), encoding="utf-8")
    return file


def run(file: Path) -> JudgementResults:
    assert run_assembly(RunRequest(path=file, typed="tanks", tracking=False)) == 0
    results = read_judgement_results(Path("runs") / "tanks")
    assert results is not None
    return results


def test_every_start_is_trained_stored_and_shown_and_the_best_mean_is_taken(workspace: Path) -> None:
    file = write(workspace, "starts: 3\ncommittee: 3\n")
    results = run(file)

    folder = workspace / "runs" / "tanks"
    assert [entry.name for entry in sorted((folder / "fits").iterdir()) if "upper-0" in entry.name] == [
        "pump-lower-upper-0", "start-2-pump-lower-upper-0", "start-3-pump-lower-upper-0",
    ]  # fmt: skip
    stages = [subject.name for subject in results.subjects]
    assert stages[:3] == ["start 1", "start 2", "start 3"]
    selection = {stage: metrics["selection"] for stage, metrics in results.judgement.metrics.items()}
    assert len(set(selection.values())) == len(selection), "starts differ"
    chosen = min(selection, key=lambda stage: selection[stage])
    assert f"{chosen} (chosen)" in [row[0] for row in results.judgement.tables[0].rows]
    for number, seed in ((1, 3), (2, 10_003), (3, 20_003)):
        assert any(f"Start {number} (seed {seed}) does best" in one for one in results.judgement.sentences)
    alone = any("alone" in one and "No mean of" in one for one in results.judgement.sentences)
    assert alone == all("mean" not in stage for stage in stages)
    taken = sorted(re.findall(r"\d", stages[-1] if "mean" in stages[-1] else chosen))
    rounds = next(one for one in results.judgement.tables if one.caption.startswith("Training end to end"))
    assert [row[0] for row in rounds.rows] == [f"1 of start {number}" for number in taken]
    assert all(one.startswith(tuple(f"Start {number}, round 1: " for number in taken)) for one in rounds.folded)
    # What the table says is what the stored assembly does.
    pump = np.repeat(np.random.default_rng(3).uniform(0.0, 2.0, 15), 20)
    pump[:5] = 0.0
    error = np.mean((read_assembly(folder).simulate(pump[:, None])["lower"] - levels(pump)[1]) ** 2)
    assert error == pytest.approx(results.judgement.metrics[chosen]["lower/V/mse"], rel=1e-6)

    stamps = {one: one.stat().st_mtime_ns for one in folder.rglob("fit.json")}
    assert len(stamps) == 6
    assert run(file).judgement.metrics == results.judgement.metrics
    assert {one: one.stat().st_mtime_ns for one in folder.rglob("fit.json")} == stamps, "nothing is fitted again"


def test_the_first_start_is_what_a_run_of_one_start_is(workspace: Path) -> None:
    alone = run(write(workspace, ""))
    beside = run(write(workspace, "starts: 2\n"))
    best = min(metrics["selection"] for metrics in alone.judgement.metrics.values())
    assert beside.judgement.metrics["start 1"]["selection"] == best
    assert "mean" not in " ".join(subject.name for subject in beside.subjects), "no committee was asked for"


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("committee: 2\n", "a committee of 2 of 1 starts"),
        (f"starts: 2\ncommittee: 2\n{LINE}", "the places of a line are taken out of one whole"),
    ],
)
def test_a_committee_that_cannot_be_is_refused(workspace: Path, asked: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        check(AssemblyConfig, read_yaml(write(workspace, asked)), where="tanks")
