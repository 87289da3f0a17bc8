"""How long exported files take, beside the model's own compiled free run."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from sysid.export.bundle import Bundle
from sysid.export.expected_runs import random_cases
from sysid.export.exporter import ExportedFile, Kind
from sysid.export.exporters import exporter
from sysid.export.surrogate import Surrogate

SAMPLES = 20_000
"""Length of a run: 2,000 s at a tenth of a second."""
SHORT = 2_000
"""Length of a run that is called sample by sample, whose time is told for the whole length all the same."""
OWN = "compiled free run"
"""Name of the model's own run in the table."""


@dataclass(frozen=True, kw_only=True)
class RunTime:
    """How long one file takes.

    Args:
        name: File name; :data:`OWN` for the model itself.
        format: Name of the exporter; empty for the model itself.
        dtype: Of the numbers.
        cars: Runs side by side in one call.
        seconds: Median time of a run of :data:`SAMPLES` samples.
        ratio: To the model's own free run of as many cars, measured in turn with it.
    """

    name: str
    format: str
    dtype: str
    cars: int
    seconds: float
    ratio: float


def measure_run_times(
    surrogate: Surrogate, files: Sequence[ExportedFile], folder: Path, *, cars: int = 100, repeats: int = 5
) -> tuple[RunTime, ...]:
    """Run every file on one car, and files that take many at once on many too.

    Each repetition times the model's own run and then the file's, so that what else the machine does weighs on both.

    Args:
        surrogate: The model or cascade.
        files: What was written from it.
        folder: Where it lies.
        cars: How many side by side.
        repeats: Timed repetitions, after one to warm up.

    Returns:
        The model's own run first, then file by file.
    """
    drawn = random_cases(surrogate, sequences=cars, samples=SAMPLES)
    inputs = np.stack([case.inputs for case in drawn], axis=1)
    states = np.stack([case.state for case in drawn])

    def own(samples: int) -> None:
        surrogate.simulate(inputs[:samples, 0])

    found = []
    for file in files:
        runner = exporter(file.format).load(file, folder)
        whole = file.kind is Kind.SEQUENCE
        samples = SAMPLES if whole and file.format != "torchscript" else SHORT
        many = (1, cars) if whole and file.format.startswith("onnx") else (1,)
        for count in many:
            run = partial(runner, inputs[:samples, :count], states[:count])
            seconds, ratio = _timed(run, partial(own, samples), repeats)
            scale = SAMPLES / samples
            found.append(
                RunTime(
                    name=file.name,
                    format=file.format,
                    dtype=file.dtype,
                    cars=count,
                    seconds=seconds * scale,
                    ratio=ratio / count,
                )
            )
    alone, _ = _timed(lambda: own(SAMPLES), lambda: own(SAMPLES), repeats)
    return (RunTime(name=OWN, format="", dtype="float64", cars=1, seconds=alone, ratio=1.0), *found)


def bundle_run_times(bundle: Bundle, *, repeats: int = 3) -> tuple[RunTime, ...]:
    """Time every file of a bundle; see :func:`measure_run_times`.

    Args:
        bundle: The bundle, in a folder.
        repeats: Timed repetitions.

    Returns:
        The model's own run first, then file by file.
    """
    ranges = {entry["name"]: tuple(entry["range"]) for entry in bundle.inputs if entry["range"] is not None}
    files = [
        ExportedFile(
            name=entry["name"],
            format=entry["format"],
            kind=Kind(entry["kind"]),
            dtype=entry["dtype"],
            details=entry["details"],
            companions=tuple(entry["companions"]),
        )
        for entry in bundle.metadata["files"]
    ]
    outputs = [str(entry["name"]) for entry in bundle.outputs]
    return measure_run_times(Surrogate.of(bundle.model, ranges, outputs=outputs), files, bundle.folder, repeats=repeats)


def _timed(run: Callable[[], object], own: Callable[[], None], repeats: int) -> tuple[float, float]:
    """Median time of a run, and the median of its ratio to the own run just before it."""
    run()
    own()
    times, ratios = [], []
    for _ in range(repeats):
        begin = time.perf_counter()
        own()
        middle = time.perf_counter()
        run()
        end = time.perf_counter()
        times.append(end - middle)
        ratios.append((end - middle) / (middle - begin))
    return float(np.median(times)), float(np.median(ratios))
