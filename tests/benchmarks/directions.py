"""Neurons that read and move a few directions beside neurons that read everything, at the same starts and iterations.

    SYSID_DATA=<folder> python -m tests.benchmarks directions [--only=drives,tanks,curves] [--seeds=0,1,2] [--first=0]

*Drives*: both records of the Coupled Electric Drives (``ced/DATAUNIF.csv`` in the folder), 400 samples of each to fit
and the last 100 to test, from 10 and from 4 measured samples; nothing is declared of their sensor, which gives the
absolute value of a speed. *Tanks*: one record of the Cascaded Tanks (``cascaded_tanks/dataBenchmark.csv``) to fit, the
other to test, from 50 measured samples. *Curves*: six simulated plants, a static curve between two linear blocks of
order 3, 1,000 samples with noise of 1 % to fit and 3,000 without noise to test; ``--first=6`` draws six others. Every
structure has six starts, chosen by the evidence; a network in few directions begins from one with free neurons, and its
time is that of both.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from statistics import median

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray
from scipy import signal

import sysid
from sysid.estimation import StabilityOptions, Training
from sysid.models import Mapping, NeuralStateSpace, Start, StartKind
from sysid.traces import Trace
from tests.benchmarks._findings import found
from tests.benchmarks._public import checked
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")
NEURONS, ITERATIONS = 8, 200
SHAPES: tuple[dict[str, int | None], ...] = (
    {"output_neurons": 0, "directions": None},
    {"output_neurons": NEURONS, "directions": None},
    {"output_neurons": NEURONS, "directions": 1},
    {"output_neurons": NEURONS, "directions": 2},
)
Array = NDArray[np.float64]


def trace(name: str, u: Array, y: Array) -> Trace:
    return trace_of({"u": u, "y": y}, name=name, sample_time=0.02, units="1")


def measured(samples: int) -> Start:
    return Start(kind=StartKind.MEASURED, n_measured=samples)


def errors(
    records: list[Trace], tests: dict[str, tuple[Trace, int]], network: NeuralStateSpace, seed: int, n: int
) -> dict[str, float]:
    """Root mean square of the free run over each test record, behind its first samples."""
    training = Training(seed=100 * seed, max_iterations=ITERATIONS, workers=1)
    asked = StabilityOptions(count=0)
    model = sysid.fit(records, MAPPING, network, training, start=measured(n), stability=asked).model
    off = {}
    for name, (record, first) in tests.items():
        u, y = record.columns(["u"]), record["y"]
        run = model.simulate(u[first:], measured(first).history(u, y, model.rest_output))
        off[name] = float(np.sqrt(np.mean((run - y[first:]) ** 2)))
    return off


def beside(
    what: str, unit: str, states: int, one: Callable[[NeuralStateSpace, int], dict[str, float]], seeds: list[int]
) -> None:
    """Every shape with every seed."""
    for shape in SHAPES:
        network = NeuralStateSpace(states=states, neurons=NEURONS, **shape)  # type: ignore[arg-type]
        began = time.process_time()
        runs = [one(network, seed) for seed in seeds]
        seconds = (time.process_time() - began) / len(seeds)
        for name in runs[0]:
            each = [run[name] for run in runs]
            told = ", ".join(f"{value:.3g}" for value in each)
            note = f"seeds {', '.join(map(str, seeds))}: {told}; {seconds:.0f} s of processor time a seed"
            found(f"{what}{name}: {network.label}", median(each), unit, note=note)


def drives(seeds: list[int], _: int) -> None:
    """Both records at once."""
    data = np.genfromtxt(checked("ced/DATAUNIF.csv"), delimiter=",", names=True)
    whole = {n: (data[f"u1{n}"], data[f"z1{n}"]) for n in "12"}
    fitted = [trace(n, u[:400], y[:400]) for n, (u, y) in whole.items()]
    tests = {
        f"{n}, n = {first}": (trace(n, u[400:], y[400:]), first) for n, (u, y) in whole.items() for first in (10, 4)
    }
    beside(
        "Coupled Electric Drives ", "ticks/s", 3, lambda network, seed: errors(fitted, tests, network, seed, 10), seeds
    )


def tanks(seeds: list[int], _: int) -> None:
    """The estimation record, and the other."""
    data = np.genfromtxt(checked("cascaded_tanks/dataBenchmark.csv"), delimiter=",", names=True)
    fitted, unseen = (trace(name, data[f"u{name}"], data[f"y{name}"]) for name in ("Est", "Val"))
    beside(
        "Cascaded Tanks", "V", 2, lambda network, seed: errors([fitted], {"": (unseen, 50)}, network, seed, 50), seeds
    )


def blocks(seed: int) -> Iterator[tuple[Array, Array]]:
    """Two linear blocks of order 3 and gain 1, each a pair that swings and a pole."""
    rng = np.random.default_rng(seed)
    for _ in range(2):
        turn, dies = rng.uniform(0.1, 0.6), rng.uniform(0.2, 0.8)
        pair = np.exp(turn * (-dies + 1j * np.sqrt(1.0 - dies * dies)))
        below = np.poly([pair, pair.conjugate(), rng.uniform(0.6, 0.9)]).real
        above = rng.standard_normal(3)
        yield above / (above.sum() / below.sum()), below


def curved(plant: int) -> Callable[[Array], Array]:
    """A plant: its curve saturates, or has a kink."""
    first, second = blocks(plant)

    def run(u: Array) -> Array:
        v = signal.lfilter(*first, u)
        bent = np.tanh(1.5 * v) + 0.1 * v if plant % 2 else np.where(v > 0.0, v, 0.3 * v)
        return np.asarray(signal.lfilter(*second, bent))

    return run


def curves(seeds: list[int], first: int) -> None:
    """A static curve between linear blocks."""
    for plant in range(first, first + 6):
        run, rng = curved(plant), np.random.default_rng(1000 + plant)
        u, v = (np.repeat(rng.standard_normal(n // 5), 5) for n in (1000, 3000))
        y, w = run(u), run(v)
        size = w.std()
        fitted, unseen = (
            [trace("fit", u, (y + 0.01 * size * rng.standard_normal(len(y))) / size)],
            {"": (trace("test", v, w / size), 50)},
        )
        beside(
            f"curve between blocks, plant {plant}",
            "of its deviation",
            6,
            lambda network, seed, fitted=fitted, unseen=unseen: errors(fitted, unseen, network, seed, 50),  # type: ignore[misc]
            seeds,
        )


if __name__ == "__main__":
    options = dict(argument.lstrip("-").split("=") for argument in sys.argv[1:] if "=" in argument)
    every = {"drives": drives, "tanks": tanks, "curves": curves}
    for name in options.get("only", ",".join(every)).split(","):
        every[name]([int(seed) for seed in options.get("seeds", "0,1,2").split(",")], int(options.get("first", "0")))
