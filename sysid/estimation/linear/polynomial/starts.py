r"""Starts of polynomial models from a long ARX model.

A long ARX model :math:`\hat A y = \hat B u + \hat e` tells both what the inputs do and what the innovations were,
however coloured the noise. With :math:`\hat e` known, ARMAX is a linear regression (Hannan and Rissanen 1982,
"Recursive
estimation of mixed autoregressive-moving average order"). What each input does,
:math:`\hat w_j = \hat B_j/\hat A\,u_j`, has next to no noise, and :math:`F_j \hat w_j = B_j u_j` is solved by
iterated filtering with :math:`\hat A/F_j` or
:math:`1/F_j` (Steiglitz and McBride 1965; Zhu 2001, "Multivariable system identification for process control",
chapter 6). What is left is the noise, an ARMA series.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy import linalg

from sysid.errors import FitDivergedError, TraceError, UserError
from sysid.estimation.linear.long_arx import LongARX
from sysid.estimation.linear.polynomial.contained import has_common
from sysid.estimation.linear.segments import Segment, delayed_inputs
from sysid.estimation.linear.state_space.search import search
from sysid.estimation.linear.state_space.training import StateSpaceTraining
from sysid.estimation.linear.subspace.projections import arx_orders, regress
from sysid.estimation.linear.subspace.system import EDGE
from sysid.estimation.linear.subspace.windows import Windows
from sysid.estimation.linear.subspace.yardstick import Yardstick
from sysid.models import LinearStateSpace
from sysid.models.linear.innovations import Innovations
from sysid.models.linear.polynomial_orders import AbstractPolynomial

Array = NDArray[np.float64]

SHORTEST = 4
"""Samples in a row that a start is looked for in."""

LONGEST, ROUNDS, INSIDE, SETTLED = 40, 12, 0.98, 1e-3
"""Lags of a long ARX model at most; filtering rounds; how far inside the unit circle a root is put; and a change of
coefficients at which filtering may end."""
ALLOWED = 2.0 * EDGE - 1.0
"""Magnitude at which a pole is begun that stands at the edge of what is allowed, or beyond."""
STEPS = 30
"""Steps of a state space that a start is taken from."""


def long_model(pieces: Sequence[Segment], least: int, *, more: float = 1.0) -> LongARX:
    """The model whose order Akaike's criterion chooses, or longer by a factor.

    Args:
        pieces: Unbroken records, in scaled numbers.
        least: Lags at least.
        more: The factor.

    Returns:
        The model.
    """
    m = pieces[0].inputs.shape[1]
    total, longest = sum(map(len, pieces)), max(map(len, pieces))
    most = max(min(LONGEST, total // (4 * (m + 1)), longest // 2), 1)
    windows = Windows.of(pieces, max(min(max(most, least), longest - 1), 1), 1)
    chosen = 1 + int(np.argmin(arx_orders(windows)))
    order = min(max(round(chosen * more), least), windows.past)
    yardstick = Yardstick.of(windows, order, feedthrough=True)
    return replace(model_of_order(windows, order), yardstick=yardstick)


def model_of_order(windows: Windows, order: int) -> LongARX:
    """The model with so many lags.

    Args:
        windows: Of the pieces, with as many past samples or more.
        order: How many.

    Returns:
        The model.
    """
    inputs_now = windows.inputs(0, 1)
    m, columns = inputs_now.shape[1], [windows.constant, windows.at(-order, 0), inputs_now]
    theta = regress(np.concatenate(columns, axis=1), windows.outputs(0, 1))[:, 0]
    lagged = theta[1 : 1 + order * (m + 1)].reshape(order, m + 1)[::-1]  # newest lag first
    now = theta[1 + order * (m + 1) :]
    A = np.concatenate([[1.0], -lagged[:, m]])
    B = tuple(np.concatenate([[now[j]], lagged[:, j]]) for j in range(m))
    return LongARX(A=A, B=B, constant=float(theta[0]))


def _in_state_space(pieces: Sequence[Segment], orders: AbstractPolynomial) -> LongARX | None:
    """What the inputs do in a state space of the same order that is fitted to the free run.

    Args:
        pieces: Unbroken records.
        orders: The structure: its largest denominator says how many states.

    Returns:
        The transfer functions over their common denominator, beside no noise model; ``None`` where there is none.
    """
    states = max(orders.denominators, default=0)
    # Without D a state space has as many coefficients above as states, the first of them at a lag of one sample.
    found = _state_space(pieces, orders, states, direct=min(orders.nk, default=1) == 0 or max(orders.nb) > states)
    return None if found is None else LongARX(A=np.real(np.poly(found[0].A)), B=tuple(found[1]))


def _state_space(
    pieces: Sequence[Segment], orders: AbstractPolynomial, states: int, *, direct: bool, noise: bool = False
) -> tuple[Innovations, list[Array]] | None:
    """A state space behind the structure's dead times, and its numerators by lag; ``None`` where there is none."""
    if not states:
        return None
    dead = [nk - (not direct) for nk in orders.nk]
    late = [replace(p, inputs=delayed_inputs(p.inputs, np.zeros(len(dead)), dead)) for p in pieces]
    asked = LinearStateSpace(states=states, feedthrough=direct, noise=noise)
    try:
        system = search(late, asked, StateSpaceTraining(max_iterations=STEPS)).system
    except (UserError, FitDivergedError, linalg.LinAlgError, ValueError):  # too short for it: the other starts do
        return None
    A = np.real(np.poly(system.A))
    B = []
    for j, k in enumerate(dead):
        b, d = system.B[:, j : j + 1], float(system.D[0, j])
        # C adj(zI - A) b + d det(zI - A): the determinant lemma.
        numerator = np.real(np.poly(system.A - b @ system.C)) + (d - 1.0) * A
        B.append(np.concatenate([np.zeros(k), numerator]))
    return system, B


