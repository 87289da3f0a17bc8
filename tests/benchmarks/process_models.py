"""How often the intervals of process models hold the truth: plants that are known, in continuous time.

    python -m tests.benchmarks process_models [--seeds=10]

Each type under single steps and under steps of random length, sampled every 0.1 s and every 10 s, with offsets of input
and output, from rest and from what came before a record that begins in motion; 5 % of noise. The dead time is no whole
number of samples. The plant is run on a grid a hundred times as fine by another routine (`scipy.signal.lsim`).
"""

from __future__ import annotations

import os
import sys
import time
import warnings

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray
from scipy import signal

import sysid

FINE = 100
PLANTS: dict[str, dict[str, float]] = {
    "P1D": {"K": 2.0, "Tp1": 12.0, "Td": 4.37},
    "P2D": {"K": -0.7, "Tp1": 14.0, "Tp2": 5.0, "Td": 3.62},
    "P2DZ": {"K": 1.5, "Tp1": 15.0, "Tp2": 6.0, "Tz": -4.0, "Td": 2.41},
    "P2DU": {"K": 3.0, "Tw": 5.0, "zeta": 0.35, "Td": 2.73},
    "P2DZU": {"K": 3.0, "Tw": 5.0, "zeta": 0.3, "Tz": 6.0, "Td": 2.73},
    "P1DI": {"K": 0.05, "Tp1": 8.0, "Td": 3.18},
}
"""Times in samples."""
SAMPLES = {"step": 200, "steps": 400}


def ratio(plant: dict[str, float], T: float, integrates: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Numerator and denominator in falling powers of s."""
    num = np.array([plant.get("Tz", 0.0) * T, 1.0]) * plant["K"] / (T if integrates else 1.0)
    den = np.ones(1)
    for name, value in plant.items():
        if name.startswith("Tp"):
            den = np.convolve(den, [value * T, 1.0])
    if "Tw" in plant:
        den = np.convolve(den, [(plant["Tw"] * T) ** 2, 2 * plant["zeta"] * plant["Tw"] * T, 1.0])
    return num, np.convolve(den, [1.0, 0.0]) if integrates else den


def record(
    kind: str, excitation: str, T: float, *, moving: bool, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], dict[str, float]]:
    """Input, output and the truth."""
    rng = np.random.default_rng([seed, len(kind), len(excitation), moving, int(T)])
    plant, n, before = PLANTS[kind], SAMPLES[excitation], 120 if moving else 0
    integrates = "I" in kind
    if excitation == "step":
        u = np.zeros(n)
        u[15 + rng.integers(10) :] = 1.0
        if integrates:
            u[80:] = 0.0
    else:
        lengths = rng.integers(4, 30, size=n)
        u = np.repeat(rng.choice([-1.0, 1.0], size=n), lengths)[:n]
    earlier = np.repeat(rng.choice([-1.0, 1.0], size=before), 15)[:before]
    whole = np.concatenate([earlier, u]) if moving else u
    fine = np.repeat(whole - (0.0 if moving else whole[0]), FINE)
    late = round(plant["Td"] * FINE)
    fine = np.concatenate([np.zeros(late), fine])[: len(fine)]
    num, den = ratio(plant, T, integrates)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        _, y, _ = signal.lsim((num, den), fine, np.arange(len(fine)) * T / FINE, interp=False)
    y = y[::FINE][before:]
    y = y + 0.05 * y.std() * rng.normal(size=n) + 40.0
    times = {name: value * (T if name.startswith("T") else 1.0) for name, value in plant.items()}
    return u + 7.0, y, times | ({"K": plant["K"] / T} if integrates else {})


def judged(kind: str, excitation: str, *, moving: bool, seeds: int) -> tuple[list[bool], int, float]:
    """Which intervals hold the truth, how many there are none of, and the median distance from it in deviations."""
    held: list[bool] = []
    none, off = 0, []
    for seed in range(seeds):
        T = (0.1, 10.0)[seed % 2]
        u, y, truth = record(kind, excitation, T, moving=moving, seed=seed)
        fit = sysid.fit(sysid.data((u, y), sample_time=T), "u -> y", sysid.ProcessModel(type=kind), start="estimated")
        for i, name in enumerate(fit.uncertainty.names):
            deviation = fit.uncertainty.standard_deviations[i]
            if name in truth and np.isnan(deviation):
                none += 1
            elif name in truth:
                low, high = fit.uncertainty.interval(0.95)[i]
                held.append(bool(low <= truth[name] <= high))
                off.append(abs(fit.model.parameters[name] - truth[name]) / deviation)
    return held, none, float(np.median(off))


def main() -> int:
    seeds = next((int(a.partition("=")[2]) for a in sys.argv if a.startswith("--seeds=")), 10)
    print("type      record            % held  none  deviations off   s a fit")
    whole: list[bool] = []
    missing = 0
    for kind in PLANTS:
        for excitation in SAMPLES:
            for moving in (False, True):
                began = time.perf_counter()
                held, none, off = judged(kind, excitation, moving=moving, seeds=seeds)
                per = (time.perf_counter() - began) / seeds
                name = f"{excitation}, {'in motion' if moving else 'at rest'}"
                print(f"{kind:9} {name:17} {100 * np.mean(held):6.1f} {none:5d} {off:15.2f} {per:9.2f}", flush=True)
                whole += held
                missing += none
    print(f"all: {100 * np.mean(whole):.1f} % of {len(whole)} intervals; {missing} parameters have none")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
