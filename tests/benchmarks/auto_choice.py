"""Rules by which a search may choose, replayed on tables of networks whose error on another record is known.

    SYSID_DATA=<folder> python -m tests.benchmarks auto_choice [--only=tanks,wiener]

Thirteen neural state spaces (states, neurons, regularisation) are fitted as a search fits them: four times with a
quarter of the blocks of a record held out, from four starts each, and to the whole record from twelve starts, once the
start of most evidence and once the mean of the best eight. A rule sees the held-out errors alone. What it chooses is
set against the least error that is in the table, on a record that no fit has seen: ratios, and their geometric mean
over records.

Records: Cascaded Tanks, both ways (what is fitted and what is tested change places), and three simulated plants with
2 % of noise, 1,000 samples each: a Wiener system, Duffing's oscillator, van der Pol's.
"""

from __future__ import annotations

import itertools
import math
import os
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray

from sysid.errors import SysidError
from sysid.estimation import Training, fit_neural_state_space
from sysid.models import Mapping, NeuralStateSpace, Start, StartKind
from sysid.traces import Role, Trace
from sysid.validation import case_results
from sysid.workbench.auto.parts import ENSEMBLE, FOLDS, LAST, SEARCH, masked
from tests.benchmarks._findings import found
from tests.benchmarks._public import checked
from tests.benchmarks.public_neural import trace

SIZES = (*itertools.product(((2, 3), (2, 8), (2, 14), (3, 8)), (1e-3, 3e-2, 0.3)), ((1, 4), 3e-2))
MAPPING = Mapping.parse("u -> y")
Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Row:
    """A network in the table: size, regularisation, errors held out, and of both last fits on the test record."""

    neurons: int
    states: int
    regularisation: float
    held_out: tuple[float, ...]
    single: float
    mean: float

    @property
    def error(self) -> float:
        """Geometric mean of what was held out."""
        return math.exp(float(np.mean(np.log(self.held_out))))

    @property
    def size(self) -> int:
        """Multiplications of a step."""
        return (self.states + 2) * (self.states + self.neurons + 1) + self.states * self.neurons


def held_input(rng: np.random.Generator, least: int, most: int, size: float, n: int = 1000) -> Array:
    """Levels that last for a random number of samples."""
    levels: list[float] = []
    while len(levels) < n:
        levels += [rng.uniform(-size, size)] * int(rng.integers(least, most))
    return np.array(levels[:n])


def wiener(rng: np.random.Generator) -> tuple[Array, Array]:
    u, w = held_input(rng, 4, 30, 2.0), np.zeros(1000)
    for k in range(2, len(u)):
        w[k] = 1.5 * w[k - 1] - 0.6 * w[k - 2] + 0.06 * u[k - 1] + 0.04 * u[k - 2]
    return u, np.tanh(1.5 * w) + 0.2 * w**2


def oscillator(
    rng: np.random.Generator, longest: int, force: Callable[[float, float], float], x: float
) -> tuple[Array, Array]:
    """An input that is held for up to so many samples, and what comes of it."""
    u = held_input(rng, 5, longest, 2.0)
    return u, oscillator_over(u, force, x)


def oscillator_over(u: Array, force: Callable[[float, float], float], x: float) -> Array:
    """Runge and Kutta's rule, four steps a sample of 0.1 s."""
    y, state = np.empty(len(u)), np.array([x, 0.0])
    for k in range(len(u)):
        y[k] = state[0]

        def slope(z: Array, drive: float = u[k]) -> Array:
            return np.array([z[1], force(z[0], z[1]) + drive])

        for _ in range(4):
            a = slope(state)
            b = slope(state + 0.0125 * a)
            c = slope(state + 0.0125 * b)
            state = state + 0.025 / 6.0 * (a + 2.0 * b + 2.0 * c + slope(state + 0.025 * c))
    return y


PLANTS: dict[str, Callable[[np.random.Generator], tuple[Array, Array]]] = {
    "wiener": wiener,
    "duffing": lambda rng: oscillator(rng, 30, lambda q, v: -q - q**3 - 0.3 * v, 0.0),
    "vdp": lambda rng: oscillator(rng, 40, lambda q, v: (1.0 - q**2) * v - q, 0.5),
}


