"""Wholes from starts that are far off: what training on windows first brings, and what it costs.

    python -m tests.benchmarks whole_starts [--seeds=3] [--windows=none,auto] [--off=0,0.2,0.4] [--plants="two tanks"]

Fourteen plants of two or three stages, simulated with white noise of 0.5 % of each channel's range; every stage is a
network of four neurons that is fitted alone. ``off`` says how far from there the whole begins: each parameter is moved
by so many standard deviations of a normal distribution; ``step`` begins with networks that were fitted one step ahead
with ten iterations. Two records of 500 samples train, one chooses, one that nothing has seen scores: the geometric mean
over the channels of the free run's root mean square error, over the channel's range. Time is processor time.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray

from sysid.estimation import CascadeFit, JointTraining, Training, fit_cascade, fit_narx
from sysid.estimation.networks.together.provider import CascadeProvider
from sysid.models import NARX, Cascade, Mapping
from sysid.traces import Channel, Trace
from tests.benchmarks._findings import found

SAMPLES, NOISE, HELD = 500, 0.005, 15
Step = Callable[[float, list[float]], Sequence[float]]
"""From the input and the channels one sample ago, these now."""


def _root(value: float) -> float:
    return float(np.sqrt(max(value, 0.0)))


def _two_tanks(u: float, x: list[float]) -> list[float]:
    down = 0.15 * _root(x[0])
    return [x[0] + 0.12 * (u + 1.0) - down, x[1] + down - 0.12 * _root(x[1])]


def _three_tanks(u: float, x: list[float]) -> list[float]:
    a, b = 0.2 * _root(x[0]), 0.17 * _root(x[1])
    return [x[0] + 0.15 * (u + 1.0) - a, x[1] + a - b, x[2] + b - 0.15 * _root(x[2])]


def _coupled_tanks(u: float, x: list[float]) -> list[float]:
    down = 0.15 * np.sign(x[0] - x[1]) * _root(abs(x[0] - x[1]))
    return [x[0] + 0.1 * (u + 1.0) - down, x[1] + down - 0.08 * _root(x[1])]


def _vessel(u: float, x: list[float]) -> list[float]:
    valve = x[0] + 0.25 * (np.clip(1.5 * u, -1.0, 1.0) - x[0])
    return [valve, x[1] + 0.1 * ((1.0 + valve) * _root(4.0 - x[1]) - 0.9 * x[1])]


def _motor(u: float, x: list[float]) -> list[float]:
    current = x[0] + 0.4 * (3.0 * u - x[0] - 0.5 * x[1])
    return [current, x[1] + 0.1 * (current - 0.4 * x[1] - 0.6 * np.tanh(8.0 * x[1]))]


def _exchanger(u: float, x: list[float]) -> list[float]:
    wall = x[0] + 0.15 * (2.0 * (u + 1.0) - (x[0] - x[1]))
    return [wall, x[1] + 0.12 * (x[0] - x[1]) - 0.05 * (1.5 + u) * x[1]]


def _resonance(u: float, x: list[float]) -> list[float]:
    drive = 0.7 * x[0] + 0.3 * (u + 0.6 * u**3)
    swing = 1.55 * x[1] - 0.8 * x[2] + 0.25 * drive
    return [drive, swing, x[1]]


def _springs(u: float, x: list[float]) -> list[float]:
    drive = 0.8 * x[0] + 0.3 * u
    speed = 0.92 * x[2] - 0.2 * (x[1] + 0.4 * x[1] ** 3) + 0.2 * drive
    return [drive, x[1] + speed, speed]


def _pipe(u: float, x: list[float]) -> list[float]:
    pipe = x[0] + 0.3 * (u - x[0])
    rate = 0.25 if pipe > x[1] else 0.06
    return [pipe, x[1] + rate * (pipe - x[1])]


def _brake(u: float, x: list[float]) -> list[float]:
    pipe = x[0] + 0.3 * (u - x[0])
    store = x[1] + (0.08 if pipe > x[1] else 0.01) * (pipe - x[1])
    cylinder = x[2] + 0.2 * (np.clip(2.5 * (store - pipe), 0.0, 1.5) - x[2])
    return [pipe, store, cylinder]


def _bioreactor(u: float, x: list[float]) -> list[float]:
    feed = 0.8 * x[0] + 0.2 * (0.3 + 0.15 * u)
    growth = 0.6 * x[1] / (0.8 + x[1]) * x[2]
    return [feed, x[1] + 0.15 * (feed * (6.0 - x[1]) - growth), x[2] + 0.15 * (0.7 * growth - feed * x[2])]


def _pendulum(u: float, x: list[float]) -> list[float]:
    torque = 0.7 * x[0] + 0.3 * u
    speed = 0.9 * x[2] - 0.12 * np.sin(x[1]) + 0.12 * torque
    return [torque, x[1] + speed, speed]


def _oscillator(u: float, x: list[float]) -> list[float]:
    drive = 0.8 * x[0] + 0.2 * u
    speed = x[2] + 0.15 * (1.0 * (1.0 - x[1] ** 2) * x[2] - x[1] + drive)
    return [drive, x[1] + 0.15 * speed, speed]


def _slope(u: float, x: list[float]) -> list[float]:
    limited = x[0] + np.clip(u - x[0], -0.12, 0.2)
    return [limited, x[1] + 0.15 * (np.tanh(2.0 * limited) - x[1]), x[2] + 0.1 * (x[1] - x[2])]


PLANTS: dict[str, tuple[Step, tuple[str, ...], tuple[float, ...]]] = {
    "two tanks": (_two_tanks, ("u -> a", "a -> b"), (0.6, 1.0)),
    "three tanks": (_three_tanks, ("u -> a", "a -> b", "b -> c"), (0.6, 0.8, 1.0)),
    "coupled tanks": (_coupled_tanks, ("u+b -> a", "a -> b"), (1.5, 1.0)),
    "pressure vessel": (_vessel, ("u -> a", "a -> b"), (0.0, 1.5)),
    "motor with friction": (_motor, ("u+b -> a", "a -> b"), (0.0, 0.0)),
    "heat exchanger": (_exchanger, ("u+b -> a", "a+u -> b"), (7.0, 5.0)),
    "resonance": (_resonance, ("u -> a", "a -> b"), (0.0, 0.0, 0.0)),
    "hardening spring": (_springs, ("u -> a", "a -> b"), (0.0, 0.0, 0.0)),
    "check valve": (_pipe, ("u -> a", "a -> b"), (0.0, 0.0)),
    "brake": (_brake, ("u -> a", "a -> b", "a+b -> c"), (0.0, 0.0, 0.0)),
    "bioreactor": (_bioreactor, ("u -> a", "a+c -> b", "a+b -> c"), (0.3, 1.0, 3.5)),
    "pendulum": (_pendulum, ("u -> a", "a -> b"), (0.0, 0.0, 0.0)),
    "Van der Pol": (_oscillator, ("u -> a", "a -> b"), (0.0, 0.5, 0.0)),
    "slope limiter": (_slope, ("u -> a", "a -> b", "b -> c"), (0.0, 0.0, 0.0)),
}
"""One sample of each, its members, and where it begins; states behind the members' channels are not measured."""


