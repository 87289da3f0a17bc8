"""Public benchmarks by the pipelines of this project: seeds 0, 1 and 2, the median and the spread.

    SYSID_DATA=<folder> python -m tests.benchmarks public [--only=cascaded-tanks,emps] [--seeds=0,1,2] [--minutes=10]

Every `pipelines/benchmarks/*.yaml` whose record lies in the folder is run as `sysid run` runs it, once for each seed;
a record that is not there is left out, and that is told. With `--minutes` a search has so many by the clock, as
`sysid auto` has, in place of the iterations that make it the same on every machine. Nothing of a test record chooses
anything: each row says by which rule its model was chosen, and what was declared beyond the record. Rows of experts
beside them are those of `public_neural` and `linear_public`; a search that declares nothing is
meant to come within a fifth of them.

Published: Champneys et al., "Baseline results for selected nonlinear system identification benchmarks",
arXiv 2405.10779, and its references.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

from sysid.content import content_folders
from sysid.errors import SysidError
from sysid.ingest.datasets.dataset import find_dataset
from sysid.ingest.datasets.description import read_description
from sysid.reporting.results import Results
from sysid.workbench.auto.run import Searched
from sysid.workbench.kinds import RunRequest, kind_of, kinds
from sysid.workbench.runner.program import carry_out
from sysid.yaml_files import read_yaml, yaml_text
from tests.benchmarks._findings import found, read

SOURCE = "Champneys et al. 2024 and its references"
ROWS: dict[str, dict[str, tuple[str, float, str]]] = {
    "cascaded-tanks": {"test": ("V", 1.0, "neural 0.306 to 0.396, grey box 0.191 (n = 5)")},
    "coupled-drives": {
        "test 1": ("ticks/s", 1.0, "best 0.096 (n = 4)"),
        "test 2": ("ticks/s", 1.0, "best 0.074 (n = 4)"),
    },
    "silverbox": {
        "multisine test": ("mV", 1e3, "best 0.301"),
        "arrow": ("mV", 1e3, "best 0.26 (polynomial state space), 0.60"),
        "arrow without extrapolation": ("mV", 1e3, "best 0.259"),
    },
    "bouc-wen": {
        "multisine": ("um", 1e6, "polynomial state space 12.1 on one of the two (arXiv 1610.09138)"),
        "sweep": ("um", 1e6, "polynomial state space 12.1 on one of the two (arXiv 1610.09138)"),
    },
    "wiener-hammerstein": {
        "test": ("mV", 1e3, "best 0.241 (SUBNET), 0.42 and 0.452 of others, maybe parted as in 2009"),
        "test of 2009": ("mV", 1e3, ""),
    },
    "f16": dict.fromkeys(("level 2", "level 4", "level 6"), ("m/s^2", 1.0, "")),
    "hair-dryer": {"test": ("", 1.0, "")},
    "emps": {"test": ("mm", 1e3, "best 2.64 (dynoNet), continuous SUBNET 4.61, linear 5.53; n = 20")},
}
"""By pipeline and case: the unit, what it is of ours, and published figures."""
NEAR_EXPERTS = 1.2
"""Times what experts of this project reached by hand that a search may be off."""
BY_HAND = {
    "cascaded-tanks": {"test": 0.246},
    "coupled-drives": {"test 1": 0.0389, "test 2": 0.0431},
    "silverbox": {"multisine test": 0.203, "arrow": 0.270, "arrow without extrapolation": 0.209},
    "emps": {"test": 4.39},
}
"""By pipeline and case, in the unit of its row: medians of three seeds of `public_neural` and `emps-by-hand`; of
Silverbox the better of two runs."""
DECLARED = {
    "-equations": ("by equations", "its equations"),
    "-by-hand": ("by hand", "an integrator that neurons see, inputs in proportion"),
}
"""What the name of a pipeline ends with that declares something of its record: how it is named, and what that is."""


def option(name: str, default: list[str]) -> list[str]:
    given = [argument.split("=")[1].split(",") for argument in sys.argv if argument.startswith(f"--{name}=")]
    return given[0] if given else default


def once(file: Path, seed: int, scratch: Path, minutes: float | None) -> tuple[Results, str]:
    """The pipeline run with a seed, without export and page, and the rule by which its model was chosen."""
    pipeline = {**read_yaml(file), "seed": seed, "export": None}
    if minutes is not None and pipeline.get("kind") == "auto":
        pipeline = {name: value for name, value in pipeline.items() if name != "iterations"} | {"minutes": minutes}
    again = scratch / file.name
    again.write_text(yaml_text(pipeline), encoding="utf-8")
    request = RunRequest(path=again, typed=file.stem)
    program = kinds()[kind_of(again)].load_program()(request)
    ran: Any = carry_out(program, scratch / f"{file.stem}-{seed}", command=f"sysid run benchmarks/{file.stem}")
    results = ran.results if isinstance(ran, Searched) else ran
    return results, "" if results.best is None else results.best.chosen_by


def suffix_of(file: Path) -> str:
    """What the name of a pipeline ends with that says what it declares; nothing of a search."""
    return next((one for one in DECLARED if file.stem.endswith(one)), "")


def benchmark(file: Path, seeds: list[int], minutes: float | None) -> None:
    """Run a pipeline for every seed, and say the median and the spread of each test case."""
    data = read_description(find_dataset(str(read_yaml(file)["data"])))
    for name, digest in data.source.sha256.items():
        read(name, digest)
    suffix = suffix_of(file)
    rows = ROWS[file.stem.removesuffix(suffix)]
    by, declared = DECLARED.get(suffix, ("by the search", "nothing"))
    by_clock = "" if minutes is None else f"; a search of {minutes:g} min by the clock"
    named = f"{data.name} {by}"
    errors: dict[str, list[float]] = {case: [] for case in rows}
    print(f"{data.name}: {read_yaml(file)['description']}")
    with tempfile.TemporaryDirectory() as scratch:
        for seed in seeds:
            began, cpu = time.perf_counter(), time.process_time()
            results, rule = once(file, seed, Path(scratch), minutes)
            best = next(fit for fit in results.fits if fit.name == results.best_name)
            for case, values in errors.items():
                values.append(best.cases[case].free_run.mse ** 0.5)
            took = f"{time.perf_counter() - began:.0f} s, {time.process_time() - cpu:.0f} s of this process"
            print(f"  seed {seed}: {best.label}, {took}. {rule}")
    for case, (unit, scale, published) in rows.items():
        values = [scale * value for value in errors[case]]
        spread = f"seeds {', '.join(map(str, seeds))}: {', '.join(f'{value:.3g}' for value in values)}"
        known = f"{published} ({SOURCE})" if published and "arXiv" not in published else published
        note = f"median; {spread}; {declared} declared{by_clock}"
        hand = None if suffix else BY_HAND.get(file.stem, {}).get(case)
        target = None if hand is None else NEAR_EXPERTS * hand
        found(f"{named}, {case}", median(values), unit, target=target, published=known, note=note)


def main() -> None:
    folder = next(one / "benchmarks" for one in content_folders("pipelines") if (one / "benchmarks").is_dir())
    seeds = [int(seed) for seed in option("seeds", ["0", "1", "2"])]
    minutes = next(iter(map(float, option("minutes", []))), None)
    for file in sorted(folder.glob("*.yaml")):
        if file.stem.removesuffix(suffix_of(file)) not in ROWS:
            continue  # it compares ways of taking one record, and has no row
        if file.stem in option("only", [file.stem]):
            try:
                benchmark(file, seeds, minutes)
            except SysidError as error:
                print(f"{file.stem} is left out: {error}")


if __name__ == "__main__":
    main()
