"""Flags of every sample as ONNX nodes: all that is looked at side by side, a comparison for each way to raise one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.export.flags import Flag
from sysid.export.onnx.core import join
from sysid.export.onnx.nodes import Nodes
from sysid.export.surrogate import Surrogate

FLOAT, INT32 = 1, 6
"""``TensorProto.FLOAT`` and ``INT32``: sums of truths are exact in either, and half as long as in double."""

Raised = Sequence[Flag | None]
Cause = tuple[str, Raised]
"""Truths by row, and what each raises; ``None`` for nothing."""


@dataclass(frozen=True, kw_only=True)
class Watched:
    """Rows that raise flags below a number, above one, or by being none.

    Args:
        name: Of the rows.
        below: What each is compared with: a flag is raised below it.
        above: The same, above it.
        flags: What each raises below and above; ``None`` for nothing.
        lost: Whether rows are to be numbers.
    """

    name: str
    below: NDArray[Any]
    above: NDArray[Any]
    flags: tuple[Raised, Raised]
    lost: bool = True

    @classmethod
    def lost_in(cls, name: str, count: int) -> Watched:
        """Rows that have to be numbers, and no more."""
        never = np.full(count, np.inf)
        return cls(name=name, below=-never, above=never, flags=([None] * count, [None] * count))

    @classmethod
    def held(
        cls,
        name: str,
        ends: tuple[NDArray[Any], NDArray[Any]],
        flags: tuple[Raised, Raised],
        dtype: np.dtype[Any],
        *,
        lost: bool = True,
    ) -> Watched:
        """Rows that are held between two numbers each, and raise a flag at them: to be there is to be no further in.

        Args:
            name: Of the rows.
            ends: Numbers below and above, infinite for none.
            flags: What each raises there; ``None`` for nothing.
            dtype: Of the rows.
            lost: Whether rows are to be numbers.

        Returns:
            What is looked at.
        """
        below, above = (
            np.array(
                [
                    inward(at, way, dtype) if flag is not None and np.isfinite(at) else -way
                    for at, flag in zip(numbers, raised, strict=True)
                ]
            )
            for way, numbers, raised in zip((np.inf, -np.inf), ends, flags, strict=True)
        )
        return cls(name=name, below=below, above=above, flags=flags, lost=lost)


def inward(number: float, way: float, dtype: np.dtype[Any]) -> float:
    """The next number on the way; from nothing the least that every processor keeps, as some take less for nothing."""
    if number == 0.0:
        return float(np.copysign(np.finfo(dtype).smallest_normal, way))
    return float(np.nextafter(dtype.type(number), dtype.type(way)))


def flags_of(
    nodes: Nodes, surrogate: Surrogate, inputs: tuple[str, str], watched: Sequence[Watched], reached: Sequence[Cause]
) -> str:
    """The flags of every sample, one row.

    Args:
        nodes: The graph.
        surrogate: The whole.
        inputs: The inputs in units as they came, and nothing times each.
        watched: Rows of outputs that raise flags by what they are.
        reached: Truths that raise them.

    Returns:
        The name of ``flags``: of a step, one row a car; of many samples, one row before them and the cars.
    """
    n, (given, nothing) = len(surrogate.inputs), inputs
    outside = [Flag.OUTSIDE_RANGE] * n
    low, high = (np.array([getattr(port, side) for port in surrogate.inputs]) for side in ("low", "high"))
    declared = Watched(name=given, below=low, above=high, flags=(outside, outside), lost=False)
    every = [declared, Watched.lost_in(nothing, n), *watched]
    causes = [*_compared(nodes, every), *reached]
    which = [flag for _, flags in causes for flag in flags]
    present = sorted({flag for flag in which if flag is not None})
    numbers = nodes.add("Cast", [join(nodes, [name for name, _ in causes], "causes")], "marks", to=FLOAT)
    if nodes.trailing > 1:
        numbers = nodes.add("Reshape", [numbers, nodes.integers([len(which), -1])], "marks_in_rows")
    single = nodes.counting()
    table = single.numbers("flag_of_cause", [[float(flag is one) for one in which] for flag in present])
    raised = nodes.add("Sign", [nodes.add("MatMul", [table, numbers], "raised")], "raised_or_not")
    values = [[float(flag)] for flag in present]
    if nodes.trailing == 1:
        total = nodes.add("Gemm", [raised, single.numbers("flag_values", values)], "flag_sum", transA=1)
        return nodes.add("Cast", [total], "flags", to=INT32)
    total = nodes.add("MatMul", [single.numbers("flag_values", np.transpose(values)), raised], "flag_sum")
    total = nodes.add("Cast", [total], "flag_row", to=INT32)
    shape = nodes.add(
        "Concat", [nodes.integers([1]), nodes.add("Shape", [nothing], "u_shape", start=1)], "flag_shape", axis=0
    )
    return nodes.add("Reshape", [total, shape], "flag_rows")


def _compared(nodes: Nodes, every: Sequence[Watched]) -> list[Cause]:
    """All that is looked at, below, above and as numbers: a node each."""
    value = join(nodes, [one.name for one in every], "watched")
    causes: list[Cause] = []
    for i, (operator, side) in enumerate((("Less", "below"), ("Greater", "above"))):
        flags = [flag for one in every for flag in one.flags[i]]
        limits = np.concatenate([getattr(one, side) for one in every])
        if np.isfinite(limits).any():
            causes.append((nodes.add(operator, [value, nodes.column(side, limits)], f"is_{side}"), flags))
    lost = [Flag.NOT_A_NUMBER if one.lost else None for one in every for _ in one.below]
    return [*causes, (nodes.add("IsNaN", [value], "is_lost"), lost)]