def record(plant: str, seed: int) -> Trace:
    """A run of a plant at random inputs, measured with noise."""
    step, members, state = PLANTS[plant]
    rng, outputs = np.random.default_rng(seed), [Mapping.parse(one).output for one in members]
    u = np.repeat(rng.uniform(-1.0, 1.0, SAMPLES // HELD + 1), HELD)[:SAMPLES]
    u[:5] = 0.0
    path, x = [], list(state)
    for now in u:
        x = [float(one) for one in step(float(now), x)]
        path.append(x)
    y = np.array(path)[:, : len(outputs)]
    y += NOISE * np.ptp(y, axis=0) * rng.standard_normal(y.shape)
    channels = tuple(Channel(name=name, unit="V") for name in ("u", *outputs))
    return Trace(name=f"{plant} {seed}", sample_time=0.1, channels=channels, values=np.column_stack([u, y]))


def _network(mapping: Mapping) -> NARX:
    """One stage; only the first input is read at the same sample, so that stages may stand in a circle."""
    delays = [[0, 1], *[[1, 2]] * (len(mapping.inputs) - 1)]
    return NARX(input_delays=delays, output_delays=2, neurons=4)


def members(plant: str, traces: Sequence[Trace], training: Training) -> Cascade:
    """The stages, each fitted alone."""
    texts = PLANTS[plant][1]
    fits = [fit_narx(traces, one, _network(one), training) for one in map(Mapping.parse, texts)]
    return Cascade(models=tuple(one.model for one in fits))


def begun(plant: str, off: str, seed: int, traces: Sequence[Trace]) -> Cascade:
    """Where a whole begins."""
    if off == "step":
        options: dict[str, Any] = {"loop": "open", "max_iterations": 10}
        return members(plant, traces, Training(starts=1, seed=seed, workers=1, **options))
    alone = members(plant, traces, Training(starts=1, seed=seed, workers=1, max_iterations=30))
    provider = CascadeProvider(cascade=alone, traces=tuple(traces), errors=dict.fromkeys(alone.outputs, 1.0))
    return provider.at(provider.theta + float(off) * np.random.default_rng(seed).standard_normal(len(provider.theta)))


def score(cascade: Cascade, trace: Trace) -> float:
    """Error over the range, in percent."""
    run = cascade.simulate_trace(trace)
    with np.errstate(over="ignore", invalid="ignore"):
        errors: NDArray[np.float64] = np.array(
            [np.mean((run[name] - trace[name]) ** 2) ** 0.5 / np.ptp(trace[name]) for name in cascade.outputs]
        )
        found = float(100.0 * np.exp(np.mean(np.log(errors))))
    return found if np.isfinite(found) else np.inf


def fitted(start: Cascade, traces: Sequence[Trace], selection: Trace, windows: str) -> tuple[CascadeFit, float]:
    """A fit, and its processor time."""
    asked: Any = {"none": (), "auto": "auto"}.get(windows) if windows in {"none", "auto"} else None
    if asked is None:
        asked = tuple(int(one) for one in windows.split("+"))
    began = time.process_time()
    training = JointTraining(max_iterations=60, checkpoints=6, workers=1, windows=asked)
    fit = fit_cascade(start, traces, training=training, selection=[selection])
    return fit, time.process_time() - began


def main() -> None:
    """Measure."""
    given = dict(option.removeprefix("--").split("=") for option in sys.argv[1:] if option.startswith("--"))
    seeds, ways = int(given.get("seeds", 3)), given.get("windows", "none,auto").split(",")
    names = given["plants"].split(",") if "plants" in given else list(PLANTS)
    for off in given.get("off", "0,step,0.2,0.4").split(","):
        errors, seconds = {way: list[float]() for way in ways}, {way: list[float]() for way in ways}
        for name in names:
            for seed in range(seeds):
                traces = [record(name, 100 * seed + one) for one in range(2)]
                selection, unseen = (record(name, 100 * seed + one) for one in (2, 3))
                start = begun(name, off, seed, traces)
                for way in ways:
                    fit, took = fitted(start, traces, selection, way)
                    errors[way].append(score(fit.model, unseen))
                    seconds[way].append(took)
            own = {way: errors[way][-seeds:] for way in ways}
            for way in ways:
                each = ", ".join(f"{one:.3g}" for one in own[way])
                found(f"{name}, off {off}, windows {way}: error over range", float(np.median(own[way])), "%",
                      note=f"{each}; {sum(seconds[way][-seeds:]):.1f} s")  # fmt: skip
        for way in ways:
            found(f"all, off {off}, windows {way}: median of the errors", float(np.median(errors[way])), "%",
                  note=f"{sum(seconds[way]):.1f} s of processor time")  # fmt: skip


if __name__ == "__main__":
    main()
