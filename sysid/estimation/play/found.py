"""Find in records an input that acts through play: what follows it moves only once the input has moved by some width.

Where outputs are the state, the next sample is nearly a polynomial of the last, of the inputs, and of what follows the
input. What that leaves is least at the width that there is, and rises to both sides of it; an input without play has
its least at nought.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Records = Sequence[tuple[Array, Array]]

WIDTHS = tuple(np.geomspace(0.005, 0.4, 16).tolist())
"""Shares of an input's range that are tried."""
FINER = 12
"""Widths between the neighbours of the best that are tried next."""
NEEDED = 2.5
"""Times what is left with all outputs before that may be left without one, which is then no state."""
DEGREE, GAIN, EXPLAINED = 3, 0.5, 0.9
"""Of the polynomial; what it leaves with play as a share of what it leaves without, at most; and share of an output's
changes that it has to explain with play."""
MOST = 5
"""Inputs and outputs together, of which polynomials have few enough terms."""
SAMPLES = 20_000
"""Of all records, at most."""
SAME = 1e-6
"""Share of an output's range within which all records begin at one place."""


@dataclass(frozen=True, kw_only=True)
class Play:
    """An input with play.

    Args:
        input: Its number.
        width: How far it moves before what follows it does, to either side of its middle; in its unit.
        states: Numbers of the outputs that the next sample depends on.
        left: What a cubic leaves of the outputs' changes with it, as a share of what it leaves without.
    """

    input: int
    width: float
    states: tuple[int, ...]
    left: float


def played(moved: Array, width: float) -> Array:
    """What follows an input through play.

    Args:
        moved: The input, shape ``(n_samples,)``.
        width: To either side.

    Returns:
        Shape ``(n_samples,)``.

    Example:
        >>> played(np.array([0.0, 0.1, 0.5, 0.45, 0.0]), 0.2).round(2).tolist()
        [0.0, 0.0, 0.3, 0.3, 0.2]
    """
    at, found = float(moved[0]), np.empty(len(moved))
    for k, one in enumerate(moved.tolist()):
        at = min(max(at, one - width), one + width)
        found[k] = at
    return found


def found_play(records: Records) -> Play | None:
    """Find such an input.

    Args:
        records: Inputs, shape ``(n_samples, n_inputs)``, and outputs, shape ``(n_samples, n_outputs)``, which begin at
            one place.

    Returns:
        The input whose play explains most; ``None`` where none explains enough.
    """
    records = [(u, y) for u, y in records if len(y) > 2]
    if not records or not 0 < records[0][0].shape[1] <= MOST - records[0][1].shape[1]:
        return None
    each = max(3, SAMPLES // len(records))
    records = [(u[:each], y[:each]) for u, y in records]
    inputs, outputs = (np.concatenate(some) for some in zip(*records, strict=True))
    reach, span = np.ptp(inputs, axis=0), np.ptp(outputs, axis=0)
    firsts = np.ptp([y[0] for _, y in records], axis=0)
    if (reach <= 0.0).any() or (span <= 0.0).any() or (firsts > SAME * span).any():
        return None
    plain = _left(records, 0, 0.0, range(len(span)))
    found = [_of(records, k, float(reach[k]), plain) for k in range(len(reach))]
    return min((one for one in found if one is not None), key=lambda one: one.left, default=None)


def _of(records: Records, k: int, reach: float, plain: float) -> Play | None:
    """The play of an input, where it has some."""
    states = list(range(records[0][1].shape[1]))
    left = [_left(records, k, share * reach, states) for share in WIDTHS]
    best = int(np.argmin(left))
    if left[best] > 1.0 - EXPLAINED or left[best] > GAIN * plain or best == len(left) - 1:
        return None
    finer = np.geomspace(WIDTHS[max(best - 1, 0)], WIDTHS[best + 1], FINER) * reach
    nearer = [_left(records, k, width, states) for width in finer]
    width, least = float(finer[np.argmin(nearer)]), min(nearer)
    for one in states.copy():
        others = [j for j in states if j != one]
        states = others if others and _left(records, k, width, others) <= NEEDED * least else states
    return Play(input=k, width=width, states=tuple(states), left=least / plain)


def _left(records: Records, k: int, width: float, states: Sequence[int]) -> float:
    """Share of the squares of the outputs' changes that a cubic leaves, the mean over the outputs."""
    before, after, changed = [], [], []
    for u, y in records:
        given = u[1:].copy()
        given[:, k] = played(u[:, k], width)[1:]
        before.append(np.hstack([given, y[:-1][:, list(states)]]))
        after.append(y[1:])
        changed.append(np.diff(y, axis=0))
    terms, values = np.vstack(before), np.vstack(after)
    terms = (terms - terms.mean(axis=0)) / np.where(np.ptp(terms, axis=0) > 0.0, terms.std(axis=0), 1.0)
    powers = np.column_stack([np.prod(terms[:, list(one)], axis=1) for one in monomials(terms.shape[1], DEGREE)])
    off = values - powers @ np.linalg.lstsq(powers, values, rcond=None)[0]
    whole = np.vstack(changed).var(axis=0)
    return float(np.mean(np.mean(off**2, axis=0) / np.where(whole > 0.0, whole, 1.0)))


def monomials(variables: int, degree: int) -> list[tuple[int, ...]]:
    """Products of some variables up to a degree, each as the numbers of its factors.

    Args:
        variables: How many.
        degree: The highest.

    Returns:
        The constant first.

    Example:
        >>> monomials(2, 2)
        [(), (0,), (1,), (0, 0), (0, 1), (1, 1)]
    """
    return [one for d in range(degree + 1) for one in itertools.combinations_with_replacement(range(variables), d)]
