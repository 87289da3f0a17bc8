"""State spaces and polynomial models beside SIPPY, nfoursid and Octave: three systems, 20 seeds; a million samples.

    python -m tests.benchmarks linear_noise [--without-peers] [--seeds=20]

Fit on validation without noise, in free run, and processor time of the fit, as medians over the seeds; the same data
for all, one thread each. The peers live in an environment of their own under the cache folder; the first run makes it.
Octave's control package (SLICOT IB01) takes part where it is there. slycot wraps none of SLICOT's identification.
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
from threadpoolctl import threadpool_limits

from sysid.estimation import StateSpaceTraining
from sysid.estimation.fitting import fit
from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.state_space.search import search
from sysid.kernels import linear as kernel
from sysid.models import (
    BJ,
    OE,
    AbstractStructure,
    LinearStateSpace,
    Mapping,
    Start,
    VectorStateSpace,
)
from sysid.traces import Channel, Trace
from tests.benchmarks._findings import found
from tests.benchmarks._linear_octave import octave_fits
from tests.benchmarks._linear_systems import NAMES, SAMPLES, fit_percent, systems
from tests.benchmarks._peers_environment import python_with

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
    return python_with("linear-peers", PINNED)


def peers(seeds: range) -> dict[str, tuple[str, float, float]]:
    """For each system the peer with the best median fit, that fit and its median seconds."""
    done = subprocess.run(
        [str(python_of_peers()), str(WORKER), *map(str, seeds)],
        capture_output=True,
        text=True,
        check=True,
    )
    lines: dict[tuple[str, str], list[tuple[float, float]]] = defaultdict(list)
    for line in done.stdout.splitlines():
        system, name, fit_, seconds = json.loads(line)
        lines[system, name].append((fit_, seconds))
    for system, name, fit_, seconds in octave_fits(seeds):
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
        found(f"{NAMES[system]}, {name}, fit", fit_, "%", peer=said, note=f"{fit_:.2f} %, median of {len(seeds)} seeds")
        found(f"{NAMES[system]}, {name}, processor time", seconds, "s")


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
    with threadpool_limits(1):  # who runs this may have numpy already
        million()
        three_systems(range(11, 11 + option("seeds", 20)), beside="--without-peers" not in sys.argv)


if __name__ == "__main__":
    main()
