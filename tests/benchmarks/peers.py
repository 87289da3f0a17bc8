"""Time to the same free-run error: jax-sysid, fastcan and pyrenn beside this project, in one run.

    python -m tests.benchmarks peers [--cap=300] [--only=tank] [--peer="jax-sysid, state space"] [--workers=2]

The peers live in an environment of their own under the cache folder, which the first run makes (some 700 MB); they are
no dependencies of the project. Two problems, the same lags and neurons for all: a synthetic tank behind a valve, 2,000
samples, 2 lags, 10 neurons; and BP+AR -> BC on EST01 of the data set abdx-service, 20,000 samples, 2 lags, 20 neurons
(fastcan: polynomials over the same lags; jax-sysid also as a state space with two free states, which is its own way,
and beside it ours of as many states and neurons). Ours trains as ``Training()`` has it: one start of a NARX network,
six of a state space, most of which are dropped soon. Every tool sees scaled signals at rest before the first sample;
the errors that times are measured to are those of the free run over the training record. Beside them stands what the
peers' best parameters give on VAL01 to VAL04, which nothing is fitted to or chosen on.

Times are processor times, one thread each, so that a machine with other work gives the same answer. A peer gets the
cap at most. Two comparisons: the time to an error that was fixed beforehand (the tank: 3.6 % of the output's standard
deviation; the cylinder: 7e-3 psi^2), and the time in which ours undercuts the peer's best, beside the time that this
took the peer. Ours and theirs are medians over three seeds, the preparation of the fit included; a seed that never gets
there counts as infinite. fastcan leaves nothing to chance and runs once. Imports count for nobody. Our
kernels are compiled once per installation, jax's functions in each process: that difference is
part of what is measured, and of the order of some seconds.
"""

from __future__ import annotations

import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from sysid.estimation import FitProgress, Training, fit_narx, fit_neural_state_space
from sysid.ingest import load_dataset
from sysid.models import NARX, Mapping, NeuralStateSpace
from sysid.reporting.scores import Score
from sysid.traces import Trace
from tests.benchmarks._findings import found, read, scored
from tests.benchmarks._peers_environment import python_with
from tests.traces.made import trace_of

PINNED = ("jax-sysid==1.1.0", "fastcan==0.6.0", "pyrenn==0.1")
WORKER = Path(__file__).with_name("_peers_worker.py")
STATE_SPACE = "jax-sysid, state space"
TOOLS = ("jax-sysid", "fastcan, degree 2", "fastcan, degree 3", "pyrenn", STATE_SPACE)
CERTAIN = {"fastcan, degree 2", "fastcan, degree 3"}
SEEDS = (0, 1, 2)
PATIENCE = 30.0
"""Wall time that a peer is given, in units of its cap and two minutes: the machine may have other work."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """A record, and what the tools share."""

    name: str
    trace: Trace
    mapping: Mapping
    rest_output: float
    lags: int
    neurons: int
    target: float
    """Mean squared error fixed beforehand, in the output's unit squared."""
    ahead: float
    """How many times faster ours is to be."""
    unseen: tuple[Trace, ...] = ()
    """Records that nothing is fitted to."""

    @property
    def unit(self) -> str:
        return f"{self.trace.channel(self.mapping.output).unit}²"

    @property
    def scale(self) -> float:
        return float(np.ptp(self.trace[self.mapping.output]) / 2.0)

    def store(self, folder: Path) -> Path:
        """What the peers read: deviations from rest, in half ranges."""
        u = self.trace.columns(self.mapping.inputs)
        span = np.ptp(u, axis=0) / 2.0

        def scaled(trace: Trace) -> tuple[np.ndarray, np.ndarray]:
            output = (trace[self.mapping.output] - self.rest_output) / self.scale
            return (trace.columns(self.mapping.inputs) - u[0]) / span, output

        arrays = dict(zip(("u", "y"), scaled(self.trace), strict=True))
        for trace in self.unseen:
            arrays[f"u_{trace.name}"], arrays[f"y_{trace.name}"] = scaled(trace)
        path = folder / "problem.npz"
        np.savez(path, lags=self.lags, neurons=self.neurons, **arrays)
        return path


@dataclass(frozen=True, kw_only=True, eq=False)
class Learned:
    """What a peer gave: its learning curve, and its error on unseen records by name; NaN where it diverges."""

    tool: str
    seconds: np.ndarray
    errors: np.ndarray
    unseen: dict[str, float]


