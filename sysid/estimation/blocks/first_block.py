r"""Two blocks around a curve, found from the first: what lies behind a first block and a polynomial is nearly linear.

The best linear model of a short record may have poles that are not the blocks', as what the curve distorts is noise to
it, and ways to part it then start far from the system. But given the first block, with :math:`z` its output, the rest
is nearly linear in its unknowns,

.. math:: y = \frac{1}{A(q)} \sum_{k=1}^{3} B_k(q)\, z^k + c,

a curve and a second block whose numerators are left free of each other (over-parametrised as in Bai 1998). It is found
by the iterations of Steiglitz and McBride 1965 in milliseconds. So many first blocks are drawn, the best are moved to
where the rest leaves least of the output, and the numerators are parted into a curve and a block by their largest
singular value.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.blocks.sections import LARGEST_POLE, Block, Pair, block_of, samples_for, sections_of
from sysid.estimation.clock import now

Array = NDArray[np.float64]

POWERS, ROUNDS, RANKED = 3, 4, 2
"""Of what lies between; iterations of Steiglitz and McBride; and those of them that tell which first blocks to move."""
DRAWN, MOVED, EVALUATIONS = 300, 6, 60
"""First blocks that are drawn, those that are moved to where the error is least, and evaluations for each of them."""
SEARCHED, SETTLED = 2_000, 0.1
"""Samples that are looked at, and the share of them that the blocks take to forget that they began at 0."""
DAMPED, FASTEST = (0.1, 1.0), 2.0
"""Damping ratios of pairs that are drawn, and the fastest natural frequency, in radians a sample."""
FLAT = 0.1
"""Share of its spread below which the slope of a curve is none: that of a square over what is centred."""
SAME = 1e-3
"""Relative difference of errors below which two first blocks are one."""
FAR = 1e3
"""Residual of a block that is not stable, where outputs range over -1 to 1."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Rest:
    """What is behind a first block.

    Args:
        between: What lies between, from -1 to 1, shape ``(n_samples,)``.
        residual: Of the output, without the first samples.
        denominator: ``A``, shape ``(n_second + 1,)``.
        numerators: ``B_k``, shape ``(POWERS, n_second + 1)``.
    """

    between: Array
    residual: Array
    denominator: Array
    numerators: Array


def searched(
    begun: Sequence[Block], second: int, signals: tuple[Array, Array], *, direct: Sequence[bool], slowest: float,
    rng: np.random.Generator, until: float, moved: int = MOVED,
) -> list[tuple[float, Pair]]:  # fmt: skip
    """Pairs of blocks around a curve, what lies between scaled to -1 to 1, and the curve to what it is along a line.

    Args:
        begun: First blocks to begin with, of as many states as are wanted.
        second: States behind the curve.
        signals: Scaled inputs, shape ``(n_samples, n_inputs)``, and output of a record.
        direct: Of each input whether it is read within the sample.
        slowest: The longest time constant that is drawn, in samples.
        rng: Source of randomness.
        until: When no more is tried, on the clock of ``sysid.estimation.clock.now``.
        moved: How many are moved to where the error is least.

    Returns:
        Mean squared errors and the pairs that leave them, the best first.
    """
    w, y = signals[0][:SEARCHED], signals[1][:SEARCHED]
    tried = [*begun, *(_drawn(begun[0], direct, slowest, rng) for _ in range(DRAWN))]
    ranked: list[tuple[float, int]] = []
    for at, block in enumerate(tried):
        if ranked and now() > until:
            break
        ranked.append((_size(_behind(block.from_rest(w), y, second, rounds=RANKED)), at))
    found: list[tuple[float, Pair]] = []
    for at in _apart(sorted(ranked))[:moved]:
        if found and now() > until:
            break
        block = _moved(tried[at], w, y, second, direct)
        rest = _behind(block.from_rest(w), y, second)
        if rest is not None:
            found.append((_size(rest), _pair(block, rest, w)))
    return sorted(found, key=lambda one: one[0])


def _apart(ranked: Sequence[tuple[float, int]]) -> list[int]:
    """Which are tried, of those that leave the same error one."""
    kept, last = list[int](), -np.inf
    for error, at in ranked:
        if error > last * (1.0 + SAME):
            kept.append(at)
            last = error
    return kept


def _drawn(like: Block, direct: Sequence[bool], slowest: float, rng: np.random.Generator) -> Block:
    """A stable block of some time constants."""
    n, poles = like.states, list[complex]()
    while len(poles) < n:
        frequency = np.exp(rng.uniform(-np.log(max(slowest, 2.0)), np.log(FASTEST)))
        if len(poles) + 2 <= n and rng.random() < 0.5:
            damping = rng.uniform(*DAMPED)
            pole = np.exp(frequency * complex(-damping, np.sqrt(1.0 - damping**2)))
            poles += [pole, pole.conjugate()]
        else:
            poles.append(complex(np.exp(-frequency)))
    gains = rng.standard_normal(like.gains.shape)
    return Block(
        sections=sections_of(np.array(poles)),
        gains=gains,
        direct=np.where(direct, rng.standard_normal(len(direct)), 0.0),
    )


