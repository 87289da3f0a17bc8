"""The form of every model with lagged regressors: a cascade of one, in its channels' units."""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.kernels import cascade as kernel
from sysid.kernels.arrays import read_only
from sysid.kernels.cascade_layout import Program
from sysid.kernels.cascade_plan import Plan
from sysid.models.channels.ends import Ends
from sysid.models.channels.history import History, fitting_columns
from sysid.models.contract.column_recursion import ColumnRecursion
from sysid.models.contract.form import AbstractForm
from sysid.models.lagged.cascade_program import Limit, program_of
from sysid.models.orders.lags import Lags
from sysid.models.orders.output_limits import Between

Array = NDArray[np.float64]
Planned = tuple[NDArray[np.uintp], Array, Array]
NOT_KEPT = np.empty((0, 0))
"""Room for activations of which nobody asks."""


def side_by_side(members: Sequence[ColumnRecursion], n_inputs: int, limits: Sequence[Between] = ()) -> Program:
    """Recursions that do not read each other, as one cascade.

    Args:
        members: They.
        n_inputs: How many of its columns each does not write.
        limits: Of each output of all, in its unit; empty for none.

    Returns:
        The cascade; its channels are the inputs of all, one member after the other, and then their outputs.
    """
    ends = [
        Ends(
            inputs=tuple(f"u{i},{m}" for i in range(n_inputs)), outputs=tuple(f"y{i},{m}" for i in range(n)),
            input_units=("",) * n_inputs, output_units=("",) * n, rest_outputs=(0.0,) * n, direct=frozenset(),
        )
        for m, n in enumerate(len(member.lags.inputs) - n_inputs for member in members)
    ]  # fmt: skip
    inputs, outputs = [name for one in ends for name in one.inputs], [name for one in ends for name in one.outputs]
    between = {name: Limit(low=low, high=high) for name, (low, high) in zip(outputs, limits, strict=False)}
    return program_of(members, ends, (*inputs, *outputs), between)


def opened(columns: ColumnRecursion, n_inputs: int) -> ColumnRecursion:
    """The recursion whose regressors of outputs read columns of their own, which stand between inputs and outputs.

    Args:
        columns: As it is fed with what it puts out.
        n_inputs: How many of its columns it does not write.

    Returns:
        It with one more column for every regressor that is an output, in their order.
    """
    n, lags = n_inputs, columns.lags.inputs
    own = [(channel, lag) for channel in range(n, len(lags)) for lag in lags[channel]]
    place = [*range(n), *(channel for channel, _ in own), *range(n, len(lags))]
    return replace(
        columns,
        lags=Lags(inputs=(*lags[:n], *((lag,) for _, lag in own), *((),) * (len(lags) - n)), output=()),
        offset=tuple(columns.offset[i] for i in place),
        scale=tuple(columns.scale[i] for i in place),
    )


@lru_cache(maxsize=128)
def _plan(n_theta: int, n_inputs: int, limits: tuple[Between, ...], **structure: Any) -> Plan:
    """The plan of one recursion, whatever its parameters are: to make one takes as long as a run of 2,000 samples."""
    columns = ColumnRecursion(theta=np.zeros(n_theta), **structure)
    return Plan.of(side_by_side([columns], n_inputs, limits))


def _planned_alone(columns: ColumnRecursion, n_inputs: int, limits: tuple[Between, ...]) -> Planned:
    """What the pass is given of one recursion without an equation: its plan and its parameters."""
    structure = {one.name: getattr(columns, one.name) for one in fields(columns) if one.name != "theta"}
    theta = np.ascontiguousarray(columns.theta, dtype=np.float64)
    return *_plan(len(theta), n_inputs, limits, **structure), read_only(theta)


