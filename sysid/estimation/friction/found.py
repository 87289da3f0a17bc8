"""Find in records which output is a place that dry friction holds, and about how it moves.

Friction shows where an output stands while an input moves on, neither at a stop nor where the input would hold it. What
speeds it up and slows it down while it moves is then nearly linear in inputs, speed, place and other outputs, but for
the sign of the speed; that gives the numbers to begin with. Records are without noise: a place that is measured with
noise never stands.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.records.output_ends import found_ends
from sysid.models.orders.output_limits import Between

Array = NDArray[np.float64]
Records = Sequence[tuple[Array, Array]]

STANDS = 1e-6
"""Share of the fastest step from sample to sample within which an output stands."""
ANYWHERE, LATEST, BY_CHANCE = 0.5, 4, 0.1
"""Part of its stands that are at places of their own; part of the longest record to which a dead time may come; and
part of the stands over which inputs that come so late move by chance."""
BAND = 1e-3
"""Share of its range from an end within which it is held there, and not by friction."""
LONG, FEWEST, DRIVEN = 4, 3, 0.05
"""Samples for which it stands at least, how often it does so, and share of its range by which an input moves then."""
SLOWEST = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4)
"""Shares of the fastest speed at which friction may have come down from what it is at rest."""
LEAST = 0.05
"""Of friction to begin with, as a share of what moves it."""
MOSTLY = 0.9
"""Share of the samples over which a place stands at whose end its speed is nought: it may begin to move at the end."""
EXPLAINED = 0.3
"""Share of how the speed changes that has to be explained."""
FOLLOWS = 1e-3
"""Share of its own steps that an output may be off which adds up what inputs and speed bring, or is the speed."""


@dataclass(frozen=True, kw_only=True)
class Beside:
    """Another output, a sum of what inputs and speed bring, or the speed itself.

    Args:
        output: Its number.
        size: Its largest value from rest.
        by_inputs: What each input, as a share of its reach, brings in a sample, as shares of its size; empty where it
            is the speed.
        by_speed: What the fastest speed brings so; of the speed itself, its value then.
    """

    output: int
    size: float
    by_inputs: tuple[float, ...]
    by_speed: float


@dataclass(frozen=True, kw_only=True)
class Friction:
    """An output that friction holds, and numbers to begin with.

    Args:
        output: Its number.
        rest: Outputs before the first sample.
        begins: Inputs there.
        reach: How far each input goes from there.
        ends: Between what it is held.
        span: How far it goes.
        fastest: How far in a sample.
        beside: The other outputs.
        by_inputs: What each input adds to the speed in a sample, as a share of the fastest; a share of its reach each.
        by_beside: Likewise what each of the others adds that is a sum.
        drag: Share of the speed that is lost in a sample.
        pull: What is lost so where the place is a range away from rest.
        held: What friction takes in a sample.
        more: What it takes more at rest.
        slow: Share of the fastest speed at which that has gone.
        left: Share of how the speed changes that all this leaves: what drives it lags behind its command.
    """

    output: int
    rest: tuple[float, ...]
    begins: tuple[float, ...]
    reach: tuple[float, ...]
    ends: Between
    span: float
    fastest: float
    beside: tuple[Beside, ...]
    by_inputs: tuple[float, ...]
    by_beside: tuple[float, ...]
    drag: float
    pull: float
    held: float
    more: float
    slow: float
    left: float


def found_friction(records: Records) -> Friction | None:
    """Find such an output.

    Args:
        records: Inputs, shape ``(n_samples, n_inputs)``, and outputs, shape ``(n_samples, n_outputs)``, which begin at
            rest.

    Returns:
        The first output that is one, with what goes with it; ``None`` where none is.

    Example:
        >>> rng, records = np.random.default_rng(0), []
        >>> for _ in range(6):
        ...     u, x, v, places = np.append([0.0, 0.0], rng.uniform(-1.0, 1.0, 40).repeat(10)), 0.0, 0.0, []
        ...     for force in u:
        ...         v = 0.9 * v + 0.1 * force
        ...         v = np.sign(v) * max(abs(v) - 0.03, 0.0)
        ...         x += v
        ...         places.append(x)
        ...     records.append((u[:, np.newaxis], np.array(places)[:, np.newaxis]))
        >>> found = found_friction(records)
        >>> found.output, round(found.held * found.fastest, 4), found.ends
        (0, 0.03, (None, None))
    """
    records = [(u, y) for u, y in records if len(y) > LONG]
    if not records or records[0][0].shape[1] == 0:
        return None
    firsts = np.array([y[0] for _, y in records])
    span = np.ptp(np.concatenate([y for _, y in records]), axis=0)
    reach = np.max([np.abs(u - u[0]).max(axis=0) for u, _ in records], axis=0)
    if (span <= 0.0).any() or (reach <= 0.0).any() or (np.ptp(firsts, axis=0) > STANDS * span).any():
        return None
    return next((one for k in range(len(span)) if (one := _of(records, k, span, reach)) is not None), None)


def _of(records: Records, k: int, span: Array, reach: Array) -> Friction | None:
    """That output, where it is one."""
    steps = [np.diff(y[:, k], prepend=y[0, k]) for _, y in records]
    fastest = float(np.quantile(np.abs(np.concatenate(steps)), 0.99))
    if not fastest > 0.0:
        return None
    steps = [one / fastest for one in steps]
    ends = _ends(records, k, steps)
    if not _sticks(records, k, steps, ends, reach):
        return None
    others = [j for j in range(len(span)) if j != k]
    beside = [_beside(records, j, k, fastest, reach) for j in others]
    known = [one for one in beside if one is not None]
    if len(known) < len(others):
        return None
    sums = [one for one in known if one.by_inputs]
    moved = _moved(records, k, fastest, reach, sums)
    if moved is None:
        return None
    m, q = len(reach), len(sums)
    return Friction(
        output=k, rest=tuple(records[0][1][0].tolist()), begins=tuple(records[0][0][0].tolist()),
        reach=tuple(reach.tolist()), ends=ends, span=float(span[k]), fastest=fastest, beside=tuple(known),
        by_inputs=tuple(moved[:m]), by_beside=tuple(moved[m : m + q]), drag=max(moved[m + q], 0.0),
        pull=moved[m + q + 1], held=moved[m + q + 3], more=max(moved[m + q + 4], 0.0), slow=moved[m + q + 5],
        left=moved[m + q + 6],
    )  # fmt: skip


def _ends(records: Records, k: int, steps: Sequence[Array]) -> Between:
    """Its ends, which it comes to at several speeds: where it comes to rest as it always does, friction holds it."""

    def is_met(end: float) -> bool:
        arrivals = set[float]()
        for (_, y), step in zip(records, steps, strict=True):
            there = y[:, k] == end
            arrivals |= set(step[1:][there[1:] & ~there[:-1]].round(6).tolist())
        return len(arrivals) >= FEWEST

    found = found_ends([(u, y[:, k]) for u, y in records])
    low, high = (end if end is not None and is_met(end) else None for end in found)
    return low, high


def _sticks(records: Records, k: int, steps: Sequence[Array], ends: Between, reach: Array) -> bool:
    """Whether an output stands, elsewhere than at its ends, while an input moves on, and moves on later.

    It stands anywhere: what comes to rest at the same few places again and again is held by a dead band, or is coarse.
    And it does so whatever the dead time: one after which it stands only where the inputs have stood explains it all.
    """
    band = BAND * float(np.ptp(np.concatenate([y[:, k] for _, y in records])))
    stands = [
        (r, begin + 1, end)
        for r, ((_, y), step) in enumerate(zip(records, steps, strict=True))
        for begin, end in _standing(y[:, k], step, ends, band)
    ]
    places = np.array([records[r][1][begin, k] for r, begin, _ in stands])
    if len(set((places / (band or 1.0)).round().tolist())) < ANYWHERE * len(places):
        return False
    for late in range(1 + max(len(u) for u, _ in records) // LATEST):
        driven = [
            bool((np.ptp(records[r][0][begin - late : end - late], axis=0) > DRIVEN * reach).any())
            for r, begin, end in stands
            if begin >= late
        ]
        if sum(driven) < (FEWEST if late == 0 else BY_CHANCE * len(driven)):
            return False
    return True


def _standing(place: Array, step: Array, ends: Between, band: float) -> list[tuple[int, int]]:
    """First sample of each stretch over which a place stands away from its ends, and the one behind its last."""
    free = np.ones(len(step), dtype=bool)
    for stop in ends:
        free &= True if stop is None else np.abs(place - stop) > band
    still = free & (np.abs(step) <= STANDS)
    # Stretches that begin and end in motion: before the first nobody knows whether anything holds it.
    return [
        (begin + 1, end)
        for begin, end in itertools.pairwise(np.flatnonzero(~still).tolist())
        if end - begin > LONG and free[begin + 1 : end].all()
    ]


def _beside(records: Records, j: int, k: int, fastest: float, reach: Array) -> Beside | None:
    """Another output, where it is the speed, or adds up what inputs and the speed bring."""
    size = max(float(np.abs(y[:, j] - y[0, j]).max()) for _, y in records)
    shares = np.concatenate([(u[1:] - u[0]) / reach for u, _ in records])
    speed = np.concatenate([np.diff(y[:, k]) for _, y in records]) / fastest
    value = np.concatenate([y[1:, j] - y[0, j] for _, y in records]) / size
    gained = np.concatenate([np.diff(y[:, j]) for _, y in records]) / size
    factors, off = _fitted(np.column_stack([shares, speed]), gained)
    if off <= FOLLOWS:
        return Beside(output=j, size=size, by_inputs=tuple(factors[:-1]), by_speed=factors[-1])
    still = np.abs(speed) <= STANDS
    (as_speed,), off = _fitted(speed[:, np.newaxis], value)
    # At the end of a sample it is not what it was over it: how near both are is no more than a hint.
    if off < 1.0 - EXPLAINED and np.mean(np.abs(value[still]) <= STANDS) > MOSTLY:
        return Beside(output=j, size=size, by_inputs=(), by_speed=as_speed)
    return None


def _fitted(terms: Array, values: Array) -> tuple[list[float], float]:
    """Factors of least squares, and the share of the values' squares that they leave."""
    found = np.linalg.lstsq(terms, values, rcond=None)[0]
    whole = float(values @ values)
    left = values - terms @ found
    return found.tolist(), float(left @ left) / whole if whole > 0.0 else np.inf


