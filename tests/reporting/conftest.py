"""A synthetic run folder: a tank's level that follows two inputs, fitted four times."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.validation import figures

CASES = {"EST01": "estimation", "VAL01": "validation", "VAL02": "validation", "VAL03": "validation", "VAL04": "test"}
FITS = {
    "ARX": ("arx", "open", "EXACT", 0.9),
    "NARX one step": ("narx-one-step", "open", "CONVERGED", np.inf),
    "NARX free run": ("narx-free-run", "closed", "CONVERGED", 0.04),
    "NARX free run, small": ("narx-free-run-small", "closed", "MAX_ITERATIONS", 0.2),
}


def _level(samples: int, rng: np.random.Generator) -> np.ndarray:
    """Random steps through a first-order lag."""
    commands = np.repeat(rng.uniform(0.0, 60.0, 40), -(-samples // 40))[:samples]
    level = np.empty(samples)
    state = 0.0
    for index, command in enumerate(commands):
        state += 0.01 * (command - state)
        level[index] = state
    return level


def _signals(noise: float, samples: int, seed: int) -> dict[str, dict[str, np.ndarray]]:
    found = {}
    for number, case in enumerate(CASES):
        rng = np.random.default_rng([seed, number])
        target = _level(samples, np.random.default_rng(number))
        size = 0.5 if np.isinf(noise) else noise
        simulated = target + size * np.sin(np.arange(samples) / 700.0) + 0.1 * size * rng.standard_normal(samples)
        if np.isinf(noise) and case == "VAL03":
            simulated[samples // 2 :] = np.inf
        predicted = target + 0.003 * rng.standard_normal(samples)
        found[case] = {
            "time": 0.1 * np.arange(samples),
            "target": target,
            "simulated": simulated,
            "predicted": predicted,
        }
    return found


def _fit(name: str, signals: dict[str, dict[str, np.ndarray]], selection_mse: float | None) -> dict[str, Any]:
    slug, loop, status, noise = FITS[name]
    cases = {
        case: {
            "role": CASES[case],
            "free_run": figures(parts["target"], parts["simulated"], "psi").to_dict(),
            "one_step": figures(parts["target"], parts["predicted"], "psi").to_dict(),
            "run_time_s": 0.0011 + 1e-7 * len(parts["time"]),
            "n_samples": len(parts["time"]),
            "simulated_s": float(parts["time"][-1]),
        }
        for case, parts in signals.items()
    }
    is_arx = name == "ARX"
    return {
        "name": name,
        "slug": slug,
        "mapping": "pump+valve -> level",
        "structure": {"kind": "ARX", "na": 2} if is_arx else {"kind": "NARX", "neurons": 20},
        "label": "ARX [2; 2 2; 1 1]" if is_arx else "NARX 4/4/20",
        "loop": loop,
        "train_time_s": 0.02 if is_arx else 38.25,
        "status": status,
        "notes": ["Three starts were compared.", "The free run is <stable>."],
        "evidence": None
        if is_arx
        else {
            "log_evidence": 1234.5,
            "beta": 10.0,
            "alphas": {"hidden": 0.1},
            "effective_parameters": {"hidden": 150.2, "output": 18.1},
            "parameters": {"hidden": 260, "output": 21},
        },
        "n_parameters": 7 if is_arx else 281,
        "selection_mse": selection_mse,
        "cases": cases,
        "exports": [
            {"format": kind, "file": f"bundle/{file}", "largest_difference": 3.1e-12, "tolerance": 1e-9, "unit": "psi"}
            for kind, file in (("onnx", "step.onnx"), ("torchscript", "step.pt"))
        ]
        if noise == 0.04
        else [],
        "learning_curve": None
        if is_arx
        else {"iteration": list(range(300)), "mse": list(5.0 * np.exp(-np.arange(300) / 40.0) + noise_floor(noise))},
    }


def noise_floor(noise: float) -> float:
    return 0.01 if np.isinf(noise) else noise**2


def _null(value: Any) -> Any:
    """As the run writes it: no number that JSON has no word for."""
    if isinstance(value, dict):
        return {key: _null(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_null(entry) for entry in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _document(fits: list[dict[str, Any]], samples: int) -> dict[str, Any]:
    """The results of a run with these fits."""
    return {
        "schema_version": 1,
        "pipeline": "tank-level",
        "description": "Level of a tank from pump -> valve, <fitted> four ways.",
        "command": "sysid run tank-level --seed 3",
        "created": "2026-03-01T12:00:00+00:00",
        "environment": {
            "python": "3.11.9",
            "packages": {"numpy": "2.2.1", "scipy": "1.15.0"},
            "cpu": "Test Processor 3 GHz",
            "cores": 2,
            "platform": "Linux",
            "commit": None,
        },
        "seed": 3,
        "data": {
            "name": "tank",
            "digest": "ab" * 32,
            "sample_time": 0.1,
            "cases": {
                case: {
                    "role": role,
                    "samples": samples,
                    "duration_s": 0.1 * (samples - 1),
                    "provenance": ["Recorded on the rig", "Averaged to 0.1 s."],
                }
                for case, role in CASES.items()
            },
        },
        "selection": {"name": "tank-selection", "cases": {"SEL01": {"samples": 500}, "SEL02": {"samples": 500}}},
        "start": {"kind": "rest", "n_measured": 0},
        "fits": fits,
        "best": {
            "name": "NARX free run",
            "chosen_by": "Least mean free-run mse on the selection traces SEL01 and SEL02.",
        },
        "published": None,
    }


@pytest.fixture(scope="session")
def make_run() -> Callable[..., Path]:
    """Writes a run folder; ``edit`` changes the results before they are written."""

    def make(
        folder: Path,
        *,
        samples: int = 2000,
        names: Sequence[str] = tuple(FITS),
        edit: Callable[[dict[str, Any]], None] | None = None,
    ) -> Path:
        fits = []
        for number, name in enumerate(names):
            slug, _, _, noise = FITS[name]
            signals = _signals(noise, samples, seed=number)
            place = folder / "fits" / slug
            place.mkdir(parents=True)
            arrays = {f"{case}/{part}": array for case, parts in signals.items() for part, array in parts.items()}
            np.savez_compressed(place / "signals.npz", **arrays)
            fits.append(_fit(name, signals, None if np.isinf(noise) else 1.1 * noise**2))
        document = _null(_document(fits, samples))
        if edit is not None:
            edit(document)
        (folder / "results.json").write_text(json.dumps(document, allow_nan=False), encoding="utf-8")
        return folder

    return make


@pytest.fixture(scope="session")
def run_folder(make_run: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that tests may read and must not change."""
    return make_run(tmp_path_factory.mktemp("run") / "tank-level")


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A workspace with published figures of its own."""
    folder = tmp_path / "reports" / "published"
    folder.mkdir(parents=True)
    (folder / "tanks.yaml").write_text(
        "title: Tanks\nauthor: A. Writer\nyear: 1999\nkind: Report\npart: all\ncases: all\n"
        "computer: an old machine\ncomparability: Other tanks.\nfigures: tanks.csv\n"
    )
    head = "source,mapping,structure,variant,loop,run,case,signal,quantity,value,unit,yardstick,note\n"
    rows = "".join(
        f"Table 1,pump+valve->level,NARX 4/4/20,best,closed,{run},{case},,{quantity},{value},{unit},yes,\n"
        for case in ("VAL01", "VAL02")
        for run, quantity, value, unit in (
            ("free_run", "mse", "0.0020", "psi^2"),
            ("one_step", "mse", "0.00010", "psi^2"),
            ("free_run", "run_time", "0.20", "s"),
        )
    )
    (folder / "tanks.csv").write_text(head + rows)
    return tmp_path