class AbstractLaggedForm(AbstractForm):
    """A recursion over lagged inputs and outputs that is run by the compiled pass of cascades, as one of one member.

    An output of shape ``(n_samples,)`` is one column there.
    """

    @property
    @abstractmethod
    def columns(self) -> ColumnRecursion:
        """It as a member of a cascade."""

    @property
    @abstractmethod
    def n_inputs(self) -> int:
        """How many of these columns are inputs."""

    @property
    @abstractmethod
    def output_limits(self) -> tuple[Between, ...]:
        """Limits of each output in its unit; empty for none."""

    @cached_property
    def _planned(self) -> Planned:
        return _planned_alone(self.columns, self.n_inputs, self.output_limits)

    @property
    def _own(self) -> int:
        """The longest lag of an output."""
        return max(max(lags, default=0) for lags in self.columns.lags.inputs[self.n_inputs :])

    @property
    def memory(self) -> int:
        """Lags before the first row, and rows to tell the outputs among them."""
        return self.columns.lags.depth + self._own

    def simulate(self, inputs: Array, history: History) -> Array:
        """Free run; see the base class."""
        depth, m = self.columns.lags.depth, self.n_inputs
        room = self._room(inputs, history)
        walk(self._planned, room, depth)
        return np.ascontiguousarray(room[depth:, m:]).reshape(len(inputs), *history.output.shape[1:])

    def refined(self, history: History) -> History:
        """Past outputs by Gauss-Newton on those before the first row, followed by the free run from there.

        Masked outputs take no part. A single Gauss-Newton step is exact for a linear model. What is found leaves no
        more of the history than what was measured before the first row; where it foretells clearly worse than that, see
        :func:`foretold`, what was measured stays. The history is as it is where it is no longer than the lags, or the
        run is lost; see the base class.
        """
        depth, own, n = self.columns.lags.depth, self._own, len(history.output)
        if own == 0 or n <= depth:
            return history
        scaling, places = self.scaling, slice(depth - own, n)
        room = np.column_stack([history.inputs, history.output])
        measured = scaling.scale_output(history.output)[places]

        def run(past: Array) -> Array:
            y = scaling.unscale_output(past.reshape(own, *measured.shape[1:]))
            room[depth - own : depth, self.n_inputs :] = y.reshape(own, -1)
            walk(self._planned, room, depth)
            return scaling.scale_output(room[places, self.n_inputs :].reshape(measured.shape)).ravel()

        known = np.repeat(history.known[places], measured[0].size)
        found = gauss_newton(run, measured[:own].ravel(), measured.ravel(), known)
        if found is None:
            return history
        if not foretold(run, measured[:own].ravel(), measured.ravel(), known):
            found = measured[:own].ravel()
        output = history.output.copy()
        output[places] = scaling.unscale_output(run(found).reshape(measured.shape))
        return History(inputs=history.inputs, output=output)

    def followed(self, history: History) -> Array:
        """The free run over a history itself; see the base class."""
        return self.refined(history).output

    def predict(self, inputs: Array, output: Array, history: History, steps: int) -> Array:
        """Prediction ``steps`` ahead, of all samples at once, step by step; see the base class."""
        columns, m = self.columns, self.n_inputs
        depth, lags = columns.lags.depth, columns.lags.inputs[m:]
        own = [(j, lag) for j, some in enumerate(lags) for lag in some]
        room = self._room(inputs, history)
        y = room[:, m:].copy()
        y[depth:] = np.reshape(np.asarray(output, dtype=np.float64), (len(inputs), -1))
        room = np.concatenate([room[:, :m], np.empty((len(room), len(own))), y], axis=1)
        plan = _planned_alone(opened(columns, m), m + len(own), self.output_limits)
        # What was predicted of each sample one step less before it is the newest; none of it is newer than measured.
        newest = deque[Array](maxlen=max(1, self._own))
        for step in range(1, min(steps, len(inputs)) + 1):
            for k, (j, lag) in enumerate(own, m):
                room[:, k] = (newest[-lag] if lag < step else y)[:, j]
            # The samples before were predicted from the history, fewer steps before them.
            walk(plan, room, depth + step - 1)
            newest.append(room[:, m + len(own) :].copy())
        return (newest[-1] if newest else y)[depth:].reshape(len(inputs), *history.output.shape[1:])

    def _room(self, inputs: Array, history: History) -> Array:
        """Inputs and outputs side by side, in their units; after the history's the outputs are zero."""
        inputs = self._checked(inputs, history)
        past_inputs, past_output = history.padded(self.columns.lags.depth)
        depth, n = len(past_inputs), len(inputs)
        room = np.zeros((depth + n, len(self.columns.lags.inputs)))
        room[:depth] = np.column_stack([past_inputs, past_output])
        room[depth:, : self.n_inputs] = inputs
        return room

    def extended(self, inputs: Array, history: History) -> tuple[Array, Array]:
        """Scaled inputs with their past, and room for the outputs after their past.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.
            history: The samples before.

        Returns:
            Inputs of shape ``(depth + n_samples, n_inputs)`` and outputs of shape ``(depth + n_samples, n_outputs)``,
            both scaled; the outputs' last ``n_samples`` are zero.

        Raises:
            TraceError: If the number of inputs is not the model's.
        """
        inputs = self._checked(inputs, history)
        past_inputs, past_output = history.padded(self.columns.lags.depth)
        n_outputs = len(self.columns.lags.inputs) - self.n_inputs  # of no past none can be counted
        past = self.scaling.scale_output(past_output).reshape(len(past_inputs), n_outputs)
        u = self.scaling.scale_inputs(np.concatenate([past_inputs, inputs]))
        return u, np.concatenate([past, np.zeros((len(inputs), past.shape[1]))])

    @property
    def bounds(self) -> Array:
        """Between what the kernels hold each output, in scaled numbers: bounds within the limits.

        Returns:
            Shape ``(n_outputs, 2)``, infinite for none.
        """
        n = len(self.columns.lags.inputs) - self.n_inputs
        given = self.output_limits or ((None, None),) * n
        sides = np.array([[-np.inf if low is None else low, np.inf if high is None else high] for low, high in given])
        low, high = self.scaling.scale_output(sides.T)
        return np.clip([[self.low], [self.high]], low, high).T

    def _checked(self, inputs: Array, history: History) -> Array:
        """Inputs of the right shape, or an error."""
        fitting_columns(history.inputs, self.n_inputs)
        return fitting_columns(inputs, self.n_inputs)


