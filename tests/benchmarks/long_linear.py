"""Linear fits of long records: processor time and mean squared error, with starts compared on stretches and on all.

    python -m tests.benchmarks long_linear [--samples=100000] [--inputs=1] [--fast=10] [--kinds="OE;TF"] [--new]

A plant of one lightly damped pair of poles and a slow one for each input, noise of its own colour at 5 %, seed 0.
``--fast=10`` samples it ten times as fast as its input moves. Each kind is fitted twice in one process after a fit of
2,000 samples that compiles: as it is, and with every start compared on all samples, as before; ``--new`` leaves the
second out. The mean squared errors of the two are set side by side: the first may not be above.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter

import sysid
from sysid.estimation.linear.polynomial import fit as polynomial
from sysid.estimation.linear.transfer_function import fit as transfer_function

COMPILING, NOISE, SEED = 2_000, 0.05, 0
START = sysid.Start(kind="estimated")
KINDS: dict[str, Callable[[int], Any]] = {
    "ARX": lambda m: sysid.ARX(na=4, nb=(4,) * m, nk=(1,) * m),
    "OE": lambda m: sysid.OE(nb=(3,) * m, nf=(3,) * m, nk=(1,) * m),
    "ARMAX": lambda m: sysid.ARMAX(na=4, nb=(4,) * m, nc=2, nk=(1,) * m),
    "BJ": lambda m: sysid.BJ(nb=(3,) * m, nc=1, nd=1, nf=(3,) * m, nk=(1,) * m),
    "TF": lambda m: sysid.TransferFunction(poles=(3,) * m, zeros=(2,) * m, delays=(1,) * m),
    "TF, dead time searched": lambda m: sysid.TransferFunction(poles=(3,) * m, zeros=(2,) * m),
    "TF, continuous": lambda m: sysid.TransferFunction(
        poles=(3,) * m, zeros=(2,) * m, delays=(0,) * m, domain="continuous"
    ),
    "SS": lambda m: sysid.LinearStateSpace(states=3 * m),
    "SS, noise: false": lambda m: sysid.LinearStateSpace(states=3 * m, noise=False),
}


def record(samples: int, inputs: int, fast: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Inputs and an output."""
    rng = np.random.default_rng(SEED)
    u = rng.normal(size=(samples, inputs))
    u = u if fast == 1 else lfilter(*butter(3, 0.5 / fast), u, axis=0)
    y = np.zeros(samples)
    for j in range(inputs):
        pair = [1.0, -2.0 * 0.97 * np.cos(0.15 + 0.1 * j), 0.97**2]
        y += lfilter([0.0, 0.1, 0.05, 0.02], np.convolve(pair, [1.0, -0.9 + 0.02 * j]), u[:, j])
    return u, y + lfilter([1.0, 0.5], [1.0, -0.8], NOISE * y.std() * rng.normal(size=samples))


def timed(u: NDArray[np.float64], y: NDArray[np.float64], structure: Any) -> tuple[float, float]:
    """Processor seconds of a fit, and its mean squared error."""
    traces = sysid.data((u, y), sample_time=1.0)
    *inputs, output = traces.traces[0].channel_names
    began = time.process_time()
    fit = sysid.fit(traces, f"{'+'.join(inputs)} -> {output}", structure, start=START)
    return time.process_time() - began, float(fit.history["mse"][-1])


def main(arguments: list[str]) -> int:
    """Print the table."""
    given = dict(one.removeprefix("--").split("=") for one in arguments if "=" in one)
    samples, inputs, fast = (int(given.get(k, v)) for k, v in {"samples": 100_000, "inputs": 1, "fast": 1}.items())
    kinds = given["kinds"].split(";") if "kinds" in given else list(KINDS)
    warnings.simplefilter("ignore")
    u, y = record(samples, inputs, fast)
    own, above = transfer_function.stretches, []
    print(f"{samples} samples, {inputs} inputs, {fast} times as fast; processor seconds of a fit, mean squared error")
    for kind in kinds:
        structure = KINDS[kind](inputs)
        timed(u[:COMPILING], y[:COMPILING], structure)
        took, mse = timed(u, y, structure)
        row = f"{kind:24} {took:7.2f} s {mse:12.6g}"
        if "--new" not in arguments:
            transfer_function.stretches = polynomial.stretches = lambda _: None
            before, than = timed(u, y, structure)
            transfer_function.stretches = polynomial.stretches = own
            row += f"   with all samples throughout {before:7.2f} s {than:12.6g}"
            above += [kind] * (mse > than * (1.0 + 1e-5))
        print(row, flush=True)
    print(f"above what all samples come to: {', '.join(above) or 'none'}")
    return len(above)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
