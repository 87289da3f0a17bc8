"""How well records determine the parameters of a process model, and what that says of its polynomials."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.linear.coloured_errors import colour, information, sandwich
from sysid.estimation.linear.process.search import End
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import FittedProcess
from sysid.models.process.process_type import GAIN
from sysid.models.process.structure import shown

Array = NDArray[np.float64]

AT_END = 1e-6
"""Part of a parameter, or of a sample time, within which it stands at its bound."""
EQUAL = 1e-3
"""Part of a time constant within which another one is the same."""
OPEN = 1e-12
"""Singular value of unit columns below which a direction is not shown, and part of a row in such directions."""


def at_bounds(end: End) -> list[str]:
    """Of each parameter that is searched the bound at which it stands.

    Args:
        end: Where the search ended.

    Returns:
        ``low``, ``high`` or an empty text.
    """
    problem = end.problem
    values, bounds = problem.values(end.theta), problem.bounds
    found = []
    for i in problem.free:
        near = AT_END * max(abs(values[i]), problem.sample_time)
        low, high = values[i] - bounds.low[i] <= near, bounds.high[i] - values[i] <= near
        found.append("low" if low else "high" if high else "")
    return found


def merged(end: End) -> list[int]:
    """Time constants of one input that came out equal: each is half of a pair, and has no interval of its own.

    Args:
        end: Where the search ended.

    Returns:
        Their places among all parameters.
    """
    problem, values, found = end.problem, end.problem.values(end.theta), set()
    lags = [i for i in problem.free if problem.names[i][1].startswith("Tp")]
    for a, b in itertools.combinations(lags, 2):
        if problem.names[a][0] == problem.names[b][0] and abs(values[a] - values[b]) <= EQUAL * values[a]:
            found |= {a, b}
    return sorted(map(int, found))


def process_uncertainty(model: FittedProcess, end: End) -> Uncertainty:
    """What the errors say of the parameters that were searched, and of the constant or the level.

    One that stands at its bound is taken to be there for the others' sake, and has no interval.

    Args:
        model: The model there.
        end: Where the search ended.

    Returns:
        The uncertainty, in the channels' units and seconds.
    """
    problem = end.problem
    errors, J = problem.errors(end.theta)
    n = len(problem.free)
    unit = np.where(problem.logarithms, problem.values(end.theta)[problem.free], 1.0)
    J[:, :n] /= unit
    held = np.array([bool(side) for side in at_bounds(end)] + [False] * (J.shape[1] - n))
    own = J[:, ~held]
    variance = float(errors @ errors) / max(problem.n_counted - own.shape[1], 1)
    norms = np.linalg.norm(own, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    R = linalg.qr(own / scale, mode="r")[0][: own.shape[1]]
    _, sizes, Vt = linalg.svd(R)
    sizes = np.concatenate([sizes, np.zeros(own.shape[1] - len(sizes))])
    kept = sizes > OPEN * float(sizes[0])
    root = (Vt[kept].T / sizes[kept]) / scale[:, np.newaxis]
    root = _coloured(end, errors, own, root)
    lost = np.abs(Vt[~kept]).max(axis=0, initial=0.0) > np.sqrt(OPEN)
    names, rows, values = _in_units(model, end)
    spread = np.zeros((J.shape[1], root.shape[1]))
    spread[~held] = root
    moved = rows @ spread
    covariance = variance * (moved @ moved.T)
    unknown = held.copy()
    unknown[~held] = lost
    unknown[[list(problem.free).index(i) for i in merged(end)]] = True
    open_ = unknown[: len(rows)] | ~np.isfinite(np.diag(covariance))
    covariance[open_] = covariance[:, open_] = np.nan
    return Uncertainty(
        names=names, values=values, covariance=covariance,
        noise_variance=variance * model.scaling.output_scale**2,
    )  # fmt: skip


def _coloured(end: End, errors: Array, J: Array, root: Array) -> Array:
    """The factor of the covariance where errors hang together; see :mod:`..coloured_errors`."""
    records = end.problem.records
    ends = np.cumsum([len(record.target) - record.first for record in records])[:-1]
    a = colour(np.split(errors, ends), [record.counted for record in records])
    if len(a) == 1:
        return root
    hang = np.sum([information([part], a) for part in np.split(J @ root, ends)], axis=0)
    return np.asarray(root @ sandwich(np.eye(len(hang)), hang, end.problem.n_counted))


def _in_units(model: FittedProcess, end: End) -> tuple[tuple[str, ...], Array, Array]:
    """Names, derivatives and values of what is told, by the vector's parameters and the constant or the level."""
    problem, form = end.problem, model.scaling
    n = len(problem.free)
    rows = np.zeros((n + problem.n_offsets, len(end.theta)))
    inputs, names, values = model.mapping.inputs, [], []
    for at, i in enumerate(problem.free):
        j, name = problem.names[i]
        rows[at, at] = form.output_scale / form.input_scale[j] if name == GAIN else 1.0
        names.append(shown(name, inputs[j], inputs))
        values.append(model.parameters[names[-1]])
    if problem.constant and problem.levelled is None:
        rows[n, n] = form.output_scale
        for at, i in enumerate(problem.free):  # from the inputs' middle, about which it was fitted, to zero
            j, name = problem.names[i]
            if name == GAIN:
                rows[n, at] = -rows[at, at] * end.problem.middles[j]
        names.append("constant")
        values.append(form.output_offset)
    elif problem.constant and problem.levelled is not None:
        rows[n, n] = form.input_scale[problem.levelled]
        names.append(shown("level", inputs[problem.levelled], inputs))
        values.append(form.input_offset[problem.levelled])
    return tuple(names), rows, np.array(values)


