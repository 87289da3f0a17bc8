"""How often the intervals of the output hold what was measured, by structure: records of plants that are known.

    python -m tests.benchmarks interval_coverage [--records=30]

Each record estimates once and is judged on another one of the same plant, with other inputs and other noise. An ARX
plant has its noise in the equation, the others on the output. The 95 % interval should hold 95 % of the samples.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import replace

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from sysid.estimation import Training
from sysid.estimation.fitting import fit
from sysid.estimation.results.result import Loop
from sysid.models import (
    ARMAX,
    ARX,
    BJ,
    NARX,
    OE,
    AbstractStructure,
    LinearStateSpace,
    Mapping,
    NeuralStateSpace,
    Start,
    StartKind,
    TransferFunction,
    VectorNARX,
    VectorNeuralStateSpace,
    VectorStateSpace,
)
from sysid.traces import Channel, Role, Trace
from sysid.validation import predict_interval
from sysid.validation.evaluation import case_results
from tests.benchmarks._findings import found
from tests.estimation.linear_systems import trace_of

SAMPLES, AHEAD = 300, 5
ESTIMATED = Start(kind=StartKind.ESTIMATED)
MAPPING, BOTH = Mapping.parse("u1 -> y"), Mapping.parse("u1 -> y+z")
QUICK = Training(starts=1, max_iterations=60)
STRUCTURES: dict[str, tuple[AbstractStructure, Training | None, bool]] = {
    "ARX": (ARX(na=2, nb=(1,), nk=(1,)), None, True),
    "TF": (TransferFunction(poles=(2,), zeros=(0,), delays=(1,)), None, False),
    "continuous TF": (TransferFunction(poles=(2,), zeros=(1,), delays=(0,), domain="continuous"), None, False),
    "OE": (OE(nb=(1,), nf=(2,), nk=(1,)), None, False),
    "BJ": (BJ(nb=(1,), nc=0, nd=1, nf=(2,), nk=(1,)), None, False),
    "ARMAX": (ARMAX(na=2, nb=(1,), nc=1, nk=(1,)), None, True),
    "SS": (LinearStateSpace(states=2), None, True),
    "SS without noise model": (LinearStateSpace(states=2, noise=False), None, False),
    "SS of two outputs": (VectorStateSpace(states=2), None, False),
    "NARX": (NARX(input_delays=1, output_delays=2, neurons=1), QUICK, True),
    "NSS": (NeuralStateSpace(states=2, neurons=1), QUICK, False),
    "NSS of two outputs": (VectorNeuralStateSpace(states=2, neurons=1), QUICK, False),
    "NARX of two outputs": (
        VectorNARX(input_delays=1, output_delays=2, neurons=1),
        Training(max_iterations=60),
        True,
    ),
}
"""Structure, training, and whether its noise is in the equation."""


def record(rng: np.random.Generator, *, inside: bool) -> Trace:
    """A record of two poles that begins somewhere.

    Args:
        rng: Source of randomness.
        inside: Whether the noise goes through the equation; on the output otherwise.
    """
    u = np.repeat(rng.uniform(-1.0, 1.0, SAMPLES // 5), 5)
    y, e = np.zeros(SAMPLES), 0.02 * rng.standard_normal(SAMPLES)
    y[:2] = rng.uniform(-1.0, 1.0)
    for k in range(2, SAMPLES):
        y[k] = 1.5 * y[k - 1] - 0.56 * y[k - 2] + 0.06 * u[k - 1] + (e[k] if inside else 0.0)
    both = trace_of(u[:, None], y if inside else y + e)
    # A second output beside it, which only structures of several outputs are asked for.
    z = 2.0 * y - np.append(0.0, y[:-1]) + 0.05 * rng.standard_normal(SAMPLES)
    channels = (*both.channels, Channel(name="z", unit="1"))
    return replace(both, channels=channels, values=np.column_stack([both.values, z]))


def shares(name: str, records: int) -> dict[str, list[float]]:
    """Share of the samples that the intervals hold, record by record, of the free run, one step and some steps ahead.

    Args:
        name: Of the structure.
        records: How many.
    """
    structure, training, inside = STRUCTURES[name]
    held: dict[str, list[float]] = {"free run": [], "one step ahead": [], f"{AHEAD} steps ahead": []}
    for seed in range(records):
        rng = np.random.default_rng([seed, len(name)])
        estimation, other = record(rng, inside=inside), record(rng, inside=inside)
        mapping = BOTH if structure.several_outputs else MAPPING
        fitted = fit([estimation], mapping, structure, training, start=ESTIMATED, stability=None)
        if fitted.posterior is None:
            continue
        if fitted.model.innovation_responses(1) is not None:
            ahead = predict_interval(fitted, other, loop=Loop.OPEN, steps=AHEAD, start=ESTIMATED)
            for name_of, interval in zip(mapping.outputs, ahead.of_outputs(), strict=True):
                held[f"{AHEAD} steps ahead"].append(interval.coverage(other[name_of][-len(interval.output) :]).share)
        cases = case_results(fitted.model, other, Role.VALIDATION, ESTIMATED, 1, posterior=fitted.posterior)
        for case in cases.values():
            if case.intervals is not None:
                held["free run"].append(case.intervals.free_run.share)
                held["one step ahead"].append(case.intervals.one_step.share)
    return held


def main() -> None:
    """Count."""
    given = dict(option.removeprefix("--").split("=") for option in sys.argv[1:] if option.startswith("--"))
    records = int(given.get("records", 30))
    for name in STRUCTURES:
        began = time.process_time()
        for run, held in shares(name, records).items():
            if held and np.isfinite(held).all():
                note = f"{len(held)} outputs of {records} records, {(time.process_time() - began) / records:.2f} s each"
                found(f"{name}: samples within the 95 % interval, {run}", 100.0 * float(np.mean(held)), "%", note=note)


if __name__ == "__main__":
    main()
