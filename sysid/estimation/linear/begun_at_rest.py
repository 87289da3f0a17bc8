"""Records that begin at rest: what their first samples tell of a dead time, though inputs came before them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Beginning = tuple[Array, Array, NDArray[np.bool_] | None]
"""Inputs, shape ``(n_samples, n_inputs)``, outputs, shape ``(n_samples, n_outputs)``, and which samples are measured;
``None`` where all are."""

STANDS, NOISE, ROUNDING = 3, 1.5, 1e-6
"""Samples that tell whether an output stands, and the most that it moves then: over what it does from sample to sample,
and over its standard deviation."""


def at_rest(record: Beginning, dead: int) -> int:
    """First samples of a record in which all inputs and outputs stand: what came before it was no different.

    A record of a step begins so, and the samples that a long dead time would leave out may be all that it tells. The
    output has to stand until it can show that inputs move, ``dead`` samples later: where inputs stepped as the record
    began it stands too, and moves before.

    Args:
        record: The record.
        dead: The shortest dead time, in samples.

    Returns:
        How many; 0 where the record does not begin at rest.
    """
    inputs, outputs, usable = record
    moved = (inputs != inputs[0]).any(axis=1)
    first = int(np.argmax(moved)) if moved.any() else 0
    y = outputs[: first + dead] if usable is None else outputs[: first + dead][usable[: first + dead]]
    if len(y) < STANDS:
        return 0
    noise = np.std(np.diff(y, axis=0), axis=0) / np.sqrt(2.0)
    return first if (np.std(y, axis=0) <= NOISE * noise + ROUNDING * np.std(outputs, axis=0)).all() else 0


def left_out(records: Sequence[Beginning], unknown: int, dead: int) -> list[int]:
    """First samples that do not count, because an input that acts there may have come before the record.

    Of a record that begins at rest these are fewer by as many as it rests for. Where that leaves out all that an input
    does in the records, as a single step soon after the beginning, those at rest are taken to have always been so:
    without these samples all dead times do alike, and chance has the choice.

    Args:
        records: The records.
        unknown: The longest dead time.
        dead: The shortest.

    Returns:
        One number for each record.
    """
    rests = [at_rest(record, dead) for record in records]
    lost = [max(unknown - rest, 0) for rest in rests]
    moves = np.any([moving(inputs) for inputs, _, _ in records], axis=0)
    shown = np.any([moving(one[0][max(n - dead - 1, 0) :]) for one, n in zip(records, lost, strict=True)], axis=0)
    if not (moves & ~shown).any():
        return lost
    return [0 if rest else n for rest, n in zip(rests, lost, strict=True)]


def moving(inputs: Array) -> NDArray[np.bool_]:
    """Which inputs move.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``, of however few samples.

    Returns:
        Shape ``(n_inputs,)``.
    """
    return np.asarray((inputs != inputs[:1]).any(axis=0))
