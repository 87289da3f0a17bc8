"""The results of an assembly of two tanks, as a run stores them, with everything that a run can have."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.reporting.assembly.results import AssemblyResults

LOOK = {"within": 0.5, "median": 0.2, "p99": 0.9}


def document() -> dict[str, Any]:
    """The contents of results.json."""
    return {
        "schema_version": 2,
        "kind": "assembly",
        "pipeline": "tanks",
        "description": "Two tanks.",
        "command": "sysid run tanks",
        "created": "2026-11-21T04:00:00+00:00",
        "environment": {"commit": "9ffa098", "cpu": "A", "cores": 2},
        "seed": 3,
        "data": {"name": "tanks", "digest": "abc", "others": {"pool": "def"}},
        "cases": {
            "A": {"role": "estimation", "samples": 300, "duration_s": 300.0, "run_time_s": 0.003},
            "V": {"role": "validation", "samples": 300, "duration_s": 300.0, "run_time_s": 0.006},
        },
        "outputs": {"lower": {"unit": "cm"}},
        "whole": {"stage": "trained end to end", "inputs": ["pump"], "models": 2, "parameters": 40},
        "stages": [
            {
                "name": "each alone",
                "networks": ["upper -> lower: NARX 1/1/3"],
                "selection": 0.25,
                "mse": {"lower": {"A": 0.5, "V": None}},
            },
            {
                "name": "trained end to end",
                "networks": ["all as before"],
                "selection": 0.125,
                "mse": {"lower": {"A": 0.25, "V": 0.3}},
            },
        ],
        "published": {"lower": {"source": "Table 1", "target": 0.5, "mse": {"V": 0.4}}},
        "members": [
            {
                "mapping": "upper -> lower",
                "unit": "cm",
                "candidates": [
                    {
                        "structure": "NARX 1/1/3",
                        "seed": 3,
                        "best_alone": True,
                        "chosen": True,
                        "selection": 0.1,
                        "free_run_mse": {"A": 0.1, "V": 0.2},
                        "run_time_s": {"A": 0.001, "V": 0.001},
                        "one_step": {"one_step_mse": {"A": 1e-6, "V": 1e-6}, "free_run_mse": {"A": 4.0, "V": None}},
                    }
                ],
            }
        ],
        "rounds": [
            {
                "name": "1",
                "trained": ["upper", "lower"],
                "all_instances": False,
                "measured": [],
                "traces": 2,
                "iterations": 4,
                "train_time_s": 1.5,
                "loss": 2.0,
                "selection_before": 0.25,
                "selection_after": 0.125,
                "status": "STOPPED_EARLY",
                "notes": ["Chosen by the selection traces."],
            }
        ],
        "active_learning": [
            {
                "outputs": ["lower"],
                "unit": "cm",
                "limit": 0.5,
                "aim": 0.99,
                "pick": "worst",
                "held_out": 10,
                "ended": "it ended with the pool",
                "rounds": [
                    {
                        "number": number,
                        "stage": stage,
                        "added": [f"T{k}" for k in range(3 * number)],
                        "traces": 2 + 3 * number,
                        "samples": 120 + 180 * number,
                        "train_time_s": 2.5 * number,
                        "held_out": {"within": 0.5 * number, "median": 0.2, "p99": 0.9 - number / 2},
                        "monte_carlo": {"within": 0.1 * number, "median": 0.0, "p99": 5.0 - number},
                        "selection": 0.25 / (1 + number),
                    }
                    for number, stage in enumerate(("each alone", "trained end to end"))
                ],
            }
        ],
        "ablation": [
            {
                "step": "close_loop",
                "published": "Table 2",
                "comparisons": [{"what": "upper -> lower", "before": None, "after": 1.0, "one_step": 1e-6}],
            },
            {"step": "train_together", "comparisons": [{"what": "the whole", "before": 0.25, "after": 0.5}]},
        ],
        "monte_carlo": {
            "output": "lower",
            "unit": "cm",
            "sequences": 4,
            "lost": 1,
            "limit": 0.5,
            "within": 0.75,
            "quantiles": {"0.5": 0.1, "0.99": 0.6},
            "worst": [{"name": "R7", "rmse": 0.6}],
            "by_state": {"filling": {"0.5": 0.05, "0.99": 0.3}},
            "by_kind": {
                "ramps": {"sequences": 3, "lost": 1, "within": 0.5, "quantiles": {"0.5": 0.1, "0.99": 0.4}},
                "sine": {"sequences": 2, "lost": 0, "within": 1.0, "quantiles": {"0.5": 0.2, "0.99": 0.3}},
            },
        },
        "limits": [
            {
                "output": "lower",
                "unit": "cm",
                "low": 0.0,
                "high": "rim",
                "cases": {"low": 100, "high": 0, "lost": 0, "samples": 600},
            }
        ],
        "limit_check": {
            "traces": 3,
            "limits": [
                {"output": "lower", "limit": "rim", "unit": "cm", "most": 2.0, "summed": 3.5, "trace": "t1"},
                {"output": "upper", "limit": "top", "unit": "cm", "most": 0.0, "summed": 0.0, "trace": "t1"},
            ],
        },
        "interpolation": {
            "outputs": {
                "lower": {
                    "positions": [1.0, 4.0, 9.0],
                    "fitted": [True, False, True],
                    "mse": {"A": [0.0, 0.25, 0.0], "V": [0.5, 0.125, 0.25]},
                }
            },
            "run_time_s": {"A": 0.002, "V": 0.004},
        },
        "exports": [
            {
                "format": "c",
                "file": "bundle/model.c",
                "largest_difference": 1e-9,
                "tolerance": 1e-6,
                "unit": "cm",
            }
        ],
        "notes": ["Begun from nothing."],
    }


@pytest.fixture
def results() -> AssemblyResults:
    """As it is read."""
    return AssemblyResults.model_validate(document())


def write_run(folder: Path, stored: dict[str, Any]) -> Path:
    """A run folder with the signals that belong to it."""
    folder.mkdir(parents=True)
    (folder / "results.json").write_text(json.dumps(stored), encoding="utf-8")
    time = np.arange(300.0)
    for file, names in (("signals.npz", ("A", "V")), ("monte-carlo.npz", ("R7",))):
        parts = {"time": time, "target": np.sin(time / 20), "simulated": np.sin(time / 20 + 0.1)}
        arrays = {f"lower/{name}/{part}": values for name in names for part, values in parts.items()}
        np.savez(folder / file, **arrays)
    return folder


@pytest.fixture
def run_folder(tmp_path: Path) -> Path:
    """A finished run."""
    return write_run(tmp_path / "runs" / "tanks", document())
