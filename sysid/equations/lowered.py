"""What equations are lowered to: programs for the register machine, and what belongs to them."""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.equations.graph import CONTINUOUS_STATE, FREE, WEIGHT, Program

RUNGE_KUTTA, ROSENBROCK = "runge-kutta", "rosenbrock"
SOLVERS = (RUNGE_KUTTA, ROSENBROCK)
"""How continuous states go on: explicitly, or implicitly, for equations that are stiff."""

METHODS = {
    RUNGE_KUTTA: np.array([[1.0, 0.5, 0.0], [2.0, 0.5, 0.5], [2.0, 1.0, 0.5], [1.0, 0.0, 1.0]]),
    ROSENBROCK: np.array([[1.0, 0.0, 0.0]]),
}
"""Of each the stages of a step: how much a stage's slope counts, how much of a step ahead the next one is, and how much
of it lies behind. The slope of the one stage of ``rosenbrock`` is that over the whole implicit step."""


@dataclass(frozen=True, kw_only=True)
class Net:
    """A network within the equations: ``scale * (c + w z + v tanh(W z + b))`` of scaled arguments ``z``.

    Args:
        arguments: How many there are.
        neurons: How many there are.
        first: Where its weights begin: ``W`` and ``b`` row by row, ``v``, ``w``, ``c``.
        norm: Where its levels and scales begin: of each argument the level and one over the scale; then its own.
        probe: Where its arguments begin among the probes.
        scaled: Whether its own scale was given.
    """

    arguments: int
    neurons: int
    first: int
    norm: int
    probe: int
    scaled: bool

    @property
    def hidden(self) -> slice:
        """``W`` and ``b``."""
        return slice(self.first, self.first + self.neurons * (self.arguments + 1))

    @property
    def readout(self) -> slice:
        """``v``."""
        return slice(self.hidden.stop, self.hidden.stop + self.neurons)

    @property
    def linear(self) -> slice:
        """``w`` and ``c``."""
        return slice(self.readout.stop, self.readout.stop + self.arguments + 1)

    @property
    def stop(self) -> int:
        """Where the next one's weights begin."""
        return int(self.linear.stop)


@dataclass(frozen=True, kw_only=True)
class Switch:
    """What has a soft form for training.

    Args:
        probe: Where its argument is among the probes.
        root: Whether it is a root, soft only near 0.
    """

    probe: int
    root: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Lowered:
    """Equations as programs.

    Parameters are ``[free | weights | fixed | norms | step]``; those that have sensitivities are the first two.

    Args:
        rates: Of the continuous states.
        slopes: What a step goes along: the rates, or the mean slopes of an implicit step.
        solver: How the continuous states go on.
        updates: Of the other states.
        outputs: Of the outputs.
        probes: Arguments of networks and switches.
        counts: Of each kind of leaf.
        states: Names of all states, those of what remembers included.
        lagged: What each input of the programs is: an input of the mapping, and how many samples ago.
        nets: The networks.
        switches: What has a soft form for training.
        norms: The levels and scales as they are before any data are seen.
        places: Of each table its first row and its rows.
        table: Rows of all tables, shape ``(n_rows, 2)``.
        ahead: Whether a sample is reached by a step that ends there, on the way of its inputs from the sample before:
            the state before a sample is then that at the one before. Otherwise a step goes on from a sample.
    """

    rates: Program
    slopes: Program
    solver: str
    updates: Program
    outputs: Program
    probes: Program
    counts: Dict[str, int]
    states: tuple[str, ...]
    lagged: tuple[tuple[int, float], ...]
    nets: tuple[Net, ...]
    switches: tuple[Switch, ...]
    norms: tuple[float, ...]
    places: NDArray[np.int64]
    table: NDArray[np.float64]
    ahead: bool = False

    @property
    def n_continuous(self) -> int:
        """States with a rate, the first ones."""
        return self.counts[CONTINUOUS_STATE]

    @property
    def method(self) -> NDArray[np.float64]:
        """The stages of a step, a row each."""
        return METHODS[self.solver]

    @property
    def n_states(self) -> int:
        """All states."""
        return len(self.states)

    @property
    def n_weights(self) -> int:
        """Weights of all networks."""
        return self.counts[WEIGHT]

    @property
    def n_estimated(self) -> int:
        """Parameters and weights that have sensitivities."""
        return self.counts[FREE] + self.counts[WEIGHT]

    @property
    def depth(self) -> int:
        """Samples of the inputs before now that are read."""
        return max((math.ceil(lag) for _, lag in self.lagged), default=0)

    def given(self, inputs: NDArray[np.float64], n: int) -> NDArray[np.float64]:
        """What the programs read, of inputs with some samples before the first.

        Args:
            inputs: Shape ``(depth + n, n_inputs)``.
            n: Samples.

        Returns:
            Shape ``(n, n_lagged)``: inputs now and some time ago, between samples interpolated.
        """
        found = np.empty((n, len(self.lagged)))
        before = len(inputs) - n
        for j, (channel, lag) in enumerate(self.lagged):
            whole = math.floor(lag)
            rest = lag - whole
            found[:, j] = inputs[before - whole : before - whole + n, channel]
            if rest > 0.0:
                found[:, j] *= 1.0 - rest
                found[:, j] += rest * inputs[before - whole - 1 : before - whole - 1 + n, channel]
        return found


@dataclass(frozen=True, kw_only=True)
class Terms:
    """What equations are lowered for.

    Args:
        inputs: Channels that go in.
        outputs: Channels that come out.
        sample_time: Seconds; ``None`` to see whether they can be lowered at all.
        free: Names of parameters that are estimated.
        fixed: Names of the others.
        tables: Points of each table.
        solver: How the continuous states go on.
        moving: By input, whether it goes straight from sample to sample; it is held otherwise.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    sample_time: float | None
    free: tuple[str, ...]
    fixed: tuple[str, ...]
    tables: Dict[str, tuple[tuple[float, float], ...]]
    solver: str = RUNGE_KUTTA
    moving: tuple[bool, ...] = ()
