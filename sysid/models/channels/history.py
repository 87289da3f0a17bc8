"""History: what a recursion remembers before its first step, and how a trace provides it."""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError, shortened


@dataclass(frozen=True, kw_only=True, eq=False)
class History:
    """Past inputs and outputs, oldest first, in the channels' units.

    A history may be shorter than a model's longest lag: the oldest sample is then held, so that one
    sample alone is a system at rest.

    Args:
        inputs: Shape ``(n_past, n_inputs)``.
        output: Shape ``(n_past,)``, or ``(n_past, n_outputs)`` before a model of several outputs.
        usable: Which outputs are not masked, shape ``(n_past,)``; ``None`` for all. A state is estimated from those.
        case: Name of the record that it stands before; empty where there is none.
        constants: Values of a model's parameters by case in the record, in their units; empty where they are not known
            yet, or there are none.

    Raises:
        TraceError: If the two have different lengths, or there is no sample.

    Example:
        >>> History.at_rest(inputs=[90.0, 90.0], output=0.0).padded(3)[1].tolist()
        [0.0, 0.0, 0.0]
    """

    inputs: NDArray[np.float64]
    output: NDArray[np.float64]
    usable: NDArray[np.bool_] | None = None
    case: str = ""
    constants: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        inputs = known_inputs(np.array(self.inputs, dtype=np.float64, ndmin=2))
        output = np.array(self.output, dtype=np.float64, ndmin=1)
        if inputs.ndim != 2 or output.ndim not in {1, 2} or len(inputs) != len(output) or len(output) == 0:
            raise TraceError(
                "the history's inputs and output do not match",
                expected="inputs of shape (n_past, n_inputs) and an output of shape (n_past,), n_past at least 1",
                got=f"shapes {inputs.shape} and {output.shape}",
                remedy="give one row of inputs for each past output",
            )
        object.__setattr__(self, "inputs", inputs)
        object.__setattr__(self, "output", output)

    @classmethod
    def at_rest(cls, *, inputs: NDArray[np.float64] | list[float], output: float | NDArray[np.float64]) -> History:
        """A system that has stood at these values for ever.

        Args:
            inputs: One value per input.
            output: The output's value, or one for each of several outputs, shape ``(n_outputs,)``.

        Returns:
            A history of one sample.
        """
        return cls(inputs=np.atleast_2d(np.asarray(inputs, dtype=np.float64)), output=np.asarray(output)[np.newaxis])

    @property
    def known(self) -> NDArray[np.bool_]:
        """Which outputs are not masked, as an array."""
        return np.ones(len(self.output), dtype=np.bool_) if self.usable is None else self.usable

    def padded(self, n_past: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The last ``n_past`` samples, the oldest one held where the history is shorter.

        Args:
            n_past: Samples wanted.

        Returns:
            Inputs of shape ``(n_past, n_inputs)`` and output of shape ``(n_past,)``, or ``(n_past, n_outputs)``.
        """
        if n_past == 0:
            return self.inputs[:0], self.output[:0]
        missing = max(0, n_past - len(self.output))
        inputs = np.concatenate([np.repeat(self.inputs[:1], missing, axis=0), self.inputs])[-n_past:]
        output = np.concatenate([np.repeat(self.output[:1], missing, axis=0), self.output])[-n_past:]
        return inputs, output


def known_inputs(inputs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inputs with what is infinite as not a number: a free run answers neither, and says so the same way.

    Without it a network saturates and gives a number that looks like an answer, a linear model loses its output some
    samples later, and every exported format does one or the other by how it sums.

    Args:
        inputs: Any shape.

    Returns:
        The same array where all of it is finite.

    Example:
        >>> known_inputs(np.array([1.0, np.inf, np.nan])).tolist()
        [1.0, nan, nan]
    """
    inputs = np.asarray(inputs, dtype=np.float64)
    return np.where(np.isinf(inputs), np.nan, inputs) if np.isinf(inputs).any() else inputs


def input_columns(values: object, names: Sequence[str]) -> NDArray[np.float64]:
    """What was given as a model's inputs, as numbers in columns.

    Args:
        values: Shape ``(n_samples, n_inputs)``; one input may lie flat.
        names: The inputs.

    Returns:
        The numbers, of which what is infinite or masked is not a number.

    Raises:
        TraceError: If they are no real numbers.
    """
    found = np.asarray(values)
    if found.dtype.kind not in "buifO":
        raise _no_numbers(found)
    try:
        inputs = np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError):
        raise _no_numbers(found) from None
    if isinstance(values, np.ma.MaskedArray):
        inputs = np.where(np.ma.getmaskarray(values), np.nan, inputs)
    return known_inputs(inputs[:, np.newaxis] if inputs.ndim == 1 and len(names) == 1 else inputs)


def fitting_columns(inputs: NDArray[np.float64], n: int, *, more: bool = False) -> NDArray[np.float64]:
    """Inputs as float64, a column for each that a form reads.

    Args:
        inputs: What is given.
        n: How many columns there have to be.
        more: Whether there may be more, which are not read.

    Returns:
        The inputs.

    Raises:
        TraceError: If they have another shape.
    """
    found = np.asarray(inputs, dtype=np.float64)
    if found.ndim != 2 or found.shape[1] < n or (found.shape[1] > n and not more):
        raise TraceError(
            "the inputs do not fit the model",
            expected=f"inputs and history of shape (n, {n})",
            got=f"shape {found.shape}",
            remedy="give one column per input of the mapping, in its order",
        )
    return found


def _no_numbers(found: NDArray[Any]) -> TraceError:
    return TraceError(
        "the inputs are no numbers",
        expected="real numbers of shape (n_samples, n_inputs)",
        got=f"shape {found.shape} of type {found.dtype}",
        remedy="give an array of numbers, one column an input; fit.simulate takes frames and records too",
    )


