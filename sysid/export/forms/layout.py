"""The state of an exported model: which number of the flat vector is which past sample.

Every format carries the same state, one flat row per car, so that a caller who has learnt it once can run
all of them, and move a run from one to another between two samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.export.forms.lagged import LaggedForm, lowered_form
from sysid.export.forms.programs import ProgramForm
from sysid.export.forms.state_space import StateSpaceForm
from sysid.models import History
from sysid.models.cascades.wiring import Member


@dataclass(frozen=True, kw_only=True, eq=False)
class HiddenState:
    """The state of a state space: numbers without a channel of their own.

    Args:
        form: The state space.
    """

    form: StateSpaceForm

    @property
    def size(self) -> int:
        """Length of the state."""
        return self.form.n_state

    @property
    def lines(self) -> tuple[DelayLine, ...]:
        """None: no number of the state is a past sample."""
        return ()

    def from_history(self, history: History) -> NDArray[np.float64]:
        """The state after some samples; see :meth:`StateSpaceForm.from_history`."""
        return self.form.from_history(history)

    def at_rest(self, levels: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state of a system that has stood at some values for ever.

        Args:
            levels: Inputs, then the output, in their units.

        Returns:
            Shape ``(size,)``.
        """
        n = self.form.n_inputs
        return self.from_history(History.at_rest(inputs=levels[:n], output=self.form.rest_of(levels[n:])))

    def to_dict(self) -> dict[str, Any]:
        """How to begin at rest, as JSON values."""
        form = self.form
        channels = form.rest_channels
        bounds = {"bound": form.bound} if np.isfinite(form.bound) else {}
        return {
            "size": self.size,
            "rule": "at rest: constant plus at_rest times the scaled channels, (value - offset) / scale, one column "
            "per channel; within the bound, where there is one, on both sides of zero",
            "channels": list(channels),
            "offset": list(form.offset[: len(channels)]),
            "scale": list(form.scale[: len(channels)]),
            "at_rest": form.gain.tolist(),
            "constant": form.rest.tolist(),
            **bounds,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class EquationState:
    """The state of equations: their states in units, then past samples of inputs that are read later.

    Args:
        form: The equations.
    """

    form: ProgramForm

    @property
    def size(self) -> int:
        """Length of the state."""
        return self.form.n_state + sum(self.form.depths)

    @property
    def lines(self) -> tuple[DelayLine, ...]:
        """One line an input, behind the states."""
        ends, depths = self.form.ends, self.form.depths
        first = [self.form.n_state + at for at in [0, *accumulate(depths)]]
        return tuple(
            DelayLine(channel=name, unit=unit, first=at, length=depth, offset=0.0, scale=1.0)
            for name, unit, at, depth in zip(ends.inputs, ends.input_units, first, depths, strict=False)
        )

    def from_history(self, history: History) -> NDArray[np.float64]:
        """The state after some samples, as the model finds it.

        Args:
            history: The samples, oldest first, in units; a single one is a system at rest.

        Returns:
            Shape ``(size,)``.
        """
        inputs, _ = history.padded(max(self.form.depths, default=0))
        past = [column[::-1][:depth] for column, depth in zip(inputs.T, self.form.depths, strict=False)]
        return np.concatenate([self.form.state_after(history), *past])

    def at_rest(self, levels: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state of a system that has stood at some values for ever.

        Args:
            levels: Inputs, then outputs, in their units.

        Returns:
            Shape ``(size,)``.
        """
        n = self.form.n_inputs
        return self.from_history(self.form.history_at(levels[:n], levels[n:]))

    def next_columns(self) -> NDArray[np.int64]:
        """Where each past sample of the next state comes from in ``[inputs | state]``; behind the states.

        Returns:
            Shape ``(size - n_states,)``.
        """
        n = self.form.n_inputs
        columns = [
            i if lag == 1 else n + line.column(lag - 1)
            for i, line in enumerate(self.lines)
            for lag in range(1, line.length + 1)
        ]
        return np.array(columns, dtype=np.int64)

    def to_dict(self) -> dict[str, Any]:
        """The states, and how to begin at rest, as JSON values."""
        return {
            "size": self.form.n_state,
            "names": list(self.form.states),
            "rule": "states in their own units; at rest a state that is declared has its value, the others are where "
            "nothing changes: see initialisation.state and verify/states.json for computed examples",
            "declared": list(self.form.declared),
        }


def layout_of(model: Member, *, spare: bool = False) -> StateLayout | HiddenState | EquationState:
    """The layout of a model's state, whatever it lowers to.

    Args:
        model: The model.
        spare: Whether equations without states have a number all the same.

    Returns:
        Delay lines, the state of a state space, or that of equations.

    Raises:
        ConfigError: If it lowers to none of them.
    """
    form = lowered_form(model, spare=spare)
    if isinstance(form, ProgramForm):
        return EquationState(form=form)
    return HiddenState(form=form) if isinstance(form, StateSpaceForm) else StateLayout.of_form(form)


@dataclass(frozen=True, kw_only=True)
class DelayLine:
    """The past samples of one channel, newest first, in scaled numbers: ``(value - offset) / scale``.

    Args:
        channel: Its name.
        unit: Its unit.
        first: Where the line begins in the state.
        length: Samples held: the channel's longest lag. An output's line holds at least its last value.
        offset: In the channel's unit.
        scale: In the channel's unit.
    """

    channel: str
    unit: str
    first: int
    length: int
    offset: float
    scale: float

    def column(self, lag: int) -> int:
        """Where the sample ``lag`` steps ago stands in the state (``lag`` from 1 to ``length``)."""
        return self.first + lag - 1

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {
            "channel": self.channel,
            "unit": self.unit,
            "first": self.first,
            "length": self.length,
            "offset": self.offset,
            "scale": self.scale,
        }


@dataclass(frozen=True, kw_only=True)
class StateLayout:
    """The delay lines of a model, laid end to end.

    Scaled numbers are kept because that is what the model feeds back: a state in units would be rounded
    twice at every step, which a free run can amplify, and a run in pieces would no longer equal one long run.

    Args:
        inputs: One line per input, in the mapping's order; empty for an input that is only used directly.
        outputs: One line per output, last in the state.

    Example:
        >>> from sysid.models import ARX, ARXModel, Mapping
        >>> model = ARXModel(orders=ARX(na=1, nb=(2,), nk=(1,)), coefficients=np.array([1.0, 2.0, 0.5]),
        ...     intercept=0.0, mapping=Mapping.parse("u -> y"), sample_time=0.1, input_units=("V",),
        ...     output_unit="psi", rest_output=0.0)
        >>> layout = StateLayout.of(model)
        >>> layout.from_history(History(inputs=[[7.0], [8.0]], output=[1.0, 2.0])).tolist()
        [8.0, 7.0, 2.0]
    """

    inputs: tuple[DelayLine, ...]
    outputs: tuple[DelayLine, ...]

    @classmethod
    def of(cls, model: Member) -> StateLayout:
        """The layout of a model's state; :class:`ConfigError` if it has no delay lines."""
        return cls.of_form(LaggedForm.of(model))

    @classmethod
    def of_form(cls, form: LaggedForm) -> StateLayout:
        """The layout of a form's state.

        Args:
            form: The lowered form.

        Returns:
            Lines as long as the model's lags need.
        """
        ends, n = form.ends, form.n_inputs
        lengths = [max([int(i >= n), *own]) for i, own in enumerate(form.lags)]
        first = [0, *accumulate(lengths)][:-1]
        names, units = (*ends.inputs, *ends.outputs), (*ends.input_units, *ends.output_units)
        lines = tuple(
            DelayLine(channel=name, unit=unit, first=at, length=length, offset=offset, scale=scale)
            for name, unit, at, length, offset, scale in zip(
                names, units, first, lengths, form.offset, form.scale, strict=True
            )
        )
        return cls(inputs=lines[:n], outputs=lines[n:])

    @property
    def lines(self) -> tuple[DelayLine, ...]:
        """All lines in the state's order."""
        return (*self.inputs, *self.outputs)

    @property
    def size(self) -> int:
        """Length of the state."""
        return self.lines[-1].first + self.lines[-1].length

    def from_history(self, history: History) -> NDArray[np.float64]:
        """The state after some samples of a model.

        Args:
            history: The samples, oldest first, in units; a single one is a system at rest.

        Returns:
            Shape ``(size,)``.
        """
        inputs, output = history.padded(max(line.length for line in self.lines))
        columns = (*inputs.T, *output.reshape(len(output), -1).T)
        return np.concatenate(
            [
                (past[::-1][: line.length] - line.offset) / line.scale
                for line, past in zip(self.lines, columns, strict=True)
            ]
        )

    def at_rest(self, levels: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state of a system that has stood still for ever.

        Args:
            levels: Inputs, then outputs, in their units.

        Returns:
            Shape ``(size,)``.
        """
        return np.concatenate(
            [
                np.full(line.length, (level - line.offset) / line.scale)
                for line, level in zip(self.lines, levels, strict=True)
            ]
        )

    def column(self, channel: int, lag: int) -> int:
        """Where a sample stands in ``[scaled inputs | state]``.

        Args:
            channel: An input, or the number of inputs plus the place of an output.
            lag: How many steps ago; 0 for an input of this step.

        Returns:
            The column.
        """
        return len(self.inputs) + self.lines[channel].column(lag) if lag else channel

    def next_columns(self) -> NDArray[np.int64]:
        """Where each number of the next state comes from in ``[scaled inputs | scaled outputs | state]``.

        Returns:
            Shape ``(size,)``.
        """
        n_new = len(self.lines)
        columns = [
            i if lag == 1 else n_new + line.column(lag - 1)
            for i, line in enumerate(self.lines)
            for lag in range(1, line.length + 1)
        ]
        return np.array(columns, dtype=np.int64)

    def to_dict(self) -> dict[str, Any]:
        """The layout as JSON values, with how to read it."""
        return {
            "size": self.size,
            "order": "delay line after delay line; within a line the newest sample first",
            "number": "(value in the channel's unit - offset) / scale",
            "lines": [line.to_dict() for line in self.lines],
        }
