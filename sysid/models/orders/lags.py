"""Lags: which past samples a model looks at."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, shortened
from sysid.models.orders.activations import PLAIN

LagSpec = int | str | Iterable[int]
MOST = 10_000
"""Orders, lags and dead times end here, in samples: a slip of the pen is refused before it takes memory."""


def whole(value: object) -> bool:
    """Whether a value can be an order: a whole number from 0 to :data:`MOST`, and no truth value.

    Args:
        value: Anything that stands in a file.

    Returns:
        Whether it is.

    Example:
        >>> whole(3), whole(True), whole(2.5), whole(10**9)
        (True, False, False, False)
    """
    return isinstance(value, int | np.integer) and not isinstance(value, bool) and bool(0 <= value <= MOST)


def of_samples(value: object) -> bool:
    """Whether a value can be a dead time in samples that need not be whole.

    Args:
        value: Anything that stands in a file.

    Returns:
        Whether it is a number from 0 to :data:`MOST`.

    Example:
        >>> of_samples(2), of_samples(2.5), of_samples(-0.5), of_samples(float("nan"))
        (True, True, False, False)
    """
    return whole(value) or (isinstance(value, float | np.floating) and bool(0.0 <= value <= MOST))


def per_input(given: object) -> tuple[Any, ...]:
    """One order for each input; with a single input it may be written as a number.

    Args:
        given: A number, or a collection of numbers.

    Returns:
        The numbers; what is neither stands alone, to be refused by name.

    Example:
        >>> per_input(2), per_input([2, 3])
        ((2,), (2, 3))
    """
    return tuple(given) if isinstance(given, Iterable) and not isinstance(given, str | bytes) else (given,)


def is_one_set(spec: object) -> bool:
    """Whether lags are one set, for all channels, and not a collection of sets.

    Args:
        spec: In one of the forms that people write, or several of them.

    Returns:
        Whether it is; numbers of NumPy are numbers.

    Example:
        >>> is_one_set(3), is_one_set(np.arange(1, 4)), is_one_set([1, "0:3"])
        (True, True, False)
    """
    if isinstance(spec, str | bytes) or not isinstance(spec, Iterable):
        return True
    entries = list(spec)
    return bool(entries) and all(isinstance(one, int | np.integer) for one in entries)


def parse_lags(spec: LagSpec, *, first: int, where: str) -> tuple[int, ...]:
    """Lags from the forms that people write.

    Args:
        spec: ``4`` for 1 to 4 (as MATLAB's ``1:4``), ``"0:3"`` for a range, or a collection such as
            ``[1, 2, 4, 8]``.
        first: The smallest lag allowed: 0 for an input (the direct input x(n)), 1 for the output.
        where: The field, for the error's text.

    Returns:
        The lags, strictly increasing.

    Raises:
        ConfigError: If it is not a set of different whole numbers from ``first`` on.

    Example:
        >>> parse_lags(4, first=0, where="input_delays"), parse_lags("0:3", first=0, where="input_delays")
        ((1, 2, 3, 4), (0, 1, 2, 3))
    """
    try:
        if isinstance(spec, str):
            low, _, high = spec.partition(":")
            ends = int(low), int(high or low)
            lags = tuple(range(ends[0], ends[1] + 1)) if whole(ends[0]) and whole(ends[1]) else ()
        elif isinstance(spec, bytes):
            lags = ()
        elif isinstance(spec, int | np.integer):
            lags = tuple(range(1, int(spec) + 1)) if whole(spec) else ()
        else:
            entries = tuple(spec)
            lags = tuple(int(lag) for lag in entries) if all(whole(lag) for lag in entries) else ()
    except (TypeError, ValueError):
        lags = ()
    if not lags or min(lags) < first or any(b <= a for a, b in pairwise(lags)):
        raise ConfigError(
            "not a set of lags",
            where=where,
            expected=f"a number n for 1 to n, a range such as {first}:4, or increasing lags from {first} on; "
            f"none above {MOST:,}",
            got=shortened(spec),
            remedy=f"write [{first}] for the lag {first} alone"
            if whole(spec) and spec == 0
            else "list each lag once, smallest first",
        )
    return lags


def parse_output_lags(spec: LagSpec) -> tuple[int, ...]:
    """Lags of the output, from 1 on; an empty collection is a model that reads inputs alone.

    Args:
        spec: As :func:`parse_lags` takes it.

    Returns:
        The lags, strictly increasing.

    Raises:
        ConfigError: If it is not a set of different whole numbers from 1 on.

    Example:
        >>> parse_output_lags(2), parse_output_lags([])
        ((1, 2), ())
    """
    given = spec if is_one_set(spec) else tuple(cast("Iterable[int]", spec))
    return () if given == () else parse_lags(given, first=1, where="output_delays")


def check_reads(inputs: tuple[tuple[int, ...], ...], output: tuple[int, ...]) -> None:
    """Refuse a model that reads nothing.

    Args:
        inputs: Lags of each input.
        output: Lags of the output.

    Raises:
        ConfigError: If there is no lag at all.
    """
    if not output and not any(inputs):
        raise ConfigError(
            "a model of no lags reads nothing",
            where="output_delays",
            expected="lags of an input, or of the output",
            got="neither",
            remedy="write output_delays: 2 for a record without inputs, or input_delays: '0:2' for one with inputs",
        )


@dataclass(frozen=True, kw_only=True)
class Lags:
    """The regressors of a model, in order: input by input, then the past outputs.

    Args:
        inputs: For each input channel its lags in samples, from 0 on; may be empty for an input.
        output: Lags of the output in samples, from 1 on; may be empty (a finite memory of the inputs).
    """

    inputs: tuple[tuple[int, ...], ...]
    output: tuple[int, ...]

    @property
    def n_inputs(self) -> int:
        """Number of input channels."""
        return len(self.inputs)

    @property
    def n_regressors(self) -> int:
        """Number of regressors."""
        return sum(len(lags) for lags in self.inputs) + len(self.output)

    @cached_property
    def depth(self) -> int:
        """Past samples needed before the first step."""
        return max([0, *self.output, *(lag for lags in self.inputs for lag in lags)])

    @property
    def input_channel(self) -> NDArray[np.int64]:
        """Column of the input that each input regressor reads, shape ``(n_input_regressors,)``."""
        return np.array([i for i, lags in enumerate(self.inputs) for _ in lags], dtype=np.int64)

    @property
    def input_lag(self) -> NDArray[np.int64]:
        """Lag of each input regressor, shape ``(n_input_regressors,)``."""
        return np.array([lag for lags in self.inputs for lag in lags], dtype=np.int64)


@dataclass(frozen=True, kw_only=True)
class Lagged:
    """What a one-step map over lagged samples is made of: whether one structure contains another is read off it.

    Args:
        lags: The regressors.
        neurons: How many, 0 for a linear map.
        linear: Whether a linear part stands beside them.
        gated: Whether each neuron is a gate.
        activation: The kind of the neurons.
    """

    lags: Lags
    neurons: int = 0
    linear: bool = True
    gated: bool = False
    activation: str = PLAIN

    def contains(self, other: Lagged) -> bool:
        """Whether another map is this one with some weights of zero.

        Args:
            other: The map that is to be contained.

        Returns:
            Whether it is.

        Example:
            >>> lags = Lags(inputs=((0, 1),), output=(1,))
            >>> Lagged(lags=lags, neurons=4).contains(Lagged(lags=Lags(inputs=((1,),), output=(1,))))
            True
        """
        ours, theirs = self.lags, other.lags
        return (
            ours.n_inputs == theirs.n_inputs
            and all(set(few) <= set(many) for many, few in zip(ours.inputs, theirs.inputs, strict=True))
            and set(theirs.output) <= set(ours.output)
            and other.neurons <= self.neurons
            and other.linear <= self.linear
            and other.gated <= self.gated
            and (other.activation == self.activation or not other.neurons)
        )

    def __str__(self) -> str:
        inputs, output = list(map(list, self.lags.inputs)), list(self.lags.output)
        kind = f" {self.activation}" if self.activation != PLAIN else ""
        return f"input lags {inputs}, output lags {output}, {self.neurons}{' gated' * self.gated}{kind} neurons"