class StartKind(enum.Enum):
    """Where the samples before a record's first step come from."""

    REST = "rest"
    FIRST_SAMPLE = "first-sample"
    MEASURED = "measured"
    ESTIMATED = "estimated"


@dataclass(frozen=True, kw_only=True)
class Start:
    """How a free run over a trace is started, and from which sample on it is scored.

    * ``rest``: inputs held at their first sample, output at the model's declared rest value; nothing is
      taken from the measured output, every sample is scored.
    * ``first-sample``: the same with the first measured output held.
    * ``measured``: the first ``n_measured`` samples of the record are the history; scoring begins after
      them, as in the public benchmarks.
    * ``estimated``: the state before the record is estimated from its first samples, for each record and each model,
      and scoring begins after them (:mod:`sysid.models.contract.beginning`). A fit takes nothing for granted of what
      came before a record: rows of lags begin where all of them are measured, and initial states are fitted with the
      parameters.

    Args:
        kind: Which of the four.
        n_measured: Samples used, for ``measured``; and for ``estimated``, where 0 leaves the choice to the model.

    Raises:
        ConfigError: If ``n_measured`` does not go with the kind.
    """

    kind: StartKind = StartKind.REST
    n_measured: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "kind", StartKind(self.kind))  # so that "measured" may be written
        fits = (
            self.n_measured >= 0
            if self.kind is StartKind.ESTIMATED
            else ((self.kind is StartKind.MEASURED) == (self.n_measured > 0))
        )
        if not fits:
            raise ConfigError(
                "the number of measured samples does not go with the kind of start",
                expected="n_measured above 0 for a measured start, and 0 otherwise",
                got=f"{self.kind.value} with n_measured = {self.n_measured}",
                remedy="write start: estimated, start: rest, start: first-sample, or start: {measured: 50}",
            )

    @classmethod
    def of(cls, value: object) -> Start:
        """A start as people write it.

        Args:
            value: A start, or ``"estimated"``, ``"rest"``, ``"first-sample"``, ``{"measured": 50}`` or
                ``"measured=50"``.

        Returns:
            The start.

        Raises:
            ConfigError: If it is none.

        Example:
            >>> Start.of("measured=50") == Start.of({"measured": 50})
            True
        """
        if isinstance(value, Start):
            return value
        found: object = value
        if isinstance(found, str):
            word, equals, number = found.partition("=")
            found = {word: int(number)} if equals and number.strip().isdecimal() else word
        try:
            if isinstance(found, str) and found != StartKind.MEASURED.value:
                return cls(kind=StartKind(found))
            if isinstance(found, Mapping) and len(found) == 1 and set(found) <= {"measured", "estimated"}:
                ((kind, n),) = found.items()
                if type(n) is int:
                    return cls(kind=StartKind(kind), n_measured=n)
        except ValueError:
            pass
        raise ConfigError(
            "not a way to start a free run",
            expected="estimated, rest, first-sample, {measured: 50} for 50 measured samples, or {estimated: 200}",
            got=shortened(value),
            remedy="choose one of the four, or leave start out: it is then estimated",
        )

    def history(
        self,
        inputs: NDArray[np.float64],
        output: NDArray[np.float64],
        rest_output: float | NDArray[np.float64],
        usable: NDArray[np.bool_] | None = None,
    ) -> History:
        """The history that a record begins with, before any model is known.

        Args:
            inputs: The record's inputs, shape ``(n_samples, n_inputs)``.
            output: The record's measured output, shape ``(n_samples,)`` or ``(n_samples, n_outputs)``; read only as the
                kind allows.
            rest_output: The output's declared rest value.
            usable: Which samples are not masked; all by default. The first sample is then the first of those.

        Returns:
            The history before sample ``n_measured``. For an estimated start it is the first sample held, which stands
            for what is not known yet.

        Raises:
            TraceError: If the record is not longer than the measured start.
        """
        if self.kind is StartKind.REST:
            return History.at_rest(inputs=inputs[0], output=rest_output)
        if self.kind is not StartKind.MEASURED:
            first = 0 if usable is None or not usable.any() else int(np.argmax(usable))
            return History.at_rest(inputs=inputs[first], output=output[first])
        if len(output) <= self.n_measured:
            raise TraceError(
                "the record is too short for its start",
                expected=f"more than {self.n_measured} samples",
                got=f"{len(output)} samples",
                remedy="use fewer measured samples, or a longer record",
            )
        known = output if usable is None else bridged(output, usable)  # what stands under a mask is a filling
        return History(inputs=inputs[: self.n_measured], output=known[: self.n_measured])


StartLike = Start | str | Mapping[str, int]
"""What :meth:`Start.of` takes."""


def bridged(output: NDArray[np.float64], usable: NDArray[np.bool_]) -> NDArray[np.float64]:
    """An output with straight lines over its masked samples.

    Args:
        output: Shape ``(n_samples,)`` or ``(n_samples, n_outputs)``.
        usable: Which samples are not masked, shape ``(n_samples,)`` or as the output.

    Returns:
        The output; itself where nothing, or all of it, is masked.
    """
    if usable.all() or not usable.any():
        return output
    found = output.copy()
    columns = found.reshape(len(found), -1)
    masks = usable.reshape(len(found), -1)
    for j in range(columns.shape[1]):
        known = np.flatnonzero(masks[:, min(j, masks.shape[1] - 1)])
        if 0 < len(known) < len(columns):
            columns[:, j] = np.interp(np.arange(len(columns)), known, columns[known, j])
    return found