def _moved(records: Records, k: int, fastest: float, reach: Array, sums: Sequence[Beside]) -> list[float] | None:
    """Factors of inputs, sums, speed, place, 1, friction, more of it at rest; how slow; and the share that is left."""
    parts, span = [], float(np.ptp(np.concatenate([y[:, k] for _, y in records])))
    for u, y in records:
        step, shares = np.diff(y[:, k], prepend=y[0, k]) / fastest, (u - u[0]) / reach
        t = np.arange(1, len(step) - 1)
        t = t[(step[t - 1] * step[t] > 0.0) & (step[t] * step[t + 1] > 0.0) & (np.abs(step[t]) > STANDS)]
        own = [(y[t, one.output] - y[0, one.output]) / one.size for one in sums]
        moving = [shares[t + 1], *own, -step[t], (y[0, k] - y[t, k]) / span, np.ones(len(t))]
        rest = [step[t + 1] - step[t], 0.5 * (step[t] + step[t + 1]), np.sign(step[t]), step[t - 1], shares[t]]
        parts.append((np.column_stack(moving), np.column_stack(rest)))
    terms, others = (np.vstack(some) for some in zip(*parts, strict=True))
    change, speed, way, before = others[:, 0], others[:, 1], others[:, 2], others[:, 3:]
    if len(change) < 4 * (terms.shape[1] + before.shape[1] + 2):
        return None
    best: tuple[float, list[float]] = (np.inf, [])
    for slow in SLOWEST:
        rubs = np.column_stack([terms, -way, -way * np.exp(-((speed / slow) ** 2))])
        best = min(best, (_fitted(rubs, change)[1], [*_fitted(rubs, change)[0], slow]))
    # A drive that lags behind its command shows in what was before; of that no number is taken.
    explained = 1.0 - _fitted(np.column_stack([terms, -way, before]), change)[1]
    least = LEAST * max(map(abs, best[1][: len(reach) + len(sums)]))
    found = best[1]
    found[-3] = max(found[-3], least)
    return [*found, best[0]] if max(explained, 1.0 - best[0]) >= EXPLAINED else None
