"""Parity: every exported file is run against the model that it came from, on every case, before it is published."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ParityError
from sysid.export.exporter import ExportedFile, run_sequence
from sysid.export.exporters import exporter
from sysid.export.layout import StateLayout
from sysid.models import AbstractModel, History, Start
from sysid.traces import TraceSet


@dataclass(frozen=True, kw_only=True, eq=False)
class ParityCase:
    """A free run of the model that an exported file has to reproduce.

    Args:
        name: Name of the trace.
        inputs: In their units, shape ``(n_samples, n_inputs)``.
        history: The samples before the first.
        output: The model's output, shape ``(n_samples,)``.
    """

    name: str
    inputs: NDArray[np.float64]
    history: History
    output: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Parity:
    """How far an exported file is from its model.

    Args:
        largest_difference: Over all samples of all cases, in the output's unit.
        case: Where it occurred.
        tolerance: What is allowed, in the same unit.
        unit: The output's unit.
        samples: Number of samples compared.
    """

    largest_difference: float
    case: str
    tolerance: float
    unit: str
    samples: int

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {
            "largest_difference": self.largest_difference,
            "case": self.case,
            "tolerance": self.tolerance,
            "unit": self.unit,
            "samples": self.samples,
        }


def parity_cases(model: AbstractModel, traces: TraceSet, start: Start) -> tuple[ParityCase, ...]:
    """The model's free run on every trace.

    Args:
        model: The model.
        traces: The cases.
        start: How each free run begins.

    Returns:
        One case per trace.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        TraceError: If a trace is not longer than its measured start.
    """
    cases = []
    for trace in traces:
        inputs, target = trace.columns(model.mapping.inputs), trace.columns([model.mapping.output])[:, 0]
        history = start.history(inputs, target, model.rest_output)
        inputs = inputs[start.n_measured :]
        output = model.simulate(inputs, history)
        cases.append(ParityCase(name=trace.name, inputs=inputs, history=history, output=output))
    return tuple(cases)


def check_parity(
    file: ExportedFile, folder: Path, model: AbstractModel, cases: Iterable[ParityCase], tolerance: float
) -> Parity:
    """Run an exported file on every case.

    Args:
        file: The file.
        folder: Where it lies.
        model: The model it came from.
        cases: From :func:`parity_cases`; at least one.
        tolerance: Largest difference allowed, in the output's unit.

    Returns:
        The largest difference, and where it occurred.

    Raises:
        ParityError: If a difference is larger than the tolerance, or not a number.
    """
    runner, layout = exporter(file.format).load(folder / file.name), StateLayout.of(model)
    worst, where, samples = -1.0, "", 0
    for case in cases:
        state = layout.from_history(case.history)[np.newaxis]
        run = run_sequence(runner, file.kind, case.inputs[:, np.newaxis], state)
        difference = largest_difference(run.output[:, 0, 0], case.output)
        samples += len(case.output)
        if difference > worst:
            worst, where = difference, case.name
    if not worst <= tolerance:
        raise ParityError(file.name, where, worst, tolerance, model.output_unit)
    return Parity(largest_difference=worst, case=where, tolerance=tolerance, unit=model.output_unit, samples=samples)


def largest_difference(output: NDArray[Any], expected: NDArray[np.float64]) -> float:
    """The largest absolute difference of two records.

    Args:
        output: Shape ``(n_samples,)``.
        expected: The same shape.

    Returns:
        The difference; infinite where one of them is not a number and the other is, or where both are infinite
        with different signs.

    Example:
        >>> largest_difference(np.array([1.0, np.nan]), np.array([1.5, np.nan]))
        0.5
    """
    same = (output == expected) | (np.isnan(output) & np.isnan(expected))
    with np.errstate(invalid="ignore"):
        difference = np.where(same, 0.0, np.abs(output - expected))
    return float(np.max(np.nan_to_num(difference, nan=np.inf, posinf=np.inf), initial=0.0))
