"""One trace as the training of a whole has it, and its windows.

A whole whose free run goes astray has sensitivities that say where it went, not how to come back: steps are refused, or
lead to a minimum at which it is still lost. Over a window it begins from what is measured and has no time to go astray
(multiple shooting, with the first states known; Bock 1983). What is found so is a start for the run over all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Record:
    """One trace: every channel in a first run, after as many rows as the lags reach back; the targets where they count.

    Inputs, and outputs of members that come before any trained one, keep the values of the first run. ``rows`` are
    those of the samples that count, among the samples. Targets stand column by column, and so do the roots of what
    they weigh: none where a target, or an input, is masked.
    """

    values: NDArray[np.float64]
    rows: NDArray[np.int64]
    target: NDArray[np.float64]
    root_weights: NDArray[np.float64] | None


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
