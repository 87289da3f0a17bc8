r"""Orders of polynomial models: OE, Box-Jenkins and ARMAX, with integrated noise, and what their parameters stand for.

All are special cases of :math:`A(q)\,y = \sum_j B_j(q)/F_j(q)\,u_j + C(q)/D(q)\,e` with polynomials in :math:`1/q`.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Annotated, Any, cast

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, shortened
from sysid.models.converting.realisation import ObserverBlock
from sysid.models.linear.innovations import Innovations
from sysid.models.orders.lags import whole
from sysid.models.orders.ranges import IntRange
from sysid.models.orders.structure import AbstractStructure

MOST_LAGS = 200
"""Samples that a polynomial and its dead time reach back at most: their state space is a matrix of that size."""


class AbstractPolynomial(AbstractStructure):
    """Orders of a polynomial model; what a kind does not have is of order zero."""

    nb: tuple[int, ...]
    """Number of coefficients of each ``B``."""
    nk: tuple[int, ...]
    """Dead time of each input in samples."""
    intercept: bool
    """Whether a constant output is fitted."""

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        given = {field.name: getattr(self, field.name) for field in dataclasses.fields(cast("Any", self))}
        return {"kind": self.kind} | {key: list(v) if isinstance(v, tuple) else v for key, v in given.items()}

    def order(self, name: str) -> int:
        """Order of ``A``, ``C`` or ``D``, by ``na``, ``nc`` or ``nd``; 0 for a kind without it."""
        return int(getattr(self, name, 0))

    @property
    def denominators(self) -> tuple[int, ...]:
        """Order of each ``F``."""
        return tuple(getattr(self, "nf", (0,) * len(self.nb)))

    @property
    def drifts(self) -> bool:
        """Whether the noise is integrated."""
        return bool(getattr(self, "integrated", False))

    @property
    def noise(self) -> bool:
        """Whether there is a model of the noise, so that measured output helps to predict."""
        return self.drifts or self.order("na") + self.order("nc") + self.order("nd") > 0

    @property
    def level(self) -> bool:
        """Whether a constant is fitted: an integrated noise has none to fit."""
        return self.intercept and not self.drifts

    @property
    def n_parameters(self) -> int:
        """Coefficients and, if fitted, the constant."""
        shared = sum(self.order(name) for name in ("na", "nc", "nd"))
        return sum(self.nb) + sum(self.denominators) + shared + self.level

    def names(self, inputs: tuple[str, ...]) -> tuple[str, ...]:
        """The parameters in their order.

        Args:
            inputs: Names of the inputs.

        Returns:
            ``B(input, lag)`` of every input, ``F(input, lag)`` of every input, ``A(lag)``, ``C(lag)``, ``D(lag)``,
            ``constant``.
        """
        found = [
            f"B({name}, {lag})"
            for name, nb, nk in zip(inputs, self.nb, self.nk, strict=True)
            for lag in range(nk, nk + nb)
        ]
        found += [
            f"F({name}, {lag})" for name, n in zip(inputs, self.denominators, strict=True) for lag in range(1, n + 1)
        ]
        found += [f"{name[1].upper()}({lag})" for name in ("na", "nc", "nd") for lag in range(1, self.order(name) + 1)]
        return (*found, *["constant"] * self.level)

    def polynomials(self, theta: NDArray[Any]) -> Polynomials:
        """The polynomials that a flat vector holds.

        Args:
            theta: In the order of :meth:`names`; complex for derivatives.

        Returns:
            The polynomials.
        """
        at = 0

        def following(n: int, *, dead: int = 0, one: int = 0) -> NDArray[Any]:
            nonlocal at
            part = np.zeros(dead + one + n, dtype=theta.dtype)
            part[:one] = 1.0
            part[dead + one :] = theta[at : at + n]
            at += n
            return part

        B = tuple(following(n, dead=nk) for n, nk in zip(self.nb, self.nk, strict=True))
        F = tuple(following(n, one=1) for n in self.denominators)
        A, C, D = (following(self.order(name), one=1) for name in ("na", "nc", "nd"))
        if self.drifts:
            D = np.convolve(D, np.array([1.0, -1.0]))
        return Polynomials(A=A, B=B, F=F, C=C, D=D, constant=theta[at] if self.level else theta.dtype.type(0.0))

    def _check(self, example: str) -> None:
        """Bring fields for each input into their form, and refuse what are no orders."""
        self._listed(*self.per_input)
        m = len(self.nb)
        # All that is not a list of whole numbers is refused before it is added up.
        numbers = [*self.nb, *self.nk, *getattr(self, "nf", ()), *(getattr(self, name, 0) for name in _SHARED)]
        same = all(len(getattr(self, name)) == m for name in self.per_input)
        fits = all(map(whole, numbers)) and same and all(nb >= 1 for nb in self.nb)
        fits = fits and sum(numbers) <= MOST_LAGS
        alone = fits and m == 0 and "nf" in self.per_input
        if alone and self.noise:
            example = f"ARMAX with na: {self.order('nd')}, nb: [], nc: {self.order('nc')}, nk: [], which is C/D e"
        if not fits or alone or (m == 0 and not self.noise):
            given = {name: getattr(self, name) for name in ("na", *self.per_input, "nc", "nd") if hasattr(self, name)}
            raise ConfigError(
                f"not the orders of {self.kind}",
                expected="one nb from 1 on, one nk and, where there is one, one nf for each input or for all, whole "
                f"numbers from 0 on, all of them together at most {MOST_LAGS}",
                got=", ".join(f"{name} = {shortened(value)}" for name, value in given.items()),
                remedy=f"write for example {example}",
            )


_SHARED = ("na", "nc", "nd")


@dataclass(frozen=True, kw_only=True)
class OE(AbstractPolynomial):
    """Output error: ``y = B/F u + e``, as MATLAB's ``oe``; white noise on the output.

    Args:
        nb: Number of coefficients of each ``B``.
        nf: Order of each ``F``.
        nk: Dead time of each input in samples.
        intercept: Fit a constant output.

    Raises:
        ConfigError: If an order cannot be used, or the numbers of inputs differ.

    Example:
        >>> OE(nb=(2,), nf=(2,), nk=(1,)).label
        'OE [2; 2; 1]'
    """

    nb: Annotated[tuple[int, ...], IntRange(low=1, high=8)]
    nf: Annotated[tuple[int, ...], IntRange(low=1, high=8)]
    nk: Annotated[tuple[int, ...], IntRange(low=0, high=3)]
    intercept: bool = True

    kind = "OE"
    per_input = ("nb", "nf", "nk")

    def __post_init__(self) -> None:
        self._check("nb: [2], nf: [2], nk: [1]")

    @property
    def label(self) -> str:
        """As MATLAB writes the orders."""
        return f"OE [{_row(self.nb)}; {_row(self.nf)}; {_row(self.nk)}]"


@dataclass(frozen=True, kw_only=True)
class BJ(AbstractPolynomial):
    """Box-Jenkins: ``y = B/F u + C/D e``, as MATLAB's ``bj``; plant and noise have nothing in common.

    Args:
        nb: Number of coefficients of each ``B``.
        nc: Order of ``C``.
        nd: Order of ``D``.
        nf: Order of each ``F``.
        nk: Dead time of each input in samples.
        intercept: Fit a constant output.

    Raises:
        ConfigError: If an order cannot be used, or the numbers of inputs differ.

    Example:
        >>> BJ(nb=(2,), nc=1, nd=1, nf=(2,), nk=(1,)).label
        'BJ [2; 1; 1; 2; 1]'
    """

    nb: Annotated[tuple[int, ...], IntRange(low=1, high=8)]
    nc: Annotated[int, IntRange(low=0, high=4)]
    nd: Annotated[int, IntRange(low=0, high=4)]
    nf: Annotated[tuple[int, ...], IntRange(low=1, high=8)]
    nk: Annotated[tuple[int, ...], IntRange(low=0, high=3)]
    intercept: bool = True

    kind = "BJ"
    per_input = ("nb", "nf", "nk")

    def __post_init__(self) -> None:
        self._check("nb: [2], nc: 1, nd: 1, nf: [2], nk: [1]")

    @property
    def label(self) -> str:
        """As MATLAB writes the orders."""
        return f"BJ [{_row(self.nb)}; {self.nc}; {self.nd}; {_row(self.nf)}; {_row(self.nk)}]"


@dataclass(frozen=True, kw_only=True)
class ARMAX(AbstractPolynomial):
    """``A y = B u + C e``, as MATLAB's ``armax``: ARMA without inputs, ARIMAX or ARIX with ``integrated``.

    Args:
        na: Order of ``A``.
        nb: Number of coefficients of each ``B``; empty, as ``nk``, for a record without input (ARMA).
        nc: Order of ``C``.
        nk: Dead time of each input in samples.
        integrated: Whether the noise is ``C/(1 - 1/q) e``, a level that drifts; no constant is then fitted.
        intercept: Fit a constant output.

    Raises:
        ConfigError: If an order cannot be used, or the numbers of inputs differ.

    Example:
        >>> ARMAX(na=2, nb=(2,), nc=1, nk=(1,)).label, ARMAX(na=2, nb=(2,), nc=0, nk=(1,), integrated=True).label
        ('ARMAX [2; 2; 1; 1]', 'ARIX [2; 2; 1]')
    """

    na: Annotated[int, IntRange(low=1, high=8)]
    nb: Annotated[tuple[int, ...], IntRange(low=1, high=8)]
    nc: Annotated[int, IntRange(low=0, high=4)]
    nk: Annotated[tuple[int, ...], IntRange(low=0, high=3)]
    integrated: bool = False
    intercept: bool = True

    kind = "ARMAX"
    per_input = ("nb", "nk")

    def __post_init__(self) -> None:
        self._check("na: 2, nb: [2], nc: 1, nk: [1]")

    @property
    def label(self) -> str:
        """As MATLAB writes the orders, by the name of the special case."""
        name = "AR" + "I" * self.integrated + "MA" * (self.nc > 0) + "X" * bool(self.nb)
        rows = [str(self.na), *([_row(self.nb)] if self.nb else []), *([str(self.nc)] if self.nc else [])]
        return f"{name} [{'; '.join([*rows, *([_row(self.nk)] if self.nb else [])])}]"


def _row(values: tuple[int, ...]) -> str:
    return " ".join(map(str, values))


@dataclass(frozen=True, kw_only=True, eq=False)
class Polynomials:
    """The polynomials, ascending in ``1/q``, numerators with the zeros of their dead time.

    Args:
        A: Of the output.
        B: Of each input.
        F: Denominator of each input.
        C: Of the innovations.
        D: Denominator of the innovations, with the factor of an integrated noise.
        constant: Output without inputs.
    """

    A: NDArray[Any]
    B: tuple[NDArray[Any], ...]
    F: tuple[NDArray[Any], ...]
    C: NDArray[Any]
    D: NDArray[Any]
    constant: Any

    def system(self) -> Innovations:
        """The state space in observer form.

        With a common ``A`` it is one block that all inputs and the noise enter; otherwise each has a block of its own.
        """
        m, dtype = len(self.B), self.A.dtype
        if len(self.A) > 1 or not m:
            den = np.convolve(self.A, self.D)
            ups = [np.convolve(b, self.D) for b in self.B]
            blocks = [ObserverBlock.of(den, dict(enumerate(ups)), self.C)]
        else:
            blocks = [ObserverBlock.of(f, {j: b}, None) for j, (b, f) in enumerate(zip(self.B, self.F, strict=True))]
            blocks.append(ObserverBlock.of(self.D, {}, self.C))
        n = sum(len(block.K) for block in blocks)
        A, B, K = np.zeros((n, n), dtype), np.zeros((n, m), dtype), np.zeros((n, 1), dtype)
        C, D, at = np.zeros((1, n)), np.zeros((1, m), dtype), 0
        for block in blocks:
            here = slice(at, at + len(block.K))
            A[here, here], K[here, 0] = block.A, block.K
            for j, (column, direct) in block.B.items():
                B[here, j], D[0, j] = column, direct
            if len(block.K):
                C[0, at] = 1.0
            at = here.stop
        return Innovations(A=A, B=B, C=C, D=D, K=K, constant=np.array([self.constant]))


_ALL: tuple[type[AbstractPolynomial], ...] = (OE, BJ, ARMAX)
POLYNOMIALS: dict[str, type[AbstractPolynomial]] = {one.kind: one for one in _ALL}
"""By kind."""
