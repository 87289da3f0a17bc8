"""What a judge said, as a section of a report and as results of its own."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from sysid.errors import ConfigError
from sysid.reporting.judging import tables as judgement
from sysid.reporting.judging.results import (
    JudgementResults,
    SceneRecord,
    read_judgement_results,
    write_judgement_report,
)
from sysid.reporting.judging.tables import FOLDER, judgement_sections, parse_judgement, read_judgements
from sysid.reporting.markdown import table_lines
from sysid.reporting.numbers import number
from sysid.reporting.parts import Picture
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


def test_a_section_begins_with_what_matters() -> None:
    (section,) = judgement_sections([parse_judgement(SAID, where="here")])
    kinds = [type(part) for part in section.parts]
    assert kinds == [str, str, Table, Picture, Table]
    assert section.parts[0] == "It stops late."
    table = section.parts[2]
    assert isinstance(table, Table)
    assert table.rows[0][0].header
    assert table.rows[0][1].value == 1.25
    assert table.rows[1][1].text == ""


@pytest.mark.parametrize(
    ("logarithmic", "scales"),
    [(False, ("linear", "linear")), ("x", ("log", "linear")), (True, ("log", "log"))],
)
def test_a_chart_has_logarithmic_axes_as_far_as_it_asks_and_marks_where_a_line_does(
    logarithmic: bool | str, scales: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Figure] = []

    def picture(figure: Figure, *words: str) -> Picture:
        drawn.append(figure)
        return made(figure, *words)

    made = judgement.picture
    monkeypatch.setattr(judgement, "picture", picture)
    lines = [
        {"name": name, "x": [1.0, 9.0], "y": [2.0, 1.0], **more} for name, more in (("a", {}), ("b", {"points": True}))
    ]
    judgement_sections(
        [
            parse_judgement(
                SAID | {"charts": [SAID["charts"][0] | {"logarithmic": logarithmic, "lines": lines}]}, where="here"
            )
        ]
    )
    (axes,) = drawn[0].axes
    assert (axes.get_xscale(), axes.get_yscale()) == scales
    plain, marked = axes.get_lines()
    assert plain.get_marker() in ("", "None")
    assert marked.get_marker() not in ("", "None")


def test_a_count_is_printed_as_it_is_and_a_number_in_three_digits() -> None:
    said = SAID | {"tables": [SAID["tables"][0] | {"rows": [["level", 12345], ["hill", 12345.0]]}]}
    (section,) = judgement_sections([parse_judgement(json.loads(json.dumps(said)), where="here")])
    (table,) = (part for part in section.parts if isinstance(part, Table))
    assert [row[1].text for row in table.rows] == ["12345", number(12345.0)]
    assert [row[1].value for row in table.rows] == [12345, 12345.0]


def test_what_stands_behind_a_table_is_folded_away_below_it(tmp_path: Path) -> None:
    table = SAID["tables"][0] | {"note": "Scenes of the judge.", "folded": ["Level -> late.", "Hill <not run>."]}
    record = parse_judgement(SAID | {"tables": [table], "charts": []}, where="here")
    results = JudgementResults(
        kind="stops", pipeline="stopping", command="sysid run stopping", created="", environment={},
        data=SceneRecord(name="scenes"), subjects=[], judgement=record,
    )  # fmt: skip
    page = write_judgement_report(tmp_path, results).read_text(encoding="utf-8")
    folded = page[page.index("Scenes of the judge.") :]
    assert "<details" in folded
    assert folded.index("<summary>") < folded.index("<p>Level → late.</p>") < folded.index("Hill &lt;not run&gt;.")
    (section,) = judgement_sections([record])
    lines = table_lines(next(part for part in section.parts if isinstance(part, Table)))
    start = lines.index("<details><summary>In words</summary>")
    assert lines[start - 2] == "*Scenes of the judge.*"
    assert lines[start + 1 :] == ["", "Level → late.", "", "Hill &lt;not run>.", "", "</details>"]


def test_two_judgements_have_names_of_their_own_in_the_page() -> None:
    record = parse_judgement(SAID, where="here")
    assert len({section.anchor for section in judgement_sections([record, record])}) == 2


def test_judgements_lie_in_the_run_that_was_judged(tmp_path: Path) -> None:
    assert read_judgements(tmp_path) == []
    folder = tmp_path / FOLDER
    folder.mkdir()
    (folder / "a.json").write_text(json.dumps(SAID), encoding="utf-8")
    assert read_judgements(tmp_path)[0].metrics == {"a": {"late": 1.25}}
    (folder / "b.json").write_text("{", encoding="utf-8")
    with pytest.raises(ConfigError, match="cannot be read"):
        read_judgements(tmp_path)


@pytest.mark.parametrize("missing", ["title", "headline"])
def test_a_judgement_without_its_words_is_refused(missing: str) -> None:
    with pytest.raises(ConfigError, match="judgement cannot be used"):
        parse_judgement({name: value for name, value in SAID.items() if name != missing}, where="here")


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"judgement": SAID, "schema_version": 99}, "newer release"),
        ({"judgement": SAID, "schema_version": 1}, "damaged"),
    ],
    ids=["newer", "damaged"],
)
def test_results_that_cannot_be_read_are_named(tmp_path: Path, document: dict[str, Any], message: str) -> None:
    (tmp_path / "results.json").write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(ConfigError, match=message):
        read_judgement_results(tmp_path)


@pytest.mark.parametrize("text", ["", "[]", '{"fits": []}'])
def test_results_of_something_else_are_left_to_others(tmp_path: Path, text: str) -> None:
    (tmp_path / "results.json").write_text(text, encoding="utf-8")
    assert read_judgement_results(tmp_path) is None
