"""Find the loop that records are of: elements and orders race, from many beginnings, over growing parts of the records.

All records begin at one place, so that the first samples of each show where the loop begins, with few turns in them to
go wrong. Those that leave most drop out as the parts grow.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.loops.fitting import fitted
from sysid.estimation.loops.gate import Law, pieces
from sysid.estimation.loops.loop import Array, Found, Loop, Records, Scaled
from sysid.estimation.loops.relays import relay_begun
from sysid.kernels.loop import DEAD_ZONE, SATURATION, WAITS

ELEMENTS = ((SATURATION, 2, 20), (DEAD_ZONE, 4, 20), (WAITS, 2, 40))
"""Elements, steps from sample to sample at first, and samples of each record that are looked at first."""
STARTS, SHORT = 48, 20
"""Beginnings of each element and order; of fewer samples a record says nothing."""
FIRST, ROUNDS = 8, ((16, 12), (8, 30))
"""Iterations of every beginning over the first part; then how many go on, with how many iterations each."""
KEPT, ITERATIONS, LAST = (6, 4, 3, 2), 30, 100
"""How many go on to each longer part, with how many iterations; and how many the best has over all."""
LOST, ENOUGH, NEAR = 0.03, 3e-3, 5e-4
"""Shares of the outputs' ranges: of more that is left of some part nothing comes; as much may be left of all; and of so
little no other element is tried."""
FINER, GAINS, MOST_STEPS, FINE = 2, 0.7, 16, 1e-4
"""By how much steps become shorter at the end, as long as that leaves so much less; how many there are at most; and of
how little that is left they are short enough."""
FOURTH = 3
"""The number of the state of two masses that nothing depends on."""
SAME = 1e-6
"""Share of an output's range within which all records begin at one place."""
SAMPLES = 12_000
"""Of all records, at most: of more the first records alone are fitted."""

Raced = tuple[float, Loop]


def found_loop(records: Records) -> Found | None:
    """Find such a loop.

    Args:
        records: Inputs, shape ``(n_samples, n_inputs)``, and outputs, shape ``(n_samples, n_outputs)``, which begin at
            one place.

    Returns:
        The loop; ``None`` where none comes near enough.
    """
    scaled = _scaled(records)
    laws = {} if scaled is None else pieces(scaled.records)
    if scaled is None or not laws:
        return None
    best = _raced(scaled, laws, np.random.default_rng(0))
    if best is None or not best[0] <= ENOUGH:
        return None
    left, loop = _finer(scaled, *best)
    return Found(left=left, scaled=scaled, loop=loop)


