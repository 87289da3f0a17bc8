"""Frozen surrogates that lie beside published reports: whole, and as accurate as their report says."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sysid.export import read_bundle
from sysid.ingest import load_dataset
from sysid.validation import evaluate_cascade

REPORTS = Path(__file__).parents[2] / "reports"

SHORTEST = dict.fromkeys(("combined-brake-held", "combined-brake-grown"), ("abdx-combined", "VAL05"))
"""By report the data set that it was scored on, and the shortest of its cases."""


def test_every_published_bundle_is_looked_at() -> None:
    assert {folder.parent.name for folder in REPORTS.glob("*/bundle")} == set(SHORTEST)


@pytest.mark.parametrize("name", SHORTEST)
def test_its_free_run_has_the_published_error(name: str) -> None:
    data, case = SHORTEST[name]
    found = evaluate_cascade(read_bundle(REPORTS / name / "bundle").model, load_dataset(data, cases=[case]))
    scores = json.loads((REPORTS / name / "scores.json").read_text(encoding="utf-8"))
    assert scores
    for score in scores:
        output = score["mapping"].split(" -> ")[1]
        # A hundredth: another processor rounds otherwise, and a relay about to switch makes much of it.
        assert found.mse(output)[case] == pytest.approx(score["mse"][case], rel=0.01)
