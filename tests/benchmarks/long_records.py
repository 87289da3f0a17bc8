"""Fits of long records: processor time of one pass over all samples, of a whole fit, and the memory that it takes.

    python -m tests.benchmarks long_records

A Wiener plant with noise, by one seed; each fit in a process of its own with one BLAS thread, that has read its record
from a file. A pass is free run, exact sensitivities and normal equations of a neural state space of 4 states and 10
neurons (142 parameters), the median of five at the parameters that were fitted. Memory is the largest that the process
had, libraries and compiled kernels included: of a record of 2,000 samples they are nearly all of it.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks._findings import found

SEED, HELD, PASSES = 0, 50, 5
NEURAL = {2_000: (None, None), 100_000: (None, None), 1_000_000: (1.3, 300.0)}
"""Samples, and the most seconds of a pass and megabytes."""
TRANSFER = 200_000


def record(samples: int) -> np.ndarray:
    """Levels held for 50 samples; what a tanh makes of their lag, behind another lag, and noise."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(SEED)
    u = np.repeat(rng.uniform(-1.0, 1.0, samples // HELD), HELD)
    inner = lfilter([0.0, 0.1], [1.0, -0.9], u)
    y = lfilter([0.0, 0.2], [1.0, -0.8], np.tanh(2.0 * inner)) + 0.01 * rng.standard_normal(samples)
    return np.array([u, y])


def measured(kind: str, file: str) -> dict[str, float]:
    """Fit a record and time it, in this process."""
    u, y = np.load(file)
    import sysid

    warnings.simplefilter("ignore")
    trace = sysid.data((u, y), sample_time=1.0)
    structure, training = {
        "neural": (sysid.NeuralStateSpace(states=4, neurons=10), sysid.Training(starts=1, max_iterations=4)),
        "transfer": (sysid.TransferFunction(poles=2, zeros=1, delays=1), None),
    }[kind]
    begin = time.process_time()
    fit = sysid.fit(trace, "u -> y", structure, training, stability=None)
    took = {"fit": time.process_time() - begin}
    took["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e3 if sys.platform == "linux" else 1e6)
    return took if kind != "neural" else {**took, "pass": one_pass(fit, u, y)}


def one_pass(fit: Any, u: np.ndarray, y: np.ndarray) -> float:
    """Median processor time of a linearisation at the fitted parameters."""
    from sysid.estimation.networks.neural.provider import NeuralProvider
    from sysid.estimation.records.experiment import Experiment
    from sysid.models import History

    rest = History.at_rest(inputs=u[:1], output=float(y[0]))
    known = Experiment(inputs=u[:, np.newaxis], output=y, history=rest)
    provider = NeuralProvider(template=fit.model.recursion, experiments=(known,))
    times = []
    for _ in range(1 + PASSES):
        begin = time.process_time()
        provider.linearise(fit.model.theta)
        times.append(time.process_time() - begin)
    return float(np.median(times[1:]))


def apart(kind: str, samples: int, folder: Path) -> dict[str, float]:
    """The same in a process of its own."""
    file = folder / f"{samples}.npy"
    if not file.exists():
        np.save(file, record(samples))
    words = [sys.executable, "-m", "tests.benchmarks.long_records", kind, str(file)]
    told = subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True).stdout
    return dict(json.loads(told.splitlines()[-1]))


def main() -> None:
    """All records."""
    with tempfile.TemporaryDirectory() as name:
        for samples, (seconds, memory) in NEURAL.items():
            took = apart("neural", samples, Path(name))
            label = f"NSS 4/10, {samples:,} samples"
            found(f"{label}: one pass", took["pass"], "s", target=seconds, note=f"a fit of 4 {took['fit']:.1f} s")
            found(f"{label}: memory of that fit", took["memory"], "MB", target=memory)
        took = apart("transfer", TRANSFER, Path(name))
        found(f"transfer function 2/1, {TRANSFER:,} samples: a fit", took["fit"], "s", note=f"{took['memory']:.0f} MB")


if __name__ == "__main__":
    if sys.argv[2:]:
        print(json.dumps(measured(sys.argv[1], sys.argv[2])))
    else:
        main()
