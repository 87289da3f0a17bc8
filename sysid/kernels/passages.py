"""Passages of records joined to a sequence, compiled: a check of stability draws a thousand of these.

To draw them in arrays of NumPy's, each of some ten numbers, took longer than to run a network over them. What is summed
and multiplied, and in which order, is as there, so that the numbers are the same; the twins are
:func:`sysid.testing.closest` and :func:`sysid.testing.joined`.
"""

from __future__ import annotations

from numba import njit

ELSEWHERE = 1e3
"""What makes a place that is passed over farther than any other: distances are of order 1."""


@njit(cache=True, nogil=True)
def closest(features, drawn, end, apart):
    """Of some places the one most like that where a passage ended, but not near it in time.

    Args:
        features: What places are compared by, shape ``(n_rows, n_features)``.
        drawn: The places, shape ``(n_places,)``.
        end: Row after the passage.
        apart: Rows within which a place is passed over.

    Returns:
        The place.
    """
    width = features.shape[1]
    last = min(end, len(features) - 1)
    best, found = 0.0, -1
    eighths = width - width % 8
    for place in drawn:
        away = 0.0
        if width >= 8:  # as NumPy sums up eight and more
            r0 = r1 = r2 = r3 = r4 = r5 = r6 = r7 = 0.0
            for j in range(0, eighths, 8):
                r0 += (features[place, j] - features[last, j]) ** 2
                r1 += (features[place, j + 1] - features[last, j + 1]) ** 2
                r2 += (features[place, j + 2] - features[last, j + 2]) ** 2
                r3 += (features[place, j + 3] - features[last, j + 3]) ** 2
                r4 += (features[place, j + 4] - features[last, j + 4]) ** 2
                r5 += (features[place, j + 5] - features[last, j + 5]) ** 2
                r6 += (features[place, j + 6] - features[last, j + 6]) ** 2
                r7 += (features[place, j + 7] - features[last, j + 7]) ** 2
            away = ((r0 + r1) + (r2 + r3)) + ((r4 + r5) + (r6 + r7))
        for j in range(eighths, width):
            away += (features[place, j] - features[last, j]) ** 2
        if abs(place - end) < apart:
            away += ELSEWHERE
        if found < 0 or away < best:
            best, found = away, place
    return found


@njit(cache=True, nogil=True)
def joined(rows, at, span, step, count, led, over, low, high, out):
    """Passages one after the other, led over from where the one before ended, and all of it within bounds.

    Args:
        rows: The records, one below the other, shape ``(n_rows, n_columns)``.
        at: First row of each passage, shape ``(n_passages,)``.
        span: Rows that each goes over; it ends there, and stands there where it is longer.
        step: Rows between its samples.
        count: Samples that it has.
        led: Whether it is led over.
        over: Samples over which.
        low: Least value of each column.
        high: Greatest.
        out: Written, as long as all passages together.
    """
    begin, width = 0, rows.shape[1]
    for p in range(len(at)):
        n = count[p]
        for i in range(n):
            where = (span[p] if i == n - 1 else min(i * step[p], span[p])) + at[p]
            below = min(int(where), len(rows) - 2)
            share = where - below
            for j in range(width):
                out[begin + i, j] = (1.0 - share) * rows[below, j] + share * rows[below + 1, j]
        if led[p]:
            for j in range(width):
                jump = out[begin - 1, j] - out[begin, j]
                for i in range(min(n, over)):
                    out[begin + i, j] += (1.0 - i / over) * jump
        begin += n
    for i in range(begin):
        for j in range(width):
            out[i, j] = min(max(out[i, j], low[j]), high[j])
