"""State spaces of bases and of ratios of polynomials, and the exact sampling of continuous ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.models.converting.orthonormal_basis import BasisSection, Domain

WHOLE = 1e-9
"""Part of a sample by which a dead time misses a whole number of them and is one."""


def parted(samples: float) -> tuple[int, float]:
    """A dead time in whole samples, and what is left as a part of one.

    Args:
        samples: The dead time.

    Returns:
        Both; the part is 0, or below 1.

    Example:
        >>> parted(7.0), parted(7.5), parted(7.0 - 1e-12)
        ((7, 0.0), (7, 0.5), (7, 0.0))
    """
    k = int(np.floor(samples + WHOLE))
    part = float(samples) - k
    return k, part if part > WHOLE else 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Realisation:
    """``x' = A x + B u``, ``taps = C x + D u`` for one input; ``x'`` is the next state or the derivative.

    Args:
        A: Shape ``(n_state, n_state)``.
        B: Shape ``(n_state,)``.
        C: Shape ``(n_taps, n_state)``.
        D: Shape ``(n_taps,)``.
    """

    A: NDArray[np.float64]
    B: NDArray[np.float64]
    C: NDArray[np.float64]
    D: NDArray[np.float64]

    def sampled(self, sample_time: float, *, moving: bool = False, late: float = 0.0) -> Realisation:
        """The same system seen at the samples; for a continuous realisation.

        An input that comes late has two courses within a sample, of its own value and of the one before, which is a
        state more, the last.

        Args:
            sample_time: Seconds.
            moving: Whether its input goes straight from sample to sample; it is held between them otherwise. The
                state is then what the input of its own sample has not moved yet.
            late: Part of a sample by which the input comes late, below 1.

        Returns:
            A discrete realisation, exact (Van Loan 1978, "Computing integrals involving the matrix exponential").
        """
        n = len(self.A)
        block = np.zeros((n + 1 + moving, n + 1 + moving))
        block[:n, :n], block[:n, n] = self.A * sample_time, self.B * sample_time
        if moving:
            block[n, n + 1] = 1.0
        if late:
            return self._late(block, late)
        exponential = scipy.linalg.expm(block)
        A, held = exponential[:n, :n], exponential[:n, n]
        if not moving:
            return Realisation(A=A, B=held, C=self.C, D=self.D)
        ramp = exponential[:n, n + 1]
        return Realisation(A=A, B=held - ramp + A @ ramp, C=self.C, D=self.D + self.C @ ramp)

    def _late(self, block: NDArray[np.float64], late: float) -> Realisation:
        n, moving = len(self.A), len(block) - len(self.A) - 1
        before, after = scipy.linalg.expm(block * late), scipy.linalg.expm(block * (1.0 - late))
        E = after[:n, :n]
        P, older, newer, ramp = E @ before[:n, :n], E @ before[:n, n], after[:n, n], np.zeros(n)
        reads = (0.0, 1.0)
        if moving:
            own, ramp = E @ before[:n, n + 1], after[:n, n + 1]
            newer = newer - ramp + (1.0 - late) * older + own
            older = late * older - own
            reads = (1.0 - late, late)
        A, B = np.zeros((n + 1, n + 1)), np.ones(n + 1)
        A[:n, :n], A[:n, n], B[:n] = P, older, newer + P @ ramp
        C = np.column_stack([self.C, reads[1] * self.D])
        return Realisation(A=A, B=B, C=C, D=reads[0] * self.D + self.C @ ramp)

    def equilibrium(self, u: float) -> NDArray[np.float64]:
        """The state at which a discrete realisation stays while its input is held.

        Args:
            u: The input.

        Returns:
            Shape ``(n_state,)``; the one of least length where there are many (an integrator without input).
        """
        matrix = np.eye(len(self.A)) - self.A
        return np.asarray(scipy.linalg.lstsq(matrix, self.B * u)[0])


def realise(basis: Sequence[BasisSection], domain: Domain) -> Realisation:
    """A state space of a basis, in its own domain: section by section, lower block triangular.

    The state of a discrete section is its all-pole output one and two samples ago; that of a continuous one is its
    all-pole output, times the natural frequency, and the derivative, so that both are of one size.

    Args:
        basis: The sections.
        domain: Their domain.

    Returns:
        The realisation.
    """
    n = sum(section.order for section in basis)
    A, B = np.zeros((n, n)), np.zeros(n)
    C: list[NDArray[np.float64]] = []
    D: list[float] = []
    x_row, x_direct, at = np.zeros(n), 1.0, 0  # the signal handed on, as a combination of state and input
    for section in basis:
        place = slice(at, at + section.order)
        built = _discrete_section(section) if domain is Domain.DISCRETE else _continuous_section(section)
        A[place] = np.outer(built.drive, x_row)
        A[place, place] += built.matrix
        B[place] = built.drive * x_direct
        for numerator in section.taps:
            row, direct = built.output(numerator, x_row, x_direct, at)
            C.append(row)
            D.append(direct)
        x_row, x_direct = built.output(section.onward, x_row, x_direct, at)
        at += section.order
    return Realisation(A=A, B=B, C=np.array(C).reshape(-1, n), D=np.array(D))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Section:
    """One section's own dynamics, and how a numerator reads its state.

    Args:
        matrix: Shape ``(order, order)``.
        drive: Shape ``(order,)``.
        powers: All-pole output and its delays or derivatives as rows over the state, shape ``(order + 1, order)``.
        direct: Their dependence on the section's input, shape ``(order + 1,)``.
    """

    matrix: NDArray[np.float64]
    drive: NDArray[np.float64]
    powers: NDArray[np.float64]
    direct: NDArray[np.float64]

    def output(
        self, numerator: NDArray[np.float64], x_row: NDArray[np.float64], x_direct: float, at: int
    ) -> tuple[NDArray[np.float64], float]:
        """A numerator's output as a row over the whole state and its direct part."""
        through = float(numerator @ self.direct)
        row = through * x_row
        row[at : at + len(self.matrix)] += numerator @ self.powers
        return row, through * x_direct


