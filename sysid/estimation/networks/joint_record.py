"""One record as training has it, and its windows.

A whole whose free run goes astray has sensitivities that say where it went, not how to come back: steps are refused, or
lead to a minimum at which it is still lost. Over a window it begins from what is measured and has no time to go astray
(multiple shooting, with the first states known; Bock 1983). What is found so is a start for the run over all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Record:
    """One record: every channel in a first run, after as many rows as the lags reach back; targets where they count.

    Inputs, and outputs of members that come before any trained one, keep the values of the first run. ``rows`` are
    those of the samples that count, among the samples. Targets stand column by column, and so do the roots of what
    they weigh: none where a target, or an input, is masked. ``whole`` is the same with all samples, where it is by
    these that the correlation of the residuals is judged.
    """

    values: NDArray[np.float64]
    rows: NDArray[np.int64]
    target: NDArray[np.float64]
    root_weights: NDArray[np.float64] | None
    whole: Record | None = None

    @cached_property
    def counted(self) -> NDArray[np.int64]:
        """Rows that count for each target, shape ``(n_targets,)``."""
        if self.root_weights is None:
            return np.full(self.target.shape[1], len(self.rows), dtype=np.int64)
        return np.asarray(np.count_nonzero(self.root_weights, axis=0), dtype=np.int64)


def windows_of(record: Record, known: NDArray[np.float64], samples: int, depth: int) -> Iterator[Record]:
    """Parts of a record, each begun with what is measured.

    Args:
        record: The record.
        known: Its values with the measured ones in the place of those that were run, same shape.
        samples: Of a window.
        depth: Rows before the first sample.

    Yields:
        The windows in which a sample counts; together they have the samples of the record.
    """
    for first in range(0, len(record.values) - depth, samples):
        own = slice(*np.searchsorted(record.rows, (first, first + samples)))
        if own.start == own.stop:
            continue
        yield Record(
            values=known[first : first + samples + depth].copy(),
            rows=record.rows[own] - first,
            target=np.asfortranarray(record.target[own]),
            root_weights=None if record.root_weights is None else np.asfortranarray(record.root_weights[own]),
        )
