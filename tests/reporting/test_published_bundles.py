"""Frozen surrogates that lie beside published reports: whole, and as accurate as their report says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.export import read_bundle
from sysid.ingest import load_dataset
from sysid.validation import evaluate_cascade
from sysid.workbench.assembly.runner import read_interpolation

REPORTS = Path(__file__).parents[2] / "reports"

SHORTEST = {
    "combined-brake-held": ("abdx-combined", "VAL05"),
    "combined-brake-grown": ("abdx-combined", "VAL05"),
    "service-cascade-grown": ("abdx-service", "VAL04"),
    "service-cascade-any": ("abdx-service", "VAL04"),
    "service-cascade-held": ("abdx-service", "VAL04"),
    "service-cascade-wide": ("abdx-service", "VAL04"),
    "service-cascade-mean": ("abdx-service", "VAL04"),
}
"""By report the data set that it was scored on, and the shortest of its cases."""


def scores_of(name: str) -> list[dict[str, Any]]:
    """What a report says of its outputs."""
    found: list[dict[str, Any]] = json.loads((REPORTS / name / "scores.json").read_text(encoding="utf-8"))
    return found


def test_every_published_bundle_is_looked_at() -> None:
    assert {folder.parent.name for folder in REPORTS.glob("*/bundle")} == set(SHORTEST)


@pytest.mark.parametrize("name", SHORTEST)
def test_its_free_run_has_the_published_error(name: str) -> None:
    data, case = SHORTEST[name]
    found = evaluate_cascade(read_bundle(REPORTS / name / "bundle").model, load_dataset(data, cases=[case]))
    scores = scores_of(name)
    assert scores
    for score in scores:
        output = score["mapping"].split(" -> ")[1]
        # A hundredth: another processor rounds otherwise, and a relay about to switch makes much of it.
        assert found.mse(output)[case] == pytest.approx(score["mse"][case], rel=0.01)


@pytest.mark.parametrize("name", [folder.parent.name for folder in REPORTS.glob("*/line.json")])
def test_a_published_line_has_the_published_error_at_its_first_place(name: str) -> None:
    trace = load_dataset("abdx-service", cases=["VAL04"])["VAL04"]
    run = read_interpolation(REPORTS / name).line.simulate_trace(trace, [1.0])
    published = {one["mapping"].split(" -> ")[1]: one["mse"]["VAL04"] for one in scores_of(name)}
    assert run["BC"].shape == (1, len(trace))
    assert np.mean((run["BC"][0] - trace["BC"]) ** 2) == pytest.approx(published["BC"], rel=0.01)
