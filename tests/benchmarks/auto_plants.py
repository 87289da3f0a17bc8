"""What ``sysid auto`` makes of plants that nothing was tuned to, beside the best linear model of the same search.

    python -m tests.benchmarks auto_plants [--only=pendulum,loudspeaker] [--minutes=1] [--seeds=0] [--workers=2]

Each of the plants of ``tests/references/strange_plants.py`` is recorded once, 2,000 samples over levels held at random,
with noise of 1 % of the output's standard deviation. The search is told the names of the channels and nothing else. Its
model is run freely, from an initial state estimated on 50 samples, over two further records of 1,000 samples without
noise: levels of the same kind, and ramps with sines between the same ends. Figures are the fit of MATLAB's ``compare``
in percent, 100 for a perfect run. Beside them stands whether anything was told that speaks against the model.
"""

from __future__ import annotations

import math
import os
import statistics
import sys
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import sysid
from sysid.errors import SysidError
from sysid.models import AbstractModel, Mapping, Start
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.validation import case_results
from tests.benchmarks._findings import found
from tests.references.strange_plants import PLANTS, Array, Plant

FITTED, TESTED, NOISE = 2000, 1000, 0.01
START = Start.of({"estimated": 50})
LOST = -1e3
"""Percent; where a run diverges or there is none."""
SPEAKS_AGAINST = ("Not shown by the record", "leaves its bounds", "hangs on", "Held at")


def levels(plant: Plant, rng: np.random.Generator, n: int) -> Array:
    """Levels over each range, held for a random number of samples, spread evenly over a decade of times."""
    columns = []
    for low, high in plant.ranges:
        values: list[float] = []
        while len(values) < n:
            held = int(plant.settles * 10.0 ** rng.uniform(-1.0, 0.0)) + 1
            values += [float(rng.uniform(low, high))] * held
        columns.append(values[:n])
    return np.array(columns).T


def ramps(plant: Plant, rng: np.random.Generator, n: int) -> Array:
    """Ramps between random levels, and a sine of a fifth of the range on them, cut at the ends of the range."""
    columns, time_of = [], np.arange(n)
    for low, high in plant.ranges:
        knots = np.arange(0, n + 2 * plant.settles, plant.settles)
        ramp = np.interp(time_of, knots, rng.uniform(low, high, len(knots)))
        sine = 0.2 * (high - low) * np.sin(2.0 * np.pi * time_of / (0.8 * plant.settles) + rng.uniform(0.0, 6.0))
        columns.append(np.clip(ramp + sine, low, high))
    return np.array(columns).T


def records(name: str, samples: int = FITTED, spread: float = NOISE) -> tuple[Trace, Trace, Trace, Mapping]:
    """What is fitted, both tests, and the mapping."""
    plant, seed = PLANTS[name], sum(map(ord, name))
    inputs = [f"u{place + 1}" for place in range(len(plant.ranges))]
    channels = tuple(Channel(name=channel, unit="1") for channel in (*inputs, "y"))
    made, noise = list[Trace](), 0.0
    for role, of, n in (("fitted", levels, samples), ("levels", levels, TESTED), ("ramps", ramps, TESTED)):
        rng = np.random.default_rng([seed, len(made)])
        u = of(plant, rng, n)
        y = plant.run(u)
        noise = spread * float(y.std()) if role == "fitted" else 0.0
        values = np.column_stack([u, y + noise * rng.standard_normal(n)])
        made.append(Trace(name=role, sample_time=plant.sample_time, channels=channels, values=values))
    return made[0], made[1], made[2], Mapping.parse(f"{'+'.join(inputs)} -> y")


def followed(model: AbstractModel, trace: Trace) -> float:
    """The fit of the free run in percent; far below nought where it diverges."""
    try:
        run = case_results(model, trace, Role.TEST, START, 1)["y"].free_run
    except SysidError:
        return LOST
    return max(100.0 * (1.0 - math.sqrt(run.mse / float(np.var(trace["y"])))), LOST) if np.isfinite(run.mse) else LOST


def searched(name: str, seed: int, minutes: float, workers: int) -> tuple[float, float, float, float, bool]:
    """Fits of the chosen model and of the linear one, levels then ramps, and whether something was told."""
    fitted, same, other, mapping = records(name)
    began = time.perf_counter()
    data = TraceSet(name="plant", traces=(fitted,), roles={"fitted": Role.ESTIMATION})
    auto = sysid.auto(data, mapping, minutes=minutes, seed=seed, workers=workers)
    took = time.perf_counter() - began
    told = [note for note in auto.notes if any(word in note for word in SPEAKS_AGAINST)]
    figures = [followed(fit.model, trace) for fit in (auto.fit, auto.linear) for trace in (same, other)]
    found(
        f"{name}, seed {seed}, levels like those fitted", figures[0], "%",
        note=f"ramps {figures[1]:.1f}; linear {figures[2]:.1f} and {figures[3]:.1f}; {auto.fit.model.label}, "
        f"{len(auto.record.trials)} tried, {took:.0f} s{f'; told: {told[0][:80]} ...' if told else ''}",
    )  # fmt: skip
    return figures[0], figures[1], figures[2], figures[3], bool(told)


def main(only: list[str], seeds: list[int], minutes: float, workers: int) -> None:
    """Every plant with every seed, then medians."""
    rows = [searched(name, seed, minutes, workers) for name in only for seed in seeds]
    for place, words in enumerate(("levels like those fitted", "ramps and sines")):
        values = [row[place] for row in rows]
        better = sum(row[place] < row[place + 2] - 1.0 and not row[4] for row in rows)
        found(
            f"{len(rows)} searches, {words}: median fit", statistics.median(values), "%",
            note=f"least {min(values):.1f}; below the linear model by over a point, untold: {better}",
        )  # fmt: skip


if __name__ == "__main__":
    given = dict(argument[2:].split("=") for argument in sys.argv[1:] if argument.startswith("--") and "=" in argument)
    main(
        given["only"].split("+") if "only" in given else list(PLANTS),
        [int(seed) for seed in given.get("seeds", "0").split(",")],
        float(given.get("minutes", 1.0)),
        int(given.get("workers", 2)),
    )
