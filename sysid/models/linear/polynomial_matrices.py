r"""Matrices of polynomials in ``1/z``: determinant, numerators, poles and state space of ``A y = B u``.

By Cramer's rule the output :math:`o` follows the input :math:`j` by :math:`\det A_{o \leftarrow B_j} / \det A`, where
column :math:`o` of :math:`A` is replaced by column :math:`j` of :math:`B`. The determinants are taken at roots of
unity, more of them than a product can have lags, and go back to coefficients by the fast Fourier transform: nothing is
divided, so that poles on the unit circle do no harm. Every coefficient stands in one entry of the matrices, so that a
determinant moves with it by a cofactor, exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.models.converting.to_control import Matrices

Array = NDArray[np.float64]
Spectra = NDArray[np.complex128]
NEVER = 1e9
"""Lags of what is not read at all."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PolynomialMatrices:
    """``A(1/z) y = B(1/z) u``.

    Args:
        terms: Of each coefficient its output, the channel that it reads, inputs before outputs, and the lag.
        values: The coefficients, those of outputs with the sign of the recursion, shape ``(n_coefficients,)``.
        sizes: Numbers of outputs and of inputs.
    """

    terms: tuple[tuple[int, int, int], ...]
    values: Array
    sizes: tuple[int, int]

    def _table(self, *, outputs: bool) -> Array:
        n, m = self.sizes
        own = [(lag, i, c - m * outputs, v) for (i, c, lag), v in zip(self.terms, self.values, strict=True)
               if (c >= m) is outputs]  # fmt: skip
        table = np.zeros((1 + max((lag for lag, *_ in own), default=0), n, n if outputs else m))
        for lag, i, c, value in own:
            table[lag, i, c] = value
        return table

    @cached_property
    def A(self) -> Array:  # noqa: N802 - as it is written
        """Of outputs, shape ``(n_lags + 1, n_outputs, n_outputs)``: the identity, and the coefficients' negatives."""
        table = -self._table(outputs=True)
        table[0] = np.eye(self.sizes[0])
        return table

    @cached_property
    def B(self) -> Array:  # noqa: N802 - as it is written
        """Of inputs, shape ``(n_lags + 1, n_outputs, n_inputs)``, from the lag 0 on."""
        return self._table(outputs=False)

    @cached_property
    def _points(self) -> int:
        """Roots of unity, more than any determinant has lags."""
        n = self.sizes[0]
        return int(scipy.fft.next_fast_len(1 + n * max(len(self.A), len(self.B)), real=True))

    def _spectrum(self, table: Array) -> Spectra:
        return np.asarray(scipy.fft.rfft(table, self._points, axis=0), dtype=np.complex128)

    def _replaced(self, o: int, j: int) -> Spectra:
        """``A`` at the roots of unity, a column replaced by one of ``B``."""
        M = self._spectrum(self.A)
        M[:, :, o] = self._spectrum(self.B)[:, :, j]
        return M

    def _ends(self, o: int = -1, j: int = -1) -> tuple[int, int] | None:
        """First and last lag that a determinant can have; ``None`` where it is 0 throughout."""
        n, m = self.sizes
        first, last = (np.where(np.eye(n, dtype=np.bool_), 0.0, sign * NEVER) for sign in (1.0, -1.0))
        if o >= 0:
            first[:, o], last[:, o] = NEVER, -NEVER
        for i, c, lag in self.terms:
            column = o if c == j else c - m if c >= m and c - m != o else -1
            if column >= 0:
                first[i, column], last[i, column] = min(first[i, column], lag), max(last[i, column], lag)
        ends = [
            t[scipy.optimize.linear_sum_assignment(t, maximize=up)].sum() for t, up in ((first, False), (last, True))
        ]
        return None if ends[0] >= NEVER else (int(ends[0]), int(ends[1]))

    def _coefficients(self, spectrum: Spectra, ends: tuple[int, int] | None) -> Array:
        if ends is None:
            return np.zeros(0)
        return np.asarray(scipy.fft.irfft(spectrum, self._points, axis=0)[ends[0] : ends[1] + 1])

    @cached_property
    def denominator(self) -> Array:
        """``det A``, as long as its orders can make it; the first coefficient is 1."""
        found = self._coefficients(np.linalg.det(self._spectrum(self.A)), self._ends())
        found[0] = 1.0
        return found

    def numerator(self, o: int, j: int) -> Array:
        """From the input ``j`` to the output ``o`` behind its dead time; empty where the input does not reach it."""
        return self._coefficients(np.linalg.det(self._replaced(o, j)), self._ends(o, j))

    def delay(self, o: int, j: int) -> int:
        """The first lag at which the input ``j`` reaches the output ``o``; 0 where it does not."""
        return (self._ends(o, j) or (0, 0))[0]

    def slopes(self, o: int = -1, j: int = -1) -> Array:
        """How :attr:`denominator`, or a :meth:`numerator`, moves with each coefficient.

        Args:
            o: An output; the denominator by default.
            j: An input.

        Returns:
            Shape ``(n_lags, n_coefficients)``, the rows as the polynomial has them.
        """
        M, m = self._spectrum(self.A) if o < 0 else self._replaced(o, j), self.sizes[1]
        ends, found = self._ends(o, j), np.zeros((self._points, len(self.terms)))
        cofactors: dict[tuple[int, int], Array] = {}
        for at, (i, c, lag) in enumerate(self.terms):
            column = o if o >= 0 and c == j else c - m if c >= m and c - m != o else -1
            if column < 0:
                continue
            if (i, column) not in cofactors:
                minor = np.delete(np.delete(M, i, axis=1), column, axis=2)
                sign = (-1.0) ** (i + column) * (1.0 if c < m else -1.0)
                cofactors[i, column] = sign * scipy.fft.irfft(np.linalg.det(minor), self._points)
            found[:, at] = np.roll(cofactors[i, column], lag)
        return found[:0] if ends is None else found[ends[0] : ends[1] + 1]

    @cached_property
    def poles(self) -> NDArray[np.complex128]:
        """Roots of ``det A`` in the z plane, as many as its orders can make, the largest first."""
        a = -self.A[1:]
        last = (np.arange(1, len(a) + 1)[:, np.newaxis, np.newaxis] * (a != 0.0)).max(axis=0, initial=0)
        if last.max(axis=0).sum() < last.max(axis=1).sum():  # det A is that of its transpose, of fewer states
            a = a.transpose(0, 2, 1)
        found = np.linalg.eigvals(_observer(a, np.zeros((1, self.sizes[0], 0)))[0])
        return np.asarray(found[np.argsort(-np.abs(found))][: len(self.denominator) - 1], dtype=np.complex128)

    def observer(self, late: Sequence[int]) -> Matrices:
        """``A``, ``B``, ``C`` and ``D`` of a state space, as many states an output as its longest lag.

        Args:
            late: Of each input the samples of dead time that are left out.

        Returns:
            The matrices.
        """
        B = np.zeros_like(self.B)
        for j, k in enumerate(late):
            B[: len(B) - k, :, j] = self.B[k:, :, j]
        return _observer(-self.A[1:], B)


def _observer(a: Array, b: Array) -> Matrices:
    """Of each output a chain of states, the first of which is the output but for what acts at once."""
    n = b.shape[1]
    read = [np.concatenate([[False], a[:, i].any(axis=1)]) for i in range(n)]
    driven = [b[:, i].any(axis=1) for i in range(n)]
    lengths = [max(int(np.flatnonzero(one).max(initial=0)) for one in both) for both in zip(read, driven, strict=True)]
    begins, size = np.cumsum([0, *lengths])[:-1], sum(lengths)
    A, C = np.zeros((size, size)), np.zeros((n, size))
    for i, (at, length) in enumerate(zip(begins, lengths, strict=True)):
        if length:
            A[at : at + length - 1, at + 1 : at + length] = np.eye(length - 1)
            C[i, at] = 1.0
    B, direct = np.zeros((size, b.shape[2])), b[0]
    for i, (at, length) in enumerate(zip(begins, lengths, strict=True)):
        for k in range(length):
            past = a[k, i] if k < len(a) else np.zeros(n)
            A[at + k] += past @ C
            B[at + k] = past @ direct + (b[k + 1, i] if k + 1 < len(b) else 0.0)
    return A, B, C, direct
