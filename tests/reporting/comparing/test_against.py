"""One run against another: who is better where, said in words, and as numbers in a file."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.reporting import compare_runs, read_results, write_comparison
from sysid.reporting.signals import read_signals
from sysid.workbench.cli import run_cli
from tests.reporting.assembly.conftest import document, write_run
from tests.reporting.judging.conftest import leakage

pytestmark = pytest.mark.usefixtures("undrawn")

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
    sides = (found.ours, found.theirs)
    assert [side.entries["level"].name for side in sides] == ["NARX free run", "ARX"]
    fits = [read_results(run).best_fit for run in runs]
    for contest in found.contests:
        ours, theirs = (fit.cases[contest.case].free_run.mse for fit in fits if fit is not None)
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
    assert numbers["runs"]["theirs"]["models"]["level"]["name"] == "ARX"
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
    assert {one["case"]: one["ratio"] for one in json.loads(page.with_suffix(".json").read_text())["cases"]}[
        "VAL03"
    ] is None


def _other_unit(document: dict[str, Any]) -> None:
    for fit in document["fits"]:
        for case in fit["cases"].values():
            case["free_run"]["unit"] = "kPa"


def test_runs_in_other_units_are_not_compared(make_run: Callable[..., Path], tmp_path: Path) -> None:
    ours = make_run(tmp_path / "ours", samples=50, names=PAIR)
    theirs = make_run(tmp_path / "theirs", samples=50, names=PAIR, edit=_other_unit)
    with pytest.raises(ConfigError, match=r"(?s)cannot be compared.*psi.*kPa"):
        compare_runs(ours, theirs)


def assembly(folder: Path, **changes: Any) -> Path:
    return write_run(folder, document() | changes)


def test_assemblies_are_compared_output_by_output(tmp_path: Path) -> None:
    stages = [document()["stages"][1] | {"mse": {"lower": {"A": 0.5, "V": 0.15}}}]
    ours, theirs = assembly(tmp_path / "ours"), assembly(tmp_path / "theirs", stages=stages)
    found = compare_runs(ours, theirs)
    assert [(one.output, one.case, one.counts) for one in found.contests] == [
        ("lower", "A", False), ("lower", "V", True),
    ]  # fmt: skip
    assert found.mean_ratio == pytest.approx(2.0)
    text = write_comparison(ours, theirs).read_text(encoding="utf-8")
    assert "ours is better on none of 1 unseen cases." in text
    assert text.count("<svg") == 1 + 2, "the errors, and both cases side by side"


def test_a_fit_is_compared_with_an_assembly_that_has_its_output(make_run: Callable[..., Path], tmp_path: Path) -> None:
    fits = make_run(tmp_path / "fits", samples=300, names=PAIR)
    signals = read_signals(fits / "fits" / "narx-free-run", ["VAL01"])["VAL01"]
    cases = {"VAL01": document()["cases"]["V"]}
    stages = [{"name": "trained end to end", "selection": 0.1, "mse": {"level": {"VAL01": 1e-9}}}]
    whole = assembly(
        tmp_path / "whole", cases=cases, outputs={"level": {"unit": "psi"}}, stages=stages, limits=[], members=[],
        published={}, monte_carlo=None,
    )  # fmt: skip
    parts = {part: getattr(signals, part) for part in ("time", "target", "simulated")}
    np.savez(whole / "signals.npz", **{f"level/VAL01/{part}": values for part, values in parts.items()})
    found = compare_runs(whole, fits)
    assert [(one.case, one.counts) for one in found.contests] == [("VAL01", True)]
    assert found.mean_ratio < 1e-3
    assert write_comparison(whole, fits).is_file()


def judged(folder: Path, found: dict[str, Any]) -> Path:
    folder.mkdir()
    run = {key: document()[key] for key in ("pipeline", "command", "created", "environment")}
    run |= {"schema_version": 2, "kind": "leak", "data": {"name": "of the judge leak"}, "judgement": found}
    run |= {"subjects": [{"name": name, "parts": ["a"]} for name in found["subjects"]]}
    (folder / "results.json").write_text(json.dumps(run), encoding="utf-8")
    return folder


def test_judgements_are_compared_by_their_error_and_what_is_limited(tmp_path: Path) -> None:
    ours, better = judged(tmp_path / "ours", leakage()), leakage()
    better["subjects"]["good"]["fast"]["differences"]["level_mse"] = 0.75
    better["reference"]["slow"]["measures"]["lost_l"] = 11.0
    compared = compare_runs(ours, judged(tmp_path / "theirs", better))
    assert [(one.output, one.case, one.counts, one.ratio) for one in compared.contests] == [
        ("good: level mse", "slow", False, 1.0),
        ("good: level mse", "fast", True, 2.0),
        ("poor: level mse", "slow", False, 1.0),
    ]
    page = write_comparison(ours, tmp_path / "theirs")
    numbers = json.loads(page.with_suffix(".json").read_text(encoding="utf-8"))
    assert numbers["cases"][1]["ours"] == {"mse": 1.5, "lost_percent": -0.75, "run_time_s": None, "role": None}


def test_a_judgement_without_an_error_is_refused(tmp_path: Path) -> None:
    run = judged(tmp_path / "run", leakage() | {"error": None})
    with pytest.raises(ConfigError, match="no error to compare by"):
        compare_runs(run, run)


def test_tables_of_an_earlier_release_are_compared_by_their_scores(tmp_path: Path) -> None:
    old = {key: document()[key] for key in ("pipeline", "command", "created", "environment", "data")}
    score = {"mapping": "pump -> lower", "unit": "cm", "model": "2 models as one", "mse": {"A": 0.5, "V": 0.6}}
    ready = {"title": "The assembly", "headline": "So.", "scores": [score]}
    run = tmp_path / "old"
    run.mkdir()
    (run / "results.json").write_text(json.dumps(old | {"subjects": [], "judgement": ready}), encoding="utf-8")
    found = compare_runs(assembly(tmp_path / "new"), run)
    assert [one.ratio for one in found.contests] == [0.5, 0.5]
    assert found.judged == (), "nobody knows on which target"
    ready["scores"] = []
    (run / "results.json").write_text(json.dumps(old | {"subjects": [], "judgement": ready}), encoding="utf-8")
    with pytest.raises(ConfigError, match="no figures that can be compared"):
        compare_runs(tmp_path / "new", run)


def test_the_command_names_the_page(runs: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["report", str(runs[0]), "--against", str(runs[1])]) == 0
    assert "against-linear.html" in capsys.readouterr().out
