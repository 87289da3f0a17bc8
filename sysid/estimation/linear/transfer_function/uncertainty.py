"""How well data determine the numerators and denominators of a transfer function."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.linear.coloured_errors import colour, information, sandwich
from sysid.estimation.linear.time_record import TimeRecord
from sysid.estimation.linear.variable_projection import SeparableProvider, Separated
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import TransferFunctionModel
from sysid.models.converting import orthonormal_basis as bases
from sysid.models.converting.orthonormal_basis import Domain

Late = dict[int, NDArray[np.float64]] | None


def transfer_function_uncertainty(
    model: TransferFunctionModel, provider: SeparableProvider, solution: Separated, late: Late = None
) -> Uncertainty:
    """What simulation errors say about numerators, denominators, the constant and dead times, in the channels' units.

    Args:
        model: The fitted model.
        provider: The least-squares problem.
        solution: Its linear part at the minimum.
        late: By input whose dead time was found between samples how the weighted output moves with it, per second.

    Returns:
        The uncertainty: ``B(input, power)``, ``F(input, power)``, ``constant``, ``Td(input)`` in seconds.
    """
    with np.errstate(all="ignore"):  # what the data leave open has a variance beyond all numbers
        found = _uncertainty(model, provider, solution, late or {})
    open_ = ~np.isfinite(np.diag(found.covariance))
    covariance = found.covariance.copy()
    covariance[open_] = covariance[:, open_] = np.nan
    return replace(found, covariance=covariance)


def _uncertainty(
    model: TransferFunctionModel, provider: SeparableProvider, solution: Separated, late: dict[int, NDArray[np.float64]]
) -> Uncertainty:
    linear = provider.design(solution.columns, solution.constants)
    moved = [column[:, np.newaxis] for column in late.values()]
    J = np.concatenate([linear, provider.tangents(solution), *moved], axis=1)
    variance = float(solution.residual @ solution.residual) / max(provider.n_samples - J.shape[1], 1)
    if not np.isfinite(J).all():  # a free run beyond all numbers says nothing about its parameters
        J = np.zeros_like(J)
    norms = np.linalg.norm(J, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    R = linalg.qr(J / scale, mode="r")[0][: J.shape[1]]
    _, sizes, Vt = linalg.svd(R)
    sizes = np.concatenate([sizes, np.zeros(J.shape[1] - len(sizes))])
    kept = sizes > 1e-13 * float(sizes[0])
    root = (Vt[kept].T / sizes[kept]) / scale[:, np.newaxis]
    hang = _coloured(provider, solution.residual, J @ root)
    if hang is not None:
        root = root @ sandwich(np.eye(len(hang)), hang, provider.n_samples)
    names, values, rows = _polynomials(model, J.shape[1], tuple(late))
    spread = rows @ root
    unit = model.scaling.output_scale**2
    covariance = variance * (spread @ spread.T)
    lost = np.abs(rows @ (Vt[~kept].T / scale[:, np.newaxis])).max(axis=1, initial=0.0)
    unknown = lost > 1e-6 * np.linalg.norm(rows / scale, axis=1)
    covariance[unknown] = covariance[:, unknown] = np.nan
    return Uncertainty(names=names, values=values, covariance=covariance, noise_variance=variance * unit)


def _coloured(
    provider: SeparableProvider, residual: NDArray[np.float64], directions: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """``J' R J`` over the errors' variance in some directions; ``None`` where they are white, or of spectra."""
    records = provider.records
    if not all(isinstance(record, TimeRecord) for record in records) or not np.isfinite(directions).all():
        return None
    ends = np.cumsum([len(record.root_weights) for record in records])[:-1]
    a = colour(np.split(residual, ends), [record.root_weights > 0.0 for record in records])
    if len(a) == 1:
        return None
    return np.asarray(np.sum([information([part], a) for part in np.split(directions, ends)], axis=0))


def _polynomials(
    model: TransferFunctionModel, width: int, late: tuple[int, ...]
) -> tuple[tuple[str, ...], NDArray[np.float64], NDArray[np.float64]]:
    """Names, values and derivatives of all coefficients and dead times by taps, sections and dead times."""
    names: list[str] = []
    values: list[float] = []
    rows: list[NDArray[np.float64]] = []
    tap, coefficient = 0, width - sum(model.orders.poles) - len(late)
    for j, name in enumerate(model.mapping.inputs):
        basis = model.basis(j)
        gain = model.scaling.output_scale / model.scaling.input_scale[j]
        numerators = gain * bases.numerators(basis)[:, : model.orders.zeros[j] + 1]
        for power, value in enumerate(model.numerator(j)):
            row = np.zeros(width)
            row[tap : tap + len(numerators)] = numerators[:, power]
            names.append(f"B({name}, {power})")
            values.append(float(value))
            rows.append(row)
        tap += len(numerators)
        slopes = _denominator_slopes(model.sections[j], model.orders.domain)
        kept = range(1, len(slopes[0])) if model.orders.domain is Domain.DISCRETE else range(len(slopes[0]) - 1)
        for power in kept:
            row = np.zeros(width)
            row[coefficient : coefficient + len(slopes)] = slopes[:, power]
            names.append(f"F({name}, {power})")
            values.append(float(model.denominator(j)[power]))
            rows.append(row)
        coefficient += len(slopes)
    if model.orders.intercept:
        row = np.zeros(width)
        row[tap] = model.scaling.output_scale
        names.append("constant")
        values.append(model.scaling.output_offset + model.scaling.output_scale * model.constant)
        rows.append(row)
    for row, j in zip(np.eye(width)[width - len(late) :], late, strict=True):
        names.append(f"Td({model.mapping.inputs[j]})")
        values.append(model.delays[j] * model.sample_time)
        rows.append(row)
    return tuple(names), np.array(values), np.array(rows)


def _denominator_slopes(sections: tuple[NDArray[np.float64], ...], domain: Domain) -> NDArray[np.float64]:
    """Derivatives of the product of all sections with respect to each section's coefficients."""
    n = sum(len(d) - 1 for d in sections)
    rows = []
    for i, d in enumerate(sections):
        others = np.ones(1)
        for k, other in enumerate(sections):
            others = np.convolve(others, other) if k != i else others
        order = len(d) - 1
        powers = range(1, order + 1) if domain is Domain.DISCRETE else range(order - 1, -1, -1)
        for power in powers:
            row = np.zeros(n + 1)
            row[power : power + len(others)] = others
            rows.append(row)
    return np.array(rows)
