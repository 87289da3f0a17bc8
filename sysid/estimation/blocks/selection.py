"""Choosing the terms of a polynomial: forward orthogonal least squares over candidates that are never all in memory."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from sysid.estimation.clock import now
from sysid.models.blocks.polynomial_narx import Term

Array = NDArray[np.float64]

CHUNK = 16_000_000
"""Numbers of candidates in memory at a time."""
LEFT = 1e-9
"""Share of its energy that a candidate keeps beside those that are chosen, below which it says nothing new."""
LEAST_GAIN = 1e-12
"""Share of the output's energy below which a term explains nothing."""


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """Terms in the order in which they were taken.

    Args:
        terms: The terms.
        reductions: Of each the share of the output's energy that it explains: its error reduction ratio.
        coefficients: By number of terms, from 1 on, least squares one step ahead, in units.
        cut: Whether the time ended before there were as many as were asked for.
    """

    terms: tuple[Term, ...]
    reductions: tuple[float, ...]
    coefficients: tuple[tuple[float, ...], ...]
    cut: bool = False


def choose_terms(
    regressors: Array, output: Array, candidates: Sequence[Term], most: int, *, until: float = math.inf
) -> Chosen:
    """Forward orthogonal least squares (Billings 2013, chapter 3; Chen, Billings and Luo 1989).

    Each candidate's energy and agreement with the output, apart from what is chosen already, are brought up to date by
    one product with the newest orthogonal term, so that a pass over the candidates costs as much as computing them.

    Args:
        regressors: Shape ``(n_regressors, n_samples)``, rows that count.
        output: Shape ``(n_samples,)``.
        candidates: Products of regressors.
        most: Terms at most.
        until: When it ends with the terms that it has, on the clock of ``sysid.estimation.clock.now``.

    Returns:
        What was chosen.
    """
    scale = np.maximum(np.abs(regressors).max(axis=1), 1e-300)
    scaled = regressors / scale[:, None]
    chunk = max(1, CHUNK // max(output.size, 1))
    parts = [range(at, min(at + chunk, len(candidates))) for at in range(0, len(candidates), chunk)]
    energy, agreement = np.empty(len(candidates)), np.empty(len(candidates))
    for part in parts:
        P = products(scaled, [candidates[i] for i in part])
        energy[part], agreement[part] = np.einsum("ij,ij->i", P, P), P @ output
    whole, begun = float(output @ output), energy.copy()
    taken: list[int] = []
    reductions: list[float] = []
    basis: list[Array] = []
    most = min(most, len(candidates), output.size - 1)
    late = False
    while len(taken) < most and not late:
        new = energy > LEFT * begun
        new[taken] = False
        gains = np.where(new, agreement**2 / np.maximum(energy, 1e-300), 0.0)
        best = int(np.argmax(gains))
        if not gains[best] > LEAST_GAIN * whole:
            break
        q = products(scaled, [candidates[best]])[0]
        for _ in range(2):  # twice is enough (Giraud, Langou and Rozloznik 2005)
            for other in basis:
                q = q - (other @ q) * other
        q /= np.linalg.norm(q)
        taken.append(best)
        basis.append(q)
        shown = float(q @ output)
        reductions.append(shown**2 / whole)
        for part in parts:
            along = products(scaled, [candidates[i] for i in part]) @ q
            energy[part] -= along**2
            agreement[part] -= along * shown
        late = now() > until
    # Where nothing is explained, the constant is what there is.
    terms = [candidates[i] for i in taken] or [()]
    return Chosen(
        terms=tuple(terms), reductions=tuple(reductions), coefficients=_least_squares(scaled, scale, output, terms),
        cut=late and len(taken) < most,
    )  # fmt: skip


def products(regressors: Array, terms: Sequence[Term]) -> Array:
    """Products of regressors.

    Args:
        regressors: Shape ``(n_regressors, n_samples)``.
        terms: The regressors of each.

    Returns:
        Shape ``(n_terms, n_samples)``.
    """
    found = np.ones((len(terms), regressors.shape[1]))
    for i, term in enumerate(terms):
        for place in term:
            found[i] *= regressors[place]
    return found


def _least_squares(scaled: Array, scale: Array, output: Array, terms: Sequence[Term]) -> tuple[tuple[float, ...], ...]:
    """The coefficients of the first terms, for each number of them, by one orthogonal decomposition."""
    Q, R = np.linalg.qr(products(scaled, terms).T)
    along = Q.T @ output
    sizes = np.array([float(np.prod(scale[list(term)])) for term in terms])
    found = []
    for n in range(1, len(terms) + 1):
        c = solve_triangular(R[:n, :n], along[:n]) / sizes[:n]
        found.append(tuple(map(float, c)))
    return tuple(found)
