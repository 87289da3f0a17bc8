"""Times of the linear estimators: order search, finalists, a large transfer function, the cost of its gradient.

    python -m tests.benchmarks linear

20,000 samples, two inputs; medians after one run that compiles. One BLAS thread; searches use two threads. Times are
processor times of all threads together, which other work on the machine hardly changes.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.signal import lfilter

from sysid.estimation import fit_transfer_function
from sysid.estimation.linear.order_grid import OrderGrid
from sysid.estimation.linear.order_search import search_orders
from sysid.estimation.linear.time_record import TimeRecord
from sysid.estimation.linear.variable_projection import PoleParameters, SeparableProvider
from sysid.models import Domain, Mapping, TransferFunction
from sysid.traces import Channel, Trace
from sysid.validation.order_finalists import run_finalists
from tests.benchmarks._findings import found

SAMPLES = 20_000
CHANNELS = tuple(Channel(name=name, unit="1") for name in ("u1", "u2", "y"))
MAPPING = Mapping.parse("u1+u2 -> y")
POLES = 20
NOTE = "the published search had 252,301"


def median(action: Callable[[int], object], repeats: int) -> float:
    """Median seconds of some runs, after one that warms up."""
    action(-1)
    seconds = []
    for i in range(repeats):
        began = time.process_time()
        action(i)
        seconds.append(time.process_time() - began)
    return float(np.median(seconds))


def modes(u: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Ten pairs of poles with moduli between 0.85 and 0.995."""
    total = np.zeros(len(u))
    for _ in range(POLES // 2):
        r, w = rng.uniform(0.85, 0.995), rng.uniform(0.01, 1.0)
        total += lfilter([0.0, rng.normal(), rng.normal()], [1.0, -2 * r * np.cos(w), r * r], u) * (1.0 - r)
    return total


def trace(seed: int = 3) -> Trace:
    """Steps of 20 samples through 20 poles per input, with noise 40 dB below."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.normal(size=(SAMPLES // 20, 2)), 20, axis=0)
    u[:20] = 0.0  # at rest before the record, as the fit assumes
    y = modes(u[:, 0], rng) + modes(u[:, 1], rng)
    y += 0.01 * y.std() * rng.normal(size=SAMPLES)
    return Trace(name="t", sample_time=1.0, channels=CHANNELS, values=np.column_stack([u, y]))


def searches() -> None:
    """The order search at the size of the published one, and its finalists on five cases."""
    data = [trace()]
    cases = [Trace(name=f"c{k}", sample_time=1.0, channels=CHANNELS, values=trace(k).values) for k in range(5)]
    grid = OrderGrid(max_na=30, max_nb=30, max_nk=4)
    losses = search_orders(data, MAPPING, grid)
    seconds = median(lambda _: search_orders(data, MAPPING, grid), 5)
    found(f"one-step losses of {len(losses):,} ARX candidates", seconds, "s", target=20.0, note=NOTE)
    began = time.process_time()
    search_orders(data, MAPPING, grid)
    finalists = run_finalists(losses, data, MAPPING, cases, count=500)
    seconds = time.process_time() - began
    note = f"{finalists.unstable} ran away"
    found("the search and 500 finalists on five cases in free run", seconds, "s", target=180.0, note=note)


def gradient() -> None:
    """Seconds of a filter pass, in the output and in its gradient, beside SciPy's filter of the same order."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.normal(size=(SAMPLES // 10, 2)), 10, axis=0)
    record = TimeRecord(
        inputs=np.asfortranarray(u), past=u[0], target=rng.normal(size=SAMPLES), root_weights=np.ones(SAMPLES),
        domain=Domain.DISCRETE, sample_time=1.0, free_start=False,
        moving=(False, False),
    )  # fmt: skip
    poles = PoleParameters(n_poles=(POLES, POLES), domain=Domain.DISCRETE, stable=True)
    provider = SeparableProvider(poles=poles, n_zeros=(POLES - 1, POLES - 1), records=(record,), constant=True)
    theta = 0.7 * rng.normal(size=2 * POLES)
    solution = provider.separated(theta)
    if solution is None:
        raise RuntimeError("the benchmark's model runs away")
    columns, weights = solution.columns[0], solution.weights[:-1]
    passes = POLES  # two inputs, a section of second order for every two poles
    output = median(lambda _: record.columns(solution.bases), 21) / passes
    tangents = median(lambda _: record.tangents(solution.bases, columns, weights), 21) / passes
    scipy = median(lambda _: lfilter([1.0], [1.0, -0.5, 0.2], u[:, 0]), 101)
    note = f"output {1e6 * output:.0f}, gradient {1e6 * tangents:.0f}, lfilter {1e6 * scipy:.0f} µs a pass"
    found("gradient, divided by SciPy's lfilter, per filter pass", tangents / scipy, "x", target=2.0, note=note)
    step = median(lambda i: provider.linearise(theta + 1e-9 * (i + 2)), 7)
    found("whole linearisation, 40 poles and 41 linear parameters", 1e3 * step, "ms")


def large_fit() -> None:
    """20 poles for each of two inputs."""
    data = trace()
    orders = TransferFunction(poles=(POLES, POLES), zeros=(POLES - 1, POLES - 1), delays=(1, 1))
    began = time.process_time()
    fit = fit_transfer_function([data], MAPPING, orders, rest_output=0.0)
    seconds = time.process_time() - began
    y = data["y"]
    left = float(np.sqrt(fit.history["mse"][-1]) / y.std())
    steps = len(fit.history["mse"]) - 1
    note = f"{fit.status.name}, {steps} steps; residual {100 * left:.2f} % of the output, noise 1 %"
    found("transfer function, 20 poles, two inputs", seconds, "s", target=30.0, note=note)


def main() -> None:
    """All of them."""
    searches()
    gradient()
    large_fit()


if __name__ == "__main__":
    main()
