"""Ensembles of neural state spaces on two public benchmarks, beside single starts of the same structure.

    SYSID_DATA=<folder> python -m tests.benchmarks public_ensembles

Structures and regularisation are those that `public_neural` chose on parts of the training records; nothing is chosen
here. Of five and of twelve starts, on the whole training records, the one with the least training error stands beside
the mean of the best eight of twelve less those that stand alone (`ensemble: 8`). Seeds 0, 1 and 2, no start in two of
them; test records are read once, after each fit. More starts find a lesser training error, and on the tanks a larger
one on the test record: what the record does not show is then fitted too.

Published: Champneys et al., "Baseline results for selected nonlinear system identification benchmarks",
arXiv 2405.10779, and its references; there n is 5 on the tanks and 4 on the drives.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from statistics import median

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from sysid.estimation import Training, fit_neural_state_space
from sysid.models import NeuralStateSpace, Start, StartKind
from sysid.traces import Trace
from tests.benchmarks._findings import found
from tests.benchmarks._public import checked
from tests.benchmarks.public_neural import MAPPING, SOURCE, piece, rmse, trace

SEEDS = (0, 1, 2)
ITERATIONS = 200
WAYS = (("best of five starts", 5, 1), ("best of twelve starts", 12, 1), ("mean of eight of twelve starts", 12, 8))
"""What it is called, how many starts there are, and how many are united at most."""
TANKS = (NeuralStateSpace(states=2, neurons=12), 0.3)
DRIVES = (NeuralStateSpace(states=3, neurons=4, output="absolute"), 0.003)


def compared(
    title: str,
    records: Sequence[Trace],
    row: tuple[NeuralStateSpace, float],
    tests: Sequence[tuple[str, Trace, int, float | None, str]],
    *,
    n_initial: int,
    unit: str,
) -> None:
    """Fit single starts and ensembles, and tell the median over seeds of each test record."""
    print(f"{title}: {row[0].label}, regularisation {row[1]:g}")
    start = Start(kind=StartKind.MEASURED, n_measured=n_initial)
    for what, starts, members in WAYS:
        errors: list[list[float]] = [[] for _ in tests]
        for seed in SEEDS:
            began = time.process_time()
            training = Training(
                starts=starts, seed=100 * seed, max_iterations=ITERATIONS, patience=20, regularisation=row[1],
                workers=2, ensemble=members,
            )  # fmt: skip
            model = fit_neural_state_space(records, MAPPING, row[0], training, start=start).model
            took = f"{model.n_parameters} parameters, {time.process_time() - began:.0f} s of processor time"
            print(f"  {what}, seed {seed}: {model.label}, {took}")
            for values, (_, record, n, _, _) in zip(errors, tests, strict=True):
                values.append(rmse(model, record, n))
        for values, (name, _, n, target, published) in zip(errors, tests, strict=True):
            spread = f"median of seeds {', '.join(map(str, SEEDS))}: {', '.join(f'{one:.3g}' for one in values)}"
            aim = target if members > 1 else None
            known = f"{published} ({SOURCE})" if aim else ""  # once: rows of public_neural have it too
            title = f"{name}, {what}, n = {n}"
            found(title, median(values), unit, target=aim, published=known, note=spread)


def tanks() -> None:
    data = np.genfromtxt(checked("cascaded_tanks/dataBenchmark.csv"), delimiter=",", names=True)
    training = trace("estimation", np.column_stack([data["uEst"], data["yEst"]]), 4.0, "V")
    test = trace("test", np.column_stack([data["uVal"], data["yVal"]]), 4.0, "V")
    published = "neural 0.306 to 0.396, grey box 0.191, n = 5"
    rows = [("Cascaded Tanks", test, n, 0.25, published) for n in (50, 5)]
    compared("Cascaded Tanks, RMSE in V", [training], TANKS, rows, n_initial=50, unit="V")


def drives() -> None:
    data = np.genfromtxt(checked("ced/DATAUNIF.csv"), delimiter=",", names=True)
    whole = [trace(n, np.column_stack([data[f"u1{n}"], data[f"z1{n}"]]), 0.02, "1") for n in "12"]
    rows = [
        (f"Coupled Electric Drives, record {record.name}", piece(record, 400, 500), n, None, "")
        for record in whole
        for n in (10, 4)
    ]
    training = [piece(record, 0, 400) for record in whole]
    compared("Coupled Electric Drives, RMSE in ticks/s", training, DRIVES, rows, n_initial=10, unit="ticks/s")


if __name__ == "__main__":
    tanks()
    drives()
