"""What an exporter is: it writes files for a surrogate, and can run the files that it wrote."""

from __future__ import annotations

import enum
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sysid.errors import UserError
from sysid.export.surrogate import Surrogate
from sysid.extras import need


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
        companions: Names of files that it needs beside it, such as a header.
    """

    name: str
    format: str
    kind: Kind
    dtype: str = "float64"
    details: dict[str, Any] = field(default_factory=dict)
    companions: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Run:
    """What a run of an exported file gives.

    Args:
        output: In its unit, shape ``(n_samples, n_cars, n_outputs)``.
        state: State after the last sample, shape ``(n_cars, n_state)``.
        flags: Bits of :class:`sysid.export.Flag`, shape ``(n_samples, n_cars)``.
    """

    output: NDArray[Any]
    state: NDArray[Any]
    flags: NDArray[Any]


Runner = Callable[[NDArray[Any], NDArray[Any] | None], Run]
"""Runs a loaded file on inputs in their units, ``(n_samples, n_cars, n_inputs)``, and a state,
``(n_cars, n_state)``. In float32 the state may come without its remainders, which are 0 then; it goes out with
them. Where the exporter ``begins``, it may be ``None``: the file then begins by itself, at rest at its first inputs."""


class AbstractExporter(ABC):
    """One format. Stateless: the table holds one instance."""

    name: str
    """Name in the table, in pipelines and in ``model.json``."""

    packages: ClassVar[tuple[str, ...]] = ()
    """Optional packages that write or run its files, by the names that are imported."""

    begins: ClassVar[bool] = False
    """Whether its files come to rest by themselves; others are handed the state of ``model.json``."""

    searches: ClassVar[bool] = False
    """Whether they also find the states at rest of equations that nobody declared."""

    def check(self) -> None:
        """Make sure that files of this format can be written and run here.

        Raises:
            UserError: If something is missing, such as a package; the remedy is the command that installs it.
        """
        for package in self.packages:
            need(package, f"the format {self.name}")

    def lacks(self) -> UserError | None:
        """What is missing here, as :meth:`check` says it; ``None`` where nothing is."""
        try:
            self.check()
        except UserError as error:
            return error
        return None

    @abstractmethod
    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Write the surrogate's files.

        Args:
            surrogate: What to write.
            folder: Where to; it exists.

        Returns:
            The files, the same bytes each time.
        """

    @abstractmethod
    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Make a file of this format ready to run.

        Args:
            file: The file, as :meth:`write` described it.
            folder: Where it lies.

        Returns:
            What runs it, on one thread.
        """


def step_by_step(step: Runner) -> Runner:
    """A runner that calls a file once a sample and hands the state on.

    Args:
        step: Runs one sample: ``(n_cars, n_inputs)`` in, an output of ``(n_cars, n_outputs)`` and flags of
            ``(n_cars,)`` out.

    Returns:
        What runs whole records.
    """

    def run(inputs: NDArray[Any], state: NDArray[Any] | None) -> Run:
        one = step(inputs[0], state)
        output, flags = (np.empty((len(inputs), *a.shape), dtype=a.dtype) for a in (one.output, one.flags))
        for k in range(len(inputs)):
            one = one if k == 0 else step(inputs[k], one.state)
            output[k], flags[k] = one.output, one.flags
        return Run(output=output, state=one.state, flags=flags)

    return run


def given(state: NDArray[Any] | None) -> NDArray[Any]:
    """The state that a file which does not begin by itself is handed."""
    assert state is not None  # noqa: S101 - see Runner
    return state


def with_remainders(state: NDArray[Any], length: int) -> NDArray[Any]:
    """A state as long as a file wants it.

    Args:
        state: Shape ``(n_cars, n_state)``, with or without the remainders of float32.
        length: Numbers that the file wants of each car.

    Returns:
        Shape ``(n_cars, length)``, with zeros for remainders that are not given.
    """
    # What numpy.pad takes a tenth of a millisecond for, which is what a step of a file takes.
    return np.concatenate([state, np.zeros((len(state), length - state.shape[1]), dtype=state.dtype)], axis=1)
