"""The scorecard: what it prints is what the run stored."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sysid.reporting.numbers import number
from sysid.reporting.results import read_results
from sysid.reporting.scorecard import scorecard


def test_every_figure_of_the_chosen_fit_stands_under_its_case(make_run: Callable[..., Path], tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run", samples=200, names=("ARX", "NARX free run"))
    fit = read_results(folder).best_fit
    assert fit is not None
    head, _, ours = ([cell.strip() for cell in line.split("|")[1:-1]] for line in scorecard([folder]).splitlines())
    for case, record in fit.cases.items():
        assert ours[head.index(case)] == number(record.free_run.mse)
    assert ours[0] == "NARX 4/4/20, closed loop"


def test_published_figures_stand_below_with_the_ratio(
    make_run: Callable[..., Path], workspace: Path, tmp_path: Path, monkeypatch
) -> None:
    monkeypatch.chdir(workspace)
    folder = make_run(
        tmp_path / "run", samples=200, names=("ARX", "NARX free run"), edit=lambda run: run.update(published="tanks")
    )
    text = scorecard([folder, folder])
    assert text.count("| published (Table 1: NARX 4/4/20, best)") == 2
    assert text.count("| ours divided by it |") == 2
