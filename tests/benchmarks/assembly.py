"""Run time of cascades against the compiled reference: one car and fifty, 3 and 101 vehicles, warm and cold.

Run with ``python -m tests.benchmarks assembly``. Not collected by pytest. The cascades have random weights of the size
of fitted ones (their run time does not depend on the values); ``--whole=runs/combined-brake`` measures the fitted
assembly of that run folder too, ``--line=runs/whole-train`` its fitted line at every place. The same 2,000 s of command
go into everything; each figure is the median of repeats after one run that warms up. Beside the wall time stands the
processor time of all threads: on a machine that others use, ratios of processor times are the ones that hold. Divided
among cores they are a projection, that of a machine which is otherwise idle.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sysid.airbrake.command import Command
from sysid.airbrake.consist import Consist
from sysid.airbrake.machine import Probe
from sysid.airbrake.simulate import simulate
from sysid.export import Surrogate, exporter
from sysid.models import (
    NARX,
    Cascade,
    Limit,
    Mapping,
    NARXModel,
    Scaling,
    parameter_count,
    simulate_family,
)
from sysid.workbench.assembly.runner import read_assembly, read_line

DURATION, CARS, WORKERS = 2000.0, 50, 2
ROWS = [[0, 90], [100, 84], [300, 90], [500, 70], [800, 90], [1100, 64.2], [1300, 90], [1700, 0], [1800, 90]]
SERVICE = (("STP -> BP", 20), ("BP -> AR", 15), ("BP+AR -> BC", 30))
COMBINED = (("STP -> BP", 20), ("BP -> ER", 15), ("BP+ER -> AR", 20), ("BP+AR+ER -> BC", 30))
LEVELS = {"BP": 90.0, "AR": 90.0, "ER": 90.0, "BC": 0.0}

TARGETS = {
    "one car, 2,000 s, one core": "at most 25 ms",
    "against the reference of 3 vehicles": "4x",
    "against the reference of 101 vehicles": "100x",
    "50 cars, 2,000 s, two cores": "at most 0.5 s",
    "50 cars against the reference of 101 vehicles": "8x",
}
PUBLISHED = "published (MATLAB 2019b, another machine): service 1.37 to 1.48 s, combined 1.70 to 1.88 s per 2,000 s;"
PUBLISHED_REFERENCE = "its interpreted Simulink reference of 3 vehicles: 20.0 to 22.3 s"


@dataclass(frozen=True)
class Taken:
    """Seconds of one run."""

    wall: float
    processor: float


def network(text: str, neurons: int, seed: int, extra: tuple[str, ...] = ()) -> NARXModel:
    """A network with lags in powers of two and small random weights."""
    mapping = Mapping.parse(text)
    mapping = Mapping(inputs=(*mapping.inputs, *extra), output=mapping.output)
    n = len(mapping.inputs)
    delays = [[0, 1, 2, 4, 8, 16, 32]] * (n - len(extra)) + [[0]] * len(extra)
    structure = NARX(input_delays=delays, output_delays=[1, 2, 4, 8], neurons=neurons)
    count = parameter_count(structure.lags(n), neurons, linear=True)
    return NARXModel(
        network=structure,
        theta=np.random.default_rng(seed).normal(0.0, 0.05, count),
        scaling=Scaling(input_offset=(77.0,) * n, input_scale=(13.0,) * n, output_offset=45.0, output_scale=45.0),
        mapping=mapping,
        sample_time=0.1,
        input_units=("psi",) * n,
        output_unit="psi",
        rest_output=LEVELS[mapping.output],
    )


def cascade(members: tuple[tuple[str, int], ...], seed: int = 0, extra: tuple[str, ...] = ()) -> Cascade:
    """An assembly with the limits that users expect."""
    models = [network(text, neurons, seed + i, extra) for i, (text, neurons) in enumerate(members)]
    return Cascade(models=models, rest={"BP": "STP"}, limits={"BC": Limit(low=0.0, high="BP")})


def taken(work: Callable[[], object], repeats: int) -> Taken:
    """Median over repeats, after one that warms up."""
    work()
    walls, processors = [], []
    for _ in range(repeats):
        wall, processor = time.perf_counter(), time.process_time()
        work()
        walls.append(time.perf_counter() - wall)
        processors.append(time.process_time() - processor)
    return Taken(statistics.median(walls), statistics.median(processors))


def show(name: str, one: Taken) -> None:
    """One line."""
    print(
        f"{name:<58} {1e3 * one.wall:9.1f} ms wall {1e3 * one.processor:9.1f} ms processor "
        f"{1e3 * one.wall / DURATION:8.4f} ms per simulated s {DURATION / one.wall:9.0f}x real time"
    )


def ratio(slow: Taken, fast: Taken, cores: int = 1) -> str:
    """How much faster; by processor time as if each thread had a core to itself."""
    by_processor = f"{cores * slow.processor / fast.processor:.1f}x by processor time"
    return f"{slow.wall / fast.wall:.1f}x wall, {by_processor}" + (f" over {cores} cores" if cores > 1 else "")


def reference(pairs: int) -> Callable[[], object]:
    """The compiled physics, recording every cylinder."""
    command = Command(times=tuple(row[0] for row in ROWS), pressures=tuple(row[1] for row in ROWS), duration=DURATION)
    consist = Consist(pairs=pairs)
    probes = tuple(Probe(quantity="cylinder", node=node) for node in consist.valve_nodes)
    return lambda: simulate(command, consist=consist, probes=probes)


COLD = """
import sys, time
sys.argv = ["cold"]
began = time.perf_counter()
from tests.benchmarks import assembly
loaded = time.perf_counter()
one = assembly.cascade(assembly.COMBINED)
one.simulate(assembly.command())
print(f"{loaded - began:.2f} s to import, {time.perf_counter() - loaded:.2f} s for the first run")
"""


def cold(cache: str | None) -> str:
    """First run in a process of its own."""
    environment = dict(os.environ) | ({"NUMBA_CACHE_DIR": cache} if cache else {})
    done = subprocess.run([sys.executable, "-c", COLD], env=environment, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def command() -> np.ndarray:
    """The handle at each sample, shape ``(n_samples, 1)``."""
    times = 0.1 * np.arange(round(DURATION / 0.1))
    rows = np.array(ROWS)
    return rows[np.searchsorted(rows[:, 0], times, side="right") - 1, 1][:, np.newaxis]


def beside_targets(figures: dict[str, str]) -> None:
    """A line for each figure."""
    for what, figure in figures.items():
        print(f"  {what:<48} {figure:<60} (target {TARGETS[what]})")


def one_car(single: Taken, small: Taken, large: Taken) -> dict[str, str]:
    """The figures of an assembly of one car."""
    return {
        "one car, 2,000 s, one core": f"{1e3 * single.wall:.1f} ms wall, {1e3 * single.processor:.1f} ms processor",
        "against the reference of 3 vehicles": ratio(small, single),
        "against the reference of 101 vehicles": ratio(large, single),
    }


def exported(whole: Cascade, u: np.ndarray, folder: Path) -> Callable[[], object]:
    """What a train simulator embeds: the exported source, built by the compiler that is here."""
    writer, surrogate = exporter("c"), Surrogate.of(whole)
    (file,) = writer.write(surrogate, folder)
    run, state = writer.load(file, folder), surrogate.at_rest(u[0])[np.newaxis]
    return lambda: run(u[:, np.newaxis], state)


def fitted_whole(folder: Path, u: np.ndarray, small: Taken, large: Taken) -> None:
    """A fitted assembly beside the reference."""
    whole = read_assembly(folder)
    single = taken(lambda: whole.simulate(u), 15)
    print(f"\n{folder.name}, fitted: {len(whole.models)} members, {whole.n_parameters} parameters")
    show(f"{folder.name}, one car", single)
    with tempfile.TemporaryDirectory() as place:
        show(f"{folder.name}, one car, exported as C", taken(exported(whole, u, Path(place)), 15))
    beside_targets(one_car(single, small, large))


def fitted_line(folder: Path, u: np.ndarray, large: Taken) -> None:
    """A fitted line at every place, beside the reference of 101 vehicles; its handle never asks for an emergency."""
    line, places = read_line(folder).line, np.arange(1.0, CARS + 1.0)
    inputs = np.maximum(u, 64.2)
    batch = taken(lambda: line.simulate(inputs, places, workers=WORKERS), 7)
    print(f"\n{folder.name}, fitted: {line.n_parameters} parameters")
    show(f"{folder.name}, {CARS} places, {WORKERS} threads", batch)
    figures = {
        "50 cars, 2,000 s, two cores": f"{batch.wall:.3f} s wall, {batch.processor:.3f} s processor over both",
        "50 cars against the reference of 101 vehicles": ratio(large, batch, cores=WORKERS),
    }
    beside_targets(figures)


def main() -> None:
    """Print a table, and each figure beside its target."""
    print(f"load before: {', '.join(f'{value:.1f}' for value in os.getloadavg())} on {os.cpu_count()} cores\n")
    u = command()
    runs: dict[str, Taken] = {}

    def measure(name: str, work: Callable[[], object], repeats: int) -> Taken:
        runs[name] = taken(work, repeats)
        show(name, runs[name])
        return runs[name]

    small = measure("compiled reference, 3 vehicles", reference(1), 5)
    large = measure("compiled reference, 101 vehicles", reference(50), 3)
    for name, members in {"service": SERVICE, "combined": COMBINED}.items():
        sizes = ", ".join(f"{text} {neurons}" for text, neurons in members)
        one = cascade(members)
        print(f"\n{name}: {sizes} neurons, {one.n_parameters} parameters")
        single = measure(f"{name}, one car", lambda one=one: one.simulate(u), 15)
        placed = cascade(members, extra=("POSITION",))
        # Every car reads the same handle and its own place in the train.
        inputs = np.stack([np.column_stack([u, np.full(len(u), float(car))]) for car in range(CARS)])
        order = [("STP", "POSITION").index(channel) for channel in placed.inputs]
        records = np.ascontiguousarray(inputs[:, :, order])
        batch = measure(
            f"{name}, {CARS} cars, one model with the position as input, {WORKERS} threads",
            lambda placed=placed, records=records: placed.simulate_batch(records, workers=WORKERS), 5,
        )  # fmt: skip
        family = [cascade(members, seed=10 * car) for car in range(CARS)]
        shared = np.repeat(u[np.newaxis], CARS, axis=0)
        measure(
            f"{name}, {CARS} cars, a model for each, {WORKERS} threads",
            lambda family=family, shared=shared: simulate_family(family, shared, workers=WORKERS), 5,
        )  # fmt: skip
        figures = one_car(single, small, large) | {
            "50 cars, 2,000 s, two cores": f"{batch.wall:.3f} s wall, {batch.processor:.3f} s processor over both",
            "50 cars against the reference of 101 vehicles": ratio(large, batch, cores=WORKERS),
        }
        beside_targets(figures)
    for folder in (word.removeprefix("--whole=") for word in sys.argv[1:] if word.startswith("--whole=")):
        fitted_whole(Path(folder), u, small, large)
    for folder in (word.removeprefix("--line=") for word in sys.argv[1:] if word.startswith("--line=")):
        fitted_line(Path(folder), u, large)
    print(f"\ncold, kernels compiled before: {cold(None)}")
    with tempfile.TemporaryDirectory() as cache:
        print(f"cold, first run on a machine: {cold(cache)}")
    print(f"\n{PUBLISHED} {PUBLISHED_REFERENCE}")
    print(f"load after: {', '.join(f'{value:.1f}' for value in os.getloadavg())}")


if __name__ == "__main__":
    main()
