"""Types of process models, as ``P2DZU`` says them: what each input's transfer function is made of."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, shortened

Array = NDArray[np.float64]

GAIN, ZERO, DEAD_TIME, PERIOD, DAMPING = "K", "Tz", "Td", "Tw", "zeta"
MOST_POLES = 3
_WRITTEN = re.compile(rf"P([0-{MOST_POLES}])([DZIU]*)")
STEP = 1e-30
"""Imaginary step of a derivative: exact but for rounding, since nothing is subtracted."""


@dataclass(frozen=True, kw_only=True)
class ProcessType:
    r"""What the transfer function of an input is made of.

    .. math:: K \frac{1 + T_z s}{s\,(1 + T_{p1} s)(1 + T_{p2} s)(1 + T_{p3} s)}\, e^{-T_d s}

    with :math:`1 + 2 \zeta T_w s + (T_w s)^2` in place of the first two poles of one that may swing.

    Args:
        poles: Poles beside that of the integrator, 0 to 3.
        dead: ``D``: a dead time.
        zero: ``Z``: a zero.
        integrates: ``I``: an integrator.
        swings: ``U``: the first two poles may be a pair.

    Example:
        >>> ProcessType.parse("P2DU").names
        ('K', 'Tw', 'zeta', 'Td')
    """

    poles: int
    dead: bool = False
    zero: bool = False
    integrates: bool = False
    swings: bool = False

    @classmethod
    def parse(cls, written: object) -> ProcessType:
        """A type as people write it.

        Args:
            written: ``P`` with the number of poles, then any of ``D``, ``Z``, ``I`` and ``U``, as in ``P2DZU``.

        Returns:
            The type.

        Raises:
            ConfigError: If it is none.
        """
        found = _WRITTEN.fullmatch(written.strip().upper()) if isinstance(written, str) else None
        letters = found[2] if found else ""
        if found is None or len(set(letters)) < len(letters):
            raise ConfigError(
                "not a type of process model", where="type",
                expected="P with 0 to 3 poles, then D (dead time), Z (zero), I (integrator), U (may swing), each once",
                got=shortened(written), remedy="write for example type: P1D, P2DU, P2DZ or P1DI",
            )  # fmt: skip
        one = cls(
            poles=int(found[1]), dead="D" in letters, zero="Z" in letters, integrates="I" in letters,
            swings="U" in letters,
        )  # fmt: skip
        if one.swings and one.poles < 2:
            raise ConfigError(
                "one pole does not swing", where="type", expected="U with 2 or 3 poles", got=written,
                remedy="write P2U, or leave U out",
            )  # fmt: skip
        if not one.order:
            raise ConfigError(
                "a gain alone is no process model", where="type", expected="a pole, or an integrator", got=written,
                remedy="write P1D or P0DI; a gain alone is ARX with na: 0, nb: 1",
            )  # fmt: skip
        return one

    def __str__(self) -> str:
        letters = zip("DZIU", (self.dead, self.zero, self.integrates, self.swings), strict=True)
        return f"P{self.poles}{''.join(letter for letter, has in letters if has)}"

    @property
    def order(self) -> int:
        """States of one path."""
        return self.poles + self.integrates

    @cached_property
    def constants(self) -> tuple[str, ...]:
        """Names of what its denominator is made of."""
        lags = tuple(f"Tp{i + 1}" for i in range(self.poles))
        return (PERIOD, DAMPING, *lags[2:]) if self.swings else lags

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of its parameters, in the order in which values stand."""
        return (GAIN, *self.constants, *[ZERO] * self.zero, *[DEAD_TIME] * self.dead)

    def at(self, values: NDArray, name: str, missing: float = 0.0) -> complex:  # type: ignore[type-arg]
        """The value of a parameter; of one that the type has not, what its absence stands for."""
        return values[self.names.index(name)] if name in self.names else missing

    def system(self, values: NDArray) -> tuple[NDArray, NDArray, NDArray, complex]:  # type: ignore[type-arg]
        """A chain of blocks of unit gain, the integrator last: at rest every state but a rate is the input.

        Args:
            values: Of :attr:`names`, real or complex, shape ``(n,)``.

        Returns:
            ``A``, ``B``, ``C`` and ``D`` in continuous time, shapes ``(order, order)``, ``(order,)``, ``(order,)`` and
            a number.
        """
        n = self.order
        A, B = np.zeros((n, n), dtype=values.dtype), np.zeros(n, dtype=values.dtype)
        last = -1  # the state that the next block is driven by; the input before the first
        at, lags = 0, values[1 : 1 + self.poles]
        if self.swings:
            period, damping = lags[:2]
            A[0, 1], A[1, 0], A[1, 1], B[1] = 1.0, -1.0 / period**2, -2.0 * damping / period, 1.0 / period**2
            last, at, lags = 0, 2, lags[2:]
        for rate in [*(1.0 / lag for lag in lags), *[None] * self.integrates]:
            A[at, at] = 0.0 if rate is None else -rate
            drive = 1.0 if rate is None else rate
            if last < 0:
                B[at] = drive
            else:
                A[at, last] = drive
            last, at = at, at + 1
        gain, ahead = values[0], self.at(values, ZERO)
        C = gain * ahead * A[last]
        C[last] += gain
        return A, B, C, gain * ahead * B[last]

    def polynomials(self, values: NDArray) -> tuple[NDArray, NDArray]:  # type: ignore[type-arg]
        """Numerator and denominator in ascending powers of ``s``, the denominator's last coefficient 1.

        Args:
            values: Of :attr:`names`, real or complex.

        Returns:
            Both, shapes ``(1 + zero,)`` and ``(order + 1,)``.
        """
        F = np.ones(1, dtype=values.dtype)
        for section in self.sections(values):
            F = np.convolve(F, section)
        lags = values[1 : 1 + self.poles]
        gain = values[0] / (np.prod(lags) if not self.swings else lags[0] ** 2 * np.prod(lags[2:]))
        return gain * np.array([1.0, self.at(values, ZERO)])[: 1 + self.zero], F

    def sections(self, values: NDArray) -> tuple[NDArray, ...]:  # type: ignore[type-arg]
        """Factors of the denominator in ascending powers of ``s``, the last coefficient of each 1."""
        lags = values[1 : 1 + self.poles]
        found = []
        if self.swings:
            found.append(np.array([1.0 / lags[0] ** 2, 2.0 * lags[1] / lags[0], 1.0]))
            lags = lags[2:]
        return (*found, *(np.array([1.0 / lag, 1.0]) for lag in lags), *[np.array([0.0, 1.0])] * self.integrates)

    def polynomial_slopes(self, values: Array) -> Array:
        """Derivatives of the coefficients of :meth:`polynomials`, but for the 1.

        Args:
            values: Of :attr:`names`.

        Returns:
            Shape ``(1 + zero + order, n)``.
        """
        columns = []
        for i in range(len(values)):
            B, F = self.polynomials(values + 1j * STEP * np.eye(len(values))[i])
            columns.append(np.concatenate([B, F[:-1]]).imag / STEP)
        return np.column_stack(columns)
