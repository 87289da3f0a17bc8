"""What an exporter is: it writes files for a model, and can run the files that it wrote."""

from __future__ import annotations

import enum
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.models import AbstractModel


class Kind(enum.Enum):
    """What one call of an exported file does."""

    STEP = "step"
    SEQUENCE = "sequence"


@dataclass(frozen=True, kw_only=True)
class ExportedFile:
    """A file that an exporter wrote.

    Args:
        name: File name in the bundle's folder.
        format: Name of the exporter in the table.
        kind: What one call does.
        dtype: ``"float64"`` or ``"float32"``: of inputs, outputs and arithmetic.
        details: What a receiver must know, such as the opset.
    """

    name: str
    format: str
    kind: Kind
    dtype: str = "float64"
    details: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, eq=False)
class Run:
    """What one call of an exported file gives.

    Args:
        output: In its unit, shape ``(n_samples, n_cars, 1)``; a step file's has no time axis.
        state: State after the last sample, shape ``(n_cars, n_state)``.
    """

    output: NDArray[Any]
    state: NDArray[Any]


Runner = Callable[[NDArray[Any], NDArray[Any]], Run]
"""Runs a loaded file on inputs in their units, ``(n_samples, n_cars, n_inputs)``, and a state,
``(n_cars, n_state)``. A step file's takes and gives one sample, without the time axis."""


class AbstractExporter(ABC):
    """One format. Stateless: the table holds one instance."""

    name: str
    """Name in the table, in pipelines and in ``model.json``."""

    @abstractmethod
    def write(self, model: AbstractModel, folder: Path) -> tuple[ExportedFile, ...]:
        """Write the model's files.

        Args:
            model: The model.
            folder: Where to; it exists.

        Returns:
            The files, the same bytes each time.
        """

    @abstractmethod
    def load(self, path: Path) -> Runner:
        """Make a file of this format ready to run.

        Args:
            path: The file.

        Returns:
            What runs it, on one thread.
        """


def run_sequence(runner: Runner, kind: Kind, inputs: NDArray[Any], state: NDArray[Any]) -> Run:
    """Run a file over a whole record, calling a step file once a sample.

    Args:
        runner: The loaded file.
        kind: What one call of it does.
        inputs: Shape ``(n_samples, n_cars, n_inputs)``, in their units.
        state: Shape ``(n_cars, n_state)``.

    Returns:
        The output of every sample, and the last state.
    """
    if kind is Kind.SEQUENCE:
        return runner(inputs, state)
    outputs = []
    for sample in inputs:
        run = runner(sample, state)
        outputs.append(run.output)
        state = run.state
    return Run(output=np.stack(outputs), state=state)
