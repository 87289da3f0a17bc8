"""State spaces of bases, and the exact sampling of continuous ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.models.orthonormal_basis import BasisSection, Domain


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

    def sampled(self, sample_time: float) -> Realisation:
        """The same system seen at the samples, its input held between them; for a continuous realisation.

        Args:
            sample_time: Seconds.

        Returns:
            A discrete realisation, exact (Van Loan 1978, "Computing integrals involving the matrix exponential").
        """
        n = len(self.A)
        block = np.zeros((n + 1, n + 1))
        block[:n, :n], block[:n, n] = self.A, self.B
        exponential = linalg.expm(block * sample_time)
        return Realisation(A=exponential[:n, :n], B=exponential[:n, n], C=self.C, D=self.D)

    def equilibrium(self, u: float) -> NDArray[np.float64]:
        """The state at which a discrete realisation stays while its input is held.

        Args:
            u: The input.

        Returns:
            Shape ``(n_state,)``; the one of least length where there are many (an integrator without input).
        """
        matrix = np.eye(len(self.A)) - self.A
        return np.asarray(linalg.lstsq(matrix, self.B * u)[0])


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
