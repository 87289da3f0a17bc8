"""One model of two outputs beside one an output: neural state spaces, NARX and ARX at the same sizes.

    python -m tests.benchmarks several_outputs [--seeds=5] [--samples=1200] [--only=states,narx,arx]

Fit on an unseen record without noise, in free run from an estimated state, of the worse output; medians over the seeds,
and over five plants for NARX and ARX. One thread.
"""

from __future__ import annotations

import sys
import time
from collections import defaultdict
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation import StabilityOptions, Training
from sysid.estimation.fitting import fit
from sysid.models import (
    ARX,
    NARX,
    AbstractModel,
    AbstractStructure,
    Mapping,
    NeuralStateSpace,
    Start,
    VectorARX,
    beginning,
)
from sysid.traces import Channel, Trace
from tests.benchmarks._findings import found
from tests.benchmarks._linear_systems import NAMES, SAMPLES, systems

Array = NDArray[np.float64]

BOTH = Mapping.parse("u1+u2 -> y1+y2")
FREE = Start(kind="estimated")
UNCHECKED = StabilityOptions(count=0)
NOISES = {"5 % noise": (0.05, 0.05), "20 and 1 % noise": (0.2, 0.01)}


def plant(seed: int, n: int = 1_200) -> tuple[Array, Array]:
    """Three states that saturate and multiply, seen by both outputs."""
    rng = np.random.default_rng(seed)
    u = np.column_stack([np.repeat(rng.uniform(-1.0, 1.0, n // hold + 1), hold)[:n] for hold in (12, 9)])
    x, y = np.zeros(3), np.empty((n, 2))
    for t in range(n):
        y[t] = [x[0] + 0.3 * x[2], np.tanh(1.5 * x[1]) - 0.4 * x[2]]
        bent = np.tanh(1.5 * x[2])
        x = np.array(
            [
                0.9 * x[0] + 0.12 * bent + 0.05 * u[t, 0],
                0.85 * x[1] + 0.2 * bent - 0.1 * x[0] + 0.08 * u[t, 1],
                0.93 * x[2] + 0.12 * u[t, 0] * (1.0 + 0.5 * x[1]) + 0.06 * u[t, 1],
            ]
        )
    return u, y


def trace_of(u: Array, y: Array) -> Trace:
    """A record of the mapping's channels."""
    channels = tuple(Channel(name=name, unit="1") for name in (*BOTH.inputs, *BOTH.outputs))
    return Trace(name="record", sample_time=1.0, channels=channels, values=np.column_stack([u, y]))


def percent(model: AbstractModel, unseen: Trace) -> Array:
    """Fit of each output."""
    inputs, target = unseen.columns(model.mapping.inputs), model.measured(unseen)
    begun = beginning(model, inputs, target, FREE)
    run = model.simulate(inputs[begun.first :], begun.history).reshape(-1, len(model.mapping.outputs))
    target = target.reshape(len(target), -1)[begun.first :]
    away = np.linalg.norm(run - target, axis=0) / np.linalg.norm(target - target.mean(axis=0), axis=0)
    return np.asarray(100.0 * (1.0 - away))


def compared(
    estimation: Trace,
    unseen: Trace,
    network: AbstractStructure,
    training: Training | None,
    whole: AbstractStructure | None = None,
) -> dict[str, Array]:
    """Fit of both outputs and processor time, of one model and of one an output."""
    began = time.process_time()
    asked = whole or network.for_outputs(2)
    model = fit([estimation], BOTH, asked, training, start=FREE, stability=UNCHECKED).model
    seconds = time.process_time() - began
    one = np.append(percent(model, unseen), seconds)
    began = time.process_time()
    each = [fit([estimation], m, network, training, start=FREE, stability=UNCHECKED).model for m in BOTH.each]
    seconds = time.process_time() - began
    return {"one model": one, "a model an output": np.append([percent(m, unseen)[0] for m in each], seconds)}


def steps(rng: np.random.Generator, n: int, holds: tuple[int, int], size: float) -> Array:
    """Two inputs that each hold random levels for as long as told."""
    return np.column_stack([np.repeat(rng.uniform(-size, size, n // hold + 1), hold)[:n] for hold in holds])


def four_tanks(seed: int, n: int) -> tuple[Array, Array]:
    """Two pumps, each of which fills a lower tank and, crosswise, an upper one; the lower levels are measured."""
    u = 0.65 + steps(np.random.default_rng(seed), n, (25, 40), 0.35)
    h, y = np.array([0.5, 0.5, 0.3, 0.3]), np.empty((n, 2))
    for t in range(n):
        y[t] = h[:2]
        out = 0.1 * np.sqrt(h)
        fed = 0.07 * np.array([0.7 * u[t, 0], 0.6 * u[t, 1], 0.36 * u[t, 1], 0.27 * u[t, 0]])
        h = np.maximum(h + fed - out + [out[2], out[3], 0.0, 0.0], 0.0)
    return u, y


def reactor(seed: int, n: int) -> tuple[Array, Array]:
    """A stirred tank: concentration and temperature, of which each drives the other."""
    u, y, c, heat = steps(np.random.default_rng(seed), n, (20, 30), 1.0), np.empty((n, 2)), 0.5, 0.0
    for t in range(n):
        y[t] = c, heat
        rate = 0.08 * c * np.exp(1.2 * heat / (1.0 + 0.2 * abs(heat)))
        c += 0.06 * (1.0 + 0.4 * u[t, 0] - c) - rate
        heat += 0.6 * rate - 0.05 * heat - 0.03 - 0.06 * u[t, 1]
    return u, y


def restricted(seed: int, n: int) -> tuple[Array, Array]:
    """Two reservoirs that fill each other through a restriction that bends."""
    u, y, x = steps(np.random.default_rng(seed), n, (15, 22), 8.0), np.empty((n, 2)), np.zeros(2)
    for t in range(n):
        y[t] = x
        apart = x[0] - x[1]
        flow = 0.15 * apart / (1.0 + 0.1 * abs(apart))
        x = x + np.array([0.2 * (u[t, 0] - x[0]) - flow, flow + 0.05 * (u[t, 1] - x[1])])
    return u, y


def pendulums(seed: int, n: int) -> tuple[Array, Array]:
    """Two pendulums that a spring couples, each with its torque."""
    u, y, x = steps(np.random.default_rng(seed), n, (10, 14), 1.0), np.empty((n, 2)), np.zeros(4)
    for t in range(n):
        y[t] = x[:2]
        for _ in range(4):
            pull = 0.6 * (x[0] - x[1])
            x = x + 0.05 * np.array(
                [x[2], x[3], u[t, 0] - np.sin(x[0]) - 0.5 * x[2] - pull, u[t, 1] - 1.5 * x[1] - 0.4 * x[3] + pull]
            )
    return u, y


PLANTS = {
    "three states": plant,
    "four tanks": four_tanks,
    "reactor": reactor,
    "reservoirs": restricted,
    "pendulums": pendulums,
}
LEVELS = {"no noise": (0.0, 0.0), "2 % noise": (0.02, 0.02), "10 and 1 % noise": (0.1, 0.01)}


def lagged(
    seeds: range,
    samples: int,
    network: AbstractStructure,
    training: Training | None,
    whole: AbstractStructure | None = None,
) -> None:
    """A structure over lags of the five plants."""
    for name, sizes in LEVELS.items():
        rows: dict[str, list[Array]] = defaultdict(list)
        for make in PLANTS.values():
            for seed in seeds:
                (u, y), rng = make(seed, samples), np.random.default_rng(seed)
                noisy = y + rng.standard_normal(y.shape) * np.array(sizes) * y.std(axis=0)
                given = None if training is None else replace(training, seed=seed)
                both = compared(trace_of(u, noisy), trace_of(*make(1_000 + seed, samples)), network, given, whole)
                for which, figures in both.items():
                    rows[which].append(figures)
        for which, figures in rows.items():
            worse = [min(row[:2]) for row in figures]
            note = f"lower quartile {np.quantile(worse, 0.25):.1f}, {len(PLANTS)} plants, {len(seeds)} seeds"
            found(f"{network.label}, {name}, {which}, worse output", float(np.median(worse)), "%", note=note)
            found(
                f"{network.label}, {name}, {which}, processor time", float(np.median([row[2] for row in figures])), "s"
            )


def states(seeds: range) -> None:
    """Neural state spaces of both plants, every noise."""
    values: dict[tuple[str, str], list[Array]] = defaultdict(list)
    network = NeuralStateSpace(states=3, neurons=8)
    for seed in seeds:
        (u, y), (other_u, other_y), rng = plant(seed), plant(1_000 + seed), np.random.default_rng(seed)
        for name, sizes in NOISES.items():
            noisy = y + rng.standard_normal(y.shape) * np.array(sizes) * y.std(axis=0)
            training = Training(max_iterations=300, workers=1, seed=seed)
            both = compared(trace_of(u, noisy), trace_of(other_u, other_y), network, training)
            for which, figures in both.items():
                values[f"nonlinear, {name}, NSS 3/8", which].append(figures)
        u, y, clean = systems(seed)["mimo"]
        linear = NeuralStateSpace(states=6, neurons=0)
        unseen = trace_of(u[SAMPLES:], clean[SAMPLES:])
        both = compared(trace_of(u[:SAMPLES], y[:SAMPLES]), unseen, linear, Training(max_iterations=60, workers=1))
        for which, figures in both.items():
            values[f"{NAMES['mimo']}, NSS 6/0", which].append(figures)
    for (plant_name, which), rows in values.items():
        worse = np.median([min(row[:2]) for row in rows])
        found(f"{plant_name}, {which}, worse output", float(worse), "%", note=f"median of {len(seeds)} seeds")
        found(f"{plant_name}, {which}, processor time", float(np.median([row[2] for row in rows])), "s")


def main() -> None:
    """What was asked for."""
    given = dict(argument.removeprefix("--").split("=") for argument in sys.argv[1:] if "=" in argument)
    seeds, only = range(int(given.get("seeds", 5))), given.get("only", "states,narx,arx").split(",")
    if "states" in only:
        states(seeds)
    samples, training = int(given.get("samples", 1_200)), Training(max_iterations=300, workers=1)
    if "narx" in only:
        lagged(seeds, samples, NARX(input_delays=3, output_delays=3, neurons=8), training)
    if "arx" in only:
        lagged(seeds, samples, ARX(na=3, nb=(3,), nk=(1,)), None, VectorARX(na=3, nb=3, nk=1))


if __name__ == "__main__":
    main()
