"""A neural state space beside jax-sysid's of the same states and neurons: what each has after the same processor time.

    python -m tests.benchmarks state_space_peers [--cap=30] [--workers=2]

BP+AR -> BC on EST01 of the data set abdx-service, 20,000 samples, at rest before the first: 3 states, 20 tanh neurons,
seeds 0, 1, 2 for both. The figure is the least mean squared error of the free run over the record that a tool had
within the cap, one thread, compiling excluded for ours (once per installation) and included for jax-sysid's (in each
process); how the cap is spent is each tool's own way: ours as ``Training()`` has it, jax-sysid's 1,000 steps of Adam,
then L-BFGS. The environment of the peers is that of the benchmark ``peers``.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from sysid.estimation import FitProgress, Training, fit_neural_state_space
from sysid.models import NeuralStateSpace
from tests.benchmarks._findings import found
from tests.benchmarks.peers import SEEDS, Problem, cylinder, environment, peer

NETWORK = NeuralStateSpace(states=3, neurons=20)
TOOL = "jax-sysid, three states"
AHEAD = 3.0
"""How many times less our error is to be."""
ITERATIONS = 230
"""Of a start that is never dropped: some 25 s on this record."""


def own(problem: Problem, seed: int, starts: int | None, cap: float, iterations: int) -> float:
    """Least error within the cap."""
    began, least = time.process_time(), float("inf")

    def watch(progress: FitProgress) -> None:
        nonlocal least
        if time.process_time() - began > cap:
            raise KeyboardInterrupt  # ends the fit, not the program
        least = min(least, progress.mse)

    training = Training(seed=seed, starts=starts, max_iterations=iterations, workers=1)
    records = [problem.trace]
    fit_neural_state_space(records, problem.mapping, NETWORK, training, rest_output=0.0, on_progress=watch)
    return least


def main(cap: float, workers: int) -> None:
    """Both tools, seed by seed."""
    problem = cylinder()
    own(problem, 0, 1, cap, 1)  # loads the compiled kernels
    ours = [own(problem, seed, None, cap, ITERATIONS) for seed in SEEDS]
    single = [own(problem, seed, 1, cap, ITERATIONS) for seed in SEEDS]
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(workers) as pool:
        python, stored = environment(), problem.store(Path(scratch))
        learned = list(pool.map(lambda seed: peer(python, TOOL, stored, cap, seed), SEEDS))
    theirs = [
        float("inf") if one is None else float(one.errors[one.seconds <= cap].min()) * problem.scale**2
        for one in learned
    ]

    def seeds(values: list[float]) -> str:
        return ", ".join(f"{value:.3g}" for value in values)

    title = f"{problem.name}, {NETWORK.label}, free-run mse after {cap:g} s"
    found(f"{title}, median of three seeds", statistics.median(ours), problem.unit, note=f"seeds: {seeds(ours)}")
    found(f"{title}, one start", statistics.median(single), problem.unit, note=f"seeds: {seeds(single)}")
    found(
        f"{title}, {TOOL}, divided by ours",
        statistics.median(theirs) / statistics.median(ours),
        "x",
        target=AHEAD,
        at_least=True,
        peer=f"{statistics.median(theirs):.3g} {problem.unit}, seeds: {seeds(theirs)}",
    )


if __name__ == "__main__":
    options = dict(argument[2:].split("=") for argument in sys.argv if argument.startswith("--") and "=" in argument)
    main(float(options.get("cap", 30.0)), int(options.get("workers", 2)))