def tank() -> Problem:
    """An equal-percentage valve with a dead band fills a tank, which gravity empties and which overflows."""
    rng = np.random.default_rng(0)
    valve = np.repeat(rng.uniform(0.0, 1.0, 100), 20)
    valve[:20] = 0.0
    flow = np.where(valve > 0.1, 30.0 ** (valve - 1.0), 0.0)
    level, y = 0.0, np.empty(2000)
    for t in range(2000):
        y[t] = level + 0.002 * rng.standard_normal()
        level = float(np.clip(level + 0.05 * (1.2 * flow[t] - np.sqrt(level)), 0.0, 0.8))
    trace = trace_of({"valve": valve, "level": y}, name="tank", sample_time=0.1, units={"valve": "1", "level": "m"})
    return Problem(
        name="tank, 2,000 samples",
        trace=trace,
        mapping=Mapping.parse("valve -> level"),
        rest_output=0.0,
        lags=2,
        neurons=10,
        target=float((0.036 * y.std()) ** 2),
        ahead=15.0,
    )


def cylinder() -> Problem:
    """BP+AR -> BC on EST01."""
    traces = load_dataset("abdx-service", cases=["EST01", "VAL01", "VAL02", "VAL03", "VAL04"])
    for trace in traces:
        read(f"abdx-service, {trace.name}", trace.digest)
    return Problem(
        name="BP+AR -> BC on EST01, 20,000 samples",
        trace=traces["EST01"],
        mapping=Mapping.parse("BP+AR -> BC"),
        rest_output=0.0,
        lags=2,
        neurons=20,
        target=7e-3,
        ahead=60.0,
        unseen=tuple(trace for trace in traces if trace.name != "EST01"),
    )


def peer(python: Path, tool: str, problem: Path, cap: float, seed: int = 0) -> Learned | None:
    """What a peer learned; ``None`` where it gave nothing."""
    command = [str(python), str(WORKER), tool, str(problem), str(cap), str(seed)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE * (cap + 120.0))
    except subprocess.TimeoutExpired:
        print(f"  {tool}: no answer within {PATIENCE * (cap + 120.0):g} s of wall time", flush=True)
        return None
    if done.returncode:
        print(f"  {tool} failed: {done.stderr.strip()[-2000:]}", flush=True)
        return None
    document = json.loads(done.stdout.strip().splitlines()[-1])
    points = np.array(document["curve"])
    if not len(points):
        print(f"  {tool} gave nothing", flush=True)
        return None
    unseen = {name: np.nan if value is None else float(value) for name, value in document["unseen"].items()}
    return Learned(tool=tool, seconds=points[:, 0], errors=points[:, 1], unseen=unseen)


Curve = tuple[np.ndarray, np.ndarray]
"""Seconds since the call, and mean squared errors in the output's unit squared."""


def own(problem: Problem, cap: float, network: NARX | NeuralStateSpace) -> list[Curve]:
    """One learning curve a seed."""
    estimate = fit_narx if isinstance(network, NARX) else fit_neural_state_space

    def curve(seed: int, iterations: int) -> Curve:
        points: list[tuple[float, float]] = []
        began = time.process_time()

        def watch(progress: FitProgress) -> None:
            points.append((time.process_time() - began, progress.mse))
            if points[-1][0] > cap:
                raise KeyboardInterrupt  # ends the fit, not the program

        training = Training(seed=seed, max_iterations=iterations, workers=1)
        estimate(
            [problem.trace], problem.mapping, network, training, rest_output=problem.rest_output, on_progress=watch
        )
        return np.array(points)[:, 0], np.array(points)[:, 1]

    curve(0, 30)  # loads the compiled kernels, and what the evidence needs from its first question on
    return [curve(seed, 2000) for seed in SEEDS]


def reached(curve: Curve, error: float) -> float:
    """Seconds until the error is undercut; infinite if it never is."""
    seconds, errors = curve
    return float(seconds[np.argmax(errors <= error)]) if (errors <= error).any() else np.inf


def compare(problem: Problem, python: Path, tools: Sequence[str], cap: float, *, folder: Path, workers: int) -> None:
    """Tools on one problem."""
    print(f"{problem.name}; {problem.lags} lags, {problem.neurons} neurons; cap {cap:g} s a peer", flush=True)
    narx = NARX(input_delays=problem.lags, output_delays=problem.lags, neurons=problem.neurons)
    state_space = NeuralStateSpace(states=2, neurons=problem.neurons)
    equals = [state_space if tool == STATE_SPACE else narx for tool in tools]
    ours = {network: told(problem, cap, network) for network in dict.fromkeys(equals)}
    stored = problem.store(folder)
    jobs = [(tool, seed) for tool in tools for seed in (SEEDS if tool not in CERTAIN else SEEDS[:1])]
    with ThreadPoolExecutor(workers) as pool:  # each peer is a process; what is compared is processor time
        done = pool.map(lambda job: peer(python, job[0], stored, cap, job[1]), jobs)
        for (tool, own_jobs), network in zip(groupby(jobs, key=lambda job: job[0]), equals, strict=True):
            runs = [learned for _ in own_jobs if (learned := next(done))]
            if runs:
                judge(problem, runs, ours[network], cap)
            else:
                print(f"  {tool} gave nothing with any seed", flush=True)


