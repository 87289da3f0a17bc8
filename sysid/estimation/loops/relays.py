"""Where a race begins whose element is a relay that nobody sees: its switches are read from what the law leaves.

Between its switches a relay adds a constant to the law of the output, one of two. At a switch it goes from one to the
other over as many samples as the law is long, and how says at which time within the sample it was. Of these times the
states follow, and of the states at them what the relay sees: all by least squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from sysid.estimation.loops.gate import NEAR, Law
from sysid.estimation.loops.loop import Array, Loop, Scaled
from sysid.kernels.loop import RELAY

CLOSE, OFTEN = 30.0 * NEAR, 0.02
"""How near a sample is to one of the two constants, and the share of the samples that has to be near each."""
WHOLE = 0.03
"""Part of a sample at either end of it at which a switch is at that end."""
FEWEST = 20
"""Switches of which something follows."""
STEPS, ROBUST = 2, 30
"""From sample to sample; and rounds of least absolute errors."""


@dataclass(frozen=True, kw_only=True)
class Switch:
    """A switch.

    Args:
        sample: In which.
        after: The part of the sample before it.
        on: Whether the relay is on behind it.
    """

    sample: int
    after: float
    on: bool


def relay_begun(scaled: Scaled, law: Law, output: int) -> Loop | None:
    """A loop with a relay as the law has it.

    Args:
        scaled: The records.
        law: That most samples of an output follow.
        output: Its number.

    Returns:
        The loop, not fitted yet; ``None`` where there are no two constants, or the law swings.
    """
    if not law.rates:
        return None
    shares = _shares(scaled, law, output)
    weights = None if shares is None else _weights(shares, law.order)
    if shares is None or weights is None:
        return None
    whole = [_part_on(one, weights) for one in shares]
    switches = [_switches(one) for one in whole]
    if sum(map(len, switches)) < FEWEST:
        return None
    return _assembled(scaled, np.array(law.rates), [bool(one[0] > 0.5) for one in whole], switches, output)


def _shares(scaled: Scaled, law: Law, output: int) -> list[Array] | None:
    """Where between both constants each sample is from the law's order on."""
    left = []
    for u, y in scaled.records:
        own, t = y[:, output], np.arange(law.order, len(y))
        past = sum(factor * own[t - k] for k, factor in enumerate(law.past, start=1))
        driven = sum(factor * u[t - k, j] for j, row in enumerate(law.drives) for k, factor in enumerate(row))
        left.append(own[t] - past - driven)
    every = np.concatenate(left)
    first, often = _commonest(every)
    second, as_often = _commonest(every[np.abs(every - first) > 3.0 * CLOSE])
    if min(often, as_often) < OFTEN * len(every):
        return None
    low, high = min(first, second), max(first, second)
    return [(one - low) / (high - low) for one in left]


def _commonest(values: Array) -> tuple[float, int]:
    """The value that most are near, and how many."""
    ranked = np.sort(values)
    near = np.searchsorted(ranked, ranked + CLOSE) - np.arange(len(ranked))
    best = int(near.argmax()) if len(near) else 0
    return (float(ranked[best : best + near[best]].mean()), int(near[best])) if len(near) else (np.nan, 0)


def _weights(shares: Sequence[Array], order: int) -> Array | None:
    """How much of a switch shows in its sample and in each behind it: of switches that stand alone."""
    if order == 1:
        return np.ones(1)
    parts = []
    for one in shares:
        flat = (np.abs(one) < 1e-3) | (np.abs(one - 1.0) < 1e-3)
        for k in range(1, len(one) - order):
            if flat[k - 1] and not flat[k] and flat[k + order] and round(one[k - 1]) != round(one[k + order]):
                part = one[k : k + order]
                parts.append(part if one[k - 1] < 0.5 else 1.0 - part)
    if len(parts) < FEWEST:
        return None
    rows = np.array(parts)
    known = np.ones(len(rows), dtype=bool)
    whole = np.zeros(order + 1)
    whole[order] = 1.0
    for i in range(1, order):
        for _ in range(3):
            line = np.linalg.lstsq(np.column_stack([rows[known, 0], np.ones(known.sum())]), rows[known, i], rcond=None)[
                0
            ]
            whole[i] = line[1]
            off = np.abs(rows[:, i] - line[0] * rows[:, 0] - line[1])
            known = off <= max(5.0 * float(np.median(off)), 1e-6)
    return np.diff(whole)


