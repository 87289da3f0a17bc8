"""Impulse responses: regularised against least squares and the truth, with their bands and dead times.

    python -m tests.benchmarks impulse [--seeds=20]

Three plants (a lag, an oscillation, two inputs), 500 samples of levels held for five, white and coloured noise 20 dB
and 10 dB below the output. The figure is the fit of the response in percent, ``100 (1 - |g - g0| / |g0 - mean(g0)|)``,
over as many lags as the estimate has; least squares has the same lags. A band counts where the true response is above
a hundredth of its peak. Then 100,000 samples and two inputs, for processor time and memory.
"""

from __future__ import annotations

import os
import resource
import sys
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from sysid.estimation.nonparametric.impulse import estimate_impulse_response
from sysid.estimation.nonparametric.impulse_response import ImpulseResponse
from sysid.models import Mapping
from sysid.traces import Trace
from tests.benchmarks._findings import found
from tests.estimation.linear_systems import trace_of

Plant = tuple[list[float], list[float], int]
PLANTS: dict[str, list[Plant]] = {
    "lag": [([0.3], [1.0, -0.8], 3)],
    "oscillation": [([0.1, 0.08], [1.0, -1.6, 0.8], 2)],
    "two inputs": [([0.3], [1.0, -0.8], 5), ([0.05, 0.04], [1.0, -1.5, 0.56], 1)],
}
SAMPLES, HOLD, LAGS = 500, 5, 50


def response(plants: list[Plant], n: int) -> NDArray[np.float64]:
    """True impulse responses."""
    return np.array([lfilter([*np.zeros(dead), *b], f, np.eye(1, n)[0]) for b, f, dead in plants])


def record(plants: list[Plant], seed: int, decibel: float, colour: float, n: int = SAMPLES) -> Trace:
    """Held levels, the plants' outputs together, and noise."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1, 1, (n // HOLD + 1, len(plants))), HOLD, axis=0)[:n]
    y = np.sum([lfilter([*np.zeros(d), *b], f, x) for (b, f, d), x in zip(plants, u.T, strict=True)], axis=0)
    v = lfilter([1.0], [1.0, -colour], rng.standard_normal(n))
    return trace_of(u, y + v * y.std() / v.std() * 10 ** (-decibel / 20) + 2.0)


def plain(trace: Trace, m: int, n: int) -> NDArray[np.float64]:
    """NumPy's least squares on the same lags."""
    u, y = trace.values[:, :m], trace.values[:, m]
    columns = [u[n - 1 - k : len(y) - k, j] for j in range(m) for k in range(n)]
    X = np.column_stack([*columns, np.ones(len(y) - n + 1)])
    return np.linalg.lstsq(X, y[n - 1 :], rcond=None)[0][:-1].reshape(m, n)


def fit(g: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    """In percent."""
    around = truth - truth.mean(axis=1, keepdims=True)
    return 100.0 * (1.0 - float(np.linalg.norm(g - truth) / np.linalg.norm(around)))


def inside(found: ImpulseResponse, truth: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Where the 95 % band holds the truth, of what can be seen."""
    seen = np.abs(truth) > 0.01 * np.abs(truth).max(axis=1, keepdims=True)
    return (np.abs(found.values - truth) <= 1.96 * found.deviation)[seen]


def main() -> None:
    """Count."""
    given = dict(option.removeprefix("--").split("=") for option in sys.argv[1:] if option.startswith("--"))
    seeds = int(given.get("seeds", 20))
    print(f"{'plant':<14}{'noise':<18}{'regularised':>12}{'least squares':>15}{'in band':>9}{'dead time':>11}{'s':>7}")
    held, on_time, total = [], 0, 0
    for name, plants in PLANTS.items():
        m, truth = len(plants), response(plants, LAGS)
        mapping = Mapping(inputs=tuple(f"u{j + 1}" for j in range(m)), output="y")
        for decibel in (20.0, 10.0):
            for colour in (0.0, 0.9):
                ours, theirs, bands, right, began = [], [], [], 0, time.process_time()
                for seed in range(seeds):
                    trace = record(plants, seed, decibel, colour)
                    estimate = estimate_impulse_response([trace], mapping, lags=LAGS)
                    ours.append(fit(estimate.values, truth))
                    theirs.append(fit(plain(trace, m, LAGS), truth))
                    bands.append(inside(estimate, truth))
                    right += sum(abs(e.best - p[2]) <= 1 for e, p in zip(estimate.dead_times, plants, strict=True))
                each = (time.process_time() - began) / seeds
                share = float(np.mean(np.concatenate(bands)))
                held.append(share)
                on_time, total = on_time + right, total + seeds * m
                noise = f"{decibel:.0f} dB, {'coloured' if colour else 'white'}"
                print(
                    f"{name:<14}{noise:<18}{np.median(ours):>12.1f}{np.median(theirs):>15.1f}{share:>9.1%}"
                    f"{right:>7}/{seeds * m:<3}{each:>7.2f}"
                )
                found(f"{name}, {noise}: fit of the response", float(np.median(ours)), "%",
                      target=float(np.median(theirs)), at_least=True)  # fmt: skip
    found("share of the truth inside the 95 % band", 100.0 * float(np.mean(held)), "%", target=92.0, at_least=True)
    found("dead times within one sample", 100.0 * on_time / total, "%", target=95.0, at_least=True)
    print(f"in band {np.mean(held):.1%}, dead times within one sample {on_time} of {total}")
    trace = record(PLANTS["two inputs"], 0, 20.0, 0.0, n=100_000)
    began, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    estimate_impulse_response([trace], Mapping.parse("u1+u2 -> y"))
    seconds = time.process_time() - began
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    print(f"100,000 samples, two inputs: {seconds:.1f} s of processor time, {grown:.0f} MB more at its peak")
    found("100,000 samples, two inputs", seconds, "s", target=10.0)


if __name__ == "__main__":
    main()
