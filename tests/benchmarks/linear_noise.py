"""State spaces and polynomial models beside SIPPY and nfoursid: three systems, 20 seeds; coverage; a million samples.

    python -m tests.benchmarks linear_noise [--without-peers] [--seeds=20] [--runs=200]

Fit on validation without noise, in free run, and processor time of the fit, as medians over the seeds; the same data
for all, one thread each. The peers live in an environment of their own under the cache folder; the first run makes it.
Coverage counts, over many records of a known system, how often an interval of 95 % holds a true coefficient.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.signal import lfilter

from sysid.estimation import FitResult, StateSpaceTraining
from sysid.estimation.estimators import fit
from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.state_space.search import search
from sysid.kernels import linear as kernel
from sysid.models import (
    ARMAX,
    ARX,
    BJ,
    OE,
    AbstractStructure,
    LinearStateSpace,
    Mapping,
    Start,
    TransferFunction,
    VectorStateSpace,
)
from sysid.models.innovations import Innovations
from sysid.models.linear_state_space import polynomials
from sysid.models.polynomial import AbstractPolynomial
from sysid.traces import Channel, Trace
from tests.benchmarks._findings import found
from tests.benchmarks._linear_systems import NAMES, SAMPLES, fit_percent, systems

PINNED = ("sippy_unipi==1.0.1", "nfoursid", "slycot")
WORKER = Path(__file__).with_name("_linear_peers_worker.py")
FREE = Start(kind="estimated")
SUBSPACE = StateSpaceTraining(method="subspace")
OURS: dict[str, dict[str, tuple[AbstractStructure, StateSpaceTraining | None]]] = {
    "white": {
        "OE": (OE(nb=4, nf=4, nk=1), None),
        "SS": (LinearStateSpace(states=4), None),
        "SS, subspace": (LinearStateSpace(states=4), SUBSPACE),
    },
    "coloured": {
        "BJ": (BJ(nb=4, nc=1, nd=2, nf=4, nk=1), None),
        "SS": (LinearStateSpace(states=4), None),
        "SS, subspace": (LinearStateSpace(states=4), SUBSPACE),
    },
    "mimo": {
        "VectorSS": (VectorStateSpace(states=6), None),
        "VectorSS, subspace": (VectorStateSpace(states=6), SUBSPACE),
    },
}


def trace_of(u: np.ndarray, y: np.ndarray) -> tuple[Trace, Mapping]:
    """A record, and the mapping of its channels."""
    ins, outs = [f"u{j}" for j in range(u.shape[1])], [f"y{j}" for j in range(y.shape[1])]
    channels = tuple(Channel(name=name, unit="1") for name in (*ins, *outs))
    trace = Trace(name="t", sample_time=1.0, channels=channels, values=np.column_stack([u, y]))
    return trace, Mapping(inputs=ins, outputs=outs)


def python_of_peers() -> Path:
    """The interpreter of the peers' environment, made if it is not there."""
    folder = Path.home() / ".cache" / "sysid" / ("linear-peers-" + "-".join(p.replace("==", "-") for p in PINNED))
    python = folder / "bin" / "python"
    if not (folder / "complete").exists():
        print(f"making {folder} with {', '.join(PINNED)}", flush=True)
        subprocess.run([sys.executable, "-m", "venv", "--clear", str(folder)], check=True)
        subprocess.run([str(python), "-m", "pip", "install", "-q", *PINNED], check=True)
        (folder / "complete").touch()
    return python


def peers(seeds: range) -> dict[str, tuple[str, float, float]]:
    """For each system the peer with the best median fit, that fit and its median seconds."""
    done = subprocess.run(
        [str(python_of_peers()), str(WORKER), *map(str, seeds)], capture_output=True, text=True, check=True
    )
    lines: dict[tuple[str, str], list[tuple[float, float]]] = defaultdict(list)
    for line in done.stdout.splitlines():
        system, name, fit_, seconds = json.loads(line)
        lines[system, name].append((fit_, seconds))
    best: dict[str, tuple[str, float, float]] = {}
    for (system, name), values in lines.items():
        fit_, seconds = np.median(values, axis=0)
        print(f"    {NAMES[system]}, {name}: {fit_:.2f} % in {seconds:.3f} s, {len(values)} seeds", flush=True)
        if system not in best or fit_ > best[system][1]:
            best[system] = (name, float(fit_), float(seconds))
    return best


