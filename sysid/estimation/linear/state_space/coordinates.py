r"""Local coordinates of a state space: the directions in which its matrices change what it does.

Changing the state's coordinates by :math:`I + \epsilon E` moves the matrices by
:math:`(EA - AE, EB, -CE, 0, EK)\,\epsilon` and the system not at all. What is orthogonal to these :math:`n^2`
directions is a chart of all systems nearby, with as many parameters as the data can tell (McKelvey, Helmersson and
Ribarits 2004, "Data driven local coordinates for multivariable linear systems"). There is no canonical form, and none
of its ill conditioning; after some steps the chart is laid anew, in balanced coordinates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.models.linear.innovations import Innovations

Array = NDArray[np.float64]


class AbstractChart(Protocol):
    """Systems as a function of a flat vector."""

    @property
    def n_parameters(self) -> int:
        """Length of the vector."""

    def system(self, theta: Array) -> Innovations:
        """The system at a vector."""

    def directions(self, theta: Array) -> Directions:
        """Derivatives of each matrix with respect to the vector."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Chart:
    """Systems around one, by a flat vector.

    Args:
        base: The system at zero.
        basis: Directions of all matrices, in the order of :attr:`Innovations.entries`, shape ``(n_entries,
            n_parameters)``.
    """

    base: Innovations
    basis: Array

    @classmethod
    def around(cls, base: Innovations, *, feedthrough: bool, noise: bool, intercept: bool, sums: int = 0) -> Chart:
        """All directions that change the system.

        Args:
            base: The system.
            feedthrough: Whether ``D`` is fitted.
            noise: Whether ``K`` is fitted.
            intercept: Whether the constant is fitted.
            sums: So many first states are sums: what makes them so is held.

        Returns:
            The chart.
        """
        n, fitted = base.n_state, _fitted(base, feedthrough=feedthrough, noise=noise, intercept=intercept)
        held = _holding(base, sums)
        fitted = np.setdiff1d(fitted, held)
        changes, breaks = [], []
        for a in range(n):
            for b in range(n):
                E = np.zeros((n, n))
                E[a, b] = 1.0
                of_A, of_C = E @ base.A - base.A @ E, -base.C @ E
                change = _joined(of_A, E @ base.B, of_C, 0.0 * base.D, E @ base.K, 0.0 * base.constant)
                changes.append(change[fitted])
                breaks.append(change[held])
        directions = np.eye(len(base.entries))[:, fitted]
        if not changes:
            return cls(base=base, basis=directions)
        # Of changes of coordinates those that leave alone what is held; and no constant that a sum makes, too.
        kept = linalg.null_space(np.array(breaks).T) if sums else np.eye(len(changes))
        still = np.hstack([np.array(changes).T @ kept, _begins(base, sums)[fitted]])
        Q, R, _ = linalg.qr(still, pivoting=True)
        sizes = np.abs(np.diag(R))
        rank = int(np.count_nonzero(sizes > 1e-12 * max(float(sizes[0]), 1e-300)))
        return cls(base=base, basis=directions @ Q[:, rank:])

    @classmethod
    def linear(cls, base: Innovations, *, feedthrough: bool, intercept: bool, sums: int = 0) -> Chart:
        """The directions in which the prediction is linear: ``B``, ``D`` and the constant; see :meth:`around`."""
        n, m, p = base.n_state, base.n_inputs, base.n_outputs
        parts = [np.zeros(n * n), np.ones(n * m), np.zeros(p * n), np.full(p * m, float(feedthrough))]
        kept = np.concatenate([*parts, np.zeros(n * p), np.full(p, float(intercept))]) > 0.0
        basis = np.eye(len(kept))[:, kept]
        return cls(base=base, basis=basis @ linalg.null_space(_begins(base, sums).T @ basis) if sums else basis)

    @property
    def n_parameters(self) -> int:
        """Length of the vector."""
        return int(self.basis.shape[1])

    def system(self, theta: Array) -> Innovations:
        """The system at a vector."""
        return self.base.at(self.base.entries + self.basis @ theta)

    def directions(self, theta: Array) -> Directions:
        """Derivatives of each matrix with respect to the vector: the basis, wherever one stands."""
        del theta
        n, m, p, P = self.base.n_state, self.base.n_inputs, self.base.n_outputs, self.n_parameters
        shapes = ((n, n), (n, m), (p, n), (p, m), (n, p), (p,))
        ends = np.cumsum([math.prod(shape) for shape in shapes])
        parts = np.split(self.basis, ends[:-1])
        A, B, C, D, K, c = (part.reshape(*shape, P) for part, shape in zip(parts, shapes, strict=True))
        return Directions(A=A, B=B, C=C, D=D, K=K, constant=c)


@dataclass(frozen=True, kw_only=True, eq=False)
class Directions:
    """Changes of each matrix, the parameters last; see :class:`Innovations` for the shapes."""

    A: Array
    B: Array
    C: Array
    D: Array
    K: Array
    constant: Array


def _joined(*parts: Array) -> Array:
    return np.concatenate([part.ravel() for part in parts])


def _staying(base: Innovations, sums: int) -> int:
    """How many of the first states, which are sums, stay where they are: all of those side by side, one of a chain."""
    return min(sums, 1) if np.triu(base.A[:sums, :sums], 1).any() else sums


def _holding(base: Innovations, sums: int) -> NDArray[np.intp]:
    """Entries of ``A`` that make first states sums, apart from the others; in a chain one may add up the next."""
    held = np.zeros_like(base.A, dtype=np.bool_)
    held[:sums], held[:, :sums] = True, True
    if _staying(base, sums) < sums:
        held[np.triu_indices(sums, 1)] = False
    return np.flatnonzero(held)


def _begins(base: Innovations, sums: int) -> Array:
    """The constants that sums make of where they begin: no record tells one from the other; as columns."""
    staying = _staying(base, sums)
    change = np.zeros((len(base.entries), staying))
    change[len(change) - base.n_outputs :] = base.C[:, :staying]
    return change


def _fitted(base: Innovations, *, feedthrough: bool, noise: bool, intercept: bool) -> NDArray[np.intp]:
    parts = (
        (base.A, True),
        (base.B, True),
        (base.C, True),
        (base.D, feedthrough),
        (base.K, noise),
        (base.constant, intercept),
    )
    return np.flatnonzero(np.concatenate([np.full(part.size, kept) for part, kept in parts]))
