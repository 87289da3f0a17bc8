"""The ``verify`` folder of a bundle: records of what the model does, and programs that compare a file with them.

Whoever receives a bundle can convince themselves that it runs rightly where they are, without the workbench.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.export.expected_runs import ParityCase
from sysid.export.exporter import ExportedFile, Kind
from sysid.export.flags import expected_flags
from sysid.export.parity import Allowed
from sysid.export.surrogate import Surrogate
from sysid.export.templating import render
from sysid.names import csv_cell

FOLDER = "verify"
SAMPLES = 200


def write_verification(
    surrogate: Surrogate,
    files: Sequence[ExportedFile],
    runs: tuple[ParityCase, ParityCase],
    folder: Path,
    allowed: Mapping[str, Allowed],
) -> dict[str, str]:
    """Write records, the states before them where these are searched for, and a program for each kind of file.

    Args:
        surrogate: What was exported.
        files: The exported files.
        runs: A case whose beginning is the first record, and a random sequence whose beginning is the second; the
            third leaves the declared range with it, and has an input that is not a number near its end.
        folder: The bundle's.
        allowed: What the programs allow, by number type.

    Returns:
        What each written file is, by its path in the bundle.
    """
    case, sequence = runs
    outside = _outside(surrogate, sequence.inputs[:SAMPLES])
    records = {
        "record1.csv": (case.inputs[:SAMPLES], f"the beginning of {case.name}, from rest"),
        "record2.csv": (sequence.inputs[:SAMPLES], "a random sequence within the declared range, from rest"),
        "record3.csv": (outside, "a sequence that leaves the declared range, and loses a number near its end"),
    }
    texts = {name: (_record(surrogate, inputs), purpose) for name, (inputs, purpose) in records.items()}
    values = {
        "p": surrogate.identifier,
        "P": surrogate.identifier.upper(),
        "allowed": ", ".join(map(repr, allowed["float64"].each.tolist())),
        "allowed_float32": ", ".join(map(repr, allowed["float32"].each.tolist())),
    }
    if any(stage.searched for stage in surrogate.stages):
        begins = {name: surrogate.at_rest(inputs[0]).tolist() for name, (inputs, _) in records.items()}
        texts["states.json"] = (json.dumps(begins, indent=1) + "\n", "the state before each record, at rest")
    networks = [file for file in files if file.name.endswith(".onnx") and file.kind is Kind.SEQUENCE]
    for network in networks[:1]:
        each = repr(allowed[network.dtype].each.tolist())
        python = values | {"onnx": network.name, "dtype": network.dtype, "allowed": each}
        texts["verify.py"] = (render("verify.py.j2", **python), f"runs {network.name} over the records")
    if any(file.name.endswith(".c") for file in files):
        texts["verify.c"] = (render("verify.c.j2", **values), f"runs {surrogate.identifier}.c over the records")
    (folder / FOLDER).mkdir()
    for name, (text, _) in texts.items():
        (folder / FOLDER / name).write_text(text, encoding="utf-8", newline="\n")
    return {f"{FOLDER}/{name}": purpose for name, (_, purpose) in texts.items()}


def _outside(surrogate: Surrogate, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
    low, high = inputs.min(axis=0), inputs.max(axis=0)
    stretched: NDArray[np.float64] = (low + high) / 2.0 + 1.3 * (inputs - (low + high) / 2.0)
    for i, port in enumerate(surrogate.inputs):
        if port.range is not None:
            stretched[len(inputs) // 2, i] = port.high + 0.1 * (port.high - port.low)
    stretched[-20, 0] = np.nan
    return stretched


def _record(surrogate: Surrogate, inputs: NDArray[np.float64]) -> str:
    computed = surrogate.compute(inputs)
    outputs, flags = surrogate.chosen(computed), expected_flags(surrogate, inputs, computed)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    ports = (*surrogate.inputs, *surrogate.outputs)
    writer.writerow(["time [s]", *(csv_cell(f"{port.name} [{port.unit}]") for port in ports), "flags"])
    for i, (row, output, flag) in enumerate(zip(inputs.tolist(), outputs.tolist(), flags.tolist(), strict=True)):
        writer.writerow([repr(round(i * surrogate.sample_time, 12)), *map(repr, [*row, *output]), flag])
    return text.getvalue()
