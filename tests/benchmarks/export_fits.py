"""Models that pipelines fitted, in every format: how far each file is from its model.

    sysid run service-brake; sysid run service-cascade
    python -m tests.benchmarks export_fits [--run=FOLDER ...] [--format=onnx ...]

Reads the kept fits of runs, by default of every run under ``runs/``, and what each run exported; writes each model or
cascade in every format, and compares the files with it on all cases of its data and on 100 random sequences. Nothing is
fitted here. A difference over its tolerance, 1e-9 in double and 1e-3 in float, is printed, not hidden, and makes the
benchmark fail.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

from sysid.errors import SysidError
from sysid.estimation import FitResult
from sysid.export import EXPORTERS, Surrogate, check_parity, parity_cases, random_cases, read_bundle
from sysid.export.ranges import declared_ranges
from sysid.ingest import load_dataset
from sysid.models import AbstractModel, Cascade, Start
from sysid.traces import TraceSet
from tests.benchmarks._findings import found

TOLERANCES = {"float64": 1e-9, "float32": 1e-3}


def kept(run: Path) -> Iterator[tuple[str, AbstractModel | Cascade]]:
    """What a run fitted, and its cascade if that is what it exported."""
    for file in sorted(run.glob("fits/*/fit.json")):
        fit = FitResult.from_dict(json.loads(file.read_text(encoding="utf-8")))
        yield f"{run.name}: {fit.model.structure.label}", fit.model
    if (run / "bundle").exists():
        model = read_bundle(run / "bundle").model
        if isinstance(model, Cascade):
            yield f"{run.name}: the cascade", model


def data_of(run: Path) -> TraceSet:
    """The traces that a run's bundle names."""
    about = json.loads((run / "bundle" / "model.json").read_text(encoding="utf-8"))
    return load_dataset(about["provenance"]["data"]["name"])


def compare(name: str, source: AbstractModel | Cascade, traces: TraceSet, formats: list[str]) -> int:
    """Say how far each file is; gives back how many are over their tolerance."""
    inputs = [port.name for port in Surrogate.of(source).inputs]
    surrogate = Surrogate.of(source, declared_ranges(inputs, traces))
    cases, sequences = parity_cases(surrogate, traces, Start()), random_cases(surrogate)
    print(f"\n{name}, {surrogate.mapping}: {len(cases)} cases, {sum(len(case.output) for case in cases)} samples\n")
    over, unit = 0, surrogate.outputs[0].unit
    with tempfile.TemporaryDirectory() as place:
        for file in (file for one in formats for file in EXPORTERS[one].write(surrogate, Path(place))):
            begin, tolerance = time.process_time(), TOLERANCES[file.dtype]
            parity = check_parity(file, Path(place), cases, sequences, tolerance=float("inf"), unit=unit)
            worst = max(parity.largest_difference, parity.random_difference)
            note = f"cases {parity.largest_difference:.1e}, worst {parity.case}; random {parity.random_difference:.1e}"
            took = f"{time.process_time() - begin:.0f} s of processor time"
            found(f"{name}: {file.name} {file.dtype}", worst, unit, target=tolerance, note=f"{note}; {took}")
            over += not worst <= tolerance
    return over


def main(options: list[str]) -> int:
    """Compare every model of the named runs."""
    named = {
        key: [option.partition("=")[2] for option in options if option.startswith(f"--{key}=")]
        for key in ("run", "format")
    }
    runs = [Path(run) for run in named["run"]] or sorted(path.parent for path in Path("runs").glob("*/bundle"))
    if not runs:
        print("there are no runs under runs/: make one with sysid run, or name one with --run=FOLDER")
        return 2
    over = refused = 0
    for run in runs:
        traces = data_of(run)
        for name, source in kept(run):
            try:
                over += compare(name, source, traces, named["format"] or list(EXPORTERS))
            except SysidError as error:
                refused += 1
                print(f"\n{name} cannot be exported: {error}\n")
    print(f"\n{over} files over their tolerance, {refused} models refused")
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
