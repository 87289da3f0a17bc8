"""Whether a free run forgets where it began.

Of two runs over the same inputs one begins a third of the way on. Where they do not come together, what is put out
hangs on a beginning that is long past. Some systems are so: what integrates, rings for long, locks, or swings by
itself. But a network that fits a record to the noise may also swing between two passages of it, or have a second place
to stand. It stays within its bounds there, and looks like any other to whoever sees the record alone (convergent
dynamics: Pavlov, Pogromsky, van de Wouw and Nijmeijer 2004, Systems and Control Letters 52; echo states: Jaeger 2001,
GMD Report 148). So it is told, and a choice prefers, of models alike, one that forgets.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.stability.sequences import InputSequence

TWICE = 100
"""Sequences that are run twice, at most."""

APART = 0.25
"""Share of the output's range, as a root mean square over the last third, from which on two runs have not met."""

NEARER = 0.75
"""Share of how far apart they were over the first third that two runs of a slow system are at most over the last half:
these come together, and are only not there yet."""

SOME = 0.02
"""Share of the sequences on which they may be apart: a joint may be such that no system would pass it. Fits of plants
that forget came to none in 100."""

Begun = tuple[InputSequence, NDArray[np.float64]]
"""A sequence, and the outputs of the run over it."""


@dataclass(frozen=True, kw_only=True)
class Beginnings:
    """On how many sequences a free run hangs on where it began.

    Args:
        sequences: How many were run from two beginnings.
        apart: On how many of them the two runs were still apart in the end.
    """

    sequences: int
    apart: int

    @property
    def forgets(self) -> bool:
        """Whether the runs come together, but for a few."""
        return self.apart <= SOME * self.sequences

    @property
    def sentence(self) -> str:
        """What was found, for people."""
        return (
            f"What the free run puts out hangs on where it began, on {self.apart} of {self.sequences} random "
            f"sequences: a second run over the same inputs, begun later, stays more than {100.0 * APART:g} % of the "
            "output's range away. A plant that is slow or rings for long, that locks or swings by itself, is so. Of "
            "any other, take another start or structure: this one may swing where the plant does not."
        )


def compare_beginnings(
    runs: Callable[[Iterable[InputSequence]], Iterator[Begun]], begun: Sequence[Begun], width: NDArray[np.float64]
) -> Beginnings:
    """Run a model once more from later beginnings.

    Args:
        runs: Runs a model over sequences, in order.
        begun: Sequences with the run over each, of shape ``(n_samples, n_outputs)``.
        width: Range of each output in the records, shape ``(n_outputs,)``.

    Returns:
        What was found.
    """
    apart = 0
    for (_, first), (sequence, second) in zip(begun, runs([_later(one) for one, _ in begun]), strict=True):
        n = len(sequence.inputs)
        with np.errstate(over="ignore", invalid="ignore"):  # a run that explodes is apart, as NaN is
            away = (second.reshape(n, -1) - first[len(first) - n :]) / width
            early, late = (np.sqrt(np.mean(part**2, axis=0)) for part in (away[: n // 3], away[n // 2 :]))
            apart += not bool(np.all((late <= APART) | (np.isfinite(late) & (late <= NEARER * early))))
    return Beginnings(sequences=len(begun), apart=apart)


def _later(sequence: InputSequence) -> InputSequence:
    """The last two thirds of a sequence."""
    part = slice(len(sequence.inputs) // 3, None)
    return replace(sequence, inputs=sequence.inputs[part], targets=sequence.targets[part], judged=sequence.judged[part])
