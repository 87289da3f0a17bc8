"""Version 1 of results.json of assemblies and judgements, with ready-made tables: it still makes its report."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from sysid.errors import ConfigError
from sysid.reporting import publish_run, write_report
from sysid.reporting.charts import chart_figure
from sysid.reporting.judging.document import judgement_sections
from sysid.reporting.judging.results import FOLDER
from sysid.reporting.judging.version_1 import ChartRecord, ReadyRecord, ReadyResults, ready_section
from sysid.reporting.kinds import read_run
from sysid.reporting.markdown import table_lines
from sysid.reporting.numbers import number
from sysid.reporting.parts import Picture
from sysid.reporting.scores import read_scores
from sysid.reporting.tables import Table

SAID: dict[str, Any] = {
    "title": "Consequence",
    "headline": "It stops late.",
    "sentences": ["By a little."],
    "tables": [
        {"caption": "First", "head": [["scene", ""], ["late", "m"]], "rows": [["level", 1.25], ["hill", None]]},
        {"caption": "Second", "head": [["scene", ""]], "rows": []},
    ],
    "charts": [
        {
            "title": "What an error costs",
            "caption": "Both axes are logarithmic.",
            "x": "mse",
            "y": "late",
            "logarithmic": True,
            "lines": [
                {"name": "asked", "x": [0.1, 10.0], "y": [1.0, 1.0], "target": True},
                {"name": "found", "x": [0.1, 10.0], "y": [0.2, 4.0]},
                {"name": "models", "x": [1.0], "y": [0.7], "marks": True},
            ],
        }
    ],
    "metrics": {"a": {"late": 1.25}},
}


RUN: dict[str, Any] = {
    "schema_version": 1,
    "kind": "stops",
    "pipeline": "stopping",
    "command": "sysid run stopping",
    "created": "2026-11-21T04:00:00+00:00",
    "environment": {"commit": "9ffa098", "cpu": "A", "cores": 2},
    "data": {"name": "of the judge stops"},
    "subjects": [{"name": "one", "parts": ["valve: fit a of run b"]}],
    "judgement": SAID,
}
"""As a judgement stored it."""

POINTS = {
    "points": [["Accuracy", "It is good."]],
    "scores": [{"mapping": "u -> y", "unit": "V", "model": "m", "mse": {"A": 0.5}}],
}
ASSEMBLY = RUN | {
    "kind": "assembly",
    "pipeline": "tanks",
    "data": {"name": "tanks", "digest": "abc", "others": {"pool": "def"}},
    "judgement": SAID | {"title": "The assembly"} | POINTS,
}
"""As an assembly did."""


def section(**changes: Any):
    return ready_section(ReadyRecord.model_validate(SAID | changes), 0)


def stored(folder: Path, document: dict[str, Any]) -> Path:
    folder.mkdir()
    (folder / "results.json").write_text(json.dumps(document), encoding="utf-8")
    return folder


def test_a_section_begins_with_what_matters() -> None:
    parts = section().parts
    assert [type(part) for part in parts] == [str, str, Table, Picture, Table]
    assert parts[0] == SAID["headline"]
    table = parts[2]
    assert isinstance(table, Table)
    assert table.rows[0][0].header
    assert table.rows[0][1].value == 1.25
    assert table.rows[1][1].text == ""


@pytest.mark.parametrize(
    ("logarithmic", "scales"),
    [(False, ("linear", "linear")), ("x", ("log", "linear")), (True, ("log", "log"))],
)
def test_a_chart_has_logarithmic_axes_as_far_as_it_asks_and_marks_where_a_line_does(
    logarithmic: bool | str, scales: tuple[str, str]
) -> None:
    lines = [
        {"name": name, "x": [1.0, 9.0], "y": [2.0, 1.0], **more} for name, more in (("a", {}), ("b", {"points": True}))
    ]
    chart = ChartRecord.model_validate(SAID["charts"][0] | {"logarithmic": logarithmic, "lines": lines}).chart()
    (axes,) = chart_figure(chart).axes
    assert (axes.get_xscale(), axes.get_yscale()) == scales
    plain, marked = axes.get_lines()
    assert plain.get_marker() in ("", "None")
    assert marked.get_marker() not in ("", "None")


def test_a_count_is_printed_as_it_is_and_a_number_in_three_digits() -> None:
    said = section(tables=[SAID["tables"][0] | {"rows": [["level", 12345], ["hill", 12345.0]]}])
    (table,) = (part for part in said.parts if isinstance(part, Table))
    assert [row[1].text for row in table.rows] == ["12345", number(12345.0)]
    assert [row[1].value for row in table.rows] == [12345, 12345.0]


def test_what_stands_behind_a_table_is_folded_away_below_it(tmp_path: Path) -> None:
    table = SAID["tables"][0] | {"note": "Scenes of the judge.", "folded": ["Level -> late.", "Hill <not run>."]}
    folder = stored(tmp_path / "run", RUN | {"judgement": SAID | {"tables": [table], "charts": []}})
    page = write_report(folder).read_text(encoding="utf-8")
    folded = page[page.index("Scenes of the judge.") :]
    assert "<details" in folded
    assert folded.index("<summary>") < folded.index("<p>Level → late.</p>") < folded.index("Hill &lt;not run&gt;.")
    lines = table_lines(next(part for part in section(tables=[table]).parts if isinstance(part, Table)))
    start = lines.index("<details><summary>In words</summary>")
    assert lines[start - 2] == "*Scenes of the judge.*"
    assert lines[start + 1 :] == ["", "Level → late.", "", "Hill &lt;not run>.", "", "</details>"]


def test_judgements_of_both_versions_stand_in_the_run_that_was_judged(tmp_path: Path, found: dict[str, Any]) -> None:
    folder = tmp_path / FOLDER
    folder.mkdir()
    for name, document in (("a", SAID), ("b", SAID), ("c", found)):
        (folder / f"{name}.json").write_text(json.dumps(document), encoding="utf-8")
    sections = judgement_sections(tmp_path)
    assert [one.title for one in sections] == ["Consequence", "Consequence", "Leakage"]
    assert len({one.anchor for one in sections}) == 3


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("document", [RUN, ASSEMBLY], ids=["judgement", "assembly"])
def test_a_run_of_version_1_is_read_reported_and_published(tmp_path: Path, document: dict[str, Any]) -> None:
    folder = stored(tmp_path / "run", document)
    results = read_run(folder)
    assert isinstance(results, ReadyResults)
    assert results.judgement.metrics == {"a": {"late": 1.25}}
    assert write_report(folder).is_file()
    page = publish_run(folder, tmp_path / "reports")
    assert "| hill |  |" in page.read_text(encoding="utf-8")
    if document is ASSEMBLY:
        (score,) = read_scores(page.parent)
        assert score.mse == {"A": 0.5}


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"judgement": SAID, "schema_version": 99}, "newer release"),
        ({"judgement": SAID, "schema_version": 1}, "damaged"),
        ({"kind": "assembly", "schema_version": 2}, "damaged"),
        ({"kind": "stops", "judgement": SAID, "schema_version": 2}, "damaged"),
    ],
    ids=["newer", "version 1", "assembly", "judgement"],
)
def test_results_that_cannot_be_read_are_named(tmp_path: Path, document: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        read_run(stored(tmp_path / "run", document))
