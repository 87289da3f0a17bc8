"""A cascade as the tables that the compiled pass runs."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.kernels.cascade import Program
from sysid.models.lags import Lags
from sysid.models.recursion import Recursion
from sysid.models.vector_narx import VectorNARXModel
from sysid.models.wiring import Ends, Member


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """One member as the compiled pass sees it: a recursion over columns, its inputs' and then its outputs'.

    Args:
        lags: Lags of every column, as ``inputs``; ``output`` is empty.
        neurons: Number of neurons.
        theta: Flat parameters.
        linear: Whether there is a linear part.
        gated: Whether the neurons have gates.
        offset: Of every column, in its unit.
        scale: Of every column, in its unit.
        low: Lower bound of the outputs in scaled numbers.
        high: Upper bound of the outputs in scaled numbers.
    """

    lags: Lags
    neurons: int
    theta: NDArray[np.float64]
    linear: bool
    gated: bool
    offset: tuple[float, ...]
    scale: tuple[float, ...]
    low: float
    high: float

    @classmethod
    def of(cls, model: Member) -> Part | None:
        """A member as a part; ``None`` for one that is no recursion over lagged regressors."""
        if isinstance(model, VectorNARXModel):
            scaling = model.scaling
            return cls(
                lags=model.lags,
                neurons=model.network.neurons,
                theta=model.theta,
                linear=model.network.feedthrough,
                gated=False,
                offset=(*scaling.input_offset, *scaling.output_offset),
                scale=(*scaling.input_scale, *scaling.output_scale),
                low=-model.clamp,
                high=model.clamp,
            )
        form = model.recursion
        if not isinstance(form, Recursion):
            return None
        return cls(
            lags=Lags(inputs=(*form.lags.inputs, form.lags.output), output=()),
            neurons=form.neurons,
            theta=form.theta,
            linear=len(form.theta) > form.neurons * (form.lags.n_regressors + 2) + 1,
            gated=form.gates is not None,
            offset=(*form.scaling.input_offset, form.scaling.output_offset),
            scale=(*form.scaling.input_scale, form.scaling.output_scale),
            low=form.low,
            high=form.high,
        )


@dataclass(frozen=True, kw_only=True)
class Limit:
    """Values between which an output is held.

    Args:
        low: Lower limit in the channel's unit, or the name of the channel that is the limit; ``None`` for none.
        high: Upper limit, likewise.

    Example:
        >>> Limit(low=0.0, high="BP").to_dict()
        {'low': 0.0, 'high': 'BP'}
    """

    low: float | str | None = None
    high: float | str | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that it names."""
        return tuple(value for value in (self.low, self.high) if isinstance(value, str))

    def to_dict(self) -> dict[str, float | str | None]:
        """The fields as JSON values."""
        return {"low": self.low, "high": self.high}


def program_of(
    parts: Sequence[Part], ends: Sequence[Ends], channels: Sequence[str], limits: Dict[str, Limit]
) -> Program:
    """The tables of some members.

    Args:
        parts: The members, in the order in which they run.
        ends: Their inputs and outputs.
        channels: Columns of the array that they read and write.
        limits: Limits by output.

    Returns:
        The tables.
    """
    column_of = {name: i for i, name in enumerate(channels)}
    names = [(*end.inputs, *end.outputs) for end in ends]
    columns = _firsts([len(some) for some in names])
    written = [name for end in ends for name in end.outputs]
    regressors = [part.lags.input_channel + first for part, first in zip(parts, columns, strict=False)]
    held = [_limit(limits.get(name, Limit()), column_of) for name in written]
    done: set[str] = set()
    late: list[bool] = []
    for end in ends:
        late += [name in written and name not in done for name in end.inputs] + [False] * len(end.outputs)
        done |= set(end.outputs)
    return Program(
        theta=np.concatenate([part.theta for part in parts]),
        theta_first=_firsts([len(part.theta) for part in parts]),
        neurons=np.array([part.neurons for part in parts], dtype=np.int64),
        regressor_first=_firsts([len(some) for some in regressors]),
        regressor_column=np.concatenate(regressors),
        regressor_lag=np.concatenate([part.lags.input_lag for part in parts]),
        column_first=columns,
        column_channel=np.array([column_of[name] for some in names for name in some], dtype=np.int64),
        column_offset=np.array([value for part in parts for value in part.offset]),
        column_scale=np.array([value for part in parts for value in part.scale]),
        column_late=np.array(late),
        output_first=_firsts([len(end.outputs) for end in ends]),
        output_column=np.array(
            [first + len(end.inputs) + j for first, end in zip(columns, ends, strict=False) for j in _range(end)],
            dtype=np.int64,
        ),
        output_channel=np.array([column_of[name] for name in written], dtype=np.int64),
        bounds=np.array([[part.low, part.high] for part, end in zip(parts, ends, strict=True) for _ in _range(end)]),
        limits=np.array([values for values, _ in held]),
        limit_channel=np.array([indices for _, indices in held], dtype=np.int64),
    )


def _firsts(counts: Sequence[int]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _range(end: Ends) -> range:
    return range(len(end.outputs))


def _limit(limit: Limit, column_of: Dict[str, int]) -> tuple[list[float], list[int]]:
    values = [-np.inf, np.inf]
    indices = [-1, -1]
    for side, value in enumerate((limit.low, limit.high)):
        if isinstance(value, str):
            indices[side] = column_of[value]
        elif value is not None:
            values[side] = value
    return values, indices