def _scaled(records: Records) -> Scaled | None:
    long = [(u, y) for u, y in records if len(y) > SHORT]
    if not long or long[0][0].shape[1] == 0:
        return None
    kept = max(1, SAMPLES // max(len(y) for _, y in long))
    scaled = Scaled.of(long[:kept])
    begins = None if scaled is None else np.array([y[0] for _, y in scaled.records])
    return None if begins is None or np.ptp(begins, axis=0).max() > SAME else scaled


def _raced(scaled: Scaled, laws: Mapping[int, Law], rng: np.random.Generator) -> Raced | None:
    """The best of the first element and order that comes near enough, or else of all."""
    best: Raced | None = None
    for short, begun in _begun(scaled, laws, rng):
        found = _followed(scaled, begun, short)
        best = found if best is None or (found is not None and found[0] < best[0]) else best
        if best is not None and best[0] <= NEAR:
            break
    return best


def _followed(scaled: Scaled, begun: Sequence[Loop], samples: int) -> Raced | None:
    """The best of some beginnings over growing parts; ``None`` where all are lost on the way."""
    part, kept = scaled.first(samples), iter(KEPT)
    pool = [fitted(one, part, FIRST) for one in begun]
    for most, iterations in ROUNDS:
        pool = [fitted(one, part, iterations) for _, one in _best(pool, most)]
    while samples < scaled.longest:
        samples = min(2 * samples, scaled.longest)
        part = scaled.first(samples)
        pool = [fitted(one, part, ITERATIONS) for _, one in _best(pool, next(kept, KEPT[-1]))]
        pool = [one for one in pool if one[0] <= LOST]
    (best,) = _best(pool, 1) or (None,)
    return None if best is None else fitted(best[1], part, LAST)


def _best(pool: Sequence[Raced], most: int) -> list[Raced]:
    """Those that leave least."""
    return sorted((one for one in pool if np.isfinite(one[0])), key=lambda one: one[0])[:most]


def _begun(scaled: Scaled, laws: Mapping[int, Law], rng: np.random.Generator) -> Iterator[tuple[int, list[Loop]]]:
    """Where races begin, after how many samples: half at the rates of the law that most samples follow, if any."""
    known = max((law.rates for law in laws.values()), key=len)
    orders = (3,) if len(scaled.span) == 1 else (3, 4)
    relays = (relay_begun(scaled, law, output) for output, law in laws.items())
    yield from ((SHORT, [one]) for one in relays if one is not None)
    for kind, steps, short in ELEMENTS:
        for states in orders:
            yield short, [_drawn(scaled, (kind, states, steps), known if n % 2 else [], rng) for n in range(STARTS)]


def _drawn(scaled: Scaled, form: tuple[int, int, int], known: Sequence[float], rng: np.random.Generator) -> Loop:
    """A loop of some element, order and steps, its numbers at random."""
    kind, states, steps = form
    m, long = len(scaled.reach), scaled.longest
    rates = np.exp(rng.uniform(np.log(0.5 / long), 0.0, states))
    rates[: len(known)] = known[:states]
    drives, sees, seen = rng.normal(size=(states, m)), rng.normal(size=states), rng.normal(size=m)
    begins, limits, more = 0.1 * rng.normal(size=states), 0.5 * np.sort(rng.normal(size=2)), np.zeros(0)
    sizes = np.maximum(rates, 1.0 / long)
    if kind == DEAD_ZONE:
        rates, drives, sees, limits = _two_masses(m, states, long, rng)
        seen, begins, sizes = np.zeros(m), np.zeros(states), np.maximum(rates, 1.0 / long)
        sees, more = sees / sizes, np.zeros(1)
    if kind == WAITS:
        more = np.append(0.1 * rng.normal(size=states + m), 0.0)
    if kind == WAITS and rng.random() < 0.5:  # a controller of an error, which it sees and adds up
        sees = np.append(-np.abs(sees[:-1]), 1.0)
        more = np.exp(rng.uniform(np.log(0.3 / long), np.log(0.3))) * np.concatenate([sees[:-1], [0.0], seen, [0.0]])
    parts = {"rates": rates, "drives": drives.ravel(), "sees": sees, "seen": seen, "begins": begins, "limits": limits}
    theta = np.concatenate([*parts.values(), more])
    return Loop(
        kind=kind, states=states, steps=steps, sizes=sizes, theta=theta, free=_free(kind, states, m, len(theta)),
        read=np.zeros((0, 0)),
    )  # fmt: skip


def _free(kind: int, n: int, m: int, numbers: int) -> NDArray[np.bool_]:
    """What is estimated: of a dead zone neither what it sees of inputs, nor where at rest it begins, which limits say.

    A fourth state there is no more than how far the second mass has gone.
    """
    free = np.ones(numbers, dtype=bool)
    if kind == DEAD_ZONE:
        sees = n + n * m
        free[sees + n : sees + 2 * n + m] = False
        if n > FOURTH:
            free[[FOURTH, sees + FOURTH, *range(n + FOURTH * m, n + n * m)]] = False
    return free


def _two_masses(m: int, states: int, long: int, rng: np.random.Generator) -> tuple[Array, Array, Array, Array]:
    """Two masses that meet through a dead zone, the first of which inputs act on: rates, drives, what is seen, limits.

    Their speeds and how far one is from the other are the states; a fourth is how far the second has gone.
    """
    slow = np.exp(rng.uniform(np.log(0.5 / long), np.log(0.3), 2))
    turn, other = np.exp(rng.uniform(np.log(0.05), np.log(1.5))), np.exp(rng.uniform(np.log(0.1), np.log(5.0)))
    moves = np.array([[-slow[0], 0.0, 0.0], [0.0, -slow[1], 0.0], [1.0, -1.0, 0.0]])
    stiff = turn**2 / (1.0 + other)
    rates, modes = np.linalg.eig(moves)
    by_element = np.linalg.solve(modes, stiff * np.array([-1.0, other, 0.0]))
    drives = np.linalg.solve(modes, np.outer([1.0, 0.0, 0.0], rng.normal(size=m)))
    half = np.exp(rng.uniform(np.log(0.01), np.log(10.0)))
    more = states - 3
    return (
        np.concatenate([-rates, np.zeros(more)]),
        np.vstack([drives / by_element[:, np.newaxis], np.zeros((more, m))]),
        np.concatenate([modes[2] * by_element, np.zeros(more)]),
        np.array([-half, half]),
    )


def _finer(scaled: Scaled, error: float, loop: Loop) -> Raced:
    """The same with shorter steps, as long as that gains."""
    part = scaled.first(scaled.longest)
    while error > FINE and FINER * loop.steps <= MOST_STEPS:
        finer = fitted(replace(loop, steps=FINER * loop.steps), part, LAST)
        if not finer[0] < GAINS * error:
            break
        error, loop = finer
    return error, loop
