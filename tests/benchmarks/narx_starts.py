"""How soon the free run of a network of lagged regressors follows its record, and what it is worth elsewhere.

    python -m tests.benchmarks narx_starts [--samples=2000] [--noise=0.05] [--seeds=0,1] [--iterations=150]

The plants of ``tests/references/strange_plants.py`` as ``auto_plants`` records them. NARX 4/4/10 is fitted in free run
from one start a seed. Figures are fits in percent, as of MATLAB's ``compare``: over the record after 0, 5 and 20
iterations and at the end, and over two records that were not seen. With noise of 5 % no model of the plant itself has
more than 95 % over its record.
"""

from __future__ import annotations

import os
import statistics
import sys
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from sysid.estimation import FitProgress, Training, fit_narx
from sysid.models import NARX
from tests.benchmarks._findings import found
from tests.benchmarks.auto_plants import followed, records
from tests.references.strange_plants import PLANTS

NETWORK = NARX(input_delays=4, output_delays=4, neurons=10)
LOOKS = (0, 5, 20)


def fitted(name: str, seed: int, iterations: int, samples: int, noise: float) -> tuple[float, ...]:
    """Fits at the looks, at the end and over two unseen records, in percent; and processor seconds."""
    record, levels, ramps, mapping = records(name, samples, noise)
    errors: list[float] = []

    def watch(progress: FitProgress) -> None:
        errors.append(progress.mse)

    began = time.process_time()
    training = Training(seed=seed, max_iterations=iterations, workers=1)
    fit = fit_narx([record], mapping, NETWORK, training, on_progress=watch)
    took = time.process_time() - began
    least = np.minimum.accumulate(errors)
    shares = [*(least[min(look, len(least) - 1)] for look in LOOKS), fit.history["mse"][-1]]
    own = [100.0 * (1.0 - float(np.sqrt(share / np.var(record[mapping.output])))) for share in shares]
    return (*own, followed(fit.model, levels), followed(fit.model, ramps), took)


def main(samples: int, noise: float, seeds: list[int], iterations: int) -> None:
    """All plants, then medians and quartiles."""
    rows = []
    for name in PLANTS:
        for seed in seeds:
            rows.append(fitted(name, seed, iterations, samples, noise))
            print(f"{name:32} {seed}  " + " ".join(f"{one:7.1f}" for one in rows[-1]), flush=True)
    titles = [*(f"after {look} iterations" for look in LOOKS), "at the end", "unseen levels", "unseen ramps"]
    for title, column in zip(titles, zip(*rows, strict=True), strict=False):
        low, middle, _ = statistics.quantiles(column, n=4)
        found(f"NARX 4/4/10, {samples} samples, {title}: median fit", middle, "%", note=f"lower quartile {low:.1f} %")
    found("processor time of a fit, median", statistics.median(row[-1] for row in rows), "s")


if __name__ == "__main__":
    options = dict(argument[2:].split("=") for argument in sys.argv if argument.startswith("--") and "=" in argument)
    main(
        int(options.get("samples", 2000)),
        float(options.get("noise", 0.05)),
        [int(seed) for seed in options.get("seeds", "0,1").split(",")],
        int(options.get("iterations", 150)),
    )