def _innovations_start(pieces: Sequence[Segment], orders: AbstractPolynomial) -> Array | None:
    """Coefficients of an ARMAX model that are those of a state space with a model of the noise.

    An ARMAX model whose polynomials are as long as each other is one, with ``C`` the poles of its predictor; of shorter
    ones the coefficients that are left say nearly the same. White noise of a sensor, whose ``C`` is ``A``, is among
    what a state space begins at.
    """
    na, nc, n_b = orders.order("na"), orders.order("nc"), max(orders.nb, default=0)
    direct = min(orders.nk, default=1) == 0
    found = _state_space(pieces, orders, max(na, nc, n_b - direct), direct=direct, noise=True)
    if found is None:
        return None
    system, numerators = found
    own = [np.concatenate([b, np.zeros(nk + nb)])[nk : nk + nb] for b, nk, nb in zip(
        numerators, orders.nk, orders.nb, strict=True
    )]  # fmt: skip
    A, C = (np.real(np.poly(one))[1:] for one in (system.A, system.A - system.K @ system.C))
    level = float(system.constant[0]) if orders.level else 0.0
    return np.concatenate([*own, A[:na], inside(C[:nc]), [level] * orders.level])


def _armax_start(pieces: Sequence[Segment], orders: AbstractPolynomial, long: LongARX) -> Array:
    """Coefficients of an ARMAX model by one regression with the innovations of a long ARX model.

    That is of the pieces, or of their differences where the noise is integrated.
    """
    na, nc, m = orders.order("na"), orders.order("nc"), len(orders.nb)
    skipped = len(long.A) - 1 + nc
    reach = max([na, skipped, *(nb + nk for nb, nk in zip(orders.nb, orders.nk, strict=True))])
    tables, targets = [], []
    for piece in pieces:
        y, e = piece.outputs[:, 0], long.innovations(piece)
        columns = [_back(piece.inputs[:, j], k) for j in range(m) for k in _lags(orders, j)]
        columns += [-_back(y, k) for k in range(1, na + 1)] + [_back(e, k) for k in range(1, nc + 1)]
        tables.append(np.column_stack([*columns, np.ones(len(y))])[reach:])
        targets.append(y[reach:])
    theta = regress(np.concatenate(tables), np.concatenate(targets)[:, np.newaxis])[:, 0]
    n_b = sum(orders.nb)
    A, C = theta[n_b : n_b + na], theta[n_b + na : n_b + na + nc]
    level = theta[-1] / max(float(1.0 + A.sum()), 1e-3)
    return np.concatenate([theta[:n_b], A, inside(C), [level] * orders.level])


