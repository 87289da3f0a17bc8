r"""Refined instrumental variables: poles from records over time, discrete or continuous (SRIV, SRIVC).

With the basis of the poles found before, :math:`A/\hat A = 1 + d^T x` and
:math:`B/\hat A = \sum_k n_k \psi_k`, so that

.. math:: y + d^T x(y) = \sum_k n_k \psi_k(u)

is linear. All signals pass through :math:`1/\hat A`, which is the state-variable filter at the first iteration and the
optimal prefilter at the last (Young and Jakeman 1980, "Refined instrumental variable methods of recursive time-series
analysis, part III"; Garnier and Young 2014). The first iterations are least squares (Steiglitz and McBride 1965); then
:math:`x` of the noise-free model output is the instrument. Inputs are held between samples, the output is taken as
linear between them. Several inputs with poles of their own are fitted in turn, each to what the others leave.

Limits: of a multiple-input system only a neighbourhood of the minimum is reached; it is the start of a refinement.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.linear.poles import sections_of, stabilised
from sysid.estimation.linear.time_record import TimeRecord
from sysid.estimation.linear.variable_projection import Sections
from sysid.kernels import linear as kernel
from sysid.models.converting.orthonormal_basis import Domain, basis_of
from sysid.models.converting.realisation import realise

PLAIN_ITERATIONS = 3
"""Least-squares iterations before instruments are used: a model's output is one as soon as it resembles the data."""
ITERATIONS, ROUNDS = 20, 3
"""At most; and how often several inputs are gone through."""


def _refined_poles(
    records: Sequence[TimeRecord], start: NDArray[np.complex128], n_zeros: int
) -> NDArray[np.complex128]:
    """Stable poles of a transfer function with one input, as many as the start has.

    The target is filtered from its first sample; the start is the first state-variable filter.
    """
    domain, n = records[0].domain, len(start)
    poles = stabilised(start, domain)
    for iteration in range(ITERATIONS):
        sections = sections_of(poles, domain)
        basis = realise(basis_of(sections, n - 1, domain), domain)
        rows = [_rows(record, sections, n_zeros) for record in records]
        X, y = np.concatenate([row[0] for row in rows]), np.concatenate([row[1] for row in rows])
        Z = X
        if iteration >= PLAIN_ITERATIONS:
            Z = np.concatenate(
                [_rows(_noise_free(record, sections, n_zeros), sections, n_zeros)[0] for record in records]
            )
        scale = np.maximum(np.linalg.norm(X, axis=0), 1e-300)
        span = linalg.qr(Z / np.maximum(np.linalg.norm(Z, axis=0), 1e-300), mode="economic")[0]
        solution = linalg.lstsq(span.T @ (X / scale), span.T @ y, cond=1e-12)[0] / scale
        following = stabilised(
            np.asarray(linalg.eigvals(basis.A - np.outer(basis.B, solution[:n])), dtype=np.complex128), domain
        )
        moved = np.abs(np.sort_complex(following) - np.sort_complex(poles)).max()
        poles = following
        if moved < 1e-7 * float(np.abs(poles).max()):
            break
    return poles


def _rows(
    record: TimeRecord, sections: tuple[NDArray[np.float64], ...], n_zeros: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Regressors ``[-x(y) | taps(u) | 1]`` and target of one record, weighted."""
    basis = basis_of(sections, n_zeros, record.domain)
    level = record.target[0]
    states = _states(sections, record.target - level, record)
    taps = record.columns((basis,))[:, : n_zeros + 1]
    root = record.root_weights[:, np.newaxis]
    table = np.column_stack([-states, taps, np.ones(len(states))]) * root
    return table, (record.target - level) * record.root_weights


def _states(
    sections: tuple[NDArray[np.float64], ...], signal: NDArray[np.float64], record: TimeRecord
) -> NDArray[np.float64]:
    """The basis's state driven by a sampled signal that begins at zero."""
    n = sum(len(d) - 1 for d in sections)
    system = realise(basis_of(sections, n - 1, record.domain), record.domain)
    system = replace(system, C=np.eye(n), D=np.zeros(n))
    if record.domain is Domain.CONTINUOUS:
        system = system.sampled(record.sample_time, moving=True)
    B, D, y = system.B[:, np.newaxis], system.D[:, np.newaxis], np.empty((len(signal), n))
    kernel.state_space(system.A, B, system.C, D, signal[:, np.newaxis], np.zeros(n), y)
    return y


def _noise_free(record: TimeRecord, sections: tuple[NDArray[np.float64], ...], n_zeros: int) -> TimeRecord:
    """The record with the output of the best model with these poles."""
    basis = basis_of(sections, n_zeros, record.domain)
    taps = np.column_stack([record.columns((basis,))[:, : n_zeros + 1], np.ones(len(record.target))])
    root = record.root_weights
    weights = linalg.lstsq(taps * root[:, np.newaxis], record.target * root, cond=1e-12)[0]
    return replace(record, target=taps @ weights, free_start=False)


def refined_sections(records: Sequence[TimeRecord], start: Sections, n_zeros: tuple[int, ...]) -> Sections:
    """Sections of several inputs, fitted in turn.

    Args:
        records: The data.
        start: For each input its sections to begin with.
        n_zeros: For each input.

    Returns:
        For each input its sections.
    """
    domain = records[0].domain
    current = list(start)
    for _ in range(ROUNDS if len(current) > 1 else 1):
        for j, zeros in enumerate(n_zeros):
            alone = [_left_for(record, j, tuple(current), n_zeros) for record in records]
            poles = np.concatenate([np.roots(d if domain is Domain.DISCRETE else d[::-1]) for d in current[j]])
            current[j] = sections_of(_refined_poles(alone, poles.astype(np.complex128), zeros), domain)
    return tuple(current)


def _left_for(record: TimeRecord, j: int, sections: Sections, n_zeros: tuple[int, ...]) -> TimeRecord:
    """What the other inputs, with their poles as they are, leave of the output for one."""
    bases = tuple(basis_of(part, zeros, record.domain) for part, zeros in zip(sections, n_zeros, strict=True))
    ends = np.cumsum([zeros + 1 for zeros in n_zeros])
    columns = record.columns(bases)[:, : ends[-1]]
    table = np.column_stack([columns, np.ones(len(columns))]) * record.root_weights[:, np.newaxis]
    weights = linalg.lstsq(table, record.target * record.root_weights, cond=1e-12)[0][:-1]
    weights[ends[j] - n_zeros[j] - 1 : ends[j]] = 0.0
    return replace(
        record,
        inputs=record.inputs[:, j : j + 1],
        past=record.past[j : j + 1],
        moving=record.moving[j : j + 1],
        target=record.target - columns @ weights,
        free_start=False,
    )
