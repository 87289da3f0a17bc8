"""The rounds of training end to end in the report: a row each, and what their fits said folded away below."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid.composite.round import TrainedRound
from sysid.estimation import CascadeFit, Status
from sysid.reporting.judging.results import read_judgement_results
from sysid.workbench.assembly.rounds import rounds_table
from sysid.workbench.assembly.runner import run_assembly
from sysid.workbench.kinds import RunRequest
from tests.models.cascades import service
from tests.workbench.assembly.conftest import PIPELINE

TWO = (
    PIPELINE.replace("candidates: 2", "candidates: 1")
    .replace("retrain: {members: [lower], max_iterations: 5}\n", "")
    .replace("targets: {upper: 0.1, lower: 0.1}", "targets: {upper: 0.1}\n  members: [upper]\n  measured: [lower]")
    .replace("looks: 2}\n", "looks: 2}\n  again: [{measured: [], members: [upper, lower], traces: 1}]\n", 1)
)
"""The upper tank behind the measured lower one, on both traces; then both tanks, on one."""


def test_a_row_says_what_a_round_trained_and_what_it_brought(workspace: Path) -> None:
    file = workspace / "pipelines" / "tanks.yaml"
    file.write_text(TWO, encoding="utf-8")
    assert run_assembly(RunRequest(path=file, typed="tanks", tracking=False)) == 0
    folder = workspace / "runs" / "tanks"
    found = read_judgement_results(folder)
    assert found is not None
    table = next(one for one in found.judgement.tables if one.caption.startswith("Training end to end"))
    assert [row[:4] for row in table.rows] == [["1", "upper", "lower", 2], ["2", "upper, lower", "", 1]]

    names = ("together.json", "together-2.json")
    fits = [CascadeFit.from_dict(json.loads((folder / one).read_text(encoding="utf-8"))) for one in names]
    for row, fit in zip(table.rows, fits, strict=True):
        _, _, _, _, iterations, seconds, residual, before, after, ended = row
        assert seconds == fit.train_time_s
        assert str(ended).upper().replace(" ", "_") == fit.status.name
        chosen, others = fit.notes
        assert f"after {iterations} iterations" in chosen
        assert chosen.endswith(f"on the selection traces {after:.4g}.")
        if residual is None:  # no step was worth taking
            assert (iterations, before) == (0, after)
        else:
            assert f"mean squared residual {residual:.4g}," in chosen
            assert f" {before:.4g} (0)" in others
    assert all(row[8] <= row[7] for row in table.rows)
    assert any(row[8] < row[7] for row in table.rows)
    said = [f"Round {n}: {note}" for n, fit in enumerate(fits, 1) for note in (*fit.notes, fit.status.value)]
    assert table.folded == said
    assert not set(said) & set(found.judgement.sentences), "they stand in the table, and are no sentences of the page"


def done(**changes: object) -> TrainedRound:
    fit = CascadeFit(
        model=service(),
        status=Status.STOPPED_EARLY,
        errors={"BC": 1.0},
        history={"iteration": np.array([0.0, 1.0, 2.0]), "loss": np.array([4.0, 2.0, 1.0])},
        train_time_s=3.0,
    )
    own = {"name": "1", "trained": ("BC",), "shared": False, "measured": (), "traces": 5}
    return TrainedRound(**{"before": 2.0, "after": 0.5, "fit": fit, **own, **changes})


def test_a_round_that_brought_nothing_has_no_curve_and_no_residual() -> None:
    bare = {"iteration": np.array([]), "loss": np.array([])}
    (row,) = rounds_table([done(fit=replace(done().fit, status=Status.NOT_IMPROVED, history=bare))])["rows"]
    assert (row[4], row[6], row[-1]) == (0, None, "not improved")


@pytest.mark.parametrize(
    ("changes", "column", "said"),
    [
        ({"name": "2.1 of growth"}, 0, "2.1 of growth"),
        ({"trained": ("AR", "BC"), "shared": True}, 1, "AR, BC, everywhere"),
        ({"measured": ("BP", "AR", "ER")}, 2, "BP, AR, ER"),
        ({"measured": ("BP", "AR", "ER", "VO")}, 2, "4 outputs"),
    ],
)
def test_a_cell_names_a_few_outputs_and_counts_many(changes: dict[str, object], column: int, said: str) -> None:
    (row,) = rounds_table([done(**changes)])["rows"]
    assert row[column] == said