def told(problem: Problem, cap: float, network: NARX | NeuralStateSpace) -> list[Curve]:
    """Our own learning curves, and what they come to by themselves."""
    curves = own(problem, min(cap, 60.0), network)
    each = ", ".join(f"{reached(curve, problem.target):.2f} s" for curve in curves)
    least = ", ".join(f"{curve[1].min():.3g}" for curve in curves)
    found(
        f"{problem.name}: our time to {problem.target:.3g} {problem.unit} by {network.label}, median of three seeds",
        statistics.median(reached(curve, problem.target) for curve in curves),
        "s",
        note=f"single seeds {each}; least mse within {max(curve[0][-1] for curve in curves):.0f} s: {least}",
    )
    return curves


def judge(problem: Problem, runs: list[Learned], curves: list[Curve], cap: float) -> None:
    """Say how a peer compares, by its seeds."""
    tool, ours = runs[0].tool, statistics.median(reached(curve, problem.target) for curve in curves)
    learned = [(run.seconds, run.errors * problem.scale**2) for run in runs]
    theirs = statistics.median(reached(run, problem.target) for run in learned)
    bests = [float(errors.min()) for _, errors in learned]
    best = statistics.median_low(bests)
    at_best = reached(learned[bests.index(best)], best)
    undercut = statistics.median(reached(curve, best) for curve in curves)
    note = elsewhere(problem, runs[bests.index(best)], best, cap)
    if np.isfinite(theirs):
        each = ", ".join(f"{reached(run, problem.target):.1f} s" for run in learned)
        found(
            f"{problem.name}: time of {tool} to {problem.target:.3g} {problem.unit}, divided by ours",
            theirs / ours,
            "x",
            target=problem.ahead,
            at_least=True,
            peer=each,
            note=note,
        )
    else:
        # How far behind, nobody knows: a ratio to the end of the trial would grow with our choice of the target.
        print(f"  {tool} did not get to {problem.target:.3g} {problem.unit} within {cap:g} s", flush=True)
    if best < float(np.var(problem.trace[problem.mapping.output])):  # worse than the mean is no best
        found(
            f"{problem.name}: time of {tool} to its own best, divided by ours to that error",
            at_best / undercut if np.isfinite(undercut) else math.nan,
            "x",
            target=problem.ahead,
            at_least=True,
            peer=f"{best:.3g} {problem.unit} in {at_best:.1f} s, the median of its seeds' best",
            note="; ".join(filter(None, ("" if np.isfinite(undercut) else "ours does not get there", note))),
        )


def environment() -> Path:
    """The peers' Python, made if it is not there."""
    return python_with("peers", PINNED)


def elsewhere(problem: Problem, learned: Learned, best: float, cap: float) -> str:
    """Keep what a peer's best parameters give on records that it did not see, and say it."""
    values = {name: value * problem.scale**2 for name, value in learned.unseen.items()}
    if not values:
        return ""
    scored(
        Score(
            mapping=str(problem.mapping),
            unit=problem.trace.channel(problem.mapping.output).unit,
            model=f"{learned.tool}, {cap:g} s of training on {problem.trace.name}",
            mse={problem.trace.name: best, **values},
        )
    )
    told = [f"{name} {value:.3g}" if np.isfinite(value) else f"{name} diverges" for name, value in values.items()]
    return f"on unseen records: {', '.join(told)}"


if __name__ == "__main__":
    options = dict(argument[2:].split("=") for argument in sys.argv if argument.startswith("--") and "=" in argument)
    limit, wanted = float(options.get("cap", 300.0)), options.get("only", "tank,cylinder").split(",")
    interpreter, asked = environment(), [options["peer"]] if "peer" in options else TOOLS
    with tempfile.TemporaryDirectory() as scratch:
        for make in (tank, cylinder):
            if make.__name__ in wanted:
                compare(make(), interpreter, asked, limit, folder=Path(scratch), workers=int(options.get("workers", 1)))
