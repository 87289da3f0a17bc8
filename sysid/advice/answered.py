"""Whether an output answers samples of an input: then the plant saw them, and they are no faults of the recording.

A controller kicks its plant where a set point steps: for one sample its output stands far off both neighbours. What a
faulty cell of a recording does, nothing answers.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.nonparametric.evidence import triangle
from sysid.estimation.nonparametric.segments import Segment, columns_of_lags

OUTPUTS, INPUTS, SURE = 4, 12, 20.0
"""Past samples of the output and of the inputs that are looked at, and by how many times the noise of one sample the
input as it is recorded must explain more than one that stays with its neighbours."""


def answered(segments: Sequence[Segment], j: int, away: Sequence[NDArray[np.float64]]) -> bool:
    """Whether the output answers what stands away in an input.

    One step ahead the output is explained by its past and the inputs as they are recorded, and by the same with one
    that stays with its neighbours: of a fault the second explains more, of what the plant saw the first.

    Args:
        segments: Stretches of the record.
        j: Place of the input.
        away: By how much each sample stands away, zero elsewhere; for each stretch, shape ``(n_samples,)``.

    Returns:
        Whether it does.
    """
    recorded, rows, columns = _left(segments, j, [np.zeros(len(s)) for s in segments])
    without = _left(segments, j, away)[0]
    return without - recorded > SURE * recorded / max(rows - columns, 1) if rows > columns else False


def _left(segments: Sequence[Segment], j: int, off: Sequence[NDArray[np.float64]]) -> tuple[float, int, int]:
    """Squares that are left of the output, rows and columns, with the input less something."""
    blocks, first = list[NDArray[np.float64]](), max(OUTPUTS, INPUTS)
    for s, less in zip(segments, off, strict=True):
        if len(s) > first + 1:
            rows = slice(first, len(s))
            inputs = s.inputs.copy()
            inputs[:, j] -= less
            # Of the same sample of this one nothing: that may be the controller's answer to the output.
            lagged = [columns_of_lags(u, range(int(k == j), INPUTS + 1), rows) for k, u in enumerate(inputs.T)]
            past = columns_of_lags(s.output, range(1, OUTPUTS + 1), rows)
            block = np.column_stack([past, *lagged, s.output[rows]])
            blocks.append(block - block.mean(axis=0))
    if not blocks:
        return 0.0, 0, 0
    columns = blocks[0].shape[1] - 1
    return float(np.sum(triangle(blocks, free=0).z[columns:] ** 2)), sum(map(len, blocks)), columns + len(blocks)
