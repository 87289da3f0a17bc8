"""Which samples of a record count in the loss of a free run.

Residuals of a free run are correlated over tens of samples: every so-manieth says nearly as much as all of them. Not so
where a target jumps. What leads up to a jump, and the sample in which it comes, last one or two samples: where only
every tenth counts, nine jumps of ten are never seen from near, and a model may begin each a sample early at no cost.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def counted_rows(target: NDArray[np.float64], stride: int, moves: float = np.inf) -> NDArray[np.int64]:
    """The samples that count.

    Args:
        target: The targets over the errors that count as one, shape ``(n_samples, n_targets)``.
        stride: A sample counts that is so many after the last that counted.
        moves: One counts as well where a target has moved by more than this, in errors, since the last that counted;
            and so does the sample before it. Infinity for the stride alone.

    Returns:
        Their positions in ascending order, beginning with 0. Where a target is not known (``nan``) it does not move.

    Example:
        >>> counted_rows(np.array([[0.0], [0.0], [0.0], [9.0], [9.0], [9.0], [9.0], [9.0]]), stride=4, moves=5).tolist()
        [0, 2, 3, 7]
    """
    if np.isinf(moves):
        return np.arange(0, len(target), stride)
    rows = [0]
    for n in range(1, len(target)):
        last = rows[-1]
        if bool((np.abs(target[n] - target[last]) > moves).any()):
            rows += [n - 1, n] if n - 1 > last else [n]
        elif n - last >= stride:
            rows.append(n)
    return np.array(rows[: len(target)], dtype=np.int64)