def polynomials_of(model: FittedProcess, known: Uncertainty) -> tuple[tuple[str, ...], Array, Array]:
    """What is known of the parameters as polynomials, as their views read it.

    Args:
        model: The model.
        known: Of its parameters.

    Returns:
        Names ``B(input, power)`` of numerators and ``F(input, power)`` of denominators, their values, and how they move
        with what is known, shape ``(n_values, n_known)``.
    """
    inputs = model.mapping.inputs
    names, values, rows = [], [], []
    for kind, own, of in zip(model.process.types, model.values, inputs, strict=True):
        at = np.array(own)
        B, F = kind.polynomials(at)
        names += [f"B({of}, {i})" for i in range(len(B))] + [f"F({of}, {i})" for i in range(len(F) - 1)]
        values += [*B, *F[:-1]]
        for row in kind.polynomial_slopes(at):
            found = np.zeros(len(known.names))
            for slope, name in zip(row, kind.names, strict=True):
                label = shown(name, of, inputs)
                if label in known.names:
                    found[known.names.index(label)] = slope
            rows.append(found)
    return tuple(names), np.array(values), np.array(rows)


def drawn_polynomials(
    model: FittedProcess, known: Uncertainty, j: int, *, draws: int, seed: int
) -> tuple[Array, Array]:
    """Numerators and denominators of one input, of parameters that are drawn from what is known of them.

    Time constants and damping are drawn as logarithms, so that none is negative. What is given, or stands at a bound,
    stays there.

    Args:
        model: The model.
        known: Of its parameters.
        j: Which input.
        draws: How many.
        seed: Of the draws.

    Returns:
        In ascending powers of ``s``, shapes ``(draws, n)``; the denominators end with 1.
    """
    kind, inputs = model.process.types[j], model.mapping.inputs
    labels = [shown(name, inputs[j], inputs) for name in kind.names]
    sure = np.isfinite(np.diag(known.covariance))
    at = [known.names.index(one) if one in known.names else -1 for one in labels]
    moved = [i for i, place in enumerate(at) if place >= 0 and sure[place]]
    values = np.array(model.values[j])
    logs = np.array([name in kind.constants for name in kind.names])
    scale = np.where(logs, values, 1.0)
    places = [at[i] for i in moved]
    covariance = known.covariance[np.ix_(places, places)] / np.outer(scale[moved], scale[moved])
    steps = np.zeros((draws, len(values)))
    steps[:, moved] = np.random.default_rng(seed).multivariate_normal(
        np.zeros(len(moved)), covariance, size=draws, method="eigh"
    )
    with np.errstate(over="ignore"):
        found = np.where(logs, values * np.exp(steps), values + steps)
    pairs = [kind.polynomials(one) for one in found]
    return np.array([B for B, _ in pairs]), np.array([F for _, F in pairs])