def _box_jenkins_start(
    pieces: Sequence[Segment], orders: AbstractPolynomial, long: LongARX, *, whitened: bool
) -> Array:
    """Coefficients of OE and Box-Jenkins models: each input's part first, then the noise that is left.

    Where it is whitened, what an input does is fitted through the filter that whitens the noise.
    """
    A = np.concatenate([[1.0], inside(long.A[1:])])
    B, F, left = [], [], [piece.outputs[:, 0].copy() for piece in pieces]
    for j in range(len(orders.nb)):
        inputs = [piece.inputs[:, j] for piece in pieces]
        driven = [scipy.signal.lfilter(long.B[j], A, u) for u in inputs]
        b, f = _rational(inputs, driven, orders, j, A if whitened else np.ones(1))
        B.append(b)
        F.append(f)
        delayed = np.concatenate([np.zeros(orders.nk[j]), b])
        left = [
            v - scipy.signal.lfilter(delayed, np.concatenate([[1.0], f]), u) for v, u in zip(left, inputs, strict=True)
        ]
    level = float(np.mean(np.concatenate(left)))
    noise = noise_of([v - level for v in left], orders.order("nc"), orders.order("nd"))
    return np.concatenate([*B, *F, *noise, [level] * orders.level])


def _state_space_start(pieces: Sequence[Segment], orders: AbstractPolynomial, same: LongARX) -> Array | None:
    """Coefficients of a model of one input that are a state space's own; ``None`` where it has not just these.

    The state space has as many states as the model has poles.
    """
    if len(orders.nb) != 1 or orders.denominators[0] != len(same.A) - 1:
        return None
    first, last = orders.nk[0], orders.nk[0] + orders.nb[0]
    b = np.concatenate([same.B[0], np.zeros(max(last - len(same.B[0]), 0))])
    if np.abs(np.delete(b, slice(first, last))).max(initial=0.0) > SETTLED * np.abs(b).max():
        return None
    roots = np.roots(same.A)
    size = np.maximum(np.abs(roots), np.finfo(np.float64).tiny)
    A = np.real(np.poly(np.where(size >= EDGE, roots / size * ALLOWED, roots)))
    left = [p.outputs[:, 0] - scipy.signal.lfilter(b, A, p.inputs[:, 0]) for p in pieces]
    level = float(np.mean(np.concatenate(left)))
    noise = noise_of([v - level for v in left], orders.order("nc"), orders.order("nd"))
    return np.concatenate([b[first:last], A[1:], *noise, [level] * orders.level])


def inside(coefficients: Array) -> Array:
    """The monic polynomial with these coefficients, its roots mirrored into the unit circle.

    Args:
        coefficients: Of lags 1, 2, and so on.

    Returns:
        Likewise.

    Example:
        >>> inside(np.array([-2.0])).tolist()
        [-0.5]
    """
    if not len(coefficients) or not np.isfinite(coefficients).all():
        return np.zeros(len(coefficients))
    roots = np.roots(np.concatenate([[1.0], coefficients]))
    size = np.maximum(np.abs(roots), np.finfo(np.float64).tiny)
    mirrored = np.where(size > INSIDE, roots / size * np.minimum(1.0 / size, INSIDE), roots)
    found = np.real(np.poly(mirrored))[1:]
    return np.concatenate([found, np.zeros(len(coefficients) - len(found))])


def _rational(
    inputs: Sequence[Array], driven: Sequence[Array], orders: AbstractPolynomial, j: int, through: Array
) -> tuple[Array, Array]:
    """``B`` and ``F`` of one input by iterated filtering."""
    nf, lags = orders.denominators[j], _lags(orders, j)
    f = np.zeros(nf)
    b = np.zeros(len(lags))
    best = np.inf
    for _ in range(ROUNDS):
        prefilter = np.concatenate([[1.0], f])
        tables, targets = [], []
        for u, w in zip(inputs, driven, strict=True):
            uf, wf = scipy.signal.lfilter(through, prefilter, u), scipy.signal.lfilter(through, prefilter, w)
            columns = [_back(uf, k) for k in lags] + [-_back(wf, k) for k in range(1, nf + 1)]
            tables.append(np.column_stack(columns))
            targets.append(wf)
        theta = regress(np.concatenate(tables), np.concatenate(targets)[:, np.newaxis])[:, 0]
        found = inside(theta[len(lags) :])
        delayed = np.concatenate([np.zeros(lags[0]), theta[: len(lags)]])
        error = sum(
            float(
                np.sum(
                    scipy.signal.lfilter(
                        through, [1.0], scipy.signal.lfilter(delayed, np.concatenate([[1.0], found]), u) - w
                    )
                    ** 2
                )
            )
            for u, w in zip(inputs, driven, strict=True)
        )
        if error < best:
            best, b, f_best = error, theta[: len(lags)], found
        settled = bool(np.abs(found - f).max(initial=0.0) < SETTLED)
        f = found
        if settled:
            break
    return (b, f_best) if np.isfinite(best) else (b, np.zeros(nf))


