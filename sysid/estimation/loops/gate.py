"""Whether records are of something that is linear most of the time, and at times another linear thing.

What goes through a dead zone, limits or a relay follows one linear law exactly as long as the element stays on one of
its pieces. What is smooth and not linear follows none for more than a moment, and what is linear always the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from sysid.estimation.linear.majority_map import majority_map

Array = NDArray[np.float64]

ORDERS, NEAR = (1, 2, 3, 4), 1e-7
"""Past samples of a law, and share of the output's range that a sample may be off which follows it."""
SOME, ALL = 0.25, 0.98
"""Shares of the samples that move which follow one law: more than the first, and fewer than the second."""
NEARER, EXACT = 0.03, 0.8
"""Part of how near samples have to be within which most of those are that follow a law exactly; and that share."""
ALIKE = 0.97
"""Part of the share of the law that most follow from which on a shorter law is taken for it."""
LATE, TERMS, ROWS = 4, 240, 4000
"""Part of the longest record to which a dead time may come, most inputs of earlier samples in a law that has one, and
samples by which it is looked for."""
MOVES = 1e-4
"""Share of its range by which an output moves at least."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Law:
    """The linear law that most samples of an output follow, of its changes and those of the inputs.

    Args:
        order: Past samples.
        past: Factors of past changes of the output, the last first, shape ``(order,)``.
        drives: Factors of changes of the inputs, the last first, shape ``(n_inputs, order)``.
        share: Of the samples that move, those that follow it.
    """

    order: int
    past: Array
    drives: Array
    share: float

    @property
    def rates(self) -> list[float]:
        """Rates a sample at which its modes die away; empty where they swing."""
        poles = np.roots([1.0, *-self.past])
        if np.iscomplex(poles).any() or (poles.real <= 0.0).any():
            return []
        return sorted((-np.log(poles.real)).tolist())


def law_of(records: Sequence[tuple[Array, Array]], *, order: int) -> Law | None:
    """The law of some order that most samples follow.

    Changes have it without constants, in which pieces of a law differ whose slopes are one.

    Args:
        records: Inputs, shape ``(n_samples, n_inputs)``, and an output, shape ``(n_samples,)``, in shares of its range.
        order: Past samples.

    Returns:
        The law; ``None`` where hardly any samples have one in common.
    """
    terms, values = [], []
    for u, y in records:
        moved, driven = np.diff(y), np.diff(u, axis=0)
        t = np.arange(order, len(moved))
        past = [moved[t - k] for k in range(1, order + 1)]
        drives = [driven[t - k, j] for j in range(u.shape[1]) for k in range(order)]
        terms.append(np.column_stack([*past, *drives]))
        values.append(moved[t])
    all_terms, all_values = np.vstack(terms), np.concatenate(values)[:, np.newaxis]
    moves = np.abs(all_values[:, 0]) > MOVES
    found = majority_map(all_terms, all_values, np.ones(1), NEAR, rng=np.random.default_rng(0), among=moves)
    if found is None:
        return None
    row, follow = found[0][:, 0], found[1]
    # What is smooth comes near a law in passing, and nearer in fewer samples.
    off = np.abs(all_terms[follow] @ row - all_values[follow, 0])
    if np.mean(off <= NEARER * NEAR) < EXACT:
        return None
    inputs = records[0][0].shape[1]
    return Law(
        order=order, past=row[:order], drives=row[order:].reshape(inputs, order), share=len(follow) / int(moves.sum())
    )


def is_late(records: Sequence[tuple[Array, Array]]) -> bool:
    """Whether all samples follow one linear law whose inputs act late, which no equations of a loop have.

    Args:
        records: Inputs, shape ``(n_samples, n_inputs)``, and an output, shape ``(n_samples,)``, in shares of its range.

    Returns:
        Whether they do.
    """
    past, inputs = max(ORDERS), records[0][0].shape[1]
    lags = max(past, min(max(len(y) for _, y in records) // LATE, TERMS // inputs))
    total, seen, rows, values = sum(len(y) for _, y in records), [], [], []
    for u, y in records:
        # At rest before its first sample, as all records are of which a loop is sought.
        moved = np.concatenate([np.zeros(past), np.diff(y, prepend=y[0])])
        driven = np.concatenate([np.zeros((lags, inputs)), np.diff(u, axis=0, prepend=u[:1])])
        some = np.linspace(0, len(y) - 1, -(-ROWS * len(y) // max(total, ROWS))).astype(int)
        own, drives = (sliding_window_view(of, n, axis=0) for of, n in ((moved[:-1], past), (driven[1:], lags)))
        rows.append(np.hstack([own[some], drives[some].reshape(len(some), -1)]))
        values.append(moved[past:][some])
        seen.append((moved, driven[1:]))
    terms = np.vstack(rows)
    if len(terms) < 2 * terms.shape[1]:
        return False
    found = np.linalg.lstsq(terms, np.concatenate(values), rcond=None)[0]
    own_past, late = found[:past], found[past:].reshape(inputs, lags)
    follow = among = 0
    for moved, driven in seen:  # by a filter: all windows side by side are as many times the record as there are terms
        off = np.convolve(moved[:-1], own_past[::-1], "valid") - moved[past:]
        off += sum(np.convolve(driven[:, j], late[j][::-1], "valid") for j in range(inputs))
        moves = np.abs(moved[past:]) > MOVES
        follow, among = follow + int(np.sum(np.abs(off[moves]) <= NEAR)), among + int(moves.sum())
    return follow > ALL * among


def pieces(records: Sequence[tuple[Array, Array]]) -> dict[int, Law]:
    """Laws that some samples follow and others do not, by the number of the output.

    Args:
        records: Inputs and outputs, in shares of their ranges.

    Returns:
        Of each output the law that most follow; empty where one output has none, all samples of all follow one, or all
        of one follow one with a dead time.
    """
    found = {}
    for k in range(records[0][1].shape[1]):
        own = [(u, y[:, k]) for u, y in records if len(y) > 2 * max(ORDERS)]
        laws = [law for order in ORDERS if own and (law := law_of(own, order=order)) is not None]
        most = max((law.share for law in laws), default=0.0)
        if most < SOME:
            return {}
        # A longer law says the same with poles that are of nothing.
        found[k] = next(law for law in laws if law.share >= ALIKE * most)
        if most <= ALL and is_late(own):
            return {}
    return {} if all(law.share > ALL for law in found.values()) else found
