"""Networks of lagged regressors on short records: with the second, cautious fit and without it.

    [SYSID_DATA=<folder>] python -m tests.benchmarks short_records [--samples=500] [--noise=0.05] [--seeds=0,1,2]
    [SYSID_DATA=<folder>] python -m tests.benchmarks short_records --starts=5 [--only=measured]

NARX 4/4/10 (109 parameters for one input) is fitted in free run, 300 iterations from one start a seed, without
selection traces. *Plants*: those of ``tests/references/strange_plants.py`` as ``auto_plants`` records them, with white
noise, and with noise of the same size that persists (an autoregression, 0.9 from sample to sample). *Measured*, where
the folder is given: the Cascaded Tanks, the Coupled Electric Drives and the hair dryer, fitted on one record (the dryer
300 samples) and tested on the others, each from 20 measured samples. Figures are fits in percent on what was not
fitted, of the plants the mean over unseen levels and ramps.

With several starts it is asked which of them is taken: the one of most evidence, the one in the middle of all on the
inputs backwards (what is done), or the mean of all but one at most (``ensemble``).
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from unittest import mock

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from scipy import signal

from sysid.estimation import Training, fit_narx
from sysid.estimation.networks.starts import multistart
from sysid.ingest import load_dataset
from sysid.models import NARX, Mapping, Start, StartKind
from sysid.traces import Role, Trace
from sysid.validation import case_results
from tests.benchmarks._findings import found
from tests.benchmarks.auto_plants import records
from tests.references.strange_plants import PLANTS

NETWORK = NARX(input_delays=4, output_delays=4, neurons=10)
PERSISTS, ITERATIONS, MEASURED = 0.9, 300, Start(kind=StartKind.ESTIMATED, n_measured=20)

Task = tuple[str, list[Trace], list[Trace], Mapping, Start]


def plants(samples: int, noise: float, persists: float) -> Iterator[Task]:
    """The plants with noise that persists from sample to sample, or not."""
    for name in PLANTS:
        clean, levels, ramps, mapping = records(name, samples, 0.0)
        white = np.random.default_rng(sum(map(ord, name))).standard_normal(samples + 100)
        coloured = signal.lfilter([1.0], [1.0, -persists], white)[100:]
        values = clean.values.copy()
        values[:, -1] += noise * values[:, -1].std() / coloured.std() * coloured
        yield name, [replace(clean, values=values)], [levels, ramps], mapping, Start()


def measured() -> Iterator[Task]:
    """Three measured systems, fitted on one part and tested on the other."""
    (tanks, tested), drives = load_dataset("cascaded-tanks"), list(load_dataset("coupled-drives"))
    dryer = list(load_dataset("hair-dryer"))
    for name, fit, test in (
        ("tanks", [tanks], [tested]),
        ("drives", drives[:1], drives[1:]),
        ("hair dryer", dryer[:1], dryer[1:]),
    ):
        *inputs, output = (channel.name for channel in fit[0].channels)
        yield name, fit, test, Mapping.parse(f"{'+'.join(inputs)} -> {output}"), MEASURED


def followed(task: Task, training: Training) -> tuple[float, float]:
    """The mean fit on what was not fitted, in percent, and processor seconds."""
    _, fit, test, mapping, start = task
    began = time.process_time()
    model = fit_narx(fit, mapping, NETWORK, training, start=start).model
    took = time.process_time() - began
    fits = []
    for trace in test:
        run = case_results(model, trace, Role.TEST, start, 1)[mapping.output].free_run
        fits.append(max(100.0 * (1.0 - np.sqrt(run.mse / np.var(trace[mapping.output]))), -100.0))
    return float(np.mean(fits)), took


def ways(starts: int) -> Iterator[tuple[str, float, Training]]:
    """What is compared: in words, below how many samples a parameter a record is short, and how it is trained."""
    plain = Training(max_iterations=ITERATIONS, workers=1, starts=starts)
    if starts == 1:
        yield "fitted once", 0.0, plain
        yield "fitted twice", multistart.SHORT, plain
        return
    yield f"of {starts} starts the one of most evidence", multistart.SHORT, replace(plain, choose_by="evidence")
    yield f"of {starts} starts the one in the middle", multistart.SHORT, plain
    yield f"the mean of {starts - 1} of {starts} starts", multistart.SHORT, replace(plain, ensemble=starts - 1)


def compare(title: str, tasks: list[Task], seeds: list[int], starts: int) -> None:
    """Medians and quartiles of each way."""
    for words, short, training in ways(starts):
        with mock.patch.object(multistart, "SHORT", short):
            rows = [followed(task, replace(training, seed=starts * seed)) for task in tasks for seed in seeds]
        for task, begin in zip(tasks, range(0, len(rows), len(seeds)), strict=True):
            own = " ".join(f"{fit:7.1f}" for fit, _ in rows[begin : begin + len(seeds)])
            print(f"{title}, {words:5} {task[0]:32} {own}", flush=True)
        low, middle, _ = statistics.quantiles([fit for fit, _ in rows], n=4)
        mean, took = statistics.mean(fit for fit, _ in rows), statistics.median(seconds for _, seconds in rows)
        note = f"lower quartile {low:.1f} %, mean (none below -100) {mean:.1f} %, {took:.2f} s of processor time a fit"
        found(f"{title}, {words}: median fit on what was not fitted", middle, "%", note=note)


def main(samples: int, noise: float, seeds: list[int], starts: int, only: str) -> None:
    """Plants with white noise and with noise that persists; measured records where they are there."""
    for words, persists in () if only == "measured" else (("white noise", 0.0), ("noise that persists", PERSISTS)):
        compare(f"{samples} samples, {words}", list(plants(samples, noise, persists)), seeds, starts)
    if os.environ.get("SYSID_DATA"):
        compare("measured", list(measured()), seeds, starts)


if __name__ == "__main__":
    options = dict(argument[2:].split("=") for argument in sys.argv if argument.startswith("--") and "=" in argument)
    main(
        int(options.get("samples", 500)),
        float(options.get("noise", 0.05)),
        [int(seed) for seed in options.get("seeds", "0,1,2").split(",")],
        int(options.get("starts", 1)),
        options.get("only", ""),
    )