def records(name: str) -> tuple[Trace, Trace, int]:
    """What is fitted, what is tested, and the samples that may be seen first."""
    if name.startswith("tanks"):
        data = np.genfromtxt(checked("cascaded_tanks/dataBenchmark.csv"), delimiter=",", names=True)
        both = [trace(one, np.column_stack([data[f"u{one}"], data[f"y{one}"]]), 4.0, "V") for one in ("Est", "Val")]
        return (*(both if name == "tanks" else both[::-1]), 50)
    made = []
    for of, more in (("fitted", 0), ("tested", 1000)):
        rng = np.random.default_rng(sum(map(ord, name)) + more)
        u, y = PLANTS[name](rng)
        made.append(trace(of, np.column_stack([u, y + 0.02 * y.std() * rng.standard_normal(len(y))]), 0.1, "1"))
    return made[0], made[1], 20


def row(given: tuple[str, tuple[tuple[int, int], float]]) -> Row | None:
    """Fit one network in all ways; ``None`` where one of them fails."""
    name, ((states, neurons), regularisation) = given
    fitted, tested, first = records(name)
    start = Start(kind=StartKind.MEASURED, n_measured=first)
    network = NeuralStateSpace(states=states, neurons=neurons)

    def error(some: Trace, other: Trace, **way: int) -> float:
        training = Training(**SEARCH | way, choose_by="evidence", regularisation=regularisation, workers=1, seed=0)
        model = fit_neural_state_space([some], MAPPING, network, training, start=start).model
        return math.sqrt(case_results(model, other, Role.TEST, start, 1)["y"].free_run.mse / float(np.var(other["y"])))

    try:
        folds = [masked([fitted], fold, start) for fold in range(FOLDS)]
        return Row(
            states=states, neurons=neurons, regularisation=regularisation,
            held_out=tuple(error(some[0], rest[0]) for some, rest in folds),
            single=error(fitted, tested, **LAST), mean=error(fitted, tested, **ENSEMBLE),
        )  # fmt: skip
    except SysidError:
        return None


def within(share: float) -> Callable[[Row, Row], bool]:
    return lambda one, best: one.error <= (1.0 + share) * best.error


def one_standard_error(one: Row, best: Row) -> bool:
    by = np.log(one.held_out) - np.log(best.held_out)
    return bool(by.mean() <= by.std(ddof=1) / math.sqrt(len(by)))


def smallest(one: Row) -> tuple[float, float]:
    return one.size, one.error


def strongest(one: Row) -> tuple[float, float]:
    return -one.regularisation, one.error


RULES = {
    "least error": (within(0.0), smallest),
    "smallest within 3 %": (within(0.03), smallest),
    "smallest within 10 %": (within(0.1), smallest),
    "smallest within one standard error": (one_standard_error, smallest),
    "strongest regularisation within 3 %": (within(0.03), strongest),
    "strongest regularisation within 15 %": (within(0.15), strongest),
    "strongest regularisation within one standard error": (one_standard_error, strongest),
}


def chosen(table: list[Row], rule: str) -> Row:
    """What a rule chooses by what was held out."""
    alike, order = RULES[rule]
    best = min(table, key=lambda one: one.error)
    return min((one for one in table if one is best or alike(one, best)), key=order)


def main() -> None:
    only = [argument.split("=")[1].split(",") for argument in sys.argv if argument.startswith("--only=")]
    names = only[0] if only else ["tanks", "tanks changed", *PLANTS]
    tables: dict[str, list[Row]] = {}
    for name in names:
        with ProcessPoolExecutor(2) as pool:
            tables[name] = [one for one in pool.map(row, [(name, size) for size in SIZES]) if one is not None]
        by = [math.log(one.mean / one.single) for one in tables[name]]
        found(
            f"{name}: error of the mean of starts over that of one",
            math.exp(float(np.mean(by))),
            note=f"{len(by)} networks",
        )
    for last in ("single", "mean"):
        what = {"single": "the start of most evidence", "mean": "the mean of eight of twelve starts"}[last]
        for rule in RULES:
            ratios = [
                getattr(chosen(table, rule), last) / min(min(one.single, one.mean) for one in table)
                for table in tables.values()
            ]
            each = ", ".join(f"{name} {ratio:.2f}" for name, ratio in zip(tables, ratios, strict=True))
            found(
                f"{rule}, then {what}: times the least error of the table",
                math.exp(float(np.mean(np.log(ratios)))),
                note=each,
            )


if __name__ == "__main__":
    main()
