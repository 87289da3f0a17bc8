"""Records that are scored and hold what was fitted: a figure on them says nothing of another record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.traces import Trace

WINDOW = 20
"""Samples in a row that are the same in both to the last bit, and move, for them to be the same."""
SHARE = 0.1
"""Part of a record that must be told."""
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
    known = [_windows(trace, channels) for trace in fitted]
    if not known or not scored:
        return ()
    seen, told, most = np.unique(np.concatenate(known)), list[str](), 0.0
    for trace in scored:
        windows = _windows(trace, channels)
        share = float(np.mean(np.isin(windows, seen))) if len(windows) else 0.0
        told += [trace.name] * (share > SHARE)
        most = max(most, share)
    if not told:
        return ()
    names = f"{', '.join(told[:4])}{' and others' if len(told) > 4 else ''}"
    return (
        f"{names}: up to {100 * most:.0f} % of the samples are in a record that was fitted too, to the last bit. "
        "The error of these says nothing of another record. Score, and choose by, what was not fitted.",
    )


def _windows(trace: Trace, channels: Sequence[str]) -> NDArray[np.uint64]:
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
    moves = np.concatenate([[0], np.cumsum(rows[1:] != rows[:-1])])
    return found[moves[WINDOW - 1 :] > moves[:n]]


def _mixed(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    x = x * FACTOR
    return np.asarray(x ^ (x >> np.uint64(29)), dtype=np.uint64)
