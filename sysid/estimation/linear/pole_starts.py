"""Starts of a transfer-function fit: poles from a long ARX model in three ways, and scattered ones."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.linear.long_arx import LongARX
from sysid.estimation.linear.poles import continuous_from, scattered, sections_of, stabilised
from sysid.estimation.linear.refined_iv import refined_sections
from sysid.estimation.linear.regression import solve
from sysid.estimation.linear.sanathanan_koerner import sk_poles
from sysid.estimation.linear.segments import LEAST_ROWS, SLOWER, blocks_of, means_of
from sysid.estimation.linear.time_record import TimeRecord
from sysid.estimation.linear.variable_projection import Sections
from sysid.estimation.nonparametric.evidence import triangle
from sysid.estimation.nonparametric.segments import columns_of_lags
from sysid.models.converting.orthonormal_basis import Domain, basis_of
from sysid.models.converting.realisation import realise

BLOCK = 2**14
"""Rows of the long ARX model that are laid side by side at a time."""
LONGEST_ARX = 40
"""Lags of each channel in the long ARX model, at most; fewer where the records are short."""
_GRID = 300
"""Frequencies at which the long model's response is read."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PoleStart:
    """Where a fit may begin.

    Args:
        name: How it was found.
        sections: For each input its sections.
    """

    name: str
    sections: Sections


def _long_arx(records: Sequence[TimeRecord], n_lags: int, *, more: int = 0) -> LongARX:
    """Fit the long model to scaled records whose inputs are delayed by their dead times.

    Inputs have ``more`` lags than outputs: what a plant over time answers to a held input comes a sample later.
    """
    m, width = records[0].inputs.shape[1], n_lags + more
    samples, columns = sum(len(record.target) for record in records), n_lags + m * width + 1
    blocks = (block for record in records for block in _blocks(record, n_lags, width))
    if samples < columns:  # a start all the same: the shortest of all that fit
        whole = np.concatenate([*blocks])
        solution = linalg.lstsq(whole[:, :-1], whole[:, -1], cond=1e-10)[0]
    else:
        reduced = triangle(blocks, free=0)
        solution = solve(reduced.R, reduced.z, samples=samples).coefficients
    b = tuple(solution[n_lags + width * j : n_lags + width * (j + 1)] for j in range(m))
    return LongARX(A=np.concatenate([[1.0], -solution[:n_lags]]), B=b)


def _blocks(record: TimeRecord, n_lags: int, width: int) -> Iterator[NDArray[np.float64]]:
    """Rows of the long model, its target last, some thousand at a time."""
    y, depth = record.target, max(n_lags, width)
    past = np.concatenate([np.full(depth, y[0]), y])
    drive = [
        np.concatenate([np.full(depth, before), u]) for u, before in zip(record.inputs.T, record.past, strict=True)
    ]
    root = record.root_weights * _known(record, width)
    for first in range(0, len(y), BLOCK):
        rows = slice(depth + first, min(depth + first + BLOCK, depth + len(y)))
        tables = [columns_of_lags(past, range(1, n_lags + 1), rows)]
        tables += [columns_of_lags(one, range(width), rows) for one in drive]
        here = slice(first, rows.stop - depth)
        yield np.column_stack([*tables, np.ones(rows.stop - rows.start), y[here]]) * root[here, np.newaxis]


def _known(record: TimeRecord, n_lags: int) -> NDArray[np.bool_]:
    """Rows none of whose lags is masked, or before a record of which nothing is known there."""
    usable = record.root_weights > 0.0
    before = np.full(n_lags, not record.free_start)
    known = np.concatenate([before, usable])
    rows = usable.copy()
    for lag in range(1, n_lags + 1):
        rows &= known[n_lags - lag : n_lags - lag + len(usable)]
    return rows if rows.any() else usable


def free_starts(records: Sequence[TimeRecord], n_poles: tuple[int, ...]) -> list[PoleStart]:
    """Starts that need not be stable: the poles of an ARX model of that order as they are, and integrators.

    Args:
        records: Data in scaled numbers.
        n_poles: For each input.

    Returns:
        The starts.
    """
    domain, sample_time = records[0].domain, records[0].sample_time
    found = {"ARX of that order, as it is": _long_arx(records, max(n_poles), more=1).raw_poles}
    for n in range(1, min(2, max(n_poles)) + 1):
        found[f"{n} integrators"] = np.concatenate([np.ones(n), np.linspace(0.3, 0.8, max(n_poles) - n)]).astype(
            complex
        )
    starts = []
    for name, poles in found.items():
        chosen = [_padded(poles, n) for n in n_poles]
        planes = [p if domain is Domain.DISCRETE else continuous_from(p, sample_time) for p in chosen]
        starts.append(PoleStart(name=name, sections=tuple(sections_of(p, domain) for p in planes)))
    return starts


