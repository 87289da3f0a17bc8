"""Samplers behind one asker: no point twice, the same points whatever the workers, finished trials alone in a study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import optuna
import pytest

from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.reporting.sweep_record import SweepRecord, Trial
from sysid.workbench.sweep.config import SweepConfig
from sysid.workbench.sweep.sampler import publish, strategy
from sysid.workbench.sweep.search_space import Point

NETWORK = {"kind": "NARX", "input_delays": {"from": 1, "to": 3}, "output_delays": 1, "neurons": {"from": 1, "to": 6}}
BY_SET = {"kind": "NARX", "input_delays": {"among": ["0:1", [1, 4]]}, "output_delays": 2, "neurons": 3}


def config(method: str, trials: int | None, **change: Any) -> SweepConfig:
    fields = {
        "kind": "sweep",
        "name": "s",
        "data": "d",
        "mapping": "u -> y",
        "structure": [NETWORK, BY_SET],
        "method": {"name": method, "trials": trials, "batch": 4},
        "objectives": ["free_run_mse", "operations"],
    }
    return check(SweepConfig, fields | change, where="s.yaml")


def trial_of(point: Point) -> Trial:
    """Best at three delays and four neurons; one point that cannot be used."""
    fields = point.structure.to_dict()
    delays, neurons = len(fields["input_delays"][0]), fields["neurons"]
    return Trial(
        number=point.number,
        key=f"key {point.number}",
        label=point.structure.label,
        structure=fields,
        values=dict(point.values),
        status="CONVERGED",
        usable=point.number != 3,
        operations=delays * neurons,
        selection_free_run_mse=0.1 + (delays - 3) ** 2 + (neurons - 4) ** 2,
    )


def tried(asked: SweepConfig) -> list[Point]:
    plan, points = strategy(asked, asked.space()), []
    while batch := plan.ask():
        plan.tell([trial_of(point) for point in batch])
        points += batch
    return points


@pytest.mark.parametrize(
    ("method", "trials"),
    [("grid", None), ("random", 12), ("random", 20), ("tpe", 12), ("tpe", 20), ("nsga-ii", 12), ("nsga-ii", 20)],
)
def test_every_point_is_asked_for_once_at_most(method: str, trials: int | None) -> None:
    points = tried(config(method, trials))
    assert len(points) == (trials or 20)
    assert len({point.number for point in points}) == len(points)


@pytest.mark.parametrize("method", ["random", "tpe", "nsga-ii"])
def test_a_sampler_asks_for_the_same_points_again(method: str) -> None:
    first, again = (tried(config(method, 12)) for _ in range(2))
    other = tried(config(method, 12, seed=1))
    assert [p.number for p in first] == [p.number for p in again]
    assert [p.number for p in first] != [p.number for p in other]


def test_tpe_goes_where_the_figure_is_low() -> None:
    space = {"structure": NETWORK | {"input_delays": {"from": 1, "to": 12}, "neurons": {"from": 1, "to": 20}}}
    points = tried(config("tpe", 60, **space))
    late = [trial_of(point).selection_free_run_mse for point in points[40:]]
    early = [trial_of(point).selection_free_run_mse for point in points[:20]]
    assert sum(late) / len(late) < 0.5 * sum(early) / len(early)


def test_more_trials_than_points_are_refused() -> None:
    asked = config("random", 21)
    with pytest.raises(ConfigError, match="different points, 20"):
        strategy(asked, asked.space())


def record(asked: SweepConfig, points: list[Point]) -> SweepRecord:
    return SweepRecord(
        name=asked.name,
        mapping="u -> y",
        unit="V",
        method="grid",
        points=20,
        ranges={"input_delays": [1, 2, 3, "0:1", [1, 4]], "neurons": [1, 2, 3, 4, 5, 6]},
        objectives=list(asked.objectives),
        choose_by="free_run_mse",
        choose_on="selection",
        chosen_by="",
        workers=1,
        wall_s=1.0,
        trials=[trial_of(point) for point in points],
    )


def test_a_study_holds_each_finished_trial_once(tmp_path: Path) -> None:
    asked, url = config("grid", None), f"sqlite:///{tmp_path / 'optuna.db'}"
    points = tried(asked)
    assert publish(record(asked, points[:8]), url) == 8
    assert publish(record(asked, points), url) == 12
    assert publish(record(asked, points), url) == 0
    study = optuna.load_study(study_name="s", storage=url)
    states = [trial.state.name for trial in study.trials]
    assert (states.count("COMPLETE"), states.count("FAIL")) == (19, 1)
    best = record(asked, points).front()
    assert sorted(trial.values for trial in study.best_trials) == sorted(
        [trial.selection_free_run_mse, float(trial.operations)] for trial in best
    )