def walk(plan: Planned, room: Array, past: int) -> None:
    """Run over the rows of an array from ``past`` on, in units, whatever holds the outputs."""
    held = np.empty((len(room) - past, room.shape[1]), dtype=np.int8)
    kernel.go_on(*plan, past, room, NOT_KEPT, held)


STEPS, APART = 12, 1e-5
"""Gauss-Newton steps at most, and how far apart outputs are put for a derivative, in scaled numbers."""


CLEARLY = 2.0
"""Times the squared error of a run from what was measured from which on one from what was found is worse."""


def foretold(
    run: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    start: NDArray[np.float64],
    target: NDArray[np.float64],
    known: NDArray[np.bool_],
) -> bool:
    """Whether what is found on the first half of a target foretells the second no worse than the first guess does.

    Over what it is found on it is always better. Where a model errs for longer than that, as one that rings over half a
    swing, it makes up for these errors, and is far off later.

    Args:
        run: See :func:`gauss_newton`.
        start: The first guess.
        target: What the run should give.
        known: Which of the target's values count.

    Returns:
        Whether it does, or halves are too short to say.
    """
    if len(target) < 3 * len(start):
        return True
    later = known & (np.arange(len(target)) >= (len(target) + len(start)) // 2)
    found = gauss_newton(run, start, target, known & ~later)

    def left(x: NDArray[np.float64]) -> float:
        error = (run(x) - target)[later]
        return float(error @ error)

    return found is None or bool(left(found) <= CLEARLY * left(start))  # a run that is lost leaves no number


def gauss_newton(
    run: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    start: NDArray[np.float64],
    target: NDArray[np.float64],
    known: NDArray[np.bool_],
) -> NDArray[np.float64] | None:
    """What to begin a run with so that it comes closest to a target.

    Args:
        run: From what it begins with to what it gives, both flat.
        start: The first guess.
        target: What it should give.
        known: Which of the target's values count.

    Returns:
        What was found; ``None`` where no run is finite.
    """

    def residual(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(known, run(x) - target, 0.0)

    x, r = start.copy(), residual(start)
    if not np.isfinite(r).all():
        return None
    for _ in range(STEPS):
        moved = [residual(x + step) - residual(x - step) for step in APART * np.eye(len(x))]
        J = np.column_stack(moved) / (2.0 * APART)
        if not np.isfinite(J).all():
            return x
        step, share, better = np.linalg.lstsq(J, -r, rcond=1e-10)[0], 1.0, False
        while not better and share > 1e-3:
            trial = residual(x + share * step)
            better = bool(np.isfinite(trial).all() and trial @ trial < r @ r)
            if better:
                gained = r @ r - trial @ trial
                x, r = x + share * step, trial
            share /= 4.0
        if not better or gained < 1e-12 * (r @ r):
            break
    return x
