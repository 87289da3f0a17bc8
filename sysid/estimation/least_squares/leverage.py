r"""How much a row of the Jacobian counts where sensitivities explode.

Where a free run comes near a switch, or chatters about it, its sensitivities grow from sample to sample: rows of the
Jacobian of a few traces are a thousand or a million times as long as the others. They are right, and say nothing: the
straight line that they describe ends long before any step that helps. In the normal equations they outweigh everything
else, and the solution hardly moves.

A row :math:`j` that is longer than :math:`c` is therefore weighted by :math:`w = c / \lVert j \rVert`, together with
its residual: Mallows' weights, which bound the influence that a row has by where it lies (Mallows 1975, "On some topics
in robustness"; Krasker and Welsch 1982, "Efficient bounded-influence regression estimation").

Limits: the gradient is then not quite that of the loss, which itself counts all rows alike; that a step is taken only
where the loss falls keeps the descent honest. Lengths are measured over plain parameters.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def leverage_roots(rows: NDArray[np.float64], longest: float) -> NDArray[np.float64]:
    """By what rows of the Jacobian, and their residuals, are multiplied.

    Args:
        rows: Rows of the Jacobian, shape ``(n_rows, n_parameters)``.
        longest: Length from which on a row counts less; infinity for none.

    Returns:
        Factors from 0 to 1, shape ``(n_rows,)``.

    Example:
        >>> leverage_roots(np.array([[3.0, 4.0], [0.0, 0.0], [30.0, 40.0]]), 10.0).tolist()
        [1.0, 1.0, 0.2]
    """
    if np.isinf(longest):
        return np.ones(len(rows))
    lengths = np.linalg.norm(rows, axis=1)
    roots = np.ones(len(rows))
    np.divide(longest, lengths, out=roots, where=lengths > longest)
    return roots
