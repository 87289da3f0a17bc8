r"""Simulation error of an unstable plant, computed soundly: through a predictor whose poles are mirrored.

The free run of :math:`B/F` with poles outside the unit circle grows without bound, while a plant in a loop stays where
it is kept: the error cannot be computed as a difference of the two. With :math:`N` the factor of all unstable poles
and :math:`N^*` the same mirrored into the circle, Forssell and Ljung (2000, "Identification of unstable systems using
output error and Box-Jenkins model structures") take

.. math:: e = \frac{N}{N^*}\Big(y - \sum_j \frac{B_j}{F_j} u_j - d\Big),

an all-pass of the simulation error, with the same spectrum, and still linear in the numerators. The unstable part of a
response never is computed: of :math:`x_u(t+1) = A_u x_u + B_u u`

.. math:: N x_u = \sum_{k \ge 1} M_k u(t - k), \qquad M_1 = B_u, \quad M_{k+1} = A_u M_k + a_k B_u,

with :math:`N = 1 + \sum a_k q^{-k}` (Cayley and Hamilton), a finite filter. What the record's beginning leaves of all
this are responses of :math:`1/N^*`, which stand among the columns of the initial state.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy import linalg

from sysid.kernels import linear as kernel
from sysid.models.converting.realisation import Realisation

GROWTH = 1e4
"""By how much a mode may grow over a record and its free run still be computed as it is."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Split:
    """A realisation in two parts that do not act on each other.

    Args:
        stable: Matrices ``A``, ``B`` and taps ``C`` of the part that stays.
        unstable: Those of the part that grows.
        D: Direct part of the taps.
    """

    stable: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
    unstable: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
    D: NDArray[np.float64]

    @classmethod
    def of(cls, system: Realisation, bound: float) -> Split:
        """Divide by the magnitude of the eigenvalues.

        Args:
            system: Discrete.
            bound: Largest magnitude that is called stable.

        Returns:
            The parts.
        """
        A, Z, n = linalg.schur(system.A, output="real", sort=lambda re, im: np.hypot(re, im) <= bound)
        X = np.zeros((n, len(A) - n))
        if X.size:
            found, scale, _ = linalg.lapack.dtrsyl(A[:n, :n], A[n:, n:], -A[:n, n:], isgn=-1)
            X = found / (scale or 1.0)
        T = Z @ np.block([[np.eye(n), X], [np.zeros((len(A) - n, n)), np.eye(len(A) - n)]])
        B, C = linalg.solve(T, system.B), system.C @ T
        return cls(stable=(A[:n, :n], B[:n], C[:, :n]), unstable=(A[n:, n:], B[n:], C[:, n:]), D=system.D)

    @cached_property
    def poles(self) -> NDArray[np.complex128]:
        """Those of the part that grows."""
        return np.asarray(linalg.eigvals(self.unstable[0]), dtype=np.complex128)


@dataclass(frozen=True, kw_only=True, eq=False)
class MirroredPredictor:
    """The errors of some responses through the predictor.

    Args:
        parts: One per input.
        n_rows: Length of the record.
    """

    parts: tuple[Split, ...]
    n_rows: int

    @classmethod
    def of(cls, systems: Sequence[Realisation], n_rows: int) -> MirroredPredictor | None:
        """The predictor, if one is needed.

        Args:
            systems: Discrete, one per input.
            n_rows: Length of the record.

        Returns:
            It, or ``None`` where all free runs can be computed as they are.
        """
        bound = GROWTH ** (1.0 / max(n_rows, 1))
        if all(np.abs(linalg.eigvals(system.A)).max(initial=0.0) <= bound for system in systems):
            return None
        found = cls(parts=tuple(Split.of(system, bound) for system in systems), n_rows=n_rows)
        return found if len(found.growing) else None  # at the bound two decompositions round to either side of it

    @cached_property
    def growing(self) -> NDArray[np.complex128]:
        """All unstable poles."""
        return np.concatenate([part.poles for part in self.parts])

    @cached_property
    def _mirrored(self) -> NDArray[np.float64]:
        """``N*``."""
        return np.real(np.poly(1.0 / np.conj(self.growing)))

    @cached_property
    def constant_gain(self) -> float:
        """What a constant becomes."""
        return float(np.real(np.poly(self.growing)).sum() / self._mirrored.sum())

    def filtered(self, signal: NDArray[np.float64]) -> NDArray[np.float64]:
        """A signal that stays bounded, such as the measured output, through ``N/N*``, along its first axis."""
        return np.asarray(scipy.signal.lfilter(np.real(np.poly(self.growing)), self._mirrored, signal, axis=0))

    def responses(self, j: int, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """All taps of an input through ``N/N*``.

        Args:
            j: Which input.
            x: Its samples, shape ``(n_rows,)``.

        Returns:
            Shape ``(n_rows, n_taps)``.
        """
        part = self.parts[j]
        A, B, C = part.stable
        states = np.empty((len(x), len(A)))
        none = np.zeros((len(A), 1))
        kernel.state_space(A, B[:, None], np.eye(len(A)), none, x[:, None], np.zeros(len(A)), states)
        columns = self.filtered(states) @ C.T + self.filtered(x)[:, None] * part.D
        A, B, C = part.unstable
        if len(A):
            own = np.real(np.poly(part.poles))
            rest = [p.poles for i, p in enumerate(self.parts) if i != j]
            others = np.real(np.poly(np.concatenate(rest))) if rest else np.ones(1)
            moment, fir = B, [np.zeros(len(A)), B]
            for a in own[1:-1]:
                moment = A @ moment + a * B
                fir.append(moment)
            taps = np.array(fir) @ C.T
            driven = np.column_stack([scipy.signal.lfilter(tap, [1.0], x) for tap in taps.T])
            columns = columns + scipy.signal.lfilter(others, self._mirrored, driven, axis=0)
        return columns

    def beginnings(self) -> NDArray[np.float64]:
        """What the unknown state before the record adds: modes of the stable parts, and of ``1/N*``.

        Returns:
            Shape ``(n_rows, n_poles_of_all)``.
        """
        columns = []
        for part in self.parts:
            A, B, _ = part.stable
            states, x = np.empty((self.n_rows, len(A))), B.copy()
            zero = np.zeros((self.n_rows, 1))
            kernel.state_space(A, np.zeros((len(A), 1)), np.eye(len(A)), np.zeros((len(A), 1)), zero, x, states)
            columns.append(self.filtered(states))
        pulses = np.eye(self.n_rows, len(self.growing))
        return np.column_stack([*columns, scipy.signal.lfilter([1.0], self._mirrored, pulses, axis=0)])