def three_systems(seeds: range, *, beside: bool) -> None:
    """Every structure on its system, beside the best peer."""
    best = peers(seeds) if beside else {}
    values: dict[tuple[str, str], list[tuple[float, float]]] = defaultdict(list)
    for seed in (seeds[0], *seeds):  # the first one once more: it compiles
        for system, (u, y, clean) in systems(seed).items():
            trace, mapping = trace_of(u[:SAMPLES], y[:SAMPLES])
            for name, (structure, training) in OURS[system].items():
                began = time.process_time()
                model = fit([trace], mapping, structure, training, start=FREE, stability=None).model
                seconds = time.process_time() - began
                values[system, name].append((fit_percent(clean, model.simulate(u).reshape(len(u), -1)), seconds))
    for (system, name), pairs in values.items():
        fit_, seconds = np.median(pairs[1:], axis=0)
        peer = best.get(system)
        said = "" if peer is None else f"{peer[0]}: {peer[1]:.2f} % in {peer[2]:.3f} s"
        found(f"{NAMES[system]}, {name}, fit", fit_, "%", peer=said or None, note=f"median of {len(seeds)} seeds")
        found(f"{NAMES[system]}, {name}, processor time", seconds, "s")


PLANT = [1.0, 0.5, -1.5, 0.7]
OF_STATES = [*PLANT, -0.6, 0.3]
KNOWN: dict[str, tuple[AbstractStructure, AbstractPolynomial, list[float], list[float]]] = {
    "ARX": (ARX(na=2, nb=2, nk=1), ARMAX(na=2, nb=2, nc=0, nk=1), PLANT, [1.0, 0.5, 1.5, -0.7]),
    "TF": (TransferFunction(poles=2, zeros=1, delays=1), OE(nb=2, nf=2, nk=1), PLANT, PLANT),
    "SS": (LinearStateSpace(states=2), ARMAX(na=2, nb=2, nc=2, nk=1), OF_STATES, OF_STATES),
    "SS, dead time 6": (
        LinearStateSpace(states=2, nk=6), ARMAX(na=2, nb=2, nc=2, nk=6), OF_STATES, OF_STATES
    ),
    **{
        name: (orders, orders, truth, truth)
        for name, orders, truth in (
            ("OE", OE(nb=2, nf=2, nk=1), PLANT),
            ("BJ", BJ(nb=2, nc=1, nd=1, nf=2, nk=1), [*PLANT, 0.5, -0.9]),
            ("ARMAX", ARMAX(na=2, nb=2, nc=1, nk=1), [*PLANT, 0.4]),
            ("ARIX", ARMAX(na=2, nb=2, nc=0, nk=1, integrated=True), PLANT),
        )
    },
}  # fmt: skip
"""What is fitted; the plant, with its coefficients; and these as the fit's uncertainty has them: ARX writes those of
past outputs on the other side, and a state space of two states is an ARMAX system."""


def record(orders: AbstractPolynomial, truth: list[float], seed: int, n: int = 1_000) -> tuple[Trace, Mapping]:
    """A record of a known system that goes on before it."""
    rng = np.random.default_rng(seed)
    p = orders.polynomials(np.array([*truth, *[0.0] * orders.level]))
    u, e = np.sign(rng.normal(size=n + 100)), 0.5 * rng.normal(size=n + 100)
    y = lfilter(p.B[0], np.convolve(p.A, p.F[0]), u) + lfilter(p.C, np.convolve(p.A, p.D), e)
    return trace_of(u[100:, None], y[100:, None])


def held(result: FitResult, truth: list[float]) -> np.ndarray:
    """Which true coefficients lie within their intervals."""
    if result.uncertainty is None:
        raise RuntimeError("the fit tells no uncertainty")
    low, high = result.uncertainty.interval(0.95).T[:, : len(truth)]
    return (low <= truth) & (high >= truth)


def coverage(runs: int) -> None:
    """How often intervals of 95 % hold the truth."""
    for name, (structure, plant, coefficients, truth) in KNOWN.items():
        inside = []
        for seed in range(runs):
            trace, mapping = record(plant, coefficients, seed)
            inside.append(held(fit([trace], mapping, structure, start=FREE, stability=None), truth))
        share = 100.0 * float(np.mean(inside))
        found(f"{name}: intervals of 95 % that hold the truth", share, "%", note=f"92 to 98 asked; {runs} records")


