"""One member of a cascade as the compiled pass sees it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sysid.models.orders.lags import Lags


class _Lowers(Protocol):
    @property
    def columns(self) -> ColumnRecursion | None: ...


class _Lowered(Protocol):
    @property
    def recursion(self) -> _Lowers: ...


@dataclass(frozen=True, kw_only=True, eq=False)
class ColumnEquation:
    """An expression of the regressors, as the register machine runs it.

    Args:
        numbers: Constants and parameters: what stands in the first registers, before the regressors.
        code: Instructions over ``[numbers | regressors | results]``, shape ``(n, 5)``.
        result: The register that is the output.
        places: Of each table its first row and its rows, shape ``(n_tables, 2)``.
        table: Rows of all tables, shape ``(n_rows, 2)``.
        free: Where those of the numbers stand that are estimated.
    """

    numbers: NDArray[np.float64]
    code: NDArray[np.uint64]
    result: int
    places: NDArray[np.int64]
    table: NDArray[np.float64]
    free: slice = field(default_factory=lambda: slice(0, 0))


@dataclass(frozen=True, kw_only=True, eq=False)
class ColumnRecursion:
    """A recursion over columns, its inputs' and then its outputs'.

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
        activation: The kind of its neurons.
        equation: What is computed in the place of a linear part; ``None`` for none. Such a recursion has a constant of
            0 for its only parameter.
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
    activation: str
    equation: ColumnEquation | None = None

    @staticmethod
    def of(model: _Lowered) -> ColumnRecursion | None:
        """What a model runs, over columns; ``None`` for one that is no recursion over lagged regressors."""
        return model.recursion.columns
