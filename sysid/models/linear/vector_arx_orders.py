"""Orders of an ARX model that several outputs share: a number for each output and each channel that it reads."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import chain
from typing import Annotated, Any, cast

from sysid.errors import ConfigError, shortened
from sysid.models.orders.lags import MOST, Lagged, Lags, whole
from sysid.models.orders.ranges import IntRange
from sysid.models.orders.structure import AbstractStructure

Orders = tuple[tuple[int, ...], ...]
"""Row by row; a single row, or a single entry of a row, stands for all of them."""
Term = tuple[int, int, int]
"""A coefficient: the output whose equation it is in, the channel that it reads (inputs before outputs), and the lag."""


@dataclass(frozen=True, kw_only=True)
class VectorARX(AbstractStructure):
    """Orders of an ARX model of several outputs, each of which reads the past of all: MATLAB's ``arx`` with matrices.

    ``y1(t)`` is a linear function of ``na[0][0]`` past values of ``y1``, ``na[0][1]`` of ``y2``, and so on, and of
    ``nb[0][j]`` values of each input from the lag ``nk[0][j]`` on. :class:`~sysid.models.ARX` of several outputs is a
    model an output, each of which reads its own past alone: outputs that drive each other are not in it. It is a
    structure of its own so that whoever asks for several outputs says which of the two is meant; the orders of the
    first are one number, of the second a matrix.

    Args:
        na: Numbers of past outputs, a row an output and a column an output that is read, or one number for all. A
            plain list of several is refused: it could mean either.
        nb: Numbers of past values of the inputs, a row an output and a column an input; one row, or one number, for all
            of them; empty, as ``nk``, for a record without input (a vector autoregression).
        nk: Dead times in samples, likewise.
        intercept: Fit a constant an output beside the lags.

    Raises:
        ConfigError: If an entry is no order, or the matrices do not go together.

    Example:
        >>> VectorARX(na=[[2, 1], [1, 2]], nb=2, nk=[[1, 1], [1, 3]]).label
        'VectorARX [2 1, 1 2; 2; 1 1, 1 3]'
    """

    na: Annotated[Orders, IntRange(low=1, high=10)]
    nb: Annotated[Orders, IntRange(low=1, high=10)]
    nk: Annotated[Orders, IntRange(low=0, high=3)]
    intercept: bool = True

    kind = "VectorARX"
    several_outputs = True

    def __post_init__(self) -> None:
        given = {name: getattr(self, name) for name in ("na", "nb", "nk")}
        for name, orders in given.items():
            object.__setattr__(self, name, _rows(orders))
        listed = len(self.na) == 1 < len(self.na[0]) and not isinstance(next(iter(given["na"])), list | tuple)
        if listed or not _are_orders(self.na, self.nb, self.nk):
            raise ConfigError(
                "not the orders of an ARX model of several outputs",
                expected="na from 0 on of each output by each output, and nb and nk of each output by each input, a "
                f"row an output, or one number for all; whole numbers up to {MOST:,}",
                got=", ".join(f"{name} = {shortened(orders, limit=60)}" for name, orders in given.items()),
                remedy="write for example na: [[2, 1], [1, 2]], nb: 2, nk: [[1, 1], [1, 3]]",
            )

    @property
    def label(self) -> str:
        """The orders as MATLAB writes them, a comma between rows; one number where all are alike."""
        tables = [self.na, self.nb, self.nk] if self.nb[0] else [self.na]
        return f"{self.kind} [{'; '.join(map(_written, tables))}]"

    def sized(self, n_inputs: int, n_outputs: int) -> VectorARX:
        """The same orders with an entry for each output and each channel that it reads.

        Args:
            n_inputs: Inputs of the mapping.
            n_outputs: Outputs of the mapping.

        Returns:
            The structure.

        Raises:
            ConfigError: If the matrices are of another size.
        """
        self.check_inputs(n_inputs)
        self.check_outputs(n_outputs)
        na, nb, nk = (
            _filled(rows, n_outputs, n) for rows, n in ((self.na, n_outputs), (self.nb, n_inputs), (self.nk, n_inputs))
        )
        return replace(self, na=na, nb=nb, nk=nk)

    def check_inputs(self, n_inputs: int) -> None:
        """Refuse orders that are not one an input; see the base class."""
        for name in ("nb", "nk"):
            self._check(name, len(getattr(self, name)[0]), n_inputs, "input")

    def check_outputs(self, n_outputs: int) -> None:
        """Refuse matrices that do not have a row an output; see the base class."""
        for name in ("na", "nb", "nk"):
            self._check(name, len(getattr(self, name)), n_outputs, "output")
        self._check("na", len(self.na[0]), n_outputs, "output")

    def _check(self, name: str, got: int, n: int, side: str) -> None:
        if got == n or (got == 1 and n):
            return
        line = (
            "a row" if side == "output" and name != "na" else "a row and a column" if side == "output" else "a column"
        )
        raise ConfigError(
            f"the orders do not match the {side}s",
            where=name,
            expected=f"{name} with {line} for each of {n} {side}s, or one number for all" if n else f"an {side}",
            got=f"{got} for {n}",
            remedy=f"give one {name} for each {side} of the mapping, or one number for all"
            if n
            else f"name an {side}; a vector autoregression, of records without one, has nb: [] and nk: []",
        )

    @property
    def terms(self) -> tuple[Term, ...]:
        """The coefficients in their order, of a structure that is :meth:`sized`: output by output, inputs first."""
        found: list[Term] = []
        for i, (past, counts, dead) in enumerate(zip(self.na, self.nb, self.nk, strict=True)):
            m = len(counts)
            found += [(i, j, k + lag) for j, (n, k) in enumerate(zip(counts, dead, strict=True)) for lag in range(n)]
            found += [(i, m + j, lag) for j, n in enumerate(past) for lag in range(1, n + 1)]
        return tuple(found)

    @property
    def lags(self) -> Lags:
        """What any output reads, of a structure that is :meth:`sized`: inputs, then outputs, all as ``inputs``."""
        read: list[set[int]] = [set() for _ in range(len(self.nb[0]) + len(self.na))]
        for _, channel, lag in self.terms:
            read[channel].add(lag)
        return Lags(inputs=tuple(tuple(sorted(lags)) for lags in read), output=())

    def lagged(self, n_inputs: int) -> Lagged:
        """Linear in its regressors; outputs that are read alike are one set, as of a network."""
        n = max(len(self.na), len(self.na[0]), len(self.nb), len(self.nk))
        lags = self.sized(n_inputs, n).lags.inputs
        outputs = lags[n_inputs:]
        return Lagged(lags=Lags(inputs=(*lags[:n_inputs], *(outputs[: len(set(outputs)) == 1 or None])), output=()))

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        tables = {name: [list(row) for row in getattr(self, name)] for name in ("na", "nb", "nk")}
        return {"kind": self.kind, **tables, "intercept": self.intercept}


def _rows(given: object) -> Orders:
    """Orders row by row; what is neither numbers nor rows stands as it is, to be refused by name."""
    if not isinstance(given, Iterable) or isinstance(given, str | bytes | dict):
        return ((cast("int", given),),)
    entries = list(given)
    if entries and all(isinstance(row, list | tuple) for row in entries):
        return tuple(map(tuple, entries))
    return (tuple(entries),)


def _are_orders(na: Orders, nb: Orders, nk: Orders) -> bool:
    """Whether three matrices of whole numbers go together, each with as many rows and columns as others, or one."""
    tables = (na, nb, nk)
    if not all(map(whole, chain(*chain(*tables)))) or any(len(set(map(len, rows))) > 1 for rows in tables):
        return False
    outputs, inputs = {*map(len, tables), len(na[0])}, {len(nb[0]), len(nk[0])}
    return (
        0 not in outputs and len(outputs - {1}) <= 1 and (inputs == {0} or (0 not in inputs and len(inputs - {1}) <= 1))
    )


def _filled(rows: Orders, height: int, width: int) -> Orders:
    wide = [row * width if len(row) == 1 else row for row in rows]
    return tuple(wide * height if len(wide) == 1 else wide)


def _written(rows: Orders) -> str:
    if len(set(chain(*rows))) == 1:
        return str(rows[0][0])
    return ", ".join(" ".join(map(str, row)) for row in rows)
