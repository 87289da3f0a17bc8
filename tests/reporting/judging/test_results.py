"""What a judge found, checked and summed up."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from sysid.errors import ConfigError
from sysid.reporting.judging.results import FOLDER, judgement_documents, parse_judgement


def test_worst_and_mean_are_of_the_scenes_that_could_be_run(found: dict[str, Any]) -> None:
    record = parse_judgement(found, where="here")
    assert record.metrics() == {
        "good": {
            "worst_lost_percent": 0.75,
            "mean_level_mse": 1.0,
            "level_mse/slow": 0.5,
            "level_mse/fast": 1.5,
            "lost_percent/slow": 0.25,
            "lost_percent/fast": -0.75,
        },
        "poor": {
            "worst_lost_percent": 20.0,
            "mean_level_mse": 9.0,
            "level_mse/slow": 9.0,
            "lost_percent/slow": 20.0,
        },
    }


def test_a_subject_that_could_do_nothing_has_no_figures(found: dict[str, Any]) -> None:
    found["subjects"]["poor"]["slow"] = {"refused": "no"}
    record = parse_judgement(found, where="here")
    assert math.isnan(record.worst("poor", "lost_percent"))
    assert record.metrics()["poor"] == {}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"title": None}, "title"),
        ({"subjects": {}}, "subjects"),
        ({"scenes": []}, "scenes"),
        ({"quantities": {}}, "quantities does not say what"),
        ({"error": "nonsense"}, "does not say what nonsense is"),
        ({"schema_version": 3}, "newer release"),
    ],
)
def test_figures_that_cannot_be_used_are_refused(found: dict[str, Any], change: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        parse_judgement(found | change, where="judge leak")


def test_tables_that_a_judge_made_ready_are_none(found: dict[str, Any]) -> None:
    """A judge of an earlier release: it is told where it has to be mended."""
    with pytest.raises(ConfigError, match="a judge of another package has to be mended there"):
        parse_judgement({"title": "Leakage", "headline": "Much.", "tables": []}, where="judge leak")


def test_judgements_lie_in_the_run_that_was_judged(tmp_path: Path, found: dict[str, Any]) -> None:
    assert judgement_documents(tmp_path) == {}
    folder = tmp_path / FOLDER
    folder.mkdir()
    (folder / "a.json").write_text(json.dumps(found), encoding="utf-8")
    assert judgement_documents(tmp_path) == {folder / "a.json": found}
    (folder / "b.json").write_text("{", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"b\.json"):
        judgement_documents(tmp_path)
