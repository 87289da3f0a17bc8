"""What the page says of starts, evidence, stability and intervals is what the run stored."""

import numpy as np
import pytest

from sysid.reporting.results import read_results
from sysid.reporting.sections import training
from sysid.reporting.sections.training import (
    attempts_figure,
    attempts_table,
    coverage_table,
    evidence_figure,
    groups_table,
    stability_table,
    training_parts,
    trust_sections,
)

ATTEMPTS = [
    {
        "start": start, "seed": start - 1, "iterations": iterations, "elapsed_s": 0.1 * iterations,
        "estimation_mse": 1.0 / (start * iterations), "selection_mse": None if start == 4 else 2.0 / start,
        "log_evidence": 100.0 * start, "effective_parameters": 12.5, "stable": stable, "chosen": start == 3,
    }
    for start, iterations, stable in ((1, 10, None), (1, 40, None), (2, 10, False), (3, 10, True), (4, 10, None))
]  # fmt: skip
STABILITY = {
    "stable": False, "text": "Unstable: ...", "source": "Passages.", "seed": 1, "sequences": 1000, "unbounded": 0,
    "judged": 900, "unsettled": 7, "tolerance": 0.1, "largest_plateau_error": 0.157, "worst": "sequence 931",
}  # fmt: skip
COVERAGE = {"level": 0.95, "share": 0.9634, "share_before_spread": 0.912, "mean_half_width": 0.25}


@pytest.fixture(scope="module")
def results(make_run, tmp_path_factory):
    def edit(document) -> None:
        fit = document["fits"][2]
        fit["attempts"], fit["stability"] = ATTEMPTS, STABILITY
        for case in fit["cases"].values():
            case["coverage"] = {"free_run": COVERAGE, "one_step": COVERAGE}

    return read_results(make_run(tmp_path_factory.mktemp("runs") / "run", samples=200, edit=edit))


def texts(table) -> list[list[str]]:
    return [[f"{cell.text}|{cell.below}" for cell in row] for row in table.rows]


def test_coverage_stands_by_case_with_its_width(results):
    rows = texts(coverage_table(results))
    assert [row[0] for row in rows] == ["NARX free run|free run", "NARX free run|one step ahead"]
    assert rows[0][1] == "96.3|± 0.250 psi; 91.2 % alone"
    assert len(rows[0]) == 1 + len(results.fits[2].cases)
    case = next(iter(results.fits[2].cases.values()))
    assert training._coverage_cell(case, "free_run", "1").below == "± 0.250; 91.2 % alone"


def test_an_unstable_fit_is_named_so_with_how_many_sequences_and_which(results):
    (row,) = texts(stability_table(results))
    assert row[0] == "NARX free run|UNSTABLE"
    assert row[1:4] == ["1000|", "0|", "7|of 900"]
    assert row[4].startswith("15.7|10 allowed")
    assert row[5] == "sequence 931|"


def test_the_last_look_at_each_start_is_listed_best_first(results):
    table = attempts_table(results.fits[2])
    assert [row[0].text for row in table.rows] == ["3", "2", "1", "4"]
    assert [row[1].value for row in table.rows] == [10, 10, 40, 10]
    assert [row[6].text for row in table.rows] == ["stable", "refused", "not checked", "not checked"]
    assert table.rows[0][0].below == "seed 2, chosen"
    assert table.rows[3][3].text == "none"


def test_a_ensemble_is_listed_with_the_starts_that_it_unites(results):
    united = results.fits[2].attempts[0].model_copy(update={"start": 5, "seed": None, "members": [3, 1, 3]})
    fit = results.fits[2].model_copy(update={"attempts": [*results.fits[2].attempts, united]})
    (row,) = (row for row in attempts_table(fit).rows if row[0].text == "ensemble")
    assert row[0].below == "of starts 3, 1, 3"


def test_a_start_says_which_inputs_it_did_without(results):
    blind = results.fits[2].attempts[0].model_copy(update={"start": 5, "seed": 4, "without": ["BP", "AR"]})
    fit = results.fits[2].model_copy(update={"attempts": [*results.fits[2].attempts, blind]})
    (row,) = (row for row in attempts_table(fit).rows if row[0].text == "5")
    assert row[0].below.startswith("seed 4, without BP and AR")


def test_every_look_is_a_point_and_the_chosen_one_stands_out(results):
    left, right = attempts_figure(results.fits[2]).axes
    points = [line.get_xydata() for line in left.lines]
    assert sorted(len(p) for p in points) == [1, 3]  # the fourth start has no selection error
    assert left.get_xscale() == left.get_yscale() == "log"
    np.testing.assert_allclose(right.lines[1].get_xydata(), [[300.0, 2.0 / 3.0]])


def test_groups_show_what_the_data_determine(results):
    rows = texts(groups_table(results.fits[2]))
    assert rows[0] == ["hidden|", "260|", "150|", "57.8|", "0.100|"]
    assert groups_table(results.fits[2]).note.startswith("Log evidence 1234.5")


def test_evidence_is_compared_between_fits_of_one_loop(results):
    figure = evidence_figure(results)
    (axes,) = figure.axes
    assert [line.get_label() for line in axes.lines] == ["pump+valve -> level, closed loop"]


def test_a_run_of_an_earlier_release_has_none_of_it(make_run, tmp_path):
    plain = read_results(make_run(tmp_path / "run", samples=200, names=["ARX"], edit=lambda d: d.update(best=None)))
    assert trust_sections(plain) == []
    assert training_parts(plain) == []
