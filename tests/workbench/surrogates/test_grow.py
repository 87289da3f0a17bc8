"""Experiments that are added where a surrogate is worst: rounds, their control, and what stops them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.errors import ConfigError
from sysid.estimation import FitResult, StabilityOptions
from sysid.models import Start
from sysid.references.candidates import SEED
from sysid.references.config import ReferenceConfig
from sysid.references.design import Design, drawn
from sysid.references.runs import ReferenceRuns
from sysid.reporting.growth import FILE, growth_section
from sysid.reporting.records import write_record
from sysid.traces import Role, TraceSet
from sysid.workbench.experiments.config import GrowConfig
from sysid.workbench.surrogates.grow import Grower, Grown, Stand
from sysid.workbench.surrogates.proof import SEED as PROOF

REFERENCE = {
    **{"python": "slow_models:stiffens", "folder": str(Path(__file__).parents[2] / "references"), "sample_time": 0.5},
    **{"inputs": {"u": {"unit": "V", "range": [-3, 3], "start": 0}}, "outputs": {"y": {"unit": "mm"}}},
}
DESIGN = {"duration": 30.0, "runs": {"estimation": 2, "selection": 8, "test": 0}}
CONFIG = ReferenceConfig.model_validate(REFERENCE)
NETWORK = sysid.NARX(input_delays="0:0", output_delays=1, neurons=3)
GROW = GrowConfig(rounds=2, candidates=8, keep=2, until=1e-6)


@pytest.fixture(scope="module")
def started(tmp_path_factory: pytest.TempPathFactory) -> tuple[TraceSet, FitResult]:
    """A network that was fitted to two experiments."""
    folder = tmp_path_factory.mktemp("grow")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SYSID_CACHE", str(folder))
        traces = sysid.experiment(REFERENCE, DESIGN, workers=1)
    training = sysid.Training(max_iterations=40)
    unchecked = StabilityOptions(count=0)
    fit = sysid.fit(traces, "u -> y", NETWORK, training, start=Start(), rest_output=0.0, stability=unchecked)
    return traces, fit


@pytest.fixture
def grower(started: tuple[TraceSet, FitResult], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Grower:
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("sysid.workbench.surrogates.grow.TRAINING", {"max_iterations": 30, "starts": 1})
    return Grower(
        reference=CONFIG, design=Design.model_validate(DESIGN), config=GROW, taught=started[0], rest={"y": 0.0},
        folder=tmp_path / "rounds", workers=1, stability=None,
    )  # fmt: skip


@pytest.fixture
def grown(grower: Grower, started: tuple[TraceSet, FitResult]) -> Grown:
    return grower.grow([started[1]])


def test_rounds_add_what_is_worst_and_as_much_at_random_and_the_selection_runs_choose(
    grown: Grown,
) -> None:
    rows = grown.record.rounds
    assert [(one.number, one.how, one.fitted) for one in rows[:3]] == [
        (0, "start", 2),
        (1, "worst", 4),
        (1, "random", 4),
    ]
    assert grown.best.error == min(one.error for one in rows)
    assert grown.best.error < 0.5 * rows[0].error


def test_what_is_added_is_what_the_surrogate_is_worst_at(grower: Grower, started: tuple[TraceSet, FitResult]) -> None:
    cases = [drawn(CONFIG, grower.design, 8, seed=(0, SEED, number), prefix=f"G{number}N") for number in (1, 2)]
    with ReferenceRuns(config=CONFIG, workers=1) as runs:
        first = grower._picked(runs, 1, Stand(fits=[started[1]], added=[], error=1.0))
        second = grower._picked(runs, 2, Stand(fits=[started[1]], added=first, error=1.0))
        errors = {}
        for one in runs.run([case for some in cases for case in some]):
            assert one.trace is not None
            run = started[1].model.simulate(one.trace.columns(["u"]))
            errors[one.case.name] = float(np.mean((run - one.trace["y"]) ** 2))
    of_first = sorted((one.name for one in cases[0]), key=lambda name: -errors[name])
    assert [one.case.name for one in first] == of_first[:2]
    # What the first round has run and not added is looked at again.
    left = [name for name in errors if name not in of_first[:2]]
    assert [one.case.name for one in second] == sorted(left, key=lambda name: -errors[name])[:2]


def test_what_a_killed_growth_has_trained_is_found(
    grower: Grower, grown: Grown, started: tuple[TraceSet, FitResult], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> FitResult:
        raise AssertionError("trained twice")

    monkeypatch.setattr("sysid.workbench.surrogates.grow.fitting.fit", refuse)
    again = replace(grower, _rows=[], _ran=0).grow([started[1]])
    same = [(one.how, one.fitted, one.error) for one in again.record.rounds]
    assert same == [(one.how, one.fitted, one.error) for one in grown.record.rounds]


def test_the_uncertain_are_run_alone(grower: Grower, started: tuple[TraceSet, FitResult]) -> None:
    asked = GrowConfig(rounds=1, candidates=8, keep=2, until=1e-6, pick="uncertain", control=False)
    found = replace(grower, config=asked).grow([started[1]])
    assert [(one.how, one.fitted, one.ran) for one in found.record.rounds] == [("start", 2, 0), ("uncertain", 4, 2)]


def test_it_ends_where_nothing_is_beyond_what_was_aimed_at(grower: Grower, started: tuple[TraceSet, FitResult]) -> None:
    found = replace(grower, config=GROW.model_copy(update={"until": 10.0})).grow([started[1]])
    assert "none of 8 new experiments is beyond" in found.record.ended
    assert not found.best.added


def test_nothing_that_is_added_is_in_the_proof(grower: Grower) -> None:
    seen = {
        case.inputs.tobytes()
        for seed in ((0, SEED, 1), (0, SEED, 2))
        for case in drawn(CONFIG, grower.design, 30, seed=seed, prefix="G")
    }
    assert not seen & {one.inputs.tobytes() for one in drawn(CONFIG, grower.design, 30, seed=(0, PROOF), prefix="N")}


def test_without_selection_runs_nothing_can_be_judged(grower: Grower, started: tuple[TraceSet, FitResult]) -> None:
    alone = replace(started[0], roles=dict.fromkeys(started[0].roles, Role.ESTIMATION))
    with pytest.raises(ConfigError, match="growth cannot be judged"):
        replace(grower, taught=alone).grow([started[1]])


@pytest.mark.usefixtures("undrawn")
def test_the_report_has_the_curve_and_its_control(grown: Grown, tmp_path: Path) -> None:
    assert growth_section(tmp_path) == []
    write_record(tmp_path / FILE, grown.record)
    (section,) = growth_section(tmp_path)
    said, picture, table = section.parts
    assert said == f"{grown.record.sentence}."
    assert "Accuracy against data" in str(picture)
    assert [row[1].text for row in table.rows][:3] == ["start", "worst", "random"]
    assert np.isfinite(grown.record.rounds[-1].median)
