"""The look at data first: false alarms on linear records, and what is found where it was put in.

    python -m tests.benchmarks advice [--seeds=100]

Each seed is another stable plant of order one or two with a dead time of one to six samples, another excitation (PRBS,
many levels, filtered and white noise, multisine; 300, 800 or 2,000 samples), and another noise, white or coloured, 1 to
50 % of the output. A false alarm is any finding of feedback, curvature, distortion, limits, spikes, drifts or jumps
that asks to be looked at. Such records are then spoiled in one way each, from 800 samples on, noise being at most 5 %.
"""

from __future__ import annotations

import os
import sys
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from sysid.advice import Advice, Verdict, advise
from sysid.excitation import excite
from sysid.models import Mapping
from sysid.traces import TraceSet
from tests.benchmarks._findings import found
from tests.estimation.linear_systems import trace_of

Array = NDArray[np.float64]
ALARMS = ("feedback.", "linearity.", "channel.", "output.", "effect.")


@dataclass
class Record:
    """A random plant with its input and noise."""

    u: Array
    y: Array
    noise: Array
    dead: int


def draw(seed: int, *, spoiled: bool = False) -> Record:
    """The record of a seed."""
    rng = np.random.default_rng(seed)
    n = int(rng.choice([800, 2000] if spoiled else [300, 800, 2000]))
    kind = str(rng.choice(["prbs", "aprbs", "noise", "multisine", "white"]))
    options: dict[str, dict[str, Any]] = {
        "prbs": {"clock": int(rng.integers(1, 8))},
        "aprbs": {"hold": int(rng.integers(3, 15))},
        "noise": {"band": (0.0, float(rng.uniform(0.05, 0.4)))},
        "multisine": {"periods": int(rng.choice([1, 3]))},
    }
    white = kind == "white"
    u = (
        rng.standard_normal(n)
        if white
        else excite(kind, samples=n, sample_time=1.0, seed=seed, **options[kind]).values[:, 0]
    )
    r, w = rng.uniform(0.3, 0.95), rng.uniform(0.05, 1.5)
    real = np.poly([rng.uniform(0.2, 0.95), rng.uniform(-0.3, 0.8)])
    f = [1.0, -2.0 * r * np.cos(w), r * r] if rng.random() < 0.5 else real
    dead = int(rng.integers(1, 7))
    y = lfilter([*np.zeros(dead), 1.0, rng.uniform(-0.5, 0.5)], f, u)
    v = lfilter([1.0], [1.0, -rng.choice([0.0, 0.5, 0.9])], rng.standard_normal(n))
    size = float(rng.choice([0.01, 0.05] if spoiled else [0.01, 0.05, 0.2, 0.5]))
    return Record(u=u, y=y / y.std(), noise=size * v / v.std(), dead=dead)


def look(u: Array, y: Array) -> Advice:
    """What is found."""
    return advise(TraceSet(name="x", traces=(trace_of(u[:, None], y + 3.0),)), Mapping.parse("u1 -> y"))


def spiked(one: Record) -> Array:
    """Three samples far off."""
    y = one.y + one.noise
    y[len(y) // np.array([5, 3, 2])] += 8.0
    return y


def looped(one: Record) -> tuple[Array, Array]:
    """The plant's noise fed back through a controller, the excitation being its set point."""
    n = len(one.u)
    u, y, x = np.zeros(n), np.zeros(n), 0.0
    e = 0.3 * np.random.default_rng(n).standard_normal(n)
    for t in range(1, n):
        x = 0.7 * x + 0.3 * u[t - 1]
        y[t] = x + e[t]
        u[t] = one.u[t] - 1.5 * y[t - 1]
    return u, y


SPOILED: dict[str, tuple[tuple[str, ...], Callable[[Record], tuple[Array, Array]]]] = {
    "curvature": (("linearity.",), lambda r: (r.u, r.y + 0.3 * r.y**2 - 0.15 * r.y**3 + r.noise)),
    "a limit": (("channel.clipped",), lambda r: (r.u, np.minimum(r.y + r.noise, 0.8))),
    "spikes": (("channel.spikes",), lambda r: (r.u, spiked(r))),
    "a drift": (("output.",), lambda r: (r.u, r.y + r.noise + np.linspace(0.0, 2.0, len(r.y)))),
    "a jump": (("output.",), lambda r: (r.u, r.y + r.noise + 1.0 * (np.arange(len(r.y)) > 0.6 * len(r.y)))),
    "feedback": (("feedback.found",), looped),
}


def main() -> None:
    """Count."""
    given = dict(option.removeprefix("--").split("=") for option in sys.argv[1:] if option.startswith("--"))
    seeds = int(given.get("seeds", 100))
    alarms, on_time, began = list[tuple[int, str]](), 0, time.process_time()
    for seed in range(seeds):
        one = draw(seed)
        result = look(one.u, one.y + one.noise)
        alarms += [(seed, f.code) for f in result.findings if f.verdict is Verdict.LOOK and f.code.startswith(ALARMS)]
        dead = [f.figures["best"] for f in result.findings if f.code.startswith("dead_time")]
        on_time += bool(dead) and abs(dead[0] - one.dead) <= 1
    each = (time.process_time() - began) / seeds
    print(f"{seeds} linear records, {each:.2f} s of processor time each; false alarms: {alarms or 'none'}")
    clean = 100.0 * (1.0 - len({seed for seed, _ in alarms}) / seeds)
    found("linear records without a false alarm", clean, "%", target=95.0, at_least=True)
    found("dead times within one sample", 100.0 * on_time / seeds, "%", target=95.0, at_least=True)
    for what, (codes, spoil) in SPOILED.items():
        hits = 0
        for seed in range(seeds):
            result = look(*spoil(draw(seed, spoiled=True)))
            hits += any(f.verdict is Verdict.LOOK and f.code.startswith(codes) for f in result.findings)
        found(f"{what} found", 100.0 * hits / seeds, "%", target=90.0, at_least=True)


if __name__ == "__main__":
    main()