def _discrete_section(section: BasisSection) -> _Section:
    c = section.denominator[1:]
    n = len(c)
    matrix = np.vstack([-c, np.eye(n)[:-1]])
    powers = np.vstack([-c, np.eye(n)])
    return _Section(matrix=matrix, drive=np.eye(n)[0], powers=powers, direct=np.eye(n + 1)[0])


def _continuous_section(section: BasisSection) -> _Section:
    d = section.denominator
    if section.order == 1:
        powers = np.array([[1.0], [-d[0]]])
        return _Section(matrix=np.array([[-d[0]]]), drive=np.ones(1), powers=powers, direct=np.array([0.0, 1.0]))
    w = float(np.sqrt(abs(d[0]))) or 1.0
    matrix = np.array([[-d[1], -d[0] / w], [w, 0.0]])
    powers = np.array([[0.0, 1.0 / w], [1.0, 0.0], [-d[1], -d[0] / w]])
    return _Section(matrix=matrix, drive=np.array([1.0, 0.0]), powers=powers, direct=np.array([0.0, 0.0, 1.0]))


@dataclass(frozen=True, kw_only=True, eq=False)
class ObserverBlock:
    """Ratios of polynomials over one denominator in observer form: the first state is the output but for ``D``.

    Args:
        A: Shape ``(n, n)``, the denominator in its first column.
        K: Of what has 1 as its first coefficient, such as innovations; shape ``(n,)``.
        B: By the place of an input its column, shape ``(n,)``, and its part of ``D``.
    """

    A: NDArray[Any]
    K: NDArray[Any]
    B: dict[int, tuple[NDArray[Any], Any]]

    @classmethod
    def of(cls, den: NDArray[Any], ups: dict[int, NDArray[Any]], noise: NDArray[Any] | None) -> ObserverBlock:
        """From polynomials in ``1/z``, or in falling powers with the denominator as long as any numerator.

        Args:
            den: The denominator; its first coefficient is 1.
            ups: By the place of an input its numerator.
            noise: Numerator of innovations; its first coefficient is 1.

        Returns:
            The block.
        """
        n = max([len(den), *(len(up) for up in ups.values()), *([] if noise is None else [len(noise)])]) - 1
        d = _padded(den, n + 1)
        A = np.eye(n, k=1, dtype=den.dtype)
        if n:
            A[:, 0] = -d[1:]
        B = {}
        for j, up in ups.items():
            b = _padded(up, n + 1)
            B[j] = (b[1:] - d[1:] * b[0], b[0])
        K = np.zeros(n, dtype=den.dtype) if noise is None else _padded(noise, n + 1)[1:] - d[1:]
        return cls(A=A, K=K, B=B)


def _padded(values: NDArray[Any], length: int) -> NDArray[Any]:
    if len(values) == length:
        return values
    return np.concatenate([values, np.zeros(length - len(values), dtype=values.dtype)])


Ratios = tuple[NDArray[np.float64], dict[int, NDArray[np.float64]]]
"""A denominator, and by the place of an input its numerator."""


def observer_row(parts: Iterable[Ratios], n_inputs: int) -> tuple[NDArray[np.float64], ...]:
    """The state space of an output that is a sum of ratios, one block for each denominator.

    Args:
        parts: The ratios, as :meth:`ObserverBlock.of` takes them.
        n_inputs: Inputs.

    Returns:
        ``A``, ``B``, ``C`` and ``D``.
    """
    blocks = [ObserverBlock.of(den, ups, None) for den, ups in parts]
    n = sum(len(block.A) for block in blocks)
    B, C, D, at = np.zeros((n, n_inputs)), np.zeros((1, n)), np.zeros((1, n_inputs)), 0
    for block in blocks:
        for j, (column, direct) in block.B.items():
            B[at : at + len(column), j], D[0, j] = column, direct
        if len(block.A):
            C[0, at] = 1.0
        at += len(block.A)
    return np.asarray(scipy.linalg.block_diag(*(block.A for block in blocks if len(block.A)))).reshape(n, n), B, C, D