TWO_BY_TWO = Innovations(
    A=np.array([[0.9, 0.2], [-0.2, 0.7]]),
    B=np.array([[0.5, 0.0], [0.2, 0.6]]),
    C=np.array([[1.0, 0.0], [0.3, 1.0]]),
    D=np.zeros((2, 2)),
    K=np.array([[0.3, 0.0], [0.1, 0.2]]),
    constant=np.zeros(2),
)
"""Two inputs, two outputs, two states, noise through the states."""


def record_of_two(seed: int, n: int = 1_000) -> tuple[Trace, Mapping]:
    """A record of the two by two system that goes on before it; the noise of its outputs hangs together."""
    rng = np.random.default_rng(seed)
    u = np.sign(rng.normal(size=(n + 100, 2)))
    e = 0.5 * rng.normal(size=(n + 100, 2)) @ np.array([[1.0, 0.4], [0.0, 0.9]])
    x, y = np.zeros(2), np.zeros((n + 100, 2))
    for t in range(n + 100):
        y[t] = TWO_BY_TWO.C @ x + e[t]
        x = TWO_BY_TWO.A @ x + TWO_BY_TWO.B @ u[t] + TWO_BY_TWO.K @ e[t]
    return trace_of(u[100:], y[100:])


def coverage_of_two(runs: int) -> None:
    """The same for a state space of two outputs: numerators, denominator, noise and constants."""
    F, numerators, noise = (np.real(part) for part in polynomials(TWO_BY_TWO))
    truth = [*numerators[:, :, 1:].ravel(), *F[1:], *noise[:, :, 1:].ravel(), 0.0, 0.0]
    inside = []
    for seed in range(runs):
        trace, mapping = record_of_two(seed)
        inside.append(held(fit([trace], mapping, VectorStateSpace(states=2), start=FREE, stability=None), truth))
    share = 100.0 * float(np.mean(inside))
    found("VectorSS: intervals of 95 % that hold the truth", share, "%", note=f"92 to 98 asked; {runs} records")


def million() -> None:
    """Subspace over a million samples of two inputs and two outputs, ten states."""
    rng, n, N = np.random.default_rng(0), 10, 1_000_000
    A = np.zeros((n, n))
    for i, (r, w) in enumerate(((0.95, 0.2), (0.9, 0.5), (0.97, 1.0), (0.8, 1.6), (0.9, 2.4))):
        A[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = r * np.array([[np.cos(w), np.sin(w)], [-np.sin(w), np.cos(w)]])
    drive = np.concatenate([rng.normal(size=(n, 2)), 0.1 * rng.normal(size=(n, 2))], axis=1)
    signals, y = rng.normal(size=(N, 4)), np.empty((N, 2))
    direct = np.concatenate([np.zeros((2, 2)), np.eye(2)], axis=1)
    kernel.state_space(A, drive, rng.normal(size=(2, n)), direct, signals, np.zeros(n), y)
    segment = Segment(inputs=signals[:, :2].copy(), outputs=y / y.std(axis=0), root_weights=np.ones(N))
    search([segment.first(3_000)], LinearStateSpace(states=n), SUBSPACE)  # compiles
    for weighting in ("CVA", "best"):
        training = StateSpaceTraining(method="subspace", weighting=weighting)
        began = time.process_time()
        result = search([segment], LinearStateSpace(states=n), training)
        seconds = time.process_time() - began
        off = np.abs(np.sort_complex(result.system.poles()) - np.sort_complex(np.linalg.eigvals(A))).max()
        note = f"poles within {off:.1e}"
        found(f"a million samples, 2x2, 10 states, subspace ({weighting})", seconds, "s", target=10.0, note=note)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    found("the whole process, data included, at most", peak, "GB", target=1.0)


def option(name: str, default: int) -> int:
    """A number from the command line."""
    given = [word.split("=")[1] for word in sys.argv[1:] if word.startswith(f"--{name}=")]
    return int(given[0]) if given else default


def main() -> None:
    """All of them."""
    million()
    three_systems(range(11, 11 + option("seeds", 20)), beside="--without-peers" not in sys.argv)
    coverage(option("runs", 200))
    coverage_of_two(option("runs", 200))


if __name__ == "__main__":
    main()
