"""Where each part of a neural state space stands in its flat parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.models.networks import low_rank


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """Where each part of the flat parameters ``[M | W | V | L | Wy | v | E]`` stands; the kernel has the equations.

    ``E``, of shape ``(n_states, n_inputs + n_outputs + 1)``, takes the oldest sample of a history (scaled inputs,
    scaled outputs, 1) to the state there.

    Args:
        states: ``n``.
        inputs: ``m``.
        neurons: ``k``, in the state equation.
        output_neurons: ``q``, in the output equation.
        outputs: ``o``.
        integrators: The last so many states are sums: :attr:`held` says which parameters that fixes.
        integrators_seen: Neurons read the sums all the same.
        linear_inputs: Neurons do not read the inputs.
        directions: Neurons read so many combinations of states and inputs, and move the states in so many ways; in any
            where it is ``None``. ``W`` and ``Wy`` over each other, without their last column, and ``V`` have that rank.

    Example:
        >>> Sizes(states=2, inputs=1, neurons=5, output_neurons=0).count
        48
    """

    states: int
    inputs: int
    neurons: int
    output_neurons: int
    outputs: int = 1
    integrators: int = 0
    integrators_seen: bool = False
    linear_inputs: bool = False
    directions: int | None = None

    @property
    def row(self) -> int:
        """Length of ``z = [x; u; 1]``."""
        return self.states + self.inputs + 1

    @property
    def dynamic(self) -> slice:
        """``M``, ``W`` and ``V``: the state equation."""
        return slice(0, (self.states + self.neurons) * self.row + self.states * self.neurons)

    @property
    def linear(self) -> slice:
        """``M``."""
        return slice(0, self.states * self.row)

    @property
    def hidden(self) -> slice:
        """``W``."""
        return slice(self.linear.stop, self.linear.stop + self.neurons * self.row)

    @property
    def readout(self) -> slice:
        """``V``."""
        return slice(self.hidden.stop, self.dynamic.stop)

    @property
    def output(self) -> slice:
        """``L``, ``Wy`` and ``v``: the output equation."""
        start = self.dynamic.stop
        return slice(start, start + self.outputs * (self.row + self.output_neurons) + self.output_neurons * self.row)

    @property
    def output_linear(self) -> slice:
        """``L``."""
        return slice(self.output.start, self.output.start + self.outputs * self.row)

    @property
    def output_hidden(self) -> slice:
        """``Wy``."""
        return slice(self.output_linear.stop, self.output_linear.stop + self.output_neurons * self.row)

    @property
    def output_readout(self) -> slice:
        """``v``."""
        return slice(self.output_hidden.stop, self.output.stop)

    @property
    def start(self) -> slice:
        """``E``: the map to the initial state."""
        return slice(self.output.stop, self.output.stop + self.states * (self.inputs + self.outputs + 1))

    @property
    def sums(self) -> slice:
        """The states that are sums."""
        return slice(self.states - self.integrators, self.states)

    @property
    def unfed(self) -> slice:
        """Sums that no neuron feeds: all of them where other states can bring what neurons give, else all but one."""
        return slice(max(self.sums.start, min(1, self.integrators)), self.states)

    @cached_property
    def held(self) -> NDArray[np.int64]:
        """Places of the parameters that are none, as some states are sums or neurons do not read everything.

        A sum is added to itself and to sums after it, and nothing else reads it, but neurons where they see sums; no
        neuron feeds it (:attr:`unfed`).
        """
        n, places = self.states, np.arange(self.count)
        M, V = places[self.linear].reshape(n, self.row), places[self.readout].reshape(n, self.neurons)
        kept = [M[: j + 1, j] for j in range(n)[self.sums]]
        kept += [
            places[part].reshape(-1, self.row)[:, self._unread].ravel() for part in (self.hidden, self.output_hidden)
        ]
        return np.concatenate([*kept, V[self.unfed].ravel()])

    @cached_property
    def _unread(self) -> NDArray[np.bool_]:
        """Which entries of ``z`` no neuron reads."""
        unread = np.zeros(self.row, dtype=bool)
        unread[self.sums] = not self.integrators_seen
        unread[self.states : -1] = self.linear_inputs
        return unread

    @cached_property
    def _ranked(self) -> tuple[NDArray[np.int64], ...]:
        """Places of the matrices whose rank :attr:`directions` bounds, without what is held."""
        if self.directions is None or self.neurons + self.output_neurons == 0:
            return ()
        places, read = np.arange(self.count), np.flatnonzero(~self._unread[:-1])
        hidden = np.concatenate([places[part].reshape(-1, self.row) for part in (self.hidden, self.output_hidden)])
        readout = places[self.readout].reshape(self.states, self.neurons)
        matrices = (hidden[:, read], np.delete(readout, self.unfed, axis=0))
        return tuple(matrix for matrix in matrices if min(matrix.shape) > self.directions)

    @property
    def free(self) -> int:
        """Number of parameters without those that are held, and without those that others of a matrix bind."""
        bound = sum(at.size - low_rank.dimension(at.shape, self.directions or 0) for at in self._ranked)
        return self.count - len(self.held) - bound

    def hold(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The nearest parameters that the sizes allow.

        Those that are held have their values, 1 of a sum by itself, else 0; matrices have no more than their rank.

        Args:
            theta: Flat parameters, those of records' initial states behind them or not.

        Returns:
            The same shape.
        """
        found = theta.copy()
        found[self.held] = 0.0
        found[np.arange(self.states)[self.sums] * (self.row + 1)] = 1.0
        for at in self._ranked:
            found[at] = low_rank.nearest(found[at], self.directions or 0)
        return found

    def along(self, theta: NDArray[np.float64], *arrays: NDArray[np.float64]) -> None:
        """Take from the last axis of arrays what no step from some parameters may have.

        Args:
            theta: Flat parameters that the sizes allow, those of records' initial states behind them or not.
            arrays: Each of shape ``(..., n_parameters)``, changed: gradients, or rows of a Jacobian.
        """
        bound = [(at, low_rank.spaces(theta[at], self.directions or 0)) for at in self._ranked]
        for array in arrays:
            array[..., self.held] = 0.0
            for at, spaces in bound:
                array[..., at] -= low_rank.leaving(array[..., at], spaces)

    @property
    def count(self) -> int:
        """Number of parameters."""
        return int(self.start.stop)
