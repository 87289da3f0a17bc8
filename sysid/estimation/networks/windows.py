r"""Long records: starts are raced on windows of them, and the one that is chosen is trained on over every sample.

What a race needs is which start leads where, and some ten thousand samples say that as well as a million: the error of
:math:`p` parameters falls with :math:`\sqrt{p/N}`, and is below the noise long before. So a few windows stand for the
records while starts are compared (truncated free runs). Each has an initial state of its own, estimated like that of a
record of which nothing is declared, so that no window is too short for a system that integrates. Windows lie in equal
parts of the records, in each where the channels move most. From the chosen start a few iterations over all samples then
find the minimum itself, with the evidence and the intervals of all samples.

Limits: what happens once, in no window, is seen by the last iterations alone; a state that moves more slowly than a
window is known from them, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.provider import AbstractProvider
from sysid.estimation.networks.starts.advancing import advanced
from sysid.estimation.networks.starts.choosing import Choice
from sysid.estimation.networks.starts.multistart import Candidate, Multistart
from sysid.estimation.networks.training import Training
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.results.result import FitResult

LONG = 200_000
"""Samples of all records together above which starts are raced on windows without being asked: below, all samples take
minutes at most."""

SAMPLES, COUNT = 5_000, 8
"""Samples of a window that nobody asked for; and how many windows there are."""

ITERATIONS, PATIENCE = 60, 6
"""Iterations over all samples at most; and over how many of them progress is judged: they begin near a minimum."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Windows:
    """What starts are raced on.

    Args:
        experiments: The windows, or the records where these are no longer.
        records: All records.
        samples: Of a window; 0 where there are none.
    """

    experiments: tuple[Experiment, ...]
    records: tuple[Experiment, ...]
    samples: int

    @classmethod
    def of(cls, records: Sequence[Experiment], training: Training) -> Windows:
        """The windows of some records.

        Args:
            records: The records.
            training: Whose ``window`` says how long they are.

        Returns:
            The windows; the records themselves where they are no longer than all windows together.
        """
        total = sum(len(one.output) for one in records)
        samples = training.window
        if samples is None:
            samples = SAMPLES if total > LONG else 0
        if samples * COUNT >= total or training.ensemble > 1:  # what is united is not trained any more
            samples = 0
        seen = _liveliest(records, samples) if samples else tuple(records)
        return cls(experiments=seen, records=tuple(records), samples=samples)

    @property
    def told(self) -> str:
        """What was done, in a sentence."""
        total = sum(len(one.output) for one in self.records)
        return (
            f"Raced on {len(self.experiments)} windows of {self.samples:,} samples at most; what was chosen was "
            f"trained on over all {total:,} samples (`window: 0` races on all of them)."
        )

    def finished(
        self,
        multistart: Multistart,
        choice: Choice,
        whole: AbstractProvider,
        theta: NDArray[np.float64],
        centre: NDArray[np.float64],
    ) -> Choice:
        """The choice, trained on over all samples.

        Args:
            multistart: What the candidates have in common.
            choice: What was chosen on the windows.
            whole: Residuals over all records.
            theta: The chosen parameters among those of ``whole``.
            centre: What they are drawn to.

        Returns:
            The choice as it is then; as it was where somebody asked the fit to stop.
        """
        if multistart.stop.is_set():
            return choice
        training = replace(multistart.training, patience=PATIENCE)
        own = replace(multistart, training=training, provider=whole)
        chosen = advanced(
            own,
            whole,
            choice.chosen,
            name="all samples",
            iterations=min(ITERATIONS, training.max_iterations),
            begun=(theta, centre),
        )
        return replace(choice, chosen=chosen)


def in_place(candidates: Sequence[Candidate], before: Candidate, after: Candidate) -> list[Candidate]:
    """Candidates with one that was trained on.

    Args:
        candidates: The candidates.
        before: The one as it was.
        after: As it is.

    Returns:
        The candidates.
    """
    return [after if one is before else one for one in candidates]


def with_note(found: FitResult, windows: Windows) -> FitResult:
    """A fit that says what it was raced on.

    Args:
        found: The fit.
        windows: What starts were raced on.

    Returns:
        The fit; as it is where they were raced on all samples.
    """
    return replace(found, notes=(*found.notes, windows.told)) if windows.samples else found


def _liveliest(records: Sequence[Experiment], samples: int) -> tuple[Experiment, ...]:
    """Of equal parts of the records the window in which the channels range furthest."""
    pieces = [
        (at, first, min(first + samples, len(one.output)))
        for at, one in enumerate(records)
        for first in range(0, max(len(one.output) - samples, 0) + 1, samples)
    ]
    total = sum(last - first for _, first, last in pieces)
    count = max(COUNT, round(len(pieces) * COUNT * samples / total))  # of short records there are more
    ranges = np.array([_ranges(records[at], first, last) for at, first, last in pieces])
    widest = np.maximum(ranges.max(axis=0), np.finfo(np.float64).tiny)
    lively = (ranges / widest).sum(axis=1)
    taken = [part[np.argmax(lively[part])] for part in np.array_split(np.arange(len(pieces)), count) if len(part)]
    return tuple(_cut(records[at], first, last) for at, first, last in (pieces[i] for i in taken))


def _ranges(record: Experiment, first: int, last: int) -> NDArray[np.float64]:
    """How far each channel ranges over some samples that count."""
    known = slice(first, last) if record.usable is None else first + np.flatnonzero(record.usable[first:last])
    values = np.column_stack([record.inputs[known], record.output[known]])
    return np.ptp(values, axis=0) if len(values) else np.zeros(values.shape[1])


def _cut(record: Experiment, first: int, last: int) -> Experiment:
    """Some samples of a record; of what came before those that do not begin it nothing is known."""
    begins, seen = first == 0, slice(first, first + 1)
    before = replace(record.history, inputs=record.inputs[seen], output=record.output[seen], usable=None)
    return Experiment(
        inputs=record.inputs[first:last],
        output=record.output[first:last],
        history=record.history if begins else before,
        weights=None if record.weights is None else record.weights[first:last],
        usable=None if record.usable is None else record.usable[first:last],
        past=record.past if begins else np.zeros(1, dtype=np.bool_),
        each=None if record.each is None else record.each[first:last],
    )
