"""How the price of one closed-loop epoch grows: 5,000 to 100,000 samples, 50 to 1,000 parameters.

Run with ``python -m tests.benchmarks growth``. One epoch is a free run, its exact sensitivities and the normal
equations, of a network with lags 0 to 1 of two inputs and one lag of the output, in one thread. Times are those of the
thread, least of five, so that other programs disturb them little. Two tables: milliseconds, and the share of the
machine's own rate of matrix products that the whole epoch reaches, counting ``p (p + 1)`` operations a sample for the
normal equations, ``2 p (1 + n_l)`` for the recursion of the rows and ``2 k (r + 2)`` for the run of ``k`` neurons.
Below, the exponent of the growth with the samples (1 is linear) and the memory that grows with them.
"""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable

import numpy as np
from threadpoolctl import threadpool_limits

from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.records.experiment import Experiment
from sysid.models import NARX, History, Recursion, Scaling, parameter_count

SAMPLES = (5_000, 10_000, 20_000, 50_000, 100_000)
NEURONS = (6, 14, 28, 71, 142)
REPEATS = 5


def least_ms(call: Callable[[], object]) -> float:
    """Least time of this thread in milliseconds, after one call that warms up."""
    call()
    spent = []
    for _ in range(REPEATS):
        began = time.thread_time()
        call()
        spent.append(time.thread_time() - began)
    return 1e3 * min(spent)


def epoch(samples: int, neurons: int) -> tuple[RecursionProvider, np.ndarray]:
    """A provider over a random record, and parameters whose free run is tame."""
    rng = np.random.default_rng(0)
    lags = NARX(input_delays="0:1", output_delays=1, neurons=neurons).lags(2)
    theta = 0.05 * rng.standard_normal(parameter_count(lags, neurons, linear=True))
    template = Recursion(lags=lags, neurons=neurons, theta=theta, scaling=Scaling.identity(2), low=-3.0, high=3.0)
    record = Experiment(
        inputs=rng.uniform(-1, 1, (samples, 2)),
        output=rng.uniform(-1, 1, samples),
        history=History.at_rest(inputs=[0.0, 0.0], output=0.0),
    )
    return RecursionProvider(template=template, experiments=(record,), closed=True), theta


def epoch_ms(samples: int, neurons: int) -> float:
    """Milliseconds of one epoch."""
    provider, theta = epoch(samples, neurons)
    return least_ms(lambda: provider.linearise(theta))


def operations(samples: int, parameters: int, neurons: int) -> float:
    """Floating-point operations of an epoch that cannot be saved."""
    return samples * (parameters * (parameters + 1.0) + 2.0 * parameters * 2 + 2.0 * neurons * 7)


def peak_mb(samples: int, neurons: int) -> float:
    """Largest memory that an epoch allocates, in MB."""
    provider, theta = epoch(samples, neurons)
    tracemalloc.start()
    provider.linearise(theta)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / 1e6


def main() -> None:
    """Both tables."""
    square = np.random.default_rng(2).standard_normal((1500, 1500))
    rate = 2 * 1500**3 / least_ms(lambda: square @ square) / 1e6
    sizes = [len(epoch(10, neurons)[1]) for neurons in NEURONS]
    table = np.array([[epoch_ms(n, k) for n in SAMPLES] for k in NEURONS])
    print(f"matrix product of this machine, one thread: {rate:.0f} Gflop/s")
    print("\nmilliseconds an epoch\n| parameters | " + " | ".join(f"{n:,}" for n in SAMPLES) + " samples | exponent |")
    print("|---|" + "---|" * (len(SAMPLES) + 1))
    for size, row in zip(sizes, table, strict=True):
        exponent = np.polyfit(np.log(SAMPLES), np.log(row), 1)[0]
        print(f"| {size} | " + " | ".join(f"{ms:.3g}" for ms in row) + f" | {exponent:.2f} |")
    print("\nshare of the matrix-product rate [%]\n| parameters | " + " | ".join(f"{n:,}" for n in SAMPLES) + " |")
    print("|---|" + "---|" * len(SAMPLES))
    for size, neurons, row in zip(sizes, NEURONS, table, strict=True):
        shares = [100.0 * operations(n, size, neurons) / ms / 1e6 / rate for n, ms in zip(SAMPLES, row, strict=True)]
        print(f"| {size} | " + " | ".join(f"{share:.0f}" for share in shares) + " |")
    few, many = peak_mb(SAMPLES[0], NEURONS[2]), peak_mb(SAMPLES[-1], NEURONS[2])
    jacobian = 8e-6 * SAMPLES[-1] * sizes[2]
    print(f"\nmemory of an epoch at {sizes[2]} parameters: {few:.1f} MB at {SAMPLES[0]:,} samples, {many:.1f} MB at")
    print(f"{SAMPLES[-1]:,}; the whole Jacobian would be {jacobian:.0f} MB")


if __name__ == "__main__":
    with threadpool_limits(1, "blas"):
        main()
