"""10 million steps in the formats of C: no drift from the model, and what numbers near zero cost.

    python -m tests.benchmarks export_long

One NARX 4/4/20 with random weights, inputs held for 50 samples each, in ten calls that hand the state on; and a linear
model whose inputs stop, so that its state decays until numbers are denormal. Other formats are not run for so long
here. Processor time.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from sysid.export import EXPORTERS, Surrogate
from sysid.models import NARX
from tests.benchmarks._findings import found
from tests.benchmarks.export import RANGES, build
from tests.export.single_models import build_arx

STEPS, CALLS, HELD = 10_000_000, 10, 50
ALLOWED = {"c": 1e-9, "c-float32": 1e-3, "cpp": 1e-9}


def pieces(name: str, surrogate: Surrogate, inputs: list[np.ndarray]) -> list[tuple[np.ndarray, float]]:
    """Outputs and seconds of calls that hand the state on."""
    with tempfile.TemporaryDirectory() as folder:
        file = EXPORTERS[name].write(surrogate, Path(folder))[0]
        run = EXPORTERS[name].load(file, Path(folder))
        state, taken = surrogate.at_rest(inputs[0][0])[np.newaxis], []
        for one in inputs:
            begin = time.process_time()
            ran = run(one[:, np.newaxis], state)
            taken.append((ran.output[:, 0, 0], time.process_time() - begin))
            state = ran.state
    return taken


def drift() -> None:
    """The first tenth and the last, beside the model."""
    surrogate = Surrogate.of(build("BP+AR -> BC", NARX(input_delays=4, output_delays=4, neurons=20), 2), RANGES)
    levels = np.random.default_rng(7).uniform([0.0, 50.0], [90.0, 90.0], (STEPS // HELD, 2))
    u = np.repeat(levels.astype(np.float32).astype(np.float64), HELD, axis=0)
    expected = np.split(surrogate.simulate(u)[:, 0], CALLS)
    for name, allowed in ALLOWED.items():
        taken = pieces(name, surrogate, np.split(u, CALLS))
        apart = [float(np.abs(y - own).max()) for (y, _), own in zip(taken, expected, strict=True)]
        note = f"{apart[0]:.1e} in the first tenth, {apart[-1]:.1e} in the last"
        found(f"{name}: largest difference over {STEPS:,} steps", max(apart), "psi", target=allowed, note=note)
        found(f"{name}: {STEPS:,} steps", sum(seconds for _, seconds in taken), "s")


def denormals() -> None:
    """A million samples without input after two with it: how much slower."""
    surrogate = Surrogate.of(replace(build_arx(na=2, nb=(2,), nk=(1,)), intercept=0.0, rest_output=0.0))
    moved = np.random.default_rng(7).uniform(0.0, 90.0, (1_000_000, 1))
    for name in ("c", "c-float32"):
        _, (_, driven), (_, first), (_, second) = pieces(name, surrogate, [moved, moved, 0.0 * moved, 0.0 * moved])
        note = (
            f"{1e3 * driven:.1f} ms a million samples driven, {1e3 * first:.1f} and {1e3 * second:.1f} ms without input"
        )
        found(f"{name}: a state that has decayed, over one that is driven", second / driven, "x", note=note)


def main() -> None:
    """Drift, then denormals."""
    drift()
    denormals()


if __name__ == "__main__":
    main()
