"""What the records say against a fit has a section of its own, and the chosen fit comes first."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from sysid.reporting import read_results
from sysid.reporting.sections.warnings_of_fits import warning_points, warnings_section
from sysid.reporting.tables import Table

PAIR = ("ARX", "NARX free run")


def warned(document: dict[str, Any]) -> None:
    document["fits"][0]["warnings"] = ["its free run is no better than a constant."]
    document["fits"][1]["warnings"] = ["it has too little memory.", "one input stands still."]


def test_warnings_of_the_chosen_fit_stand_first(make_run: Callable[..., Path], tmp_path: Path) -> None:
    results = read_results(make_run(tmp_path / "run", samples=50, names=PAIR, edit=warned))
    ((_, point),) = warning_points(results)
    assert point == "NARX free run: it has too little memory. 2 more under 'What to look at'."
    section = warnings_section(results)
    assert section is not None and section.title == "What to look at"
    (table,) = section.parts
    assert isinstance(table, Table)
    assert [row[0].text for row in table.rows] == ["NARX free run", "NARX free run", "ARX"]


def repeated(document: dict[str, Any]) -> None:
    document["fits"][0]["warnings"] = ["V was fitted too.", "it has too little memory."]
    document["fits"][1]["warnings"] = ["V was fitted too."]


def test_what_is_said_of_several_fits_is_said_once(make_run: Callable[..., Path], tmp_path: Path) -> None:
    results = read_results(make_run(tmp_path / "run", samples=50, names=PAIR, edit=repeated))
    assert warning_points(results) == [("Warning", "NARX free run: V was fitted too. 1 more under 'What to look at'.")]
    section = warnings_section(results)
    assert section is not None and isinstance(section.parts[0], Table)
    told = [(row[0].text, row[1].text) for row in section.parts[0].rows]
    assert told == [("NARX free run, ARX", "V was fitted too."), ("ARX", "it has too little memory.")]


def test_without_warnings_there_is_neither(make_run: Callable[..., Path], tmp_path: Path) -> None:
    results = read_results(make_run(tmp_path / "run", samples=50, names=PAIR))
    assert warning_points(results) == [] and warnings_section(results) is None


def only_the_other(document: dict[str, Any]) -> None:
    document["fits"][0]["warnings"] = ["its free run is no better than a constant."]


def test_a_warning_at_the_head_says_where_it_is_not_of_the_chosen_fit(
    make_run: Callable[..., Path], tmp_path: Path
) -> None:
    results = read_results(make_run(tmp_path / "run", samples=50, names=PAIR, edit=only_the_other))
    ((_, point),) = warning_points(results)
    assert point == "ARX, which was not chosen: its free run is no better than a constant."