def _behind(z: Array, y: Array, second: int, *, rounds: int = ROUNDS) -> _Rest | None:
    """The curve and the block behind what lies between, where there are any."""
    span = float(np.abs(z).max())
    if not np.isfinite(span) or span == 0.0:
        return None
    between = z / span
    powers = [between**k - between[0] ** k for k in range(1, POWERS + 1)]
    first, n, A = round(SETTLED * len(y)), second, np.eye(1, second + 1)[0]
    for _ in range(rounds):
        filtered = scipy.signal.lfilter([1.0], A, [y, *powers, np.ones(len(y))])
        rows = np.column_stack([_lagged(-filtered[0], n)[:, 1:], *(_lagged(one, n) for one in filtered[1:-1])])
        found = np.linalg.lstsq(np.column_stack([rows, filtered[-1]])[first:], filtered[0][first:], rcond=None)[0]
        A = _stable(np.concatenate([[1.0], found[:n]]))
    filtered = scipy.signal.lfilter([1.0], A, powers)
    rows = np.column_stack([*(_lagged(one, n) for one in filtered), np.ones(len(y))])
    found = np.linalg.lstsq(rows[first:], y[first:], rcond=None)[0]
    residual = (rows @ found - y)[first:]
    if not np.isfinite(residual).all():
        return None
    return _Rest(between=between, residual=residual, denominator=A, numerators=found[:-1].reshape(POWERS, n + 1))


def _lagged(values: Array, n: int) -> Array:
    """A signal and its last ``n`` samples, from 0: shape ``(n_samples, n + 1)``."""
    return np.column_stack([np.concatenate([np.zeros(k), values[: len(values) - k]]) for k in range(n + 1)])


def _stable(denominator: Array) -> Array:
    """A denominator whose roots outside the unit circle are reflected into it."""
    roots = np.roots(denominator)
    size = np.abs(roots)
    if not len(roots) or size.max() <= LARGEST_POLE:
        return denominator
    inside = np.where(
        size > LARGEST_POLE, roots / np.maximum(size, 1e-12) * np.minimum(1.0 / size, LARGEST_POLE), roots
    )
    return np.real(np.poly(inside))


def _size(rest: _Rest | None) -> float:
    return np.inf if rest is None else float(np.mean(rest.residual**2))


def _moved(block: Block, w: Array, y: Array, second: int, direct: Sequence[bool]) -> Block:
    """A first block where the rest leaves least of the output."""
    widths = [len(one) for one in block.sections]
    m, length = len(direct), len(y) - round(SETTLED * len(y))

    def of(values: Array) -> Block:
        coefficients, at = [], 0
        for width in widths:
            coefficients.append(tuple(values[at : at + width].tolist()))
            at += width
        gains = values[at : at + block.gains.size].reshape(block.gains.shape)
        return replace(
            block,
            sections=tuple(coefficients),
            gains=gains,
            direct=np.where(direct, values[-m:], 0.0) if m else block.direct,
        )

    def residual(values: Array) -> Array:
        moved = of(values)
        if not all(_inside(one) for one in moved.sections):
            return np.full(length, FAR)
        rest = _behind(moved.from_rest(w), y, second)
        return np.full(length, FAR) if rest is None else rest.residual

    begun = np.concatenate([*map(np.array, block.sections), block.gains.ravel(), block.direct])
    return of(scipy.optimize.least_squares(residual, begun, max_nfev=EVALUATIONS, x_scale="jac", diff_step=1e-6).x)


def _inside(section: tuple[float, ...]) -> bool:
    """Whether the poles of a section lie inside the unit circle."""
    return abs(section[0]) < 1.0 if len(section) == 1 else abs(section[1]) < 1.0 and abs(section[0]) < 1.0 + section[1]


def _pair(before: Block, rest: _Rest, w: Array) -> Pair:
    """The two blocks and the curve: what the numerators have in common."""
    span = float(np.abs(before.from_rest(w)).max())
    left, values, right = np.linalg.svd(rest.numerators)
    x = rest.between
    y = x[:, None] ** np.arange(1, POWERS + 1) @ left[:, 0]
    slope = np.cov(x, y)[0, 1] / np.var(x)
    spread = float(y.std() / x.std())
    # The slope on the whole is 1, as that of the identity; a square has none.
    size = slope if abs(slope) > FLAT * spread else spread
    poles = np.roots(rest.denominator).astype(np.complex128)
    impulse = np.eye(1, samples_for(poles))[0]
    response = size * values[0] * scipy.signal.lfilter(right[0], rest.denominator, impulse)
    return Pair(
        before=replace(before, gains=before.gains / span, direct=before.direct / span),
        behind=block_of(poles, response[:, None], direct=True),
        x=x,
        y=y / size,
    )
