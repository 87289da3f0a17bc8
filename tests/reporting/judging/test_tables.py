"""Tables, charts and sentences of a judgement, from figures that say themselves what they are."""

from __future__ import annotations

from typing import Any

from sysid.reporting.judging.results import parse_judgement
from sysid.reporting.judging.tables import (
    judgement_charts,
    judgement_headline,
    judgement_tables,
    tolerance_sentences,
)
from sysid.reporting.tables import Table


def values(table: Table) -> list[list[Any]]:
    """Its numbers, and its words where a cell has none; every row as wide as its head."""
    assert {len(row) for row in table.rows} == {len(table.head)}
    return [[cell.text if cell.value is None else cell.value for cell in row] for row in table.rows]


def test_every_figure_stands_in_a_table_under_its_name_and_unit(found: dict[str, Any]) -> None:
    summary, sensitivity, good, poor, measures = judgement_tables(parse_judgement(found, where="here"))
    assert values(summary) == [["good", 1.0, 0.75, "2 of 2", "0"], ["poor", 9.0, 20.0, "0 of 1", "1"]]
    assert summary.head[1:3] == (("level mse", "cm², mean"), ("lost water", "%, worst"))
    assert values(sensitivity) == [
        ["bias", "0.1 cm", 0.01, 0.1],
        ["bias", "1 cm", 1.0, 4.0],
        ["bias: passes 1 % at", "cm²", "", 0.25],
    ]
    assert values(good) == [["slow", 0.5, 0.25], ["fast", 1.5, -0.75]]
    assert values(poor) == [["slow", 9.0, 20.0, ""], ["fast", "", "", "it does not know such a flow"]]
    assert values(measures) == [
        ["slow", "reference valve", 10.0, "yes"],
        ["", "good", 10.025, "yes"],
        ["", "poor", 12.0, ""],
        ["fast", "reference valve", 10.0, "yes"],
        ["", "good", 9.925, "yes"],
    ]


def test_the_reference_stands_in_every_chart_of_a_signal(found: dict[str, Any]) -> None:
    cost, *signals = judgement_charts(parse_judgement(found, where="here"))
    assert cost.logarithmic == "xy"
    assert [(line.name, line.how) for line in cost.lines] == [
        ("lost water, bias", "line"),
        ("good: lost water", "marks"),
        ("poor: lost water", "marks"),
        ("1 %", "target"),
    ]
    assert [[(line.name, line.how) for line in chart.lines] for chart in signals] == [
        [("reference valve", "target"), ("good", "line")]
    ] * 2


def test_a_judge_without_reference_error_or_limit_has_its_figures_all_the_same(found: dict[str, Any]) -> None:
    bare = {key: found[key] for key in ("title", "scenes", "quantities", "subjects")}
    record = parse_judgement(bare, where="here")
    good, _, measures = judgement_tables(record)
    assert values(good) == [["slow", 0.5, 0.25], ["fast", 1.5, -0.75]]
    assert [row[1] for row in values(measures)] == ["good", "poor", "good"]
    assert [[line.name for line in chart.lines] for chart in judgement_charts(record)] == [["good"]] * 2
    assert tolerance_sentences(record) == []


def test_words_are_made_of_the_figures(found: dict[str, Any]) -> None:
    record = parse_judgement(found, where="here")
    assert judgement_headline(record) == (
        "Against the reference valve. good: fast −0.75 % in lost water at 1.50 cm². poor: no scenario could be run."
    )
    assert tolerance_sentences(record) == [
        "How large an error may be before the consequence passes 1 %: as a bias of the valve, lost water up to "
        "0.25 cm²."
    ]
