"""From slow models to surrogates in their place: what one command makes of each in so many minutes.

Run with ``python -m tests.benchmarks surrogates --minutes=5 --only=thermal,cylinder --workers=2``. References are slow
models of the tests (a stiff thermal network of 200 states, a hydraulic cylinder with friction and end stops, a motor on
a spindle between stops, a basin that runs over and runs dry, a block that sticks and slips behind a spring, a tank
whose valve sticks, and those of ``tests/references/loop_models.py``: gears with backlash, heaters whose controllers are
at their limits, hidden thermostats), which can be compiled
(``--compiled=yes``), to the same numbers and so fast that the proof has 1,000 experiments in any time, while the
surrogate's speed is held against two runs of the model as it is written; and, where the folder of the environment
variable ``REFERENCE_FMUS`` holds them, the Modelica Association's VanDerPol, Dahlquist and BouncingBall
(https://github.com/modelica/Reference-FMUs), the last by the equations of
``docs/how/events.md`` in place of a search. ``--proof=1000`` asks for so many new experiments whatever they take, and
``--seed=1`` draws others. Time is that of the whole: experiments, search
and proof. The target is a share of 99 % within 1 % of the range for what is smooth and 95 % for what has events (root
mean square of the free run), and 100 times the reference's speed on the thermal network.
"""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import sysid
from sysid.field_checks import check
from sysid.references.described import Wish
from sysid.references.design import drawn
from sysid.references.runs import ReferenceRuns
from sysid.references.sources import source_of
from sysid.workbench.experiments.config import ExperimentConfig
from sysid.workbench.surrogates.plan import written
from sysid.yaml_files import read_yaml

MODELS = Path(__file__).parents[1] / "references"
sys.path.insert(0, str(MODELS))
loop_models = importlib.import_module("loop_models")  # as the processes that run a reference know it
MINUTES = 5.0
RUNS = {"estimation": 12, "selection": 4, "test": 4}
MORE = {"estimation": 24, "selection": 8, "test": 4}
PYTHON: dict[str, dict[str, Any]] = {
    "thermal": {
        "reference": {
            **{"python": "slow_models:thermal", "sample_time": 20.0},
            "inputs": {
                "heat": {"unit": "W", "range": [0, 100], "start": 0},
                "air": {"unit": "kelvin", "range": [283.15, 303.15], "rate": 0.02, "start": 293.15},
            },
            "outputs": {"face": {"unit": "kelvin"}, "middle": {"unit": "kelvin"}},
        },
        "experiment": {"duration": 8000.0, "runs": RUNS},
    },
    "cylinder": {
        "reference": {
            **{"python": "slow_models:cylinder", "sample_time": 0.02},
            "inputs": {"valve": {"unit": "V", "range": [-10, 10], "start": 0}},
            "outputs": {"position": {"unit": "mm"}},
        },
        "experiment": {"duration": 10.0, "runs": RUNS},
    },
    "spindle": {
        "reference": {
            **{"python": "slow_models:spindle", "sample_time": 0.02},
            "inputs": {"volts": {"unit": "V", "range": [-6, 6], "start": 0}},
            "outputs": {"place": {"unit": "mm"}},
        },
        "experiment": {"duration": 20.0, "runs": MORE},
    },
    "basin": {
        "reference": {
            **{"python": "slow_models:basin", "sample_time": 1.0},
            "inputs": {
                "fill": {"unit": "V", "range": [0, 5], "start": 0},
                "drain": {"unit": "V", "range": [0, 4], "start": 0},
            },
            "outputs": {"level": {"unit": "m"}},
        },
        "experiment": {"duration": 600.0, "runs": MORE},
    },
    "block": {
        "reference": {
            **{"python": "slow_models:block", "sample_time": 0.05},
            "inputs": {"pull": {"unit": "m/s", "range": [-0.3, 0.3], "start": 0}},
            "outputs": {"place": {"unit": "m"}, "spring": {"unit": "N"}},
        },
        "experiment": {"duration": 20.0, "runs": MORE},
    },
    "valve": {
        "reference": {
            **{"python": "slow_models:valve", "sample_time": 1.0},
            "inputs": {
                "inflow": {"unit": "m3/s", "range": [0, 0.08], "start": 0},
                "command": {"unit": "1", "range": [0, 1], "start": 0},
            },
            "outputs": {"level": {"unit": "m"}, "outflow": {"unit": "m3/s"}},
        },
        "experiment": {"duration": 300.0, "runs": MORE},
    },
}
PYTHON |= {
    name: {
        "reference": {"python": f"loop_models:{name}", **fields},
        "experiment": {"duration": loop_models.DURATIONS[name.split("_")[0]], "runs": MORE},
    }
    for name, fields in loop_models.REFERENCES.items()
}
FMUS = {
    "VanDerPol": {"mu": (0.5, 2.0)},
    "Dahlquist": {"k": (0.5, 2.0)},
}
"""Parameters that vary: none of these has an input."""
EVENTS = Path(__file__).parents[2] / "docs" / "how" / "events.md"
BALL = "BouncingBall"


