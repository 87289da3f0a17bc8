"""Fitted models in every format: how far each file is from its model, and how long it takes.

    python -m tests.benchmarks.export_fits

Fits a network and an ARX model to the brake cylinder of ``abdx-service``, and wires two networks into a cascade; then
writes each in every format and prints the largest difference over all cases and 100 random sequences, and the run time
of 20,000 samples beside the model's own compiled free run. Differences over tolerance are printed, not hidden.
"""

from __future__ import annotations

import os
import platform
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

from sysid.errors import ParityError
from sysid.estimation import Training, fit_arx, fit_narx
from sysid.export import EXPORTERS, Surrogate, check_parity, parity_cases, random_cases
from sysid.export.manifest import declared_ranges
from sysid.export.run_times import measure_run_times
from sysid.ingest import load_dataset
from sysid.models import ARX, NARX, AbstractModel, Cascade, Limit, Mapping, Start
from sysid.traces import Role, TraceSet

TOLERANCES = {"float64": 1e-9, "float32": 1e-3}


def fitted(traces: TraceSet, selection: TraceSet) -> dict[str, AbstractModel | Cascade]:
    """Models that real data gave."""
    estimation = traces.with_role(Role.ESTIMATION)

    def network(mapping: str, structure: NARX) -> AbstractModel:
        training = Training(loop="closed", starts=4, max_iterations=200)
        return fit_narx(estimation, Mapping.parse(mapping), structure, training, selection=selection.traces).model

    cylinder = network("BP+AR -> BC", NARX(input_delays="0:1", output_delays=1, neurons=30))
    reservoir = network("BP -> AR", NARX(input_delays="0:1", output_delays="1:2", neurons=8))
    mapping = Mapping.parse("BP+AR -> BC")
    arx = fit_arx(estimation, mapping, ARX(na=30, nb=(30, 30), nk=(1, 1))).model
    cascade = Cascade(models=(reservoir, cylinder), rest={"AR": "BP"}, limits={"BC": Limit(low=0.0, high="AR")})
    return {"NARX 0:1/1/30": cylinder, "ARX 30/30": arx, "cascade BP -> AR, BP+AR -> BC": cascade}


def say(*cells: object) -> None:
    """One row of a table."""
    sys.stdout.write("| " + " | ".join(str(cell) for cell in cells) + " |\n")
    sys.stdout.flush()


def table(name: str, source: AbstractModel | Cascade, traces: TraceSet, folder: Path) -> int:
    """The table of one model; gives back how many files were over their tolerance."""
    inputs = [port.name for port in Surrogate.of(source).inputs]
    surrogate = Surrogate.of(source, declared_ranges(inputs, traces))
    cases, sequences = parity_cases(surrogate, traces, Start()), random_cases(surrogate)
    files = [file for exporter in EXPORTERS.values() for file in exporter.write(surrogate, folder)]
    times = measure_run_times(surrogate, files, folder)
    differences = {}
    for file in files:
        tolerance = TOLERANCES[file.dtype]
        try:
            parity = check_parity(file, folder, cases, sequences, tolerance=tolerance, unit="psi")
            said = f"{parity.largest_difference:.1e}", f"{parity.random_difference:.1e}", "yes"
        except ParityError as error:
            said = str(error.args[0]), "", "NO"
        differences[file.name, file.format] = said
    sys.stdout.write(f"\n{name}, {len(cases)} cases, {sum(len(case.output) for case in cases)} samples\n\n")
    say("file", "cars", "cases [psi]", "random [psi]", "within", "20,000 samples [ms]", "ratio to own, a car")
    say("---", "---:", "---:", "---:", "---", "---:", "---:")
    for one in times:
        said = differences.get((one.name, one.format), ("", "", ""))
        say(f"{one.name} {one.format} {one.dtype}", one.cars, *said, f"{1e3 * one.seconds:.1f}", f"{one.ratio:.2f}")
    return sum(said[2] == "NO" for said in differences.values())


def main() -> int:
    """Print every table as Markdown."""
    say(platform.platform(), f"{os.cpu_count()} cores", f"load {os.getloadavg()[0]:.1f}")
    traces, selection = load_dataset("abdx-service"), load_dataset("abdx-selection")
    over = 0
    for name, source in fitted(traces, selection).items():
        with tempfile.TemporaryDirectory() as folder:
            over += table(name, source, traces, Path(folder))
    sys.stdout.write(f"\n{over} files over their tolerance\n")
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
