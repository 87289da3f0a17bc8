"""Find in records what is linear from sample to sample and reset at events, as a ball that bounces.

Samples that one linear map leads to are the flow; the others are events. An event is told by a level that a reference
which looks for it so many times a sample reaches at every event, and at no other sample: of an output, an input, or the
difference of both; of a relay with two levels, while its output is at one of its two values. What it sets the outputs
to is seen by running the flow backwards from the sample behind it. A reference without noise fits exactly or not at
all: what is not near enough is no such thing, and is left to the search.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.linear.majority_map import majority_map
from sysid.estimation.resets.quotients import ratios_of
from sysid.estimation.resets.reset_map import Armed, Array, Guard, ResetMap, Rest, features, quantity, with_ratios

STEPS: Final = (1, 2, 4, 5, 8, 10, 16, 20)
"""Times in a sample that a reference may look for events."""
NEAR: Final = (1e-9, 1e-7, 1e-5)
"""Shares of each output's range that the map may be off at a sample."""
FLOWS, RESETS = 0.5, 0.85
"""Shares of the samples that move which the flow leads to, and of the events which a reset does: in a sample with two
events, or with the last, it is another."""
MOST_GUARDS, FEWEST = 3, 8
"""Events of different kinds, and samples of each at least."""
STANDS: Final = 1e-9
"""Share of the range within which an output stands."""
MOST_BEGINS: Final = 8
"""Records whose beginning is tried for that of all."""
SAMPLES: Final = 40_000
"""Of all records, at most."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Steps:
    """From each sample to the next: what was, what acted, what came of it; a row each."""

    before: Array
    inputs: Array
    after: Array
    span: Array

    @property
    def terms(self) -> Array:
        return np.hstack([self.before, self.inputs, np.ones((len(self.before), 1))])


def found_resets(records: Sequence[tuple[Array, Array]]) -> ResetMap | None:
    """Find such a map.

    Args:
        records: Inputs, shape ``(n_samples, n_inputs)``, and outputs, shape ``(n_samples, n_outputs)``; the outputs of
            a sample are those at its end.

    Returns:
        The map that has fewest looks for events a sample among those that fit best; ``None`` where there is none.
        Quotients by inputs that stand still over a record are looked for where there is none without.

    Example:
        >>> h, v, fall = 1.0, 0.0, []
        >>> for _ in range(400):
        ...     h, v = h + 0.01 * v, v - 0.0981
        ...     h, v = (0.0, -0.8 * v) if h <= 0.0 else (h, v)
        ...     fall.append((h, v))
        >>> found = found_resets([(np.zeros((400, 0)), np.array(fall))])
        >>> found.steps, found.guards[0].level, found.guards[0].reset.round(6).tolist()
        (1, 0.0, [[0.0, 0.0], [0.0, -0.8], [0.0, 0.0]])
    """
    found = _found(records)
    ratios = ratios_of([u for u, _ in records]) if found is None else ()
    if not ratios:
        return found
    found = _found([(with_ratios(u, ratios), y) for u, y in records])
    return None if found is None else replace(found, ratios=ratios)


def switches(outputs: Array) -> list[Armed]:
    """Outputs that have two values, as a relay has.

    Args:
        outputs: Of all records, shape ``(n_samples, n_outputs)``.

    Returns:
        Of each where it is at the lower one, and where at the higher.

    Example:
        >>> [(one.output, one.sign, one.level) for one in switches(np.array([[0.1, 0.0], [0.2, 1.0], [0.3, 1.0]]))]
        [(1, 1, 0.5), (1, -1, 0.5)]
    """
    found = []
    for k, column in enumerate(outputs.T):
        low, high = column.min(), column.max()
        if low < high and bool(((column == low) | (column == high)).all()):
            found += [Armed(output=k, sign=sign, level=float(low + high) / 2.0) for sign in (1, -1)]
    return found


def _found(records: Sequence[tuple[Array, Array]]) -> ResetMap | None:
    steps, rng = _steps_of(records), np.random.default_rng(0)
    if steps is None:
        return None
    two = sorted({one.output for one in switches(np.vstack([steps.before, steps.after]))})
    own = [k for k in range(len(steps.span)) if k not in two]
    moves = ~_within(steps.after[:, own] - steps.before[:, own], steps.span[own], STANDS)
    for near in NEAR:
        flow = np.eye(steps.terms.shape[1])[:, : len(steps.span)]  # of a relay, between its events
        found = _common(steps.terms, steps.after[:, own], steps.span[own], near, rng=rng, among=moves) if own else None
        if own and found is None:
            continue
        flow[:, own] = flow[:, own] if found is None else found
        led = _within(steps.terms @ flow - steps.after, steps.span, near)
        if (own and led[moves].mean() < FLOWS) or led.all():
            continue
        best = max(
            (
                _with_events(steps, flow.T, led, n, looks_first=first, near=near, rng=rng)
                for n in STEPS
                for first in (False, True)
            ),
            key=lambda one: 0.0 if one is None else one[0],
        )
        if best is not None and best[0] >= RESETS:
            begin = _begin(records, best[1])
            return None if begin is None else replace(best[1], begin=begin)
    return None


def derived_from(outputs: Array) -> dict[int, Array]:
    """Outputs that are those before them, in another unit or added up: the rest is the state, and says all.

    Args:
        outputs: Of all records, shape ``(n_samples, n_outputs)``.

    Returns:
        By number of the output its factors of the outputs that are not among these, and of 1.

    Example:
        >>> h = np.random.default_rng(0).normal(size=(50, 2))
        >>> {k: row.round(6).tolist() for k, row in derived_from(np.column_stack([h, 3.0 * h[:, 0] + 1.0])).items()}
        {2: [3.0, 0.0, 1.0]}
    """
    own, found = list[int](), dict[int, Array]()
    for k in range(outputs.shape[1]):
        terms = np.column_stack([outputs[:, own], np.ones(len(outputs))])
        row = np.asarray(np.linalg.lstsq(terms, outputs[:, k], rcond=None)[0], dtype=np.float64)
        if own and np.abs(terms @ row - outputs[:, k]).max() <= NEAR[0] * np.ptp(outputs[:, k]):
            found[k] = row
        else:
            own.append(k)
    full = {}
    for k, row in found.items():  # outputs that came to be own after it have no part in it
        full[k] = np.concatenate([row[:-1], np.zeros(len(own) + 1 - len(row)), row[-1:]])
        full[k] = np.where(np.abs(full[k]) < 1e-12 * np.abs(full[k]).max(), 0.0, full[k])
    return full


def _steps_of(records: Sequence[tuple[Array, Array]]) -> _Steps | None:
    parts = [(y[:-1], u[1:], y[1:]) for u, y in records if len(y) > 1]
    if not parts:
        return None
    before, inputs, after = (np.concatenate(some)[:SAMPLES] for some in zip(*parts, strict=True))
    span = np.ptp(np.concatenate([before, after]), axis=0)
    if not (span > 0.0).all() or len(before) < 10 * (before.shape[1] + inputs.shape[1] + 1):
        return None
    return _Steps(before=before, inputs=inputs, after=after, span=span)


def _still(steps: _Steps) -> NDArray[np.bool_]:
    return _within(steps.after - steps.before, steps.span, STANDS)


def _within(off: Array, span: Array, near: float) -> NDArray[np.bool_]:
    return np.asarray((np.abs(off) <= near * span).all(axis=1))


def _common(
    terms: Array, values: Array, span: Array, near: float, *, rng: np.random.Generator, among: NDArray[np.bool_]
) -> Array | None:
    """The linear map that most of some samples follow, of the fewest terms."""
    found = majority_map(terms, values, span, near, rng=rng, among=among)
    if found is None:
        return None
    some, chosen = found
    return _plain(some, terms[chosen], values[chosen], span, near)


def _plain(found: Array, terms: Array, values: Array, span: Array, near: float) -> Array:
    """The same map with as few terms as do: what is not needed is noise, and is far off elsewhere."""
    plain = found.copy()
    for j in range(values.shape[1]):
        used = list(np.argsort(-np.abs(found[:, j]) * np.abs(terms).max(axis=0)))
        for k in used[::-1]:
            fewer = [one for one in used if one != k]
            own = np.linalg.lstsq(terms[:, fewer], values[:, j], rcond=None)[0] if fewer else np.zeros(0)
            if np.abs(terms[:, fewer] @ own - values[:, j]).max() <= near * span[j]:
                used = fewer
        plain[:, j] = 0.0
        if used:
            plain[used, j] = np.linalg.lstsq(terms[:, used], values[:, j], rcond=None)[0]
    return plain


def _with_events(
    steps: _Steps, flow: Array, led: NDArray[np.bool_], n: int, *, looks_first: bool, near: float,
    rng: np.random.Generator,
) -> tuple[float, ResetMap] | None:  # fmt: skip
    """The map where the reference looks for events so often, and the share of the events that it leads through."""
    part = _root(flow, n)
    # What a flow forgets within a step cannot be seen by running it backwards.
    if part is None or np.linalg.matrix_rank(part[:, : len(part)]) < len(part):
        return None
    path, at = [steps.before.T], steps.terms.T
    for _ in range(n):
        at = np.vstack([part @ at, at[len(part) :]])
        path.append(at[: len(part)])
    runs, open_ = np.array(path[:-1] if looks_first else path[1:]), ~led  # runs: (n, n_outputs, samples)
    left = np.arange(n, 0, -1) - (0 if looks_first else 1)  # steps from each look to the sample behind
    still, guards, through = _still(steps), [], 0
    for _ in range(MOST_GUARDS):
        found = _guard(steps, runs, led, open_)
        if found is None:
            break
        here = open_ & _reached(found, steps, runs).any(axis=0)
        guard, led_through = _reset(steps, part, runs, here & ~still, found, left=left, near=near, rng=rng)
        open_ = open_ & ~here
        if guard is not None:
            guards.append(guard)
            through += led_through
    events = int((~led & ~still).sum())
    if not guards or not events:
        return None
    rest, begin = _rest(steps, runs, guards, ~led, still), steps.before[0]
    made = ResetMap(flow=part, steps=n, guards=tuple(guards), rest=rest, begin=begin, looks_first=looks_first)
    return through / events, made


def _reached(guard: Guard, steps: _Steps, runs: Array) -> NDArray[np.bool_]:
    """At which look of each sample it is the event, shape ``(n, samples)``."""
    return guard.reached(runs.swapaxes(0, 1), steps.inputs.T[:, np.newaxis])


def _root(flow: Array, n: int) -> Array | None:
    """The map of an n-th of a sample: with so many of them it is the whole."""
    p, whole = len(flow), np.eye(flow.shape[1])
    whole[:p] = flow
    if n == 1:
        return flow
    part = np.real(scipy.linalg.fractional_matrix_power(whole, 1.0 / n))
    if not np.isfinite(part).all():
        return None
    near = np.allclose(np.linalg.matrix_power(part, n), whole, rtol=1e-11, atol=1e-13)
    return np.where(np.abs(part[:p]) < 1e-14 * np.abs(part[:p]).max(), 0.0, part[:p]) if near else None


def _guard(steps: _Steps, runs: Array, led: NDArray[np.bool_], open_: NDArray[np.bool_]) -> Guard | None:
    """The level that most of the open events reach, and no sample of the flow; it has yet to be seen what it does."""
    best, most, outputs = None, FEWEST - 1, runs.swapaxes(0, 1)
    rows, none = _rows(len(outputs), steps.inputs.shape[1]), np.zeros((0, 0))
    for some, armed in itertools.product(rows, (None, *switches(steps.before))):
        counts = np.ones(len(led), dtype=bool) if armed is None else armed(steps.before.T)
        flows, events = led & counts, open_ & counts
        if not flows.any() or events.sum() <= most:
            continue
        for row, sign in itertools.product(some, (1, -1)):
            least = (sign * quantity(row, outputs, steps.inputs.T[:, np.newaxis])).min(axis=0)
            edge = least[flows].min()
            reach = events & (least < edge)
            if reach.sum() > most:
                level = sign * simplest(float(least[reach].max()), float(edge))
                most, best = int(reach.sum()), Guard(row=row, sign=sign, level=level, reset=none, armed=armed)
    return best


def _rows(p: int, m: int) -> tuple[list[Array], list[Array]]:
    """What a level may be of: an output or an input; an output beside an input."""
    own = np.eye(p + m)
    return list(own), [own[j] - own[p + k] for j in range(p) for k in range(m)]


def simplest(low: float, high: float) -> float:
    """The number with fewest digits from one number on to below another: a level that somebody wrote.

    Args:
        low: It may be this one.
        high: It is less.

    Returns:
        The number.

    Example:
        >>> simplest(-1e-5, 2e-4), simplest(0.0993, 0.1012), simplest(-2.45, -2.35)
        (0.0, 0.1, -2.4)
    """
    if low <= 0.0 < high:
        return 0.0
    for digits in range(1, 17):
        scale = 10.0 ** (math.floor(math.log10(max(abs(low), abs(high)))) + 1 - digits)
        one = math.ceil(low / scale) * scale
        if low <= float(f"{one:.{digits}g}") < high:
            return float(f"{one:.{digits}g}")
    return low


def _reset(
    steps: _Steps, part: Array, runs: Array, here: NDArray[np.bool_], guard: Guard, *, left: NDArray[np.int64],
    near: float, rng: np.random.Generator,
) -> tuple[Guard | None, int]:  # fmt: skip
    """What an event sets the outputs to, and in how many of these samples it does."""
    places = np.flatnonzero(here)
    if len(places) < FEWEST:
        return None, 0
    first = _reached(guard, steps, runs)[:, places].argmax(axis=0)
    met, inputs = runs[first, :, places].T, steps.inputs[places].T
    terms = features(met, inputs)
    set_to = _backwards(steps, part, places, left[first])
    some = _common(terms, set_to, steps.span, 10.0 * near, rng=rng, among=np.ones(len(places), dtype=bool))
    if some is None:
        return None, 0
    led = _within(terms @ some - set_to, steps.span, 10.0 * near)
    return replace(guard, reset=some), int(led.sum())


def _backwards(steps: _Steps, part: Array, places: NDArray[np.int64], by: NDArray[np.int64]) -> Array:
    """Outputs so many steps before the sample behind, as if nothing but the flow had led there."""
    p, found = len(part), np.empty((len(places), len(part)))
    whole = np.eye(part.shape[1])
    whole[:p] = part
    after = np.hstack([steps.after, steps.inputs, np.ones((len(steps.after), 1))])
    for n in np.unique(by):
        own = by == n
        found[own] = np.linalg.solve(np.linalg.matrix_power(whole, int(n)), after[places[own]].T)[:p].T
    return found


def _rest(
    steps: _Steps, runs: Array, guards: Sequence[Guard], events: NDArray[np.bool_], still: NDArray[np.bool_]
) -> Rest | None:
    """Below what the outputs stand still at an event; of the outputs that by which it is told most clearly."""
    if (events & still).sum() < FEWEST:
        return None
    values = np.median(steps.after[events & still], axis=0)
    ends = events & _within(steps.after - values, steps.span, STANDS)
    to, told = np.full((runs.shape[1], runs.shape[2]), np.nan), np.zeros(runs.shape[2], dtype=bool)
    for guard in guards[::-1]:
        hit = _reached(guard, steps, runs)
        own = hit.any(axis=0) & events
        met = runs[hit.argmax(axis=0), :, np.arange(runs.shape[2])].T
        set_to = (features(met, steps.inputs.T) @ guard.reset).T
        to, told = np.where(own, set_to, to), told | own
    return _edge(to, told & ends, told & ~ends, values)


def _edge(to: Array, ends: NDArray[np.bool_], goes_on: NDArray[np.bool_], values: Array) -> Rest | None:
    best, gap = None, 1.0
    for j, one in enumerate(np.abs(to)):
        if not ends.any() or not goes_on.any():
            continue
        # An event behind another of the same sample is not seen: few may lie on the wrong side.
        low, high = float(np.quantile(one[ends], 0.99)), float(np.quantile(one[goes_on], 0.01))
        low, high = _tightened(one[ends], one[goes_on], low, high)
        if low < high and high / max(low, 1e-300) > gap:
            best, gap = (
                Rest(output=j, below=simplest(np.nextafter(low, np.inf), high), values=values),
                high / max(low, 1e-300),
            )
    return best


def _tightened(ends: Array, goes_on: Array, low: float, high: float) -> tuple[float, float]:
    """The edge between most of both: the largest that ends, and the least that goes on, each on its side of it."""
    middle = math.sqrt(max(low, 1e-300) * max(high, 1e-300))
    return float(ends[ends <= middle].max(initial=low)), float(goes_on[goes_on >= middle].min(initial=math.inf))


def _begin(records: Sequence[tuple[Array, Array]], found: ResetMap) -> Array | None:
    """Where all records begin: the flow backwards from the first sample; ``None`` where they begin elsewhere."""
    p, whole = found.n_outputs, np.eye(found.flow.shape[1])
    whole[:p] = found.flow
    far = np.linalg.matrix_power(whole, found.steps)
    begins = np.array([np.linalg.solve(far, np.concatenate([y[0], u[0], [1.0]]))[:p] for u, y in records])
    span = np.ptp(np.concatenate([y for _, y in records]), axis=0)
    # Backwards through an event it is another place: some begin without one, and from there all are led.
    for begin in (np.median(begins, axis=0), *begins[:MOST_BEGINS]):
        clean = np.where(np.abs(begin) < 1e-12 * max(1.0, float(np.abs(begin).max())), 0.0, begin)
        placed = replace(found, begin=clean)
        if all((np.abs(placed.run(u[:1])[0] - y[0]) <= 1e-6 * span).all() for u, y in records):
            return clean
    return None