def arx_starts(
    records: Sequence[TimeRecord], n_poles: tuple[int, ...], n_zeros: tuple[int, ...], *, every: int = 1
) -> list[PoleStart]:
    """Starts from ARX models.

    Args:
        records: Data in scaled numbers.
        n_poles: For each input.
        n_zeros: For each input.
        every: Samples whose means the models are of: a long model of a record that is sampled fast ends before a slow
            mode shows in it.

    Returns:
        Two from a long model, reduced for each input, and one with the poles of a short one.
    """
    domain, sample_time = records[0].domain, records[0].sample_time
    records = records if every == 1 else [_means(record, every) for record in records]
    said = "" if every == 1 else f" of means of {every}"
    n_rows = sum(len(record.target) for record in records)
    n_lags = max(2, min(LONGEST_ARX, max(2 * max(n_poles), 10), n_rows // (4 * (1 + len(n_poles)))))
    if records[0].free_start:
        n_lags = max(1, min(n_lags, max(len(record.target) for record in records) // 2))
    model = _long_arx(records, n_lags)
    pairs = list(enumerate(zip(n_poles, n_zeros, strict=True)))
    ways: dict[str, Callable[[], list[NDArray[np.complex128]]]] = {
        "long ARX, balanced truncation": lambda: [_balanced(model, j, n) for j, (n, _) in pairs],
        "long ARX, Sanathanan-Koerner": lambda: [_sk(model, j, n, zeros, records) for j, (n, zeros) in pairs],
        "ARX of that order": lambda: [_padded(_long_arx(records, min(max(n_poles), n_lags)).poles, n) for n in n_poles],
        "poles at a few samples": lambda: [_padded(np.empty(0, dtype=np.complex128), n) for n in n_poles],
    }
    starts: list[PoleStart] = []
    for name, way in ways.items():
        if starts and name == "poles at a few samples":
            break
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # an equation that is nearly singular has a poor start
            try:
                poles = way()
            except (linalg.LinAlgError, ValueError):  # an input that moves too little to show any pole
                continue
        if not all(np.isfinite(p).all() for p in poles):
            continue
        planes = [_in_plane(p, domain, sample_time, every) for p in poles]
        sections = tuple(sections_of(stabilised(p, domain), domain) for p in planes)
        starts.append(PoleStart(name=f"{name}{said}", sections=sections))
    return starts


def slower_starts(records: Sequence[TimeRecord], n_poles: tuple[int, ...], n_zeros: tuple[int, ...]) -> list[PoleStart]:
    """Starts from long ARX models of a record as if it had been sampled more slowly.

    Args:
        records: Data in scaled numbers.
        n_poles: For each input.
        n_zeros: For each input.

    Returns:
        Two for each slower rate at which enough samples are left.
    """
    n_rows = min(len(record.target) for record in records)
    rates = [every for every in SLOWER if n_rows >= LEAST_ROWS * every]
    return [start for every in rates for start in arx_starts(records, n_poles, n_zeros, every=every)[:2]]


def _means(record: TimeRecord, every: int) -> TimeRecord:
    """A record of the means of so many samples each; one of which any is masked is masked."""
    return replace(
        record,
        inputs=means_of(record.inputs, every),
        target=means_of(record.target, every),
        root_weights=blocks_of(record.root_weights, every).min(axis=1),
        sample_time=record.sample_time * every,
    )


def _in_plane(poles: NDArray[np.complex128], domain: Domain, sample_time: float, every: int) -> NDArray[np.complex128]:
    """Poles in the plane of the fit, of those that were found at the rate of every so many samples."""
    if domain is Domain.DISCRETE and every == 1:
        return poles
    found = continuous_from(poles, sample_time * every)
    return found if domain is Domain.CONTINUOUS else np.exp(found * sample_time)


def pole_starts(
    records: Sequence[TimeRecord],
    n_poles: tuple[int, ...],
    n_zeros: tuple[int, ...],
    *,
    n_scattered: int,
    seed: int,
    instruments: bool = True,
) -> list[PoleStart]:
    """Starts worth trying, the most informed first.

    Args:
        records: Data in scaled numbers.
        n_poles: For each input.
        n_zeros: For each input.
        n_scattered: Random starts added.
        seed: Of those.
        instruments: Whether refined instrumental variables are among them.

    Returns:
        The starts.
    """
    domain, sample_time = records[0].domain, records[0].sample_time
    n_rows = sum(len(record.target) for record in records)
    starts = arx_starts(records, n_poles, n_zeros)
    if instruments and max(n_poles) <= MOST_REFINED:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            try:
                refined = refined_sections(records, starts[0].sections, n_zeros)
                starts.append(PoleStart(name="refined instrumental variables", sections=refined))
            except (linalg.LinAlgError, ValueError):  # the other starts are there
                pass
    rng = np.random.default_rng(seed)
    for k in range(n_scattered):
        parts = tuple(sections_of(scattered(n, n_rows, sample_time, rng, domain), domain) for n in n_poles)
        starts.append(PoleStart(name=f"scattered poles {k + 1}", sections=parts))
    return starts


MOST_REFINED = 8
"""Poles up to which instrumental variables are tried: the filtered signals of more cannot be told apart."""


def _padded(poles: NDArray[np.complex128], n: int) -> NDArray[np.complex128]:
    """The slowest poles, none torn from its conjugate, filled up with fast real ones."""
    order = np.argsort(-np.abs(poles), kind="stable")
    chosen = poles[order][:n]
    if len(chosen) and abs(chosen.imag.sum()) > 1e-9:
        chosen = np.concatenate([chosen[:-1], [chosen[-1].real + 0j]])
    fast = np.linspace(0.1, 0.3, n - len(chosen)) if len(chosen) < n else np.empty(0)
    return np.concatenate([chosen, fast]).astype(np.complex128)


def _balanced(model: LongARX, j: int, n: int) -> NDArray[np.complex128]:
    """Poles of one input's response reduced to ``n`` states by balanced truncation (Moore 1981).

    The Gramians are those of the long model in the basis of its own poles, which is nearly orthonormal.
    """
    poles = model.poles
    if n >= len(poles):
        return _padded(poles, n)
    sections = sections_of(poles, Domain.DISCRETE)
    system = realise(basis_of(sections, len(poles) - 1, Domain.DISCRETE), Domain.DISCRETE)
    grid = np.linspace(0.0, np.pi, 4 * len(poles) + 1)[1:]
    wanted = _response(model, j, grid)
    z = np.exp(1j * grid)
    inner = np.linalg.solve(
        z[:, None, None] * np.eye(len(poles)) - system.A, np.broadcast_to(system.B, (len(z), len(poles)))[..., None]
    )[..., 0]
    table = np.concatenate([np.column_stack([inner, np.ones(len(z))])])
    stacked, target = np.concatenate([table.real, table.imag]), np.concatenate([wanted.real, wanted.imag])
    C = linalg.lstsq(stacked, target, cond=1e-12)[0][:-1]
    reach = linalg.solve_discrete_lyapunov(system.A, np.outer(system.B, system.B))
    seen = linalg.solve_discrete_lyapunov(system.A.T, np.outer(C, C))
    root_reach, root_seen = _factor(reach), _factor(seen)
    U, sizes, Vt = linalg.svd(root_seen.T @ root_reach)
    scale = 1.0 / np.sqrt(np.maximum(sizes[:n], sizes[0] * 1e-14))
    left = (root_seen @ U[:, :n]) * scale
    right = (root_reach @ Vt[:n].T) * scale
    return np.asarray(linalg.eigvals(left.T @ system.A @ right), dtype=np.complex128)


def _factor(gramian: NDArray[np.float64]) -> NDArray[np.float64]:
    """A square root of a matrix that is positive but for rounding."""
    values, vectors = linalg.eigh(0.5 * (gramian + gramian.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _response(model: LongARX, j: int, grid: NDArray[np.float64]) -> NDArray[np.complex128]:
    """The long model's response at some frequencies in rad per sample, its poles mirrored into the circle."""
    denominator = np.real(np.poly(model.poles))
    return np.asarray(scipy.signal.freqz(model.B[j], denominator, worN=grid)[1], dtype=np.complex128)


def _sk(model: LongARX, j: int, n: int, n_zeros: int, records: Sequence[TimeRecord]) -> NDArray[np.complex128]:
    """Poles from the long model's response, weighted by how much of the input there is at each frequency."""
    length = max(len(record.target) for record in records)
    grid = np.exp(np.linspace(np.log(2.0 * np.pi / length), np.log(0.98 * np.pi), _GRID))
    weights = np.zeros(_GRID)
    for record in records:
        x = record.inputs[:, j] - record.past[j]
        spectrum = np.abs(np.fft.rfft(np.diff(x, prepend=0.0), 2 * len(x)))
        axis = np.linspace(0.0, np.pi, len(spectrum))
        smooth = np.convolve(spectrum, np.ones(9) / 9.0, mode="same")
        weights += np.interp(grid, axis, smooth) / grid * np.sqrt(grid)  # the grid is dense at low frequencies
    variable = np.exp(-1j * grid)
    response = _response(model, j, grid)
    start = _padded(_balanced(model, j, n), n)
    ones = np.ones((_GRID, 1), dtype=np.complex128)
    return sk_poles(ones, response, variable, start, (n_zeros,), domain=Domain.DISCRETE, weights=weights)
