"""What is told of the runs of a reference: why some gave no record, and that it does not repeat itself."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

import numpy as np

from sysid.references.runs import Outcome, ReferenceRuns

NUMBER = re.compile(r"(?<!\w)(?<!line )(?<!code )[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
"""In a reason: at another sample, or by another value, it is the same; of another line or exit code it is not."""
REPEATS = 1e-9
"""Share of an output's size to which a run repeats itself: threads may add in another order."""


def reasons_of(outcomes: Iterable[Outcome], most: int = 3) -> str:
    """Why some experiments gave no record, the most frequent reason first; those that differ in numbers alone are one.

    Args:
        outcomes: What came of them; those that gave one say nothing.
        most: Reasons that are told.

    Returns:
        In words; empty where all gave one.
    """
    alike: dict[str, list[str]] = {}
    for one in outcomes:
        if one.reason is not None:
            alike.setdefault(NUMBER.sub("#", one.reason), []).append(one.reason)
    groups = sorted(alike.values(), key=len, reverse=True)
    told = [_told(reasons) for reasons in groups[:most]]
    return "; ".join([*told, *([f"and {len(groups) - most} other reasons"] if len(groups) > most else [])])


def _told(reasons: Sequence[str]) -> str:
    if len(reasons) == 1:
        return reasons[0]
    return f"{reasons[0]} ({len(reasons)} times{', with other numbers' if len(set(reasons)) > 1 else ''})"


def unlike(runs: ReferenceRuns, done: Sequence[Outcome]) -> str | None:
    """Whether a reference answers as it did before: the first that was run is run once more, after the others.

    Args:
        runs: The reference.
        done: What :meth:`~sysid.references.runs.ReferenceRuns.run` gave. Where nothing of it was run now, nothing is.

    Returns:
        A sentence where it does not: it is random, or remembers what it ran before.
    """
    there = [(one, one.trace) for one in done if one.trace is not None]
    first = next(((one, trace) for one, trace in there if not one.stored), None)
    if first is None:
        return None
    outputs, values = tuple(runs.config.outputs), first[1].columns(tuple(runs.config.outputs))
    again, named = runs.again(first[0].case), f"{first[0].case.name}, run once more, gives"
    if again.trace is None:
        return f"{named} no record: {again.reason}"
    off = np.abs(again.trace.columns(outputs) - values).max(axis=0)
    spans = np.ptp(np.concatenate([trace.columns(outputs) for _, trace in there]), axis=0)
    worst = int(np.argmax(off / np.where(spans > 0.0, spans, 1.0)))
    if off[worst] <= REPEATS * max(float(spans[worst]), float(np.abs(values[:, worst]).max())):
        return None
    return (
        f"{named} another record: {outputs[worst]} is up to {off[worst]:.3g} off, in a range of {spans[worst]:.3g}. "
        "The reference is random (give it a seed), or remembers what it ran before: records are then of chance, or of "
        "their order, and no surrogate is nearer to it than that"
    )
