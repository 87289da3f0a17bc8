r"""Least squares that separates: given the poles, the numerators follow from a linear problem.

The loss :math:`\frac12\|y - \Phi(p)\theta\|^2` is minimised over :math:`\theta` in closed form for every :math:`p`
(Golub and Pereyra 1973, "The differentiation of pseudo-inverses and nonlinear least squares problems whose variables
separate"), which leaves a problem in the poles alone. Its gradient is exact; for the Jacobian Kaufman's (1975)
approximation is taken, the tangents with their part in the span of :math:`\Phi` removed. Because of that removal it
does not matter whether they are taken at fixed taps or at fixed numerators, and the latter cost one filter pass each.

Poles are described by the reflection coefficients of their sections (discrete), or by the coefficients of
:math:`s^2 + c_1 s + c_0` (continuous); through a hyperbolic tangent, or an exponential, every value is stable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.least_squares.small_matrices import orthogonal, singular
from sysid.estimation.linear.records import AbstractRecord, Bases
from sysid.models.converting.orthonormal_basis import Domain, basis_of, section_orders

RANK_TOLERANCE = 1e-11
"""Singular values of the unit columns below this part of the largest are directions that the data do not show."""
_NO_EFFECT = 1e-24
_APART = 1e-6
_LARGEST_REFLECTION = 1.0 - 1e-12

Sections = tuple[tuple[NDArray[np.float64], ...], ...]
"""For each input the denominators of its sections."""


@dataclass(frozen=True, kw_only=True)
class PoleParameters:
    """The poles of all inputs as a flat vector.

    Args:
        n_poles: For each input.
        domain: Of the transfer function.
        stable: Whether every vector is to mean stable poles.
        slowest: With stable poles, how far they keep from the edge: least distance from the unit circle, or least
            rate in 1/s. A record cannot tell a pole much slower than itself from an integrator, and the
            equilibrium of such a model is lost to rounding.
    """

    n_poles: tuple[int, ...]
    domain: Domain
    stable: bool
    slowest: float = 1e-9

    @property
    def orders(self) -> list[int]:
        """Order of every section, input by input."""
        return [order for n in self.n_poles for order in section_orders(n)]

    def sections(self, theta: NDArray[np.float64]) -> Sections:
        """Denominators from the vector.

        Args:
            theta: Shape ``(n_poles_of_all,)``.

        Returns:
            For each input its sections.
        """
        result, at = [], 0
        for n in self.n_poles:
            part = []
            for order in section_orders(n):
                part.append(self._denominator(self._constrained(theta[at : at + order])))
                at += order
            result.append(tuple(part))
        return tuple(result)

    def theta(self, sections: Sections) -> NDArray[np.float64]:
        """The vector of some denominators; unstable ones are reflected where all are to be stable.

        Args:
            sections: For each input its sections.

        Returns:
            Shape ``(n_poles_of_all,)``.
        """
        parts = [self._raw(d) for per_input in sections for d in per_input]
        return np.concatenate(parts)

    def chain(self, theta: NDArray[np.float64], tangents: NDArray[np.float64]) -> NDArray[np.float64]:
        """From derivatives with respect to the sections' coefficients to those with respect to the vector.

        Args:
            theta: Shape ``(n_poles_of_all,)``.
            tangents: Shape ``(n_rows, n_poles_of_all)``.

        Returns:
            The same shape.
        """
        result, at = np.empty_like(tangents), 0
        for order in self.orders:
            place = slice(at, at + order)
            result[:, place] = tangents[:, place] @ self._jacobian(theta[place])
            at += order
        return result

    def _constrained(self, raw: NDArray[np.float64]) -> NDArray[np.float64]:
        if not self.stable:
            return raw
        if self.domain is Domain.DISCRETE:
            return np.tanh(raw)
        return np.asarray(self._shift(len(raw)) @ np.exp(raw) + self._floor(len(raw)))

    def _floor(self, order: int) -> NDArray[np.float64]:
        """Least coefficients ``(c1, c0)`` of a continuous section: two poles of the slowest rate."""
        return np.array([2.0 * self.slowest, self.slowest**2]) if order == 2 else np.array([self.slowest])

    def _shift(self, order: int) -> NDArray[np.float64]:
        """From coefficients about ``s = -slowest``, which are positive where no pole is slower, to what is above that.

        A least ``c0`` alone lets one of two real poles be as slow as the other is fast.
        """
        return np.array([[1.0, 0.0], [self.slowest, 1.0]]) if order == 2 else np.eye(1)

    def _denominator(self, k: NDArray[np.float64]) -> NDArray[np.float64]:
        if self.domain is Domain.CONTINUOUS:  # k is (c1, c0)
            return np.array([*k[::-1], 1.0])
        first = self._edge * k[0]
        return np.array([1.0, first]) if len(k) == 1 else np.array([1.0, first * (1.0 + k[1]), self._edge**2 * k[1]])

    @property
    def _edge(self) -> float:
        """Radius of the circle of which discrete sections have the reflection coefficients.

        Poles lie within a circle where all of these are below 1. Coefficients of the unit circle, kept from 1 by as
        much, would keep a pair of a natural frequency ``w`` from the circle by ``w**2 / 2``, however fast it decays.
        """
        return 1.0 - self.slowest if self.stable else 1.0

    def _raw(self, d: NDArray[np.float64]) -> NDArray[np.float64]:
        if self.domain is Domain.CONTINUOUS:
            c = d[:-1][::-1]
            if not self.stable:
                return c.copy()
            floor = self._floor(len(c))
            beyond = np.linalg.solve(self._shift(len(c)), np.abs(c) - floor)
            return np.asarray(np.log(np.maximum(beyond, 1e-3 * floor)))
        k = d[1:] / self._edge ** np.arange(1, len(d))
        if len(d) == 3:
            k[0] = k[0] / (1.0 + k[1]) if k[1] != -1.0 else 0.0
        return np.arctanh(np.clip(k, -_LARGEST_REFLECTION, _LARGEST_REFLECTION)) if self.stable else k

    def _jacobian(self, raw: NDArray[np.float64]) -> NDArray[np.float64]:
        """Of the section's coefficients ``(c1, c2)`` or ``(c1, c0)`` with respect to the vector's entries."""
        if self.domain is Domain.CONTINUOUS:
            return self._shift(len(raw)) * np.exp(raw) if self.stable else np.eye(len(raw))
        k = self._constrained(raw)
        edge = self._edge
        outer = 1.0 - k**2 if self.stable else np.ones(len(k))
        if len(k) == 1:
            return np.diag(edge * outer)
        return np.array([[edge * (1.0 + k[1]), edge * k[0]], [0.0, edge**2]]) * outer


@dataclass(frozen=True, kw_only=True, eq=False)
class Separated:
    """The linear part solved at some poles.

    Args:
        bases: One per input.
        columns: Of each record, unweighted.
        span: Orthonormal basis of the weighted columns, shape ``(n_rows, rank)``.
        weights: Solution: shared columns (taps of all inputs, then the constant), then each record's own.
        residual: Weighted output minus target, shape ``(n_rows,)``.
        mirrored: Whether the errors are those of a predictor (see :mod:`sysid.estimation.linear.predictor`).
        constants: What a constant output is in each record's errors.
    """

    bases: Bases
    columns: tuple[NDArray[np.float64], ...]
    span: NDArray[np.float64]
    weights: NDArray[np.float64]
    residual: NDArray[np.float64]
    mirrored: bool = False
    constants: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class SeparableProvider(AbstractProvider):
    """Simulation error of a transfer function as a function of its poles.

    Args:
        poles: How poles are described.
        n_zeros: For each input.
        records: The data, in scaled numbers.
        constant: Whether a constant output is fitted.
    """

    poles: PoleParameters
    n_zeros: tuple[int, ...]
    records: tuple[AbstractRecord, ...]
    constant: bool
    n_samples: int = field(init=False)
    _last: dict[bytes, Separated] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self) -> None:
        counted = sum(int(np.count_nonzero(record.root_weights)) for record in self.records)
        object.__setattr__(self, "n_samples", counted)

    def loss(self, theta: NDArray[np.float64]) -> float:
        """Half the weighted sum of squared residuals; see the base class."""
        solution = self.separated(theta)
        return np.inf if solution is None else 0.5 * float(solution.residual @ solution.residual)

    def linearise(self, theta: NDArray[np.float64], *, correlation: bool = True) -> Linearisation:  # noqa: ARG002 - it is 1
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        solution = self.separated(theta)
        n = len(theta)
        if solution is None:
            return Linearisation(loss=np.inf, gradient=np.zeros(n), gauss_newton=np.eye(n))
        J = (
            self._differences(theta, solution)
            if solution.mirrored
            else self.poles.chain(theta, self.tangents(solution))
        )
        J -= solution.span @ (solution.span.T @ J)
        loss = 0.5 * float(solution.residual @ solution.residual)
        H = J.T @ J
        # A pole without effect would leave a zero on the diagonal, which a step is scaled by.
        diagonal = np.diag(H)
        floor = max(float(diagonal.max(initial=0.0)), np.finfo(np.float64).tiny) * _NO_EFFECT
        H[np.diag_indices_from(H)] = np.maximum(diagonal, floor)
        return Linearisation(loss=loss, gradient=J.T @ solution.residual, gauss_newton=H)

    def _differences(self, theta: NDArray[np.float64], solution: Separated) -> NDArray[np.float64]:
        """Derivatives of the residual where the predictor changes with the poles, by differences."""
        columns = []
        for i in range(len(theta)):
            step = np.zeros(len(theta))
            step[i] = _APART * max(abs(float(theta[i])), 1e-3 * float(np.abs(theta).max(initial=0.0)), 1e-9)
            with np.errstate(all="ignore"):
                moved = self._solve(theta + step)
            away = np.zeros(len(solution.residual)) if moved is None else moved.residual - solution.residual
            columns.append(away / step[i])
        return np.column_stack(columns)

    def separated(self, theta: NDArray[np.float64]) -> Separated | None:
        """Solve the linear part.

        Args:
            theta: Poles.

        Returns:
            The solution; ``None`` where the model runs away.
        """
        key = theta.tobytes()
        if key not in self._last:
            with np.errstate(all="ignore"):  # a trial step may leave the numbers that can be computed with
                try:
                    solution = self._solve(theta)
                except linalg.LinAlgError:  # or poles that cannot be told apart from those that grow
                    return None
            if solution is None:
                return None
            self._last.clear()
            self._last[key] = solution
        return self._last[key]

    def tangents(self, solution: Separated) -> NDArray[np.float64]:
        """Weighted derivatives of the output with respect to the sections' coefficients, at fixed numerators.

        Args:
            solution: The linear part.

        Returns:
            Shape ``(n_rows, n_poles_of_all)``.
        """
        shared = self.n_taps
        own = shared + self.constant
        parts = []
        for record, columns in zip(self.records, solution.columns, strict=True):
            n_private = columns.shape[1] - shared
            weights = np.concatenate([solution.weights[:shared], solution.weights[own : own + n_private]])
            own += n_private
            parts.append(record.tangents(solution.bases, columns, weights) * record.root_weights[:, np.newaxis])
        return np.concatenate(parts)

    def design(self, columns: Sequence[NDArray[np.float64]], constants: Sequence[float]) -> NDArray[np.float64]:
        """All records' weighted columns: shared ones, the constant, then each record's own.

        Args:
            columns: Of each record, unweighted.
            constants: What a constant output is in each record's errors.

        Returns:
            Shape ``(n_rows, n_columns)``.
        """
        shared = self.n_taps
        private = [c.shape[1] - shared for c in columns]
        width = shared + self.constant + sum(private)
        table = np.zeros((sum(len(c) for c in columns), width), order="F")
        row, own = 0, shared + self.constant
        for record, c, n, level in zip(self.records, columns, private, constants, strict=True):
            rows = slice(row, row + len(c))
            table[rows, :shared] = c[:, :shared] * record.root_weights[:, np.newaxis]
            if self.constant:
                table[rows, shared] = record.root_weights * level
            table[rows, own : own + n] = c[:, shared:] * record.root_weights[:, np.newaxis]
            row, own = row + len(c), own + n
        return table

    @property
    def n_taps(self) -> int:
        """Taps of all inputs together."""
        return sum(self.n_zeros) + len(self.n_zeros)

    def _solve(self, theta: NDArray[np.float64]) -> Separated | None:
        sections = self.poles.sections(theta)
        bases = tuple(
            basis_of(part, zeros, self.poles.domain) for part, zeros in zip(sections, self.n_zeros, strict=True)
        )
        columns = tuple(record.columns(bases) for record in self.records)
        through = [record.predictor(bases) for record in self.records]
        constants = tuple(1.0 if one is None else one.constant_gain for one in through)
        table = self.design(columns, constants)
        if not np.isfinite(table).all():
            return None
        target = np.concatenate(
            [
                (record.target if one is None else one.filtered(record.target)) * record.root_weights
                for record, one in zip(self.records, through, strict=True)
            ]
        )
        norms = np.linalg.norm(table, axis=0)
        scale = np.where(norms > 0.0, norms, 1.0)
        if not np.isfinite(scale).all():
            return None
        Q, R = orthogonal(table / scale)
        U, sizes, Vt = singular(R)
        kept = sizes > RANK_TOLERANCE * sizes[0]
        span = Q @ U[:, : len(sizes)][:, kept]
        seen = span.T @ target
        weights = (Vt[: len(sizes)][kept].T @ (seen / sizes[kept])) / scale
        return Separated(
            bases=bases, columns=columns, span=span, weights=weights, residual=span @ seen - target,
            constants=constants, mirrored=any(one is not None for one in through),
        )  # fmt: skip
