"""The page of an assembly: everything that was stored is on it, and every chart is drawn from stored signals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.reporting import publish_run, write_report
from sysid.reporting.assembly.charts import active_learning_charts, position_chart
from sysid.reporting.assembly.document import assembly_document, limit_check_sentences
from sysid.reporting.assembly.results import AssemblyResults
from sysid.reporting.kinds import read_run
from sysid.reporting.parts import Picture
from sysid.reporting.tables import Table
from tests.reporting.assembly.conftest import document, write_run


def test_a_page_has_every_table_and_a_chart_for_every_signal(run_folder: Path, results: AssemblyResults) -> None:
    page = assembly_document(run_folder, results)
    assembly, judged, data = page.sections
    assert [section.anchor for section in page.sections] == ["the-assembly", "judged", "data"]
    kinds = [type(part) for part in assembly.parts]
    assert kinds.count(Table) == 14
    assert kinds.count(Picture) == 2 + 2 + 1 + 1  # active learning, two cases, positions, the worst sequence
    assert kinds.index(Table) + 1 == kinds.index(Picture), "the first chart stands beside the stages"
    (stages,) = judged.parts
    assert isinstance(stages, Table)
    assert [row[0].text for row in stages.rows] == ["each alone", "trained end to end"]
    (digests,) = data.parts
    assert isinstance(digests, Table)
    assert [[cell.text for cell in row] for row in digests.rows] == [["tanks", "abc"], ["pool", "def"]]
    assert [word for word, _ in page.verdict.points] == [
        "Accuracy", "Published", "Speed", "Ablation", "All positions", "Weakness",
    ]  # fmt: skip


def test_what_a_run_does_not_have_is_not_mentioned(tmp_path: Path) -> None:
    few = {key: value for key, value in document().items() if key not in {"seed", *list(document())[14:]}}
    folder = write_run(tmp_path / "few", few)
    results = read_run(folder)
    assert isinstance(results, AssemblyResults)
    (assembly, *_) = assembly_document(folder, results).sections
    assert [type(part) for part in assembly.parts].count(Table) == 2
    assert results.metrics()["each alone"]["selection"] == 0.25


def test_the_curves_have_a_point_for_each_round(results: AssemblyResults) -> None:
    (found,) = results.active_learning
    error, share = active_learning_charts(found)
    assert (error.logarithmic, share.logarithmic) == ("xy", "x")
    for chart in (error, share):
        assert all(list(line.x) == [120.0, 300.0] for line in chart.lines)
        assert [line.how for line in chart.lines] == ["points"] * (len(chart.lines) - 1) + ["target"]
    assert {line.name: list(line.y) for line in error.lines}["99 % of the random sequences under"] == [5.0, 4.0]
    assert list(share.lines[0].y) == [0.0, 50.0]
    partial = [one.model_copy(update={"monte_carlo": None}) if one.number else one for one in found.rounds]
    lines = active_learning_charts(found.model_copy(update={"rounds": partial}))[0].lines
    assert len(lines) == 3, "a curve with a point missing is none"


def test_positions_that_were_fitted_are_marked(results: AssemblyResults) -> None:
    assert results.interpolation is not None
    chart = position_chart(results.interpolation.outputs["lower"], "lower")
    assert [(line.name, line.how) for line in chart.lines] == [("A", "line"), ("V", "line"), ("fitted here", "marks")]


def test_limits_that_training_traces_pass_are_told(results: AssemblyResults) -> None:
    check = results.limit_check
    assert check is not None
    assert len(limit_check_sentences(check)) == 1
    assert limit_check_sentences(check.model_copy(update={"limits": []})) == []


def test_numbers_to_track_are_those_of_the_stages_and_of_positions_that_were_not_fitted(
    results: AssemblyResults,
) -> None:
    assert results.metrics()["trained end to end"] == {
        "selection": 0.125,
        "lower/A/mse": 0.25,
        "lower/V/mse": 0.3,
        "lower/A/unseen positions/mse": 0.25,
        "lower/A/unseen positions/worst mse": 0.25,
        "lower/V/unseen positions/mse": 0.125,
        "lower/V/unseen positions/worst mse": 0.125,
    }


def test_a_report_is_made_twice_from_what_is_stored(run_folder: Path, tmp_path: Path) -> None:
    first = write_report(run_folder).read_bytes()
    stored = json.loads((run_folder / "report" / "results.json").read_text(encoding="utf-8"))
    assert AssemblyResults.model_validate(stored).chosen.mse["lower"]["V"] == 0.3
    assert write_report(run_folder).read_bytes() == first
    page = publish_run(run_folder, tmp_path / "reports")
    assert publish_run(run_folder, tmp_path / "reports").read_bytes() == page.read_bytes()
    assert (page.parent / "scores.json").is_file()


def test_signals_that_are_missing_are_named(run_folder: Path) -> None:
    (run_folder / "signals.npz").unlink()
    with pytest.raises(ConfigError, match="signals cannot be read"):
        write_report(run_folder)
