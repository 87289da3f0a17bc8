"""Pipelines that judge: models found, steps kept, results, report and tracking, whatever the judge is about."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel, ConfigDict

from sysid.errors import ConfigError
from sysid.models import History
from sysid.reporting.results import read_results
from sysid.workbench.judging import runner
from sysid.workbench.kinds import RunRequest
from sysid.workbench.listeners import perform
from sysid.workbench.tracking.mlflow_store import connect

PIPELINE = """\
kind: overshoot
name: jump
subjects:
  - {name: line, run: first, fit: ARX}
  - {name: both, parts: [{run: runs/first}, {bundle: runs/first/bundle}]}
options: {level: 400}
"""


class Options(BaseModel):
    """Of the judge of these tests."""

    model_config = ConfigDict(extra="forbid")
    level: float


class PartOptions(BaseModel):
    """Of a model."""

    model_config = ConfigDict(extra="forbid")


@dataclass(frozen=True)
class Step:
    """A run of a model after a jump of its inputs."""

    name: str
    terms: Mapping[str, Any]
    run: Callable[[], Any]


class OvershootJudge:
    """Says how far an output goes when the inlet jumps."""

    options, part_options, version = Options, PartOptions, "1"

    def __init__(self) -> None:
        self.done: list[str] = []

    def steps(self, options: Options, subjects: Mapping[str, Sequence[Any]]) -> list[Step]:
        return [
            Step(name, {"level": options.level, "models": [m.to_dict() for m, *_ in parts]}, self._run(options, parts))
            for name, parts in subjects.items()
        ]

    def _run(self, options: Options, parts: Sequence[Any]) -> Callable[[], Any]:
        def run() -> dict[str, Any]:
            self.done.append(str(len(parts)))
            inputs = np.column_stack([np.repeat([200.0, options.level], 50), np.full(100, 2.0)])
            model = parts[0][0]
            y = model.simulate(inputs, History.at_rest(inputs=inputs[0], output=model.rest_output))
            return {"highest": float(y.max()), "trace": y[::10].tolist(), "nothing": float("nan")}

        return run

    def document(self, options: Options, subjects: Mapping[str, Any], results: Mapping[str, Any]) -> dict[str, Any]:
        assert set(results) == set(subjects)
        x = [float(k) for k in range(10)]
        return {
            "title": "Overshoot",
            "method": f"Asked for {options.level:g} kPa. Higher is worse.",
            "scenes": ["jump, up"],
            "quantities": {
                "highest": {"name": "highest pressure", "unit": "kPa"},
                "pressure": {"name": "pressure", "unit": "kPa"},
                "nothing": {"name": "nothing"},
            },
            "subjects": {
                name: {
                    "jump, up": {
                        "differences": {"highest": result["highest"], "nothing": result["nothing"]},
                        "signals": {"pressure": {"time": x, "value": result["trace"]}},
                    }
                }
                for name, result in results.items()
            },
        }


@pytest.fixture
def judge(monkeypatch: pytest.MonkeyPatch) -> OvershootJudge:
    found = OvershootJudge()
    monkeypatch.setattr(runner, "find_plugin", lambda *_, **__: found)
    return found


@pytest.fixture
def place(finished: Path, empty_store: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A workspace with a finished run, its store empty."""
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    shutil.copy(empty_store, tmp_path / "mlflow.db")
    (tmp_path / "pipelines" / "jump.yaml").write_text(PIPELINE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    return tmp_path


def judged(place: Path, *, tracking: bool = False, fresh: bool = False) -> dict[str, Any]:
    request = RunRequest(path=place / "pipelines" / "jump.yaml", typed="jump", tracking=tracking, fresh=fresh)
    assert perform(runner.program(request), request) == 0
    return json.loads((place / "runs" / "jump" / "results.json").read_text(encoding="utf-8"))


def test_what_a_judge_says_is_stored_and_shown(place: Path, judge: OvershootJudge) -> None:
    results = judged(place)
    assert [subject["name"] for subject in results["subjects"]] == ["line", "both"]
    assert "bundle runs/first/bundle" in results["subjects"][1]["parts"][1]
    scene = results["judgement"]["subjects"]["line"]["jump, up"]
    assert scene["differences"]["highest"] > 100.0
    assert scene["differences"]["nothing"] is None
    assert "tables" not in results["judgement"], "what is stored are figures"
    page = (place / "runs" / "jump" / "report" / "index.html").read_text(encoding="utf-8")
    for words in ("Asked for 400 kPa.", "Higher is worse.", "Overshoot", "sysid run jump", "<svg"):
        assert words in page


def test_it_stands_in_the_report_of_the_run_that_was_judged(place: Path, judge: OvershootJudge) -> None:
    judged(place)
    page = (place / "runs" / "first" / "report" / "index.html").read_text(encoding="utf-8")
    assert "Asked for 400 kPa." in page
    assert read_results(place / "runs" / "first").fits


def test_nothing_is_done_twice_and_nothing_new_has_no_new_date(
    place: Path, judge: OvershootJudge, quick_report: None
) -> None:
    first = judged(place)
    assert judge.done == ["1", "2"]
    assert judged(place)["created"] == first["created"]
    assert judge.done == ["1", "2"]
    judged(place, fresh=True)
    assert judge.done == ["1", "2"] * 2


def test_what_a_killed_run_finished_is_kept(place: Path, judge: OvershootJudge, quick_report: None) -> None:
    steps = OvershootJudge.steps

    def broken(self: OvershootJudge, options: Options, subjects: Mapping[str, Sequence[Any]]) -> list[Step]:
        first, second = steps(self, options, subjects)

        def killed() -> None:
            raise KeyboardInterrupt

        return [first, Step(second.name, second.terms, killed)]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(OvershootJudge, "steps", broken)
        with pytest.raises(KeyboardInterrupt):
            judged(place)
    assert judge.done == ["1"]
    judged(place)
    assert judge.done == ["1", "2"]


def test_figures_are_tracked_once_for_what_was_judged(place: Path, judge: OvershootJudge, quick_report: None) -> None:
    for _ in range(2):
        judged(place, tracking=True)
    client = connect(f"sqlite:///{place / 'mlflow.db'}")
    experiments = [one.experiment_id for one in client.search_experiments()]
    runs = client.search_runs(experiments, filter_string="tags.pipeline = 'jump'")
    # The fits of this workspace were never tracked: a run of its own stands for each.
    assert sorted(run.data.tags["fit"] for run in runs) == ["both", "line"]
    assert all(run.data.metrics["jump/highest/jump_ up"] > 100.0 for run in runs)
    assert [file.path for file in client.list_artifacts(runs[0].info.run_id, "judgements/jump")]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("run: first, fit: ARX", "run: first, fit: ARXX", "no fit 'ARXX'"),
        ("run: first, fit: ARX", "run: last", "the run last is not there"),
        ("run: first, fit: ARX", "fit: ARX", "not said where a model lies"),
        ("run: first, fit: ARX", "run: first, options: {node: 3}", "unknown field"),
        ("name: both", "name: line", "two subjects have one name"),
        ("level: 400", "levels: 400", "unknown field"),
        ("run: first, fit: ARX", "model: level", "not the address of a registered model"),
    ],
)
def test_what_cannot_be_judged_is_named(  # noqa: PLR0917 - parameters and fixtures
    place: Path, judge: OvershootJudge, quick_report: None, old: str, new: str, message: str
) -> None:
    (place / "pipelines" / "jump.yaml").write_text(PIPELINE.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigError, match=message):
        judged(place)
    assert judge.done == []
