"""Equations with their numbers: runs from a state, how these move with states and parameters, and equilibrium."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.equations import Lowered
from sysid.kernels import equation_run
from sysid.kernels import register_machine as machine
from sysid.models.channels.history import fitting_columns
from sysid.models.channels.scaling import Scaling, VectorScaling
from sysid.models.contract.form import AbstractForm
from sysid.models.contract.state_descent import LARGEST, usable
from sysid.models.grey_box.state_search import Derived, at_rest

Array = NDArray[np.float64]

INTEGRATES = 1e-7
"""Singular value of what changes from sample to sample, in states' scales, up to which there is no equilibrium."""

LEAVES = 1e-6
"""Part by which what is moved has to grow from sample to sample, or in the time of the fastest state, for an
equilibrium to be left: chains of integrators are off theirs by roundings."""

MANY_RESTS = 256
"""States at rest that are kept at most: to find one takes twenty times as long as to run a short sequence from it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class StateTerms:
    """What is known of the states of some equations, one entry for each state.

    Args:
        level: An ordinary value, in its unit.
        scale: How far it ordinarily goes from there.
        low: Least value before a record.
        high: Greatest value before a record.
        declared: Whether a record that begins at rest begins at its level; at equilibrium otherwise.
        fixed: Whether every record begins at its level.
    """

    level: Array
    scale: Array
    low: Array
    high: Array
    declared: NDArray[np.bool_]
    fixed: NDArray[np.bool_]

    def held(self, x: Array) -> Array:
        """A state within its bounds."""
        return np.asarray(np.clip(x, self.low, self.high))


@dataclass(frozen=True, kw_only=True, eq=False)
class EquationPrograms(AbstractForm):
    """``dx/dt = f(x, u, p)``, ``x(k+1) = g(x, u, p)``, ``y = h(x, u, p)``: what the programs make of inputs and states.

    Args:
        lowered: The programs.
        theta: Parameters ``[free | weights | fixed | norms]``.
        scaling: Of the outputs; the equations themselves are in units.
        terms: What is known of the states.
        substeps: Steps of the solver from sample to sample.
        sample_time: Seconds.
        widths: Of each switch, in the unit of its argument; 0 is exact.
    """

    lowered: Lowered
    theta: Array
    scaling: Scaling | VectorScaling
    terms: StateTerms
    substeps: int
    sample_time: float
    widths: Array

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return len(self.scaling.input_scale)

    @property
    def n_outputs(self) -> int:
        """Number of outputs."""
        return len(self.lowered.outputs.results)

    @cached_property
    def programs(self) -> tuple[object, object, object]:
        """Slopes, updates and outputs, as the machine takes them."""
        low = self.lowered
        return low.slopes.arrays, low.updates.arrays, low.outputs.arrays

    @property
    def step(self) -> float:
        """Seconds of one step of the solver."""
        return self.sample_time / self.substeps

    @cached_property
    def filled(self) -> Array:
        """What stands in the programs' registers: parameters, the step, and the share of the way behind, here none."""
        return np.append(self.theta, [self.step, 0.0])

    @cached_property
    def output_scale(self) -> Array:
        """Of each output, in its unit."""
        return np.atleast_1d(np.asarray(self.scaling.output_scale, dtype=np.float64))

    @cached_property
    def _rests(self) -> dict[tuple[bytes, bytes], Array]:
        """States at rest that were found, by what was asked: a thousand sequences begin at a few plateaus."""
        return {}

    @property
    def _own(self) -> tuple[object, ...]:
        return self.lowered.method, self.substeps, self.step, self.lowered.ahead, *self._tables

    @property
    def _tables(self) -> tuple[object, ...]:
        return self.widths, self.lowered.places, self.lowered.table

    def given(self, inputs: Array, before: Array) -> Array:
        """What the programs read of some inputs.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.
            before: Inputs before them, the oldest held where they are too few, shape ``(n_past, n_inputs)``.

        Returns:
            Shape ``(n_samples, n_lagged)``.

        Raises:
            TraceError: If there are fewer inputs than the equations read.
        """
        needed = max((channel + 1 for channel, _ in self.lowered.lagged), default=0)
        inputs = fitting_columns(inputs, needed, more=True)
        depth = self.lowered.depth
        missing = max(0, depth - len(before))
        past = np.concatenate([np.repeat(before[:1], missing, axis=0), before])[len(before) + missing - depth :]
        return self.lowered.given(np.concatenate([past, inputs]), len(inputs))

    def run(self, u: Array, x: Array, path: Array | None = None) -> Array:
        """Output over some inputs; ``x`` becomes the state after them.

        Args:
            u: What :meth:`given` gives.
            x: State before the first sample, shape ``(n_states,)``; overwritten.
            path: Overwritten by the states before each sample, where somebody asks, shape ``(n_samples, n_states)``.

        Returns:
            Shape ``(n_samples, n_outputs)``, in units.
        """
        y = np.empty((len(u), self.n_outputs))
        path = np.empty((0, len(x))) if path is None else path
        equation_run.free_run(self.programs, self.filled, x, u, *self._own, y, path)
        return y

    def moved(self, u: Array, x: Array, S: Array, p: int) -> tuple[Array, Array]:
        """Output over some inputs and its derivatives; ``x`` and ``S`` become those after them.

        Args:
            u: What :meth:`given` gives.
            x: State before the first sample; overwritten.
            S: Its derivatives, shape ``(n_states, n_columns)``; overwritten.
            p: How many parameters have columns, the first of all.

        Returns:
            Output of shape ``(n_samples, n_outputs)``, in units, and ``(n_samples, n_outputs, n_columns)``.
        """
        y, J = np.empty((len(u), self.n_outputs)), np.empty((len(u), self.n_outputs, S.shape[1]))
        equation_run.sensitivities(self.programs, self.filled, p, x, S, u, *self._own, y, J)
        return y, J

    def probed(self, u: Array, path: Array) -> Array:
        """Arguments of networks and switches along a path of states.

        Args:
            u: What :meth:`given` gives.
            path: Shape ``(n_samples, n_states)``.

        Returns:
            Shape ``(n_samples, n_probes)``.
        """
        found = np.empty((len(u), len(self.lowered.probes.results)))
        machine.values(self.lowered.probes.arrays, self.filled, path, u, *self._tables, found)
        return found

    def resting(self, u: Array, output: Array) -> Array:
        """The state of a system that has stood for ever.

        Args:
            u: What the programs read, shape ``(n_lagged,)``.
            output: Its outputs, in their units, shape ``(n_outputs,)``.

        Returns:
            Shape ``(n_states,)``; as near to equilibrium as there is one.
        """
        asked = u.tobytes(), output.tobytes()
        found = self._rests.get(asked)
        if found is None:
            found = at_rest(_Standing(programs=self, u=u), output, self.output_scale, self.terms)[0]
            if len(self._rests) < MANY_RESTS:
                self._rests[asked] = found
        return found.copy()  # a run overwrites it

    def resting_moves(self, u: Array, output: Array, p: int) -> tuple[Array, Array]:
        """The state at rest, and how it moves with the first parameters.

        Args:
            u: What the programs read, shape ``(n_lagged,)``.
            output: Its outputs, in their units.
            p: How many parameters.

        Returns:
            Shapes ``(n_states,)`` and ``(n_states, p)``.
        """
        x, moves = at_rest(_Standing(programs=self, u=u, p=p), output, self.output_scale, self.terms)
        return x, moves

    def rates_by_state(self, x: Array, u: Array) -> Array:
        """How the rates move with the states.

        Args:
            x: State, shape ``(n_states,)``.
            u: What the programs read, shape ``(n_lagged,)``.

        Returns:
            Shape ``(n_continuous, n_states)``.
        """
        return self._derived(self.lowered.rates, x, u, 0)[1]

    def changing(self, x: Array, u: Array, p: int = 0) -> Derived:
        """What changes at a state, and its derivatives by state and parameters.

        Args:
            x: State, shape ``(n_states,)``.
            u: What the programs read, shape ``(n_lagged,)``.
            p: How many parameters.

        Returns:
            Shapes ``(n_states,)``, ``(n_states, n_states)`` and ``(n_states, p)``; what follows from sample to sample
            is less by the state, its derivatives are not.
        """
        low = self.lowered
        changes = [self._derived(program, x, u, p) for program in (low.rates, low.updates)]
        change, by_state, by_parameter = (np.concatenate(parts) for parts in zip(*changes, strict=True))
        change[low.n_continuous :] -= x[low.n_continuous :]
        return change, by_state, by_parameter

    def standing(self, x: Array, u: Array, p: int = 0) -> tuple[Derived, Derived]:
        """What changes at a state, and the outputs there, each with its derivatives by state and parameters.

        Args:
            x: State, shape ``(n_states,)``.
            u: What the programs read, shape ``(n_lagged,)``.
            p: How many parameters.

        Returns:
            Both.
        """
        low, (change, by_state, by_parameter) = self.lowered, self.changing(x, u, p)
        first = low.n_continuous
        by_state[first:, first:] = self._settling(by_state[first:, first:])
        return (change, by_state, by_parameter), self._derived(low.outputs, x, u, p)

    def _settling(self, by_state: Array) -> Array:
        """How what changes from sample to sample moves with the states; a rounding off an integrator is one.

        A pole that is off 1 by a rounding has an equilibrium where no plant ever was.
        """
        found = by_state - np.eye(len(by_state))
        if not len(found) or not np.all(np.abs(found) < LARGEST):
            return found
        scale = self.terms.scale[-len(found) :]
        left, sizes, right = np.linalg.svd(found * scale / scale[:, None])
        small = sizes < INTEGRATES
        if small.any():
            found -= (left[:, small] * sizes[small]) @ right[small] * scale[:, None] / scale
        return np.asarray(found)

    def _derived(self, program: object, x: Array, u: Array, p: int) -> tuple[Array, Array, Array]:
        results = len(program.results)  # type: ignore[attr-defined]  # a Program
        r, Jx, Jp = np.empty(results), np.empty((results, len(x))), np.empty((results, p))
        machine.derivatives(program.arrays, self.filled, p, x, u, *self._tables, r, Jx, Jp)  # type: ignore[attr-defined]
        return r, Jx, Jp


@dataclass(frozen=True, kw_only=True, eq=False)
class _Standing:
    """Some equations whose inputs stand."""

    programs: EquationPrograms
    u: Array
    p: int = 0

    def change(self, x: Array) -> Array:
        return self.programs.changing(x, self.u)[0]

    def leaves(self, x: Array, free: NDArray[np.int64]) -> bool:
        by_state, first = self.programs.changing(x, self.u)[1], self.programs.lowered.n_continuous
        if not usable(by_state):
            return True
        rated, stepped = free[free < first], free[free >= first]
        rates = np.linalg.eigvals(by_state[np.ix_(rated, rated)])
        factors = np.linalg.eigvals(by_state[np.ix_(stepped, stepped)])
        size = np.abs(rates).max(initial=0.0)
        return bool((rates.real > LEAVES * size).any() or (np.abs(factors) > 1.0 + LEAVES).any())

    def __call__(self, x: Array) -> tuple[Derived, Derived]:
        return self.programs.standing(x, self.u, self.p)