def pipeline(name: str, folder: Path, *, minutes: float, workers: int, compiled: bool = False, seed: int = 0) -> Path:
    """The YAML of a reference: of an FMU, the one that ``sysid surrogate`` proposes."""
    if name == BALL:
        ball = yaml.safe_load(EVENTS.read_text(encoding="utf-8").partition("```yaml\n")[2].partition("```")[0])
        ball["reference"]["fmu"] = str(Path(os.environ["REFERENCE_FMUS"]) / f"{BALL}.fmu")
        return _written(ball, folder / f"{name}.yaml", seed)
    if name not in PYTHON:
        file = Path(os.environ["REFERENCE_FMUS"]) / f"{name}.fmu"
        return written(
            source_of(str(file)),
            Wish(ranges={}, parameters=FMUS[name]),
            folder,
            minutes=minutes,
            workers=workers,
            seed=seed,
        )[0]
    content: dict[str, Any] = {**PYTHON[name], "reference": {"folder": str(MODELS), **PYTHON[name]["reference"]}}
    if compiled:
        files = [str(MODELS / file) for file in ("slow_models.py", "loop_models.py", "compiled_thermal.py")]
        content["reference"] |= {"python": f"compiled_models:{name}", "files": files}
    whole = {"kind": "experiment", "name": name.replace("_", "-"), "workers": workers, **content}
    return _written(whole, folder / f"{name}.yaml", seed)


def _written(content: dict[str, Any], path: Path, seed: int) -> Path:
    """The file; inputs stand in the order in which a function takes them."""
    content["experiment"] = {**content["experiment"], "seed": seed}
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path


def as_written(file: Path) -> float:
    """Processor seconds of a run of a reference, the mean of two."""
    config = check(ExperimentConfig, read_yaml(file), where=file)
    cases = drawn(config.reference, config.experiment, 2, seed=(config.experiment.seed, 3), prefix="TIMED")
    with ReferenceRuns(config=config.reference, workers=1, fresh=True) as runs:
        return float(np.mean([one.cpu_s for one in runs.run(cases)]))


def main() -> None:
    """Make each, and print a row."""
    given = dict(word.removeprefix("--").split("=", 1) for word in sys.argv[1:])
    minutes, only, workers = float(given.get("minutes", MINUTES)), given.get("only", ""), int(given.get("workers", 2))
    names = (
        only.split(",")
        if only
        else [*(name for name in PYTHON if "_" not in name), *([*FMUS, BALL] if "REFERENCE_FMUS" in os.environ else ())]
    )
    seed, proof_of = int(given.get("seed", 0)), int(given["proof"]) if "proof" in given else None
    print(f"{'reference':<14}{'new':>6}{'rms':>9}{'everywhere':>12}{'diverged':>10}{'faster':>10}{'FMU off':>10}")
    for name in names:
        with tempfile.TemporaryDirectory() as place:
            compiled = given.get("compiled", "no") == "yes"
            yaml_file = pipeline(name, Path(place), minutes=minutes, workers=workers, compiled=compiled, seed=seed)
            out = Path(place) / "out"
            made = sysid.surrogate(yaml_file, out, minutes=minutes, seed=seed, proof=proof_of)
        proof = made.proof
        reference_s = proof.reference_s
        if compiled and name in PYTHON:
            with tempfile.TemporaryDirectory() as place:
                reference_s = as_written(pipeline(name, Path(place), minutes=minutes, workers=1, seed=seed))
        off = "-" if proof.dropped is None else f"{proof.dropped:.1e}"
        print(
            f"{name:<14}{len(proof.errors):>6}{proof.share:>9.1%}{proof.share_everywhere:>12.1%}{proof.diverged:>10}"
            f"{reference_s / proof.surrogate_s:>10.3g}{off:>10}",
            flush=True,
        )
        if compiled and name in PYTHON:
            print(f"  Processor time of a run of the model as it is written: {reference_s:.3g} s")
        for line in proof.sentences():
            print(f"  {line}")


if __name__ == "__main__":
    main()
