"""One neural state space of two outputs beside one an output, at as many states: a nonlinear plant, and a linear one.

    python -m tests.benchmarks several_outputs [--seeds=5]

Fit on an unseen record without noise, in free run from an estimated state, of the worse output; medians over the seeds.
One thread.
"""

from __future__ import annotations

import sys
import time
from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from sysid.estimation import StabilityOptions, Training
from sysid.estimation.estimators import fit
from sysid.models import AbstractModel, Mapping, NeuralStateSpace, Start, beginning
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


def compared(estimation: Trace, unseen: Trace, network: NeuralStateSpace, training: Training) -> dict[str, Array]:
    """Fit of both outputs and processor time, of one model and of one an output."""
    began = time.process_time()
    whole = fit([estimation], BOTH, network.for_outputs(2), training, start=FREE, stability=UNCHECKED).model
    seconds = time.process_time() - began
    one = np.append(percent(whole, unseen), seconds)
    began = time.process_time()
    each = [fit([estimation], m, network, training, start=FREE, stability=UNCHECKED).model for m in BOTH.each]
    seconds = time.process_time() - began
    return {"one model": one, "a model an output": np.append([percent(m, unseen)[0] for m in each], seconds)}


def main() -> None:
    """Both plants, every noise."""
    given = dict(argument.removeprefix("--").split("=") for argument in sys.argv[1:] if "=" in argument)
    seeds = range(int(given.get("seeds", 5)))
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


if __name__ == "__main__":
    main()
