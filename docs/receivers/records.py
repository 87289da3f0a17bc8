"""The records of a bundle, for the examples beside this file that run its FMUs over them."""

from __future__ import annotations

import csv
import json
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

Row = list[float]
Simulate = Callable[[Path, dict[str, list[float]], list[str]], tuple[list[Row], list[int]]]
"""Runs an FMU from rest over its inputs by name: the outputs and the flags of every sample."""


def check(bundle: Path, names: Sequence[str], simulate: Simulate) -> int:
    """Run FMUs of a bundle over its records and say how far they are from what is recorded.

    Args:
        bundle: The bundle's folder.
        names: Ends of the FMUs' names, such as ``.fmi2.fmu``.
        simulate: The importer at work.

    Returns:
        How many records differ by more than 1e-9 in the outputs' units, or in a flag.
    """
    about = json.loads((bundle / "model.json").read_text(encoding="utf-8"))
    inputs, outputs = ([channel["name"] for channel in about[side]] for side in ("inputs", "outputs"))
    faults = 0
    for fmu in (path for name in names for path in sorted(bundle.glob(f"*{name}"))):
        for record in sorted((bundle / "verify").glob("record*.csv")):
            with record.open(newline="", encoding="utf-8") as file:
                table = [[float(text) for text in row] for row in list(csv.reader(file))[1:]]
            columns = {name: [row[1 + i] for row in table] for i, name in enumerate(inputs)}
            found, flags = simulate(fmu, columns, outputs)
            expected = [row[1 + len(inputs) : -1] for row in table]
            pairs = [pair for rows in zip(found, expected, strict=True) for pair in zip(*rows, strict=True)]
            worst = max(_difference(a, b) for a, b in pairs)
            good = worst <= 1e-9 and flags == [int(row[-1]) for row in table]
            faults += not good
            said = "as recorded" if good else "NOT as recorded"
            sys.stdout.write(f"{fmu.name}, {record.name}: {said}, largest difference {worst:.1e}\n")
    return faults


def _difference(a: float, b: float) -> float:
    """Between two numbers; none where both are not numbers, infinite where one is not."""
    if math.isnan(a) or math.isnan(b):
        return 0.0 if math.isnan(a) and math.isnan(b) else math.inf
    return abs(a - b)
