"""Stretches of long records, on which starts are compared before the best goes on over all samples.

A search runs a hundred and more short descents before one long one. Where the records hold far more samples than there
are parameters, some stretches of them tell good starts from bad ones as well as all of them do; the minimum itself is
always that over all samples.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.records.experiment import Experiment
from sysid.models import History

SHORTEST, KEPT, LONG = 4_000, 12_000, 36_000
"""Samples of a stretch at least, of all stretches at least, and of all records from which on stretches are taken."""
MOVES = 0.8
"""Share of a channel's variance that has to be seen within a stretch on average: what moves more slowly than that needs
longer ones."""
LEAST = 0.3
"""Share of a channel's variance that the chosen stretches have at least: one in which an input stands says nothing of
it."""


def stretches(experiments: Sequence[Experiment]) -> tuple[Experiment, ...] | None:
    """Some of the records' samples, evenly spread, in stretches long enough to show what moves slowly.

    Args:
        experiments: The records.

    Returns:
        The stretches, each but those at the beginning of a record with an unknown past; ``None`` where the records are
        not long, or move so slowly that stretches would hold most of their samples.
    """
    total = sum(len(e.output) for e in experiments)
    if total < LONG:
        return None
    length = SHORTEST
    while not all(_moves(channel, length) for e in experiments for channel in _channels(e)):
        length *= 2
        if 3 * length > total:
            return None
    pieces = [one for e in experiments for one in _pieces(e, length)]
    count = -(-max(KEPT, length) // max(length, 1))
    at = np.unique(np.linspace(0, len(pieces) - 1, min(count, len(pieces))).round().astype(int))
    chosen = tuple(pieces[i] for i in at)
    return chosen if 3 * sum(len(e.output) for e in chosen) <= total and _shows(chosen, experiments) else None


def told_of(part: Sequence[Experiment]) -> str:
    """What is told of a fit whose starts were compared on stretches.

    Args:
        part: The stretches.

    Returns:
        One sentence.
    """
    samples = sum(len(e.output) for e in part)
    return f"Starts were compared on {samples} samples in {len(part)} stretches; the best went on over all samples."


def _shows(chosen: Sequence[Experiment], experiments: Sequence[Experiment]) -> bool:
    """Whether every channel moves within the stretches about as much as in the records."""
    within = np.mean([[channel.var() for channel in _channels(e)] for e in chosen], axis=0)
    everywhere = np.mean([[channel.var() for channel in _channels(e)] for e in experiments], axis=0)
    return bool((within >= LEAST * everywhere).all())


def _channels(experiment: Experiment) -> list[NDArray[np.float64]]:
    return [*experiment.inputs.T, experiment.output]


def _moves(values: NDArray[np.float64], length: int) -> bool:
    """Whether stretches of a length see most of what a channel does."""
    whole = len(values) // length
    if whole < 2:
        return True
    within = values[: whole * length].reshape(whole, length).var(axis=1).mean()
    return bool(within >= MOVES * values[: whole * length].var())


def _pieces(experiment: Experiment, length: int) -> list[Experiment]:
    """A record cut into stretches; what is left over belongs to the last."""
    n = len(experiment.output)
    edges = [*range(0, max(n // length, 1) * length, length), n]
    cut = [_piece(experiment, first, last) for first, last in itertools.pairwise(edges)]
    return [one for one in cut if one.usable is None or one.usable.any()]


def _piece(e: Experiment, first: int, last: int) -> Experiment:
    at = slice(first, last)
    cut = replace(
        e,
        inputs=e.inputs[at],
        output=e.output[at],
        weights=None if e.weights is None else e.weights[at],
        usable=None if e.usable is None else e.usable[at],
        each=None if e.each is None else e.each[at],
    )
    if first == 0:
        return cut
    before = History(inputs=e.inputs[first - 1 : first], output=e.output[first - 1 : first])
    return replace(cut, history=before, past=np.zeros(1, dtype=np.bool_), n_first=0)
