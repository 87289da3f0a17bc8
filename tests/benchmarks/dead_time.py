"""Dead times that the search of a transfer function finds: 0 to 60 samples, 20 seeds each, noise 20 dB below.

    python -m tests.benchmarks dead_time [--seeds=20] [--step=1]

600 samples of steps of five through one pole, or two. A dead time counts as found within one sample.
"""

from __future__ import annotations

import os
import sys
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.signal import lfilter

from sysid.estimation import fit_transfer_function
from sysid.models import Mapping, Start, StartKind, TransferFunction
from sysid.traces import Trace
from tests.benchmarks._findings import found
from tests.estimation.linear_systems import trace_of

SAMPLES, DECIBEL, LONGEST = 600, 20.0, 60
PLANTS = {1: ([0.3], [1.0, -0.7]), 2: ([0.02, 0.015], list(np.convolve([1.0, -0.9], [1.0, -0.8])))}
"""Numerator and denominator by number of poles."""


def record(dead: int, seed: int, poles: int) -> Trace:
    """A plant with a dead time, and noise."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.integers(0, 2, SAMPLES // 5), 5) * 2.0 - 1.0
    b, f = PLANTS[poles]
    clean = lfilter([*np.zeros(dead), *b], f, u)
    return trace_of(u[:, None], clean + rng.standard_normal(SAMPLES) * clean.std() * 10 ** (-DECIBEL / 20))


def main() -> None:
    """Count."""
    given = dict(option.removeprefix("--").split("=") for option in sys.argv[1:] if option.startswith("--"))
    seeds, step = int(given.get("seeds", 20)), int(given.get("step", 1))
    start, mapping = Start(kind=StartKind.ESTIMATED), Mapping.parse("u1 -> y")
    for poles in PLANTS:
        orders, hits, total, began = TransferFunction(poles=(poles,), zeros=(poles - 1,)), 0, 0, time.perf_counter()
        for dead in range(0, LONGEST + 1, step):
            for seed in range(seeds):
                fit = fit_transfer_function([record(dead, seed, poles)], mapping, orders, start=start)
                hits += abs(fit.model.structure.to_dict()["delays"][0] - dead) <= 1
                total += 1
        share, each = 100.0 * hits / total, (time.perf_counter() - began) / total
        print(f"{poles} poles: {hits} of {total} dead times within one sample ({share:.1f} %), {each:.2f} s a fit")
        found(f"dead times found within one sample, {poles} poles", share, "%", target=95.0, at_least=True)


if __name__ == "__main__":
    main()
