"""The state of an exported recursion: which number of the flat vector is which past sample.

Every format carries the same state, one flat row per car, so that a caller who has learnt it once can run
all of them, and move a run from one to another between two samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.models import AbstractModel, History, Lags, Recursion, StateSpace


def recursion_of(model: AbstractModel) -> Recursion:
    """The recursion that a model lowers to, which is what every format is written from.

    Args:
        model: The model.

    Returns:
        The recursion.

    Raises:
        ConfigError: If it lowers to a state space, which formats with delay lines cannot hold.
    """
    form = model.recursion
    if isinstance(form, Recursion):
        return form
    raise ConfigError(
        "this format cannot be written for this kind of model",
        expected="a model over lagged inputs and outputs (ARX, NARX)",
        got=model.structure.label,
        remedy="export a transfer function as onnx, torchscript or torch-export",
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearState:
    """The state of a linear state space: numbers without a channel of their own.

    Args:
        form: The state space.
    """

    form: StateSpace

    @property
    def size(self) -> int:
        """Length of the state."""
        return self.form.n_state

    @property
    def lines(self) -> tuple[DelayLine, ...]:
        """None: no number of the state is a past sample."""
        return ()

    def from_history(self, history: History) -> NDArray[np.float64]:
        """The state after some samples.

        Args:
            history: The samples, oldest first, in units; a single one is a system at rest.

        Returns:
            Shape ``(size,)``.
        """
        return self.form.state(history)

    def to_dict(self) -> dict[str, Any]:
        """How to begin at rest, as JSON values."""
        columns = [self.form.equilibrium(unit) for unit in np.eye(self.form.n_inputs)]
        return {
            "size": self.size,
            "rule": "at rest: at_rest times the scaled inputs, (value - offset) / scale, one column per input",
            "at_rest": np.column_stack(columns).tolist(),
        }


def layout_of(model: AbstractModel) -> StateLayout | LinearState:
    """The layout of a model's state, whatever form it lowers to.

    Args:
        model: The model.

    Returns:
        Delay lines, or the state of a state space.
    """
    form = model.recursion
    return LinearState(form=form) if isinstance(form, StateSpace) else StateLayout.of(model)


@dataclass(frozen=True, kw_only=True)
class DelayLine:
    """The past samples of one channel, newest first, in scaled numbers: ``(value - offset) / scale``.

    Args:
        channel: Its name.
        unit: Its unit.
        first: Where the line begins in the state.
        length: Samples held: the channel's longest lag. The output's line holds at least its last value.
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
        output: The line of the output, last in the state.

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
    output: DelayLine

    @classmethod
    def of(cls, model: AbstractModel) -> StateLayout:
        """The layout of a model's state.

        Args:
            model: The model.

        Returns:
            Lines as long as the model's lags need.
        """
        recursion = recursion_of(model)
        lengths = [max(lags, default=0) for lags in recursion.lags.inputs]
        first = [0, *accumulate(lengths)]
        scaling = recursion.scaling
        inputs = tuple(
            DelayLine(channel=name, unit=unit, first=at, length=length, offset=offset, scale=scale)
            for name, unit, at, length, offset, scale in zip(
                model.mapping.inputs,
                model.input_units,
                first[:-1],
                lengths,
                scaling.input_offset,
                scaling.input_scale,
                strict=True,
            )
        )
        output = DelayLine(
            channel=model.mapping.output,
            unit=model.output_unit,
            first=first[-1],
            length=max([1, *recursion.lags.output]),
            offset=scaling.output_offset,
            scale=scaling.output_scale,
        )
        return cls(inputs=inputs, output=output)

    @property
    def lines(self) -> tuple[DelayLine, ...]:
        """All lines in the state's order."""
        return (*self.inputs, self.output)

    @property
    def size(self) -> int:
        """Length of the state."""
        return self.output.first + self.output.length

    def from_history(self, history: History) -> NDArray[np.float64]:
        """The state after some samples.

        Args:
            history: The samples, oldest first, in units; a single one is a system at rest.

        Returns:
            Shape ``(size,)``.
        """
        inputs, output = history.padded(max(line.length for line in self.lines))
        columns = (*inputs.T, output)
        return np.concatenate(
            [
                (past[::-1][: line.length] - line.offset) / line.scale
                for line, past in zip(self.lines, columns, strict=True)
            ]
        )

    def regressor_columns(self, lags: Lags) -> NDArray[np.int64]:
        """Where each regressor stands in ``[scaled inputs | state]``.

        Args:
            lags: The model's regressors.

        Returns:
            Shape ``(n_regressors,)``, in the model's order.
        """
        n = len(self.inputs)
        inputs = [n + self.inputs[i].column(lag) if lag else i for i, per in enumerate(lags.inputs) for lag in per]
        return np.array(inputs + [n + self.output.column(lag) for lag in lags.output], dtype=np.int64)

    def next_columns(self) -> NDArray[np.int64]:
        """Where each number of the next state comes from in ``[scaled inputs | scaled output | state]``.

        Returns:
            Shape ``(size,)``.
        """
        n_new = len(self.inputs) + 1
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