def _part_on(shares: Array, weights: Array) -> Array:
    """The part of each sample for which the relay is on, before the first as in it."""
    on, n = np.empty(len(shares)), len(weights)
    for t, share in enumerate(shares):
        before = [on[t - i] if t >= i else round(float(np.clip(shares[0], 0.0, 1.0))) for i in range(1, n)]
        value = float(np.clip((share - weights[1:] @ before) / weights[0], 0.0, 1.0))
        on[t] = round(value) if min(value, 1.0 - value) < WHOLE else value
    return np.concatenate([np.full(n, round(on[0])), on])


def _switches(on: Array) -> list[Switch]:
    found, now = list[Switch](), bool(on[0] > 0.5)
    for t, part in enumerate(on):
        if abs(part - now) < WHOLE:
            continue
        found.append(Switch(sample=t, after=1.0 - part if not now else part, on=not now))
        now = not now
    return found


def _assembled(
    scaled: Scaled, rates: Array, begins_on: Sequence[bool], switches: Sequence[Sequence[Switch]], output: int
) -> Loop | None:
    """The loop of which these are the switches."""
    modes = [
        _modes(u, rates, on, own)
        for (u, _), on, own in zip(scaled.records, begins_on, switches, strict=True)
    ]  # fmt: skip
    terms = np.vstack([one.reshape(len(one), -1) for one in modes])
    outputs = np.concatenate([y[:, output] for _, y in scaled.records])
    terms = np.column_stack([terms, np.ones(len(terms))])
    factors = np.linalg.lstsq(terms, outputs, rcond=None)[0][:-1].reshape(len(rates), -1)
    by_relay = factors[:, -2]
    if (np.abs(by_relay) < 1e-9).any():
        return None
    drives, begins = factors[:, :-2] / by_relay[:, np.newaxis], factors[:, -1] / by_relay
    states = [(one * factors).sum(axis=2) / by_relay for one in modes]
    row = _seen(scaled, rates, drives, states, switches)
    if row is None:
        return None
    n, sees = len(rates), row[:-1]
    limits = np.array([-1.0, 1.0]) - row[-1]
    theta = np.concatenate([rates, drives.ravel(), sees, begins, limits, [float(begins_on[0])]])
    free = np.ones(len(theta), dtype=bool)
    free[-1] = False
    return Loop(kind=RELAY, states=n, steps=STEPS, sizes=np.ones(n), theta=theta, free=free, read=np.zeros((0, 0)))


def _fed(rates: Array, time: float) -> Array:
    """What a constant has fed into each mode after some part of a sample."""
    return np.asarray((1.0 - np.exp(-rates * time)) / rates)


def _modes(u: Array, rates: Array, on: bool, switches: Sequence[Switch]) -> Array:
    """Each mode driven by each input, by the relay, and let go, at the end of each sample: ``(T, n, m + 2)``."""
    relay = np.empty((len(u), len(rates)))
    by_sample, at = {one.sample: one for one in switches}, on
    for t in range(len(u)):
        relay[t] = at * _fed(rates, 1.0)
        if t in by_sample:
            late = _fed(rates, 1.0 - by_sample[t].after)
            at = by_sample[t].on
            relay[t] += late if at else -late
    found = np.empty((len(u), len(rates), u.shape[1] + 2))
    for i, rate in enumerate(rates):
        driven = np.column_stack([u * _fed(rates, 1.0)[i], relay[:, i]])
        found[:, i, :-1] = scipy.signal.lfilter([1.0], [1.0, -np.exp(-rate)], driven, axis=0)
        found[:, i, -1] = np.exp(-rate * np.arange(1, len(u) + 1))
    return found


def _seen(
    scaled: Scaled, rates: Array, drives: Array, states: Sequence[Array], switches: Sequence[Sequence[Switch]]
) -> Array | None:
    """Factors of states, inputs and 1 in what is -1 where the relay goes on, and 1 where it goes off."""
    rows, values = [], []
    for (u, _), x, own in zip(scaled.records, states, switches, strict=True):
        for one in own:
            t = one.sample
            # An input that jumps may switch it at once, well beyond its limit.
            if t == 0 or (one.after < 2.0 * WHOLE and (u[t] != u[t - 1]).any()):
                continue
            here = np.exp(-rates * one.after) * x[t - 1]
            here += _fed(rates, one.after) * (drives @ u[t] + (not one.on))
            rows.append(np.concatenate([here, u[t], [1.0]]))
            values.append(-1.0 if one.on else 1.0)
    if len(rows) < FEWEST:
        return None
    terms, wanted = np.array(rows), np.array(values)
    weights: Array = np.ones(len(wanted))
    row: Array = np.zeros(terms.shape[1])
    for _ in range(ROBUST):
        row = np.asarray(np.linalg.lstsq(terms * weights[:, np.newaxis], wanted * weights, rcond=None)[0])
        weights = 1.0 / np.sqrt(np.maximum(np.abs(terms @ row - wanted), 1e-3))
    return row
