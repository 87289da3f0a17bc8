"""What models that did alike say of commands that a record does not show, beside their error on such commands.

    SYSID_DATA=<folder> python -m tests.benchmarks auto_beyond [--only=tank,motor]

Four plants are recorded over few long steps, each of which comes to rest before the next, with 2 % of noise: a tank
below a tank, a motor with a dead zone and drag, Duffing's spring, and a mass whose damping differs by direction, the
last once more with steps between two levels alone. They are tested over steps that follow sooner, between levels of the
same range. Beside them stand the records of ``auto_choice``, whose inputs move all the time.

Seven networks are fitted as a search fits them: four times with a quarter of the blocks of the record held out, from
four starts. ``look_beyond`` compares these 28 models as a search does. The networks that a search would choose with and
without it are then fitted to all of the record, as the mean of eight of twelve starts, and run over the test record.
All figures are root mean squares over the standard deviation of the record's output.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from sysid.estimation import Training, fit_neural_state_space
from sysid.models import AbstractModel, NeuralStateSpace, Start, StartKind
from sysid.reporting.sweep_record import Trial
from sysid.traces import Role, Trace
from sysid.validation import case_results
from sysid.workbench.auto.beyond import look_beyond
from sysid.workbench.auto.parts import ENSEMBLE, FOLDS, SEARCH, masked
from sysid.workbench.auto.words import choose
from sysid.workbench.auto.worth import error
from tests.benchmarks._findings import found
from tests.benchmarks.auto_choice import MAPPING, PLANTS, Array, oscillator_over, records
from tests.benchmarks.public_neural import trace

SIZES = ((2, 2), (2, 4), (2, 8), (3, 4), (3, 8), (1, 4), (4, 4))


def tank(u: Array) -> Array:
    """A level below a level, through square roots."""
    upper = lower = 0.5
    y = np.empty(len(u))
    for k in range(len(u)):
        for _ in range(4):
            upper += 0.03 * ((2.0 + 1.5 * u[k]) / 3.0 - math.sqrt(max(upper, 0.0)))
            lower += 0.03 * (math.sqrt(max(upper, 0.0)) - math.sqrt(max(lower, 0.0)))
        y[k] = lower
    return y


def motor(u: Array) -> Array:
    """A voltage with a dead zone and a limit, and drag that grows with the square of the speed."""
    speed = current = 0.0
    y = np.empty(len(u))
    for k in range(len(u)):
        current += 0.1 * (math.copysign(max(abs(u[k]) - 0.2, 0.0), u[k]) - current)
        speed += 0.05 * (math.tanh(2.0 * current) - speed - 0.5 * speed * abs(speed))
        y[k] = speed
    return y


STEPS: dict[str, Callable[[Array], Array]] = {
    "tank": tank,
    "motor": motor,
    "spring": lambda u: oscillator_over(1.5 * u, lambda q, v: -q - q**3 - 0.5 * v, 0.0),
    "damper": lambda u: oscillator_over(u, lambda q, v: -q - (0.8 + 0.6 * math.tanh(3.0 * v)) * v, 0.0),
    "damper, two levels": lambda u: oscillator_over(u, lambda q, v: -q - (0.8 + 0.6 * math.tanh(3.0 * v)) * v, 0.0),
}


def steps(rng: np.random.Generator, shortest: int, longest: int, *, two: bool) -> Array:
    """Levels, each held for a random number of samples."""
    levels: list[float] = []
    while len(levels) < 1000:
        level = float(rng.choice([-0.7, 0.7])) if two else float(rng.uniform(-1.0, 1.0))
        levels += [level] * int(rng.integers(shortest, longest))
    return np.array(levels[:1000])


def recorded(name: str) -> tuple[Trace, Trace, Start]:
    """What is fitted, what is tested, and how each run begins."""
    if name not in STEPS:
        fitted, tested, first = records(name)
        return fitted, tested, Start(kind=StartKind.MEASURED, n_measured=first)
    made, level = list[Trace](), 0.0
    for of, seed, held in (("fitted", 0, (100, 260)), ("tested", 1000, (30, 120))):
        rng = np.random.default_rng(sum(map(ord, name)) + seed)
        u = steps(rng, *held, two="two" in name)
        y = STEPS[name](u)
        level = level or 0.02 * float(y.std())
        made.append(trace(of, np.column_stack([u, y + level * rng.standard_normal(len(y))]), 0.1, "1"))
    return made[0], made[1], Start(kind=StartKind.ESTIMATED)


def fit(record: Trace, size: tuple[int, int], start: Start, **way: int) -> AbstractModel:
    training = Training(**SEARCH | way, choose_by="evidence", workers=1, seed=0)
    network = NeuralStateSpace(states=size[0], neurons=size[1])
    return fit_neural_state_space([record], MAPPING, network, training, start=start).model


def off(model: AbstractModel, record: Trace, start: Start) -> float:
    """Mean square of the free run."""
    return float(case_results(model, record, Role.TEST, start, 1)["y"].free_run.mse)


def held_out(given: tuple[str, tuple[int, int]]) -> tuple[list[AbstractModel], float]:
    """The models of one network, part by part, and the geometric mean of their mean squares on what was held out."""
    name, size = given
    record, _, start = recorded(name)
    models, errors = list[AbstractModel](), list[float]()
    for fold in range(FOLDS):
        some, rest = masked([record], fold, start)
        models.append(fit(some[0], size, start))
        errors.append(off(models[-1], rest[0], start))
    return models, math.exp(float(np.mean(np.log(errors))))


def last(given: tuple[str, tuple[int, int]]) -> float:
    name, size = given
    record, tested, start = recorded(name)
    return off(fit(record, size, start, **ENSEMBLE), tested, start)


def trial_of(number: int, size: tuple[int, int], mse: float) -> Trial:
    network = NeuralStateSpace(states=size[0], neurons=size[1])
    return Trial(
        number=number, key=str(number), label=network.label, structure=network.to_dict(), status="CONVERGED",
        usable=True, operations=(size[0] + 2) * (size[0] + size[1] + 1) + size[0] * size[1],
        selection_free_run_mse=mse,
    )  # fmt: skip


def compared(name: str, pool: ProcessPoolExecutor) -> None:
    """One record."""
    record, _, _ = recorded(name)
    rows = list(pool.map(held_out, [(name, size) for size in SIZES]))
    trials = [trial_of(k, size, mse) for k, (size, (_, mse)) in enumerate(zip(SIZES, rows, strict=True), start=1)]

    def fitted(one: Trial) -> list[list[AbstractModel]]:
        return [[model] for model in rows[one.number - 1][0]]

    def first(some: Sequence[Trial]) -> tuple[Trial, int]:
        return some[0], 0

    beyond = look_beyond(trials, error, fitted, [record], [1.0], seed=0)
    ways = [choose(trials, error, first, beyond=one).chosen for one in (lambda _: 0.0, beyond.of)]
    done = list(pool.map(last, [(name, SIZES[one.number - 1]) for one in ways]))
    unit = float(record["y"].std())
    without, with_it = (math.sqrt(mse) / unit for mse in done)
    own = math.sqrt(error(ways[1])) / unit
    told = "told" if beyond.tells(error(ways[1])) else "not told"
    found(f"{name}: error on other commands of what is chosen by both", with_it, note=f"{ways[1].label}; {told}")
    found(f"{name}: by what was held out alone", without, note=ways[0].label)
    found(f"{name}: error on what was held out", own, note="of what is chosen by both")
    found(f"{name}: distance from the middle of all", math.sqrt(beyond.spread) / unit, note=f"{beyond.models} models")


def main() -> None:
    only = [argument.split("=")[1].split(",") for argument in sys.argv if argument.startswith("--only=")]
    with ProcessPoolExecutor(2) as pool:
        for name in only[0] if only else [*STEPS, "tanks", "tanks changed", *PLANTS]:
            compared(name, pool)


if __name__ == "__main__":
    main()
