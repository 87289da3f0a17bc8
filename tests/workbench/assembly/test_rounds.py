"""The rounds of training end to end, as they are stored: what each trained, every state that was looked at."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from sysid.estimation import CascadeFit
from sysid.workbench.commands.run import run_request
from sysid.workbench.kinds import RunRequest
from tests.workbench.assembly.conftest import PIPELINE, assembly_results

TWO = (
    PIPELINE.replace("candidates: 2", "candidates: 1")
    .replace("retrain: {members: [lower], max_iterations: 5}\n", "")
    .replace("targets: {upper: 0.1, lower: 0.1}", "targets: {upper: 0.1}\n  members: [upper]\n  measured: [lower]")
    .replace("checkpoints: 2}\n", "checkpoints: 2}\n  again: [{measured: [], members: [upper, lower], traces: 1}]\n", 1)
)
"""The upper tank behind the measured lower one, on both traces; then both tanks, on one."""


def test_a_round_says_what_it_trained_and_what_it_brought(workspace: Path) -> None:
    file = workspace / "pipelines" / "tanks.yaml"
    file.write_text(TWO, encoding="utf-8")
    assert run_request(RunRequest(path=file, typed="tanks", tracking=False)) == 0
    folder = workspace / "runs" / "tanks"
    found = assembly_results(folder)
    told = [(one.name, one.trained, one.measured, one.traces) for one in found.rounds]
    assert told == [("1", ["upper"], ["lower"], 2), ("2", ["upper", "lower"], [], 1)]

    names = ("together.json", "together-2.json")
    fits = [CascadeFit.from_dict(json.loads((folder / one).read_text(encoding="utf-8"))) for one in names]
    for one, fit in zip(found.rounds, fits, strict=True):
        assert (one.train_time_s, one.status, one.notes) == (fit.train_time_s, fit.status.name, list(fit.notes))
        kept = ("start", "seed", "iterations", "elapsed_s", "estimation_mse", "selection_mse", "chosen", "status")
        stored, looked_at = ([[getattr(a, n) for n in kept] for a in some.attempts] for some in (one, fit))
        assert stored == looked_at
        (chosen,) = [attempt for attempt in one.attempts if attempt.chosen]
        assert (chosen.iterations, chosen.selection_mse) == (one.iterations, pytest.approx(one.selection_after))
        given = one.attempts[0]
        assert (given.iterations, given.status, given.selection_mse) == (0, "", pytest.approx(one.selection_before))
        if np.isnan(one.loss):  # no step was worth taking
            assert chosen is given
        else:
            assert chosen.estimation_mse == pytest.approx(one.loss)
    assert all(one.selection_after <= one.selection_before for one in found.rounds)
    assert any(one.selection_after < one.selection_before for one in found.rounds)