def noise_of(series: Sequence[Array], nc: int, nd: int) -> tuple[Array, Array]:
    """``C`` and ``D`` of what is left: innovations by a long AR model, then one regression.

    Args:
        series: What is left of each piece.
        nc: Order of ``C``.
        nd: Order of ``D``.

    Returns:
        Coefficients of both, from lag 1 on.
    """
    if nc + nd == 0:
        return np.zeros(0), np.zeros(0)
    order = max(min(20, min(map(len, series)) // 4), 1)
    tables = [np.column_stack([_back(v, k) for k in range(1, order + 1)])[order:] for v in series]
    targets = np.concatenate([v[order:] for v in series])
    long = regress(np.concatenate(tables), targets[:, np.newaxis])[:, 0]
    innovations = [scipy.signal.lfilter(np.concatenate([[1.0], -long]), [1.0], v) for v in series]
    reach = order + max(nc, nd)
    tables = [
        np.column_stack([*[_back(e, k) for k in range(1, nc + 1)], *[-_back(v, k) for k in range(1, nd + 1)]])[reach:]
        for v, e in zip(series, innovations, strict=True)
    ]
    theta = regress(np.concatenate(tables), np.concatenate([v[reach:] for v in series])[:, np.newaxis])[:, 0]
    return inside(theta[:nc]), inside(theta[nc:])


def _lags(orders: AbstractPolynomial, j: int) -> range:
    return range(orders.nk[j], orders.nk[j] + orders.nb[j])


def _back(signal: Array, k: int) -> Array:
    """A signal some samples ago, zero before it begins."""
    k = min(k, len(signal))
    return np.concatenate([np.zeros(k), signal[: len(signal) - k]])


def looked_at(pieces: Sequence[Segment], orders: AbstractPolynomial) -> list[Segment]:
    """Pieces that a start is looked for in: of drifting noise their changes."""
    looked = [_differenced(piece) for piece in pieces] if orders.drifts else list(pieces)
    looked = [piece for piece in looked if len(piece) >= SHORTEST]
    if not looked:
        raise TraceError(
            "no record is long enough to begin from",
            expected=f"at least {SHORTEST} samples in a row that are not masked",
            got=f"{max(map(len, pieces), default=0)} in a row at most",
            remedy="fill short gaps, with repairs: {nan: interpolate}, use longer records, or fit what needs no past: "
            "a transfer function or a neural state space",
        )
    return looked


def long_models(looked: Sequence[Segment], orders: AbstractPolynomial) -> list[LongARX]:
    """Long ARX models: as long as the records ask for, and twice that."""
    reach = [orders.order("na"), *(nb + nk for nb, nk in zip(orders.nb, orders.nk, strict=True))]
    least = max(*reach, *orders.denominators, 1) if len(reach) + len(orders.denominators) > 0 else 1
    return [long_model(looked, least), long_model(looked, least, more=2.0)]


def starts_of(looked: Sequence[Segment], orders: AbstractPolynomial, longs: Sequence[LongARX]) -> list[Array]:
    """Coefficients from long ARX models."""
    if has_common(orders):
        return [_armax_start(looked, orders, long) for long in longs]
    kinds = [(long, whitened) for long in longs for whitened in (False, True)]
    return [_box_jenkins_start(looked, orders, long, whitened=whitened) for long, whitened in kinds]


def of_state_space(looked: Sequence[Segment], orders: AbstractPolynomial) -> list[Array]:
    """Coefficients from a state space of the same order."""
    if has_common(orders):
        start = _innovations_start(looked, orders)
        return [] if start is None else [start]
    same = _in_state_space(looked, orders)
    if same is None:
        return []
    begun = [_box_jenkins_start(looked, orders, same, whitened=False)]
    # What is fitted to the state space keeps its poles inside the unit circle: its own are an integrator's, too.
    itself = _state_space_start(looked, orders, same)
    return begun if itself is None else [*begun, itself]


def _differenced(piece: Segment) -> Segment:
    """Changes from sample to sample, of which an integrated noise is an ordinary one."""
    return replace(
        piece,
        inputs=np.diff(piece.inputs, axis=0),
        outputs=np.diff(piece.outputs, axis=0),
        root_weights=piece.root_weights[1:],
    )
