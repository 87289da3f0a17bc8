"""How many records a free run stays within a tolerance over: what a surrogate is asked for, at every choice.

A record is within it where the root mean square of every output's error is at most a share of that output's range. A
mean over records hides one that fails behind others that are far better than they need to be.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sysid.traces import Trace


def spans_of(traces: Sequence[Trace], outputs: Sequence[str]) -> NDArray[np.float64]:
    """Range of each output over some records.

    Args:
        traces: The records.
        outputs: Names.

    Returns:
        In each output's unit, shape ``(n_outputs,)``, over what is not masked; of one that never moves 1.
    """
    known = [np.concatenate([trace[name][trace.usable_of([name])] for trace in traces]) for name in outputs]
    spans = np.array([np.ptp(values) if len(values) else 0.0 for values in known])
    return np.asarray(np.where(spans > 0.0, spans, 1.0), dtype=np.float64)


def outside(shares: ArrayLike, tolerance: float | None) -> int:
    """Over how many records a free run leaves a tolerance.

    Args:
        shares: Root mean squares of its errors as shares of the range, shape ``(n_records,)``, or
            ``(n_records, n_outputs)`` where each of several outputs has to stay within it.
        tolerance: That they may come to; ``None`` where there is none, which nothing leaves.

    Returns:
        Their number; what is no number is outside.

    Example:
        >>> outside([[0.001, 0.02], [0.01, 0.01], [float("nan"), 0.0]], 0.01), outside([0.5], None)
        (2, 0)
    """
    if tolerance is None:
        return 0
    errors = np.asarray(shares, dtype=np.float64)
    return int((~(errors.reshape(len(errors), -1) <= tolerance).all(axis=1)).sum()) if len(errors) else 0
