"""Records that are scored and hold what was fitted: a figure on them says nothing of another record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.traces import Trace

WINDOW = 20
"""Samples in a row that are the same in both to the last bit, and move, for them to be the same."""
SHARE, CHANCE, DOUBLED = 0.1, 0.001, 5
"""Part of a record that must be told; part of the fitted records whose stretches come again among themselves, above
which a stretch is too short to be known again; and how often its length is doubled then."""
FACTOR = np.uint64(0x9E3779B97F4A7C15)
"""An odd number whose multiples are spread over all (Knuth 1998, section 6.4)."""


def repeated(channels: Sequence[str], fitted: Sequence[Trace], scored: Sequence[Trace]) -> tuple[str, ...]:
    """Scored records whose samples were fitted.

    Args:
        channels: Those that the model is of.
        fitted: The records that were fitted.
        scored: The others.

    Returns:
        A sentence, where there are some.
    """
    if not fitted or not scored:
        return ()
    doubled, seen = _known_again(channels, fitted, max(map(len, scored)))
    told, most = list[str](), 0.0
    for trace in scored:
        # A record that is shorter is held beside stretches of its own length's half.
        fits = min(doubled, _doublings(len(trace)))
        known = seen if fits == doubled else _all_windows(channels, fitted, fits)
        windows = _windows(trace, channels, fits)
        share = float(np.mean(np.isin(windows, known))) if len(windows) else 0.0
        told += [trace.name] * (share > SHARE)
        most = max(most, share)
    if not told:
        return ()
    names = f"{', '.join(told[:4])}{' and others' if len(told) > 4 else ''}"
    return (
        f"{names}: up to {100 * most:.0f} % of the samples are in a record that was fitted too, to the last bit. "
        "The error of these says nothing of another record. Score, and choose by, what was not fitted.",
    )


def _known_again(channels: Sequence[str], fitted: Sequence[Trace], longest: int) -> tuple[int, NDArray[np.uint64]]:
    """How often the length is doubled until stretches hardly come again in what was fitted, and all of these.

    Of coarse steps and few levels, short stretches of quite different experiments are the same. Where they come again
    however long they are, as of a signal that is periodic, the longest are taken.
    """
    most = min(_doublings(longest), _doublings(max(map(len, fitted))))
    for doubled in range(most + 1):
        windows = np.concatenate([_windows(trace, channels, doubled) for trace in fitted])
        seen = np.unique(windows)
        if doubled == most or len(windows) - len(seen) <= CHANCE * len(windows):
            break
    return doubled, seen


def _doublings(n: int) -> int:
    """How often a stretch may be doubled in a record, of which it must be no more than half."""
    return int(np.clip(np.floor(np.log2(max(n / (2 * WINDOW), 1.0))), 0, DOUBLED))


def _all_windows(channels: Sequence[str], traces: Sequence[Trace], doubled: int) -> NDArray[np.uint64]:
    return np.unique(np.concatenate([_windows(trace, channels, doubled) for trace in traces]))


def _windows(trace: Trace, channels: Sequence[str], doubled: int) -> NDArray[np.uint64]:
    """A number for each stretch of samples that moves; the same for the same samples, and hardly ever for others."""
    bits = np.ascontiguousarray(trace.columns(channels) + 0.0).view(np.uint64)  # there is one zero
    rows = np.zeros(len(bits), dtype=np.uint64)
    for column in bits.T:
        rows = _mixed(rows ^ column)
    n = len(rows) - WINDOW + 1
    if n < 1:
        return np.empty(0, dtype=np.uint64)
    found = np.zeros(n, dtype=np.uint64)
    for k in range(WINDOW):
        found = _mixed(found ^ rows[k : k + n])
    width = WINDOW
    for _ in range(doubled):
        if len(found) <= width:
            return np.empty(0, dtype=np.uint64)
        found, width = _mixed(_mixed(found[:-width]) ^ found[width:]), 2 * width
    moves = np.concatenate([[0], np.cumsum(rows[1:] != rows[:-1])])
    return found[moves[width - 1 :] > moves[: len(found)]]


def _mixed(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    x = x * FACTOR
    return np.asarray(x ^ (x >> np.uint64(29)), dtype=np.uint64)
