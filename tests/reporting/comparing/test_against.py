"""One run against another: who is better where, said in words, and as numbers in a file."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sysid.errors import ConfigError
from sysid.reporting import compare_runs, write_comparison
from sysid.workbench.cli import run_cli

PAIR = ("ARX", "NARX free run")


def choose(name: str) -> Callable[[dict[str, Any]], None]:
    return lambda document: document["best"].update(name=name)


@pytest.fixture
def runs(make_run: Callable[..., Path], tmp_path: Path) -> tuple[Path, Path]:
    """The network's run and the linear model's, on the same records."""
    network = make_run(tmp_path / "network", samples=300, names=PAIR)
    linear = make_run(tmp_path / "linear", samples=300, names=PAIR, edit=choose("ARX"))
    return network, linear


def test_ratios_are_those_of_the_two_chosen_fits(runs: tuple[Path, Path]) -> None:
    found = compare_runs(*runs)
    assert (found.ours.fit.name, found.theirs.fit.name) == ("NARX free run", "ARX")
    for contest in found.contests:
        ours, theirs = (side.fit.cases[contest.case].free_run.mse for side in (found.ours, found.theirs))
        assert contest.ratio == ours / theirs
        assert contest.same
    assert found.mean_ratio < 0.1


def test_cases_that_were_fitted_do_not_count(runs: tuple[Path, Path]) -> None:
    assert [contest.case for contest in compare_runs(*runs).judged] == ["VAL01", "VAL02", "VAL03", "VAL04"]


def test_the_page_and_the_numbers_say_the_same(runs: tuple[Path, Path]) -> None:
    page = write_comparison(*runs)
    assert page == runs[0] / "report" / "against-linear.html"
    text = page.read_text(encoding="utf-8")
    assert "network is better on every one of 4 unseen cases." in text
    assert "https://" not in text
    numbers = json.loads(page.with_suffix(".json").read_text(encoding="utf-8"))
    assert numbers["mean_ratio"] == compare_runs(*runs).mean_ratio
    assert numbers["runs"]["theirs"]["fit"] == "ARX"
    assert {entry["what"] for entry in numbers["differences"]} >= {"fit", "structure"}


def test_a_run_is_equal_to_itself(runs: tuple[Path, Path]) -> None:
    page = write_comparison(runs[0], runs[0])
    assert "The runs are equal on every one of 4 unseen cases." in page.read_text(encoding="utf-8")


def test_cases_with_another_target_are_shown_but_not_counted(make_run: Callable[..., Path], tmp_path: Path) -> None:
    ours = make_run(tmp_path / "ours", samples=300, names=PAIR)
    theirs = make_run(tmp_path / "theirs", samples=301, names=PAIR)
    found = compare_runs(ours, theirs)
    assert len(found.contests) == 5
    assert found.judged == ()
    text = write_comparison(ours, theirs).read_text(encoding="utf-8")
    assert "nothing can be said about which is better" in text
    assert "those cases are shown, but not counted" in text


def test_a_run_that_diverges_loses_and_leaves_no_number(make_run: Callable[..., Path], tmp_path: Path) -> None:
    names = ("ARX", "NARX one step")
    ours = make_run(tmp_path / "ours", samples=300, names=names, edit=choose("NARX one step"))
    theirs = make_run(tmp_path / "theirs", samples=300, names=names, edit=choose("ARX"))
    page = write_comparison(ours, theirs)
    text = page.read_text(encoding="utf-8")
    assert "Largest loss</dt><dd>VAL03: mse diverged against" in text
    assert json.loads(page.with_suffix(".json").read_text())["cases"]["VAL03"]["ratio"] is None


def _other_unit(document: dict[str, Any]) -> None:
    for fit in document["fits"]:
        for case in fit["cases"].values():
            case["free_run"]["unit"] = "kPa"


def test_runs_in_other_units_are_not_compared(make_run: Callable[..., Path], tmp_path: Path) -> None:
    ours = make_run(tmp_path / "ours", samples=50, names=PAIR)
    theirs = make_run(tmp_path / "theirs", samples=50, names=PAIR, edit=_other_unit)
    with pytest.raises(ConfigError, match=r"(?s)cannot be compared.*psi.*kPa"):
        compare_runs(ours, theirs)


def test_the_command_names_the_page(runs: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["report", str(runs[0]), "--against", str(runs[1])]) == 0
    assert "against-linear.html" in capsys.readouterr().out
