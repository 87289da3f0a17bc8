"""Run times of published cascades in every format that has no loop in Python, one sample and one car at a time or many.

    python -m tests.benchmarks export_cascades

Medians of processor time on one thread. A step is one call of onnxruntime from Python; C is a program of its own.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from sysid.export import EXPORTERS, ExportedFile, Kind, Surrogate, read_bundle
from sysid.models import NARX
from tests.benchmarks._dispatch import loop_of, on_one_row
from tests.benchmarks._findings import found
from tests.benchmarks.export import RANGES, build, time_c

CASCADES = {"service-cascade-grown": (40.0, 200.0, 60.0), "combined-brake-grown": (60.0, None, None)}
"""Published bundles, and what ONNX may take of one sample: one car and a hundred in a sequence, and a step."""
SAMPLES = {1: 4000, 100: 400, 1000: 100}


def median(call: Callable[[], object], repeats: int = 7) -> float:
    """Median processor time in seconds, after one call to warm up."""
    call()
    taken = []
    for _ in range(repeats):
        begin = time.process_time()
        call()
        taken.append(time.process_time() - begin)
    return float(np.median(taken))


def feeds(surrogate: Surrogate, file: ExportedFile, cars: int) -> tuple[np.ndarray, np.ndarray]:
    """Handle positions held for 5 s each, in a range that the brakes are made for; and states at rest."""
    rng = np.random.default_rng(cars)
    ranges = [port.range or (0.0, 90.0) for port in surrogate.inputs]
    low, high = (np.array(side) for side in zip(*ranges, strict=True))
    held = rng.uniform(low, high, (SAMPLES[cars] // 50 + 1, cars, len(low)))
    u = np.repeat(held, 50, axis=0)[: SAMPLES[cars]].astype(file.dtype)
    state = np.zeros((cars, surrogate.state_length(file.dtype)), dtype=file.dtype)
    for i in range(cars):
        state[i, : surrogate.state_size] = surrogate.at_rest(u[0, i].astype(np.float64))
    return u, state


def onnx_times(label: str, surrogate: Surrogate, targets: tuple[float | None, ...], folder: Path) -> None:
    """Both graphs, in both number types."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    for name in ("onnx", "onnx-float32"):
        for file in EXPORTERS[name].write(surrogate, folder):
            session = onnxruntime.InferenceSession(folder / file.name, options, providers=["CPUExecutionProvider"])

            def run(u: Any, state: Any, session: Any = session) -> object:
                return session.run(["y", "state_out", "flags"], {"u": u, "state": state})

            if file.kind is Kind.STEP:
                u, state = feeds(surrogate, file, 1)
                took = median(lambda u=u, state=state, run=run: [run(u[i], state) for i in range(200)]) / 200
                goal = targets[2] if name == "onnx" else None
                found(f"{label}: {file.name}, a call", 1e6 * took, "µs", target=goal)
                continue
            goals = (*targets[:2], None) if name == "onnx" else (None,) * 3
            for cars, goal in zip(SAMPLES, goals, strict=True):
                u, state = feeds(surrogate, file, cars)
                took = median(lambda u=u, state=state, run=run: run(u, state), repeats=5) / len(u)
                note = f"{1e6 * took / cars:.2f} µs a car" if cars > 1 else ""
                found(f"{label}: {file.name}, {cars} cars, a sample", 1e6 * took, "µs", target=goal, note=note)
            if name == "onnx" and label in CASCADES:
                dispatch(label, folder / file.name)


def dispatch(label: str, path: Path) -> None:
    """What the runtime takes to call the nodes of a sequence's loop, each on one row: no graph of these is faster."""
    import onnxruntime

    body = loop_of(path)
    model, fed = on_one_row(body)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
    took = 1e6 * median(lambda: session.run(None, fed), repeats=5) / len(fed["x"])
    note = f"{len(body.node)} nodes, {took / len(body.node):.2f} µs each"
    found(f"{label}: the nodes of that loop on one row each, a sample", took, "µs", note=note)


def c_times(label: str, surrogate: Surrogate, folder: Path) -> None:
    """C in both number types."""
    u, _ = feeds(surrogate, EXPORTERS["c"].write(surrogate, folder)[0], 1)
    u = np.resize(u[:, 0], (20_000, u.shape[2]))
    macro = f"-D{surrogate.identifier.upper()}_FLOAT"
    for name, flags in {
        "double, -O2": ("-O2",),
        "float, -O2": ("-O2", macro),
        "double, -O3 -march=native": ("-O3", "-march=native"),
        "float, -O3 -march=native": ("-O3", "-march=native", macro),
    }.items():
        middle, least, *_ = time_c(surrogate, folder, u, *flags)
        found(f"{label}: C, {name}, a sample", middle / 2e7, "µs", note=f"least {least / 2e7:.2f} µs")


def main() -> None:
    """One network, then the cascades."""
    whole: dict[str, tuple[Surrogate, tuple[float | None, ...]]] = {
        "one network 5/3/12": (
            Surrogate.of(build("BP+AR -> BC", NARX(input_delays=5, output_delays=3, neurons=12), 2), RANGES),
            (6.0, None, 25.0),
        )
    }
    for name, targets in CASCADES.items():
        model = read_bundle(Path("reports") / name / "bundle").model
        whole[name] = (Surrogate.of(model, {"STP": (0.0, 90.0)}), targets)
    for label, (surrogate, targets) in whole.items():
        with tempfile.TemporaryDirectory() as folder:
            onnx_times(label, surrogate, targets, Path(folder))
            c_times(label, surrogate, Path(folder))


if __name__ == "__main__":
    main()
