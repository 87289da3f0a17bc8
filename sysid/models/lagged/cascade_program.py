"""A cascade as the tables that the compiled pass runs."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid.kernels.cascade_layout import Equations, Program
from sysid.kernels.cascade_plan import firsts
from sysid.kernels.neurons import code_of
from sysid.kernels.register_machine import TABLE
from sysid.models.channels.ends import Ends
from sysid.models.contract.column_recursion import ColumnEquation, ColumnRecursion

_Number = TypeVar("_Number", np.int64, np.float64)


NOBODY = ""
"""What a limit tells that is how something is computed."""


@dataclass(frozen=True, kw_only=True)
class Limit:
    """Values between which an output is held.

    Args:
        low: Lower limit in the channel's unit, or the name of the channel that is the limit; ``None`` for none.
        high: Upper limit, likewise.
        doubt: Whether an output that is there says that the whole does not know its answer: its exports raise a flag
            of their own for it. See :func:`sysid.composite.committee`.
        tells: The output of which this one is a part, as of a mean: that it is held is told where that one leaves the
            whole too. :data:`NOBODY` where it is no limit to anybody, but how a lesser of two is computed.

    Example:
        >>> Limit(low=0.0, high="BP").to_dict()
        {'low': 0.0, 'high': 'BP'}
    """

    low: float | str | None = None
    high: float | str | None = None
    doubt: bool = False
    tells: str | None = None

    def tells_of(self, name: str, output: str) -> bool:
        """Whether it is told of an output that a channel is held.

        Args:
            name: The channel that it holds.
            output: The output.

        Returns:
            Whether it is: of the channel itself, and of what that is a part of.
        """
        return output == self.tells or (output == name and self.tells != NOBODY)

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that it names."""
        return tuple(value for value in (self.low, self.high) if isinstance(value, str))

    def to_dict(self) -> dict[str, float | str | bool | None]:
        """The fields as JSON values."""
        sides: dict[str, float | str | bool | None] = {"low": self.low, "high": self.high}
        more = ({"doubt": True} if self.doubt else {}) | ({} if self.tells is None else {"tells": self.tells})
        return sides | more


def program_of(
    members: Sequence[ColumnRecursion], ends: Sequence[Ends], channels: Sequence[str], limits: Dict[str, Limit]
) -> Program:
    """The tables of some members.

    Args:
        members: The members, in the order in which they run.
        ends: Their inputs and outputs.
        channels: Columns of the array that they read and write.
        limits: Limits by output.

    Returns:
        The tables.
    """
    column_of = {name: i for i, name in enumerate(channels)}
    written = [name for end in ends for name in end.outputs]
    held = [_limit(limits.get(name, Limit()), column_of) for name in written]
    # Of each member the columns that it reads, and then its outputs: a regressor is one of them and a lag.
    columns = [np.array([column_of[name] for name in (*end.inputs, *end.outputs)], dtype=np.int64) for end in ends]
    regressors = [member.lags.input_channel for member in members]
    offsets, scales = (
        [np.array(member.offset) for member in members],
        [np.array(member.scale) for member in members],
    )
    return Program(
        theta=np.concatenate([member.theta for member in members]),
        theta_first=firsts([len(member.theta) for member in members]),
        neurons=np.array([member.neurons for member in members], dtype=np.int64),
        kinds=np.array([code_of(member.activation) for member in members], dtype=np.int64),
        regressor_first=firsts([len(some) for some in regressors]),
        regressor_channel=_of_each(columns, regressors),
        regressor_lag=np.concatenate([member.lags.input_lag for member in members]),
        regressor_offset=_of_each(offsets, regressors),
        regressor_scale=_of_each(scales, regressors),
        output_first=firsts([len(end.outputs) for end in ends]),
        output_channel=np.array([column_of[name] for name in written], dtype=np.int64),
        output_offset=np.concatenate([some[len(end.inputs) :] for some, end in zip(offsets, ends, strict=True)]),
        output_scale=np.concatenate([some[len(end.inputs) :] for some, end in zip(scales, ends, strict=True)]),
        bounds=np.array(
            [[member.low, member.high] for member, end in zip(members, ends, strict=True) for _ in _range(end)],
            dtype=np.float64,
        ),
        limits=np.array([values for values, _ in held], dtype=np.float64),
        limit_channel=np.array([indices for _, indices in held], dtype=np.int64),
        equations=_equations([member.equation for member in members], [len(some) for some in regressors]),
    )


_NONE = ColumnEquation(
    numbers=np.empty(0),
    code=np.empty((0, 5), dtype=np.uint64),
    result=0,
    places=np.empty((0, 2), dtype=np.int64),
    table=np.empty((0, 2)),
)


def _equations(given: Sequence[ColumnEquation | None], regressors: Sequence[int]) -> Equations:
    """Equations side by side: registers, tables and their rows count on from one to the next."""
    all_ = [one or _NONE for one in given]
    numbers, code = np.array([len(one.numbers) for one in all_]), np.array([len(one.code) for one in all_])
    counts = [n + x + c if one else 0 for one, n, x, c in zip(given, numbers, regressors, code, strict=True)]
    low, tables, rows = (
        firsts(some)[:-1] for some in (counts, [len(one.places) for one in all_], [len(one.table) for one in all_])
    )
    registers = np.zeros(sum(counts))
    for at, one in zip(low, all_, strict=True):
        registers[at : at + len(one.numbers)] = one.numbers
    codes = [
        one.code + np.outer(one.code[:, 0] == TABLE, [0, 0, 0, 0, own]).astype(np.uint64)
        + np.array([0, at, at, at, 0], dtype=np.uint64)
        for one, at, own in zip(all_, low, tables, strict=True)
    ]  # fmt: skip
    return Equations(
        is_one=np.array([one is not None for one in given], dtype=np.bool_),
        code=np.concatenate(codes),
        code_first=firsts([len(one.code) for one in all_]),
        registers=registers,
        low=low,
        free=low + np.array([one.free.start for one in all_], dtype=np.int64),
        n_free=np.array([one.free.stop - one.free.start for one in all_], dtype=np.int64),
        given=low + numbers,
        first=low + numbers + np.array(regressors, dtype=np.int64),
        result=low + np.array([one.result for one in all_], dtype=np.int64),
        widths=np.zeros(1 + max((int(some[:, 4].max()) for some in codes if len(some)), default=0)),
        places=np.concatenate([one.places + np.array([first, 0]) for one, first in zip(all_, rows, strict=True)]),
        table=np.concatenate([one.table for one in all_]),
    )


def _of_each(tables: Sequence[NDArray[_Number]], picked: Sequence[NDArray[np.int64]]) -> NDArray[_Number]:
    """What each member picks of its own table, one after the other."""
    return np.concatenate([table[some] for table, some in zip(tables, picked, strict=True)])


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
