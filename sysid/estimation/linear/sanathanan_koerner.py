r"""Sanathanan-Koerner iterations: poles from frequency responses or spectra by a sequence of linear problems.

Each iteration solves :math:`\min \sum_k w_k^2 |(D\,y - \sum_j N_j u_j) / D_{m-1}|^2` (Sanathanan and Koerner 1963),
with :math:`D/D_{m-1} = 1 + \sum_k d_k x_k` and :math:`N_j/D_{m-1}` in the orthonormal basis of the poles found before
(Drmač, Gugercin and Beattie 2015, "Vector fitting for matrix-valued rational approximation"): the monomials of a
denominator of degree 20 would be numerically dependent. The new poles are the zeros of :math:`1 + d^T x`, eigenvalues
of :math:`A - B d^T`.

Limits: all inputs share the poles; converges to a good start rather than to a minimum.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.linear.poles import sections_of, stabilised
from sysid.models.converting.orthonormal_basis import BasisSection, Domain, basis_of, powers_of, responses
from sysid.models.converting.realisation import realise

MAX_ITERATIONS = 20
"""As in the estimators of the field (MATLAB's ``tfest``)."""


def sk_poles(
    inputs: NDArray[np.complex128],
    output: NDArray[np.complex128],
    variable: NDArray[np.complex128],
    start: NDArray[np.complex128],
    n_zeros: tuple[int, ...],
    *,
    domain: Domain,
    weights: NDArray[np.float64] | None = None,
    iterations: int = MAX_ITERATIONS,
    stable: bool = True,
) -> NDArray[np.complex128]:
    """Common poles of all inputs.

    Args:
        inputs: Input spectra with their dead times, shape ``(n_points, n_inputs)``; ones for a frequency response.
        output: Output spectrum, shape ``(n_points,)``.
        variable: ``1/z`` or ``s`` at each point, shape ``(n_points,)``.
        start: Poles to begin with, as many as are wanted.
        n_zeros: Degree of the numerator of each input, below the number of poles.
        domain: Of the poles.
        weights: Of each point's error, shape ``(n_points,)``; all ones by default.
        iterations: How many at most.
        stable: Whether poles outside the stable region are mirrored into it.

    Returns:
        Poles, the same number.
    """
    w = np.ones(len(output)) if weights is None else weights
    poles = start
    for _ in range(iterations):
        sections = sections_of(stabilised(poles, domain), domain)
        basis = basis_of(sections, len(start) - 1, domain)
        system, states = realise(basis, domain), _state_responses(basis, variable, domain)
        blocks = [-states * output[:, np.newaxis]]
        for j, zeros in enumerate(n_zeros):
            blocks.append(responses(basis_of(sections, zeros, domain), variable) * inputs[:, j : j + 1])
        table = np.concatenate(blocks, axis=1) * w[:, np.newaxis]
        target = output * w
        table, target = (np.concatenate([part.real, part.imag]) for part in (table, target))
        scale = np.maximum(np.linalg.norm(table, axis=0), 1e-300)
        solution = linalg.lstsq(table / scale, target, cond=1e-12)[0] / scale
        following = linalg.eigvals(system.A - np.outer(system.B, solution[: len(start)]))
        moved = np.abs(np.sort_complex(following) - np.sort_complex(poles)).max()
        poles = following
        if moved < 1e-8 * max(float(np.abs(poles).max()), 1e-300):
            break
    found = np.asarray(poles, dtype=np.complex128)
    return stabilised(found, domain) if stable else found


def _state_responses(
    basis: Sequence[BasisSection], variable: NDArray[np.complex128], domain: Domain
) -> NDArray[np.complex128]:
    """The state of a basis as functions of frequency: all strictly proper functions with its poles.

    Section by section, as :func:`~sysid.models.converting.realisation.realise` has their states. The variable is
    ``1/z`` or ``s``; shape ``(n_points, n_poles)``.
    """
    columns, x = [], np.ones(len(variable), dtype=np.complex128)
    for section in basis:
        powers = powers_of(variable, section.order)
        all_pole = (x / (powers @ section.denominator))[:, np.newaxis]
        if domain is Domain.DISCRETE:
            columns.append(powers[:, 1:] * all_pole)
        elif section.order == 1:
            columns.append(all_pole)
        else:
            natural = float(np.sqrt(abs(section.denominator[0]))) or 1.0
            columns.append(np.column_stack([powers[:, 1], np.full(len(variable), natural)]) * all_pole)
        x = (powers @ section.onward) * all_pole[:, 0]
    return np.concatenate(columns, axis=1)
