"""Whether what a model leaves of the Wiener-Hammerstein record of 2009 is noise: where it lies, and what it moves with.

    SYSID_DATA=<folder> python -m tests.benchmarks noise_floor

The equations of ``pipelines/benchmarks/wiener-hammerstein-equations.yaml`` are fitted to the first 40,000 samples and
run freely over the excited part of the record. The error is parted by frequency: above 6.4 kHz the circuit passes
nothing, so that what is there is noise of the instruments. Its coherence with input, output, and bent and multiplied
forms of both says what another model of this input could still explain: over n stretches chance leaves 1/n.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy import signal

import sysid
from sysid.estimation import StabilityOptions
from sysid.models import Start, StartKind
from sysid.traces import Channel, Trace
from tests.benchmarks._findings import found
from tests.benchmarks._public import checked

PIPELINE = Path(__file__).resolve().parents[2] / "pipelines" / "benchmarks" / "wiener-hammerstein-equations.yaml"
RATE, FIRST, LAST, FITTED, SEEN, STRETCH = 51_200, 5_200, 184_000, 40_000, 50, 4_096
BANDS = ((0, 40), (40, 400), (400, 1_600), (1_600, 6_400), (6_400, RATE // 2))
Array = NDArray[np.float64]


def record() -> tuple[Array, Array]:
    """Input and output, in V, where the circuit is excited."""
    table = np.genfromtxt(checked("wiener_hammerstein/WienerHammerBenchmark.csv"), delimiter=",", skip_header=1)
    return table[FIRST:LAST, 0], table[FIRST:LAST, 1]


def left(u: Array, y: Array) -> tuple[Array, Array]:
    """The error of the free run in mV, and the run in V."""
    structure: dict[str, Any] = yaml.safe_load(PIPELINE.read_text())["fits"][0]["structure"]
    structure.pop("kind")
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
    fitted = Trace(name="fitted", sample_time=1 / RATE, channels=channels, values=np.column_stack([u, y])[:FITTED])
    start = Start(kind=StartKind.MEASURED, n_measured=SEEN)
    fit = sysid.fit(
        [fitted],
        "u -> y",
        sysid.GreyBox(**structure),
        sysid.Training(starts=1, max_iterations=60, workers=1),
        start=start,
        stability=StabilityOptions(count=0),
    )
    run = np.ravel(fit.model.simulate(u[SEEN:, None], start.history(u[:, None], y, fit.model.rest_output)))
    return 1e3 * (y[SEEN:] - run), run


def main() -> None:
    """Fit, and look at what is left."""
    u, y = record()
    error, run = left(u, y)
    unseen = error[FITTED:]
    found("error of the free run, samples that were not fitted", float(np.sqrt(np.mean(unseen**2))), "mV")
    frequency, density = signal.welch(unseen, RATE, nperseg=32_768)
    parts = [float(np.sqrt(density[(frequency >= a) & (frequency < b)].sum() * frequency[1])) for a, b in BANDS]
    for (low, high), part in zip(BANDS, parts, strict=True):
        found(f"of it between {low} and {high} Hz", part, "mV")
    white = parts[-1] * float(np.sqrt(0.5 * RATE / (BANDS[-1][1] - BANDS[-1][0])))
    found("noise as dense as above 6.4 kHz, over all frequencies", white, "mV")
    u, y = u[SEEN:][FITTED:], y[SEEN:][FITTED:]
    functions = {
        "u": u, "y": y, "u^2": u**2, "y^2": y**2, "y^3": y**3, "abs(y)": np.abs(y), "max(y, 0)": np.maximum(y, 0.0),
        "square of the run": run[FITTED:] ** 2, "y dy/dt": y * np.gradient(y),
    }  # fmt: skip
    most = 0.0
    for values in functions.values():
        at, coherence = signal.coherence(unseen, values, RATE, nperseg=STRETCH)
        power = signal.welch(unseen, RATE, nperseg=STRETCH)[1]
        most = max(most, float((coherence * power)[at < BANDS[-1][0]].sum() / power[at < BANDS[-1][0]].sum()))
    stretches = 2 * len(unseen) // STRETCH - 1
    note = (
        f"the most of {len(functions)} functions of input and output; chance leaves some {100 / (0.55 * stretches):.1f}"
    )
    found("part of what lies below 6.4 kHz that moves with any of them", 100.0 * most, "%", note=note)


if __name__ == "__main__":
    main()
