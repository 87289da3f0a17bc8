"""The last fit of a search: the start of most evidence, or of those that do not stand alone on other commands.

    SYSID_DATA=<folder> python -m tests.benchmarks auto_last [--only=tank,motor] [--seeds=0,1,2]
    python -m tests.benchmarks auto_last --only=fitted.csv+tested.csv    # time, input and output of each

For each record of ``auto_beyond`` and of ``auto_choice`` one network is fitted as a search fits it: four times with a
quarter of the blocks held out, from four starts, and once more so from others. These eight models have a middle on
other commands. The network is then fitted to all of the record, from twelve starts and as the mean of eight of twelve,
each with and without asking its starts whether they stand alone there; both are chosen among the same starts. Beside
them stand the trial's own models, that of the first part and the stable one nearest to the middle, and what a search
takes: the mean where the models are apart by more than their error or the errors of starts scatter. All figures are
errors on the test record, root mean squares over the standard deviation of the output, and at the end geometric means
of ratios over records and seeds.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from sysid.estimation import Training, fit_neural_state_space
from sysid.estimation.networks.neural import state_space
from sysid.estimation.stability import FreeRunCheck, StabilityOptions
from sysid.models import AbstractModel, NeuralStateSpace, Start, StartKind
from sysid.traces import Trace
from sysid.workbench.auto.beyond import look_beyond
from sysid.workbench.auto.last_fit import SCATTER
from sysid.workbench.auto.parts import ENSEMBLE, FOLDS, LAST, SEARCH, masked
from sysid.workbench.auto.worth import error, scatter
from tests.benchmarks._findings import found
from tests.benchmarks.auto_beyond import STEPS, off, recorded, trial_of
from tests.benchmarks.auto_choice import MAPPING, PLANTS
from tests.benchmarks.public_neural import trace

SIZES = {"spring": (3, 4), "tanks": (2, 8), "tanks changed": (2, 8), "duffing": (2, 8), "vdp": (2, 8)}
"""States and neurons where two and four are not enough."""
WAYS = ("one start, not alone", "mean", "mean, not alone", "trial, first part", "trial, nearest", "search")
"""Set against what was taken before starts were asked whether they stand alone."""
Vet = Callable[[AbstractModel], bool]


@contextmanager
def raced_once() -> Iterator[None]:
    """Starts are trained once, whatever chooses among them afterwards."""
    race, done = state_space.run_race, list[Any]()

    def once(multistart: Any) -> Any:
        done.extend(race(multistart) if not done else ())
        return list(done)

    state_space.run_race = once
    try:
        yield
    finally:
        state_space.run_race = race


def fitted(record: Trace, size: tuple[int, int], start: Start, seed: int, vet: Vet, **way: int) -> AbstractModel:
    training = Training(**SEARCH | way, choose_by="evidence", workers=1, seed=seed)
    network = NeuralStateSpace(states=size[0], neurons=size[1])
    return fit_neural_state_space([record], MAPPING, network, training, start=start, vet=vet).model


def trials_of(
    record: Trace, size: tuple[int, int], start: Start, seed: int, vet: Vet
) -> tuple[list[AbstractModel], float, float]:
    """Models from all parts and two seeds, the error on what was held out, and how far seeds are apart."""
    models, trials = list[AbstractModel](), []
    for number, own in enumerate((seed, 1_000 * seed + 100), start=1):
        errors = []
        for fold in range(FOLDS):
            some, rest = masked([record], fold, start)
            models.append(fitted(some[0], size, start, own, vet))
            errors.append(off(models[-1], rest[0], start))
        mse = math.exp(sum(map(math.log, errors)) / FOLDS)
        one = trial_of(number, size, mse)
        trials.append(one.model_copy(update={"selection_rms_shares": [math.sqrt(each) for each in errors]}))
    return models, max(map(error, trials)), scatter(trials)


def read(fitted_on: str, tested_on: str) -> tuple[Trace, Trace, Start]:
    """What is fitted, what is tested, and how each run begins, of two files."""
    rows = [np.genfromtxt(one, delimiter=",", skip_header=1) for one in (fitted_on, tested_on)]
    step = float(np.median(np.diff(rows[0][:, 0])))
    first, second = (trace(of, one[:, 1:3], step, "1") for of, one in zip(("fitted", "tested"), rows, strict=True))
    return first, second, Start(kind=StartKind.ESTIMATED)


def compared(given: tuple[str, int]) -> dict[str, float]:
    """One record and seed: test errors of all ways."""
    name, seed = given
    record, tested, start = read(*name.split("+")) if "+" in name else recorded(name)
    size, unit = SIZES.get(name, (2, 4)), float(record["y"].std())
    check = FreeRunCheck.of(StabilityOptions(), MAPPING, [record])
    models, mse, apart = trials_of(record, size, start, seed, check)
    trial = trial_of(1, size, mse)
    beyond = look_beyond([trial], error, lambda _: [[one] for one in models], [record], [1.0], seed=0)
    middle = beyond.middle
    assert middle is not None
    asked = StabilityOptions(also=lambda one: not beyond.alone(one, mse), unless="they stand alone")
    near = FreeRunCheck.of(asked, MAPPING, [record])
    ways = dict[str, AbstractModel]()
    for what, way in (("one start", LAST), ("mean", ENSEMBLE)):
        with raced_once():
            ways[what] = fitted(record, size, start, seed, check, **way)
            ways[f"{what}, not alone"] = fitted(record, size, start, seed, near, **way)
    ways["trial, first part"] = models[0]
    ways["trial, nearest"] = min(filter(check, models), key=lambda one: middle.away([one]), default=models[0])
    several = "mean" if beyond.is_lottery(mse) or apart > SCATTER else "one start"
    ways["before"] = ways["mean" if beyond.tells(mse) or apart > SCATTER else "one start"]
    last = ways[f"{several}, not alone"]
    ways["search"] = last if near(last) or not near(ways["trial, nearest"]) else ways["trial, nearest"]
    errors = {what: math.sqrt(off(model, tested, start)) / unit for what, model in ways.items()}
    return errors | {"held out": math.sqrt(mse) / unit, "apart": math.sqrt(beyond.spread) / unit}


def option(name: str, default: list[str]) -> list[str]:
    given = [one.split("=", 1)[1].split(",") for one in sys.argv if one.startswith(f"--{name}=")]
    return given[0] if given else default


def main() -> None:
    names = option("only", [*STEPS, "tanks", "tanks changed", *PLANTS])
    jobs = [(name, int(seed)) for name in names for seed in option("seeds", ["0", "1"])]
    rows = list[dict[str, float]]()
    with ProcessPoolExecutor(2) as pool:
        for (name, seed), row in zip(jobs, pool.map(compared, jobs), strict=True):
            rows.append(row)
            for what, value in row.items():
                found(f"{name}, seed {seed}: {what}", value)
    for what in WAYS:
        ratios = [math.log(row[what] / row["before"]) for row in rows]
        mean, worst = math.exp(sum(ratios) / len(ratios)), math.exp(max(ratios))
        found(f"{what} over before, geometric mean", mean, note=f"{len(rows)} records and seeds, at most {worst:.2f}")


if __name__ == "__main__":
    main()
