"""Do the inputs move enough: order of excitation, band, levels, and whether they can be told apart."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sysid.advice.finding import Finding, Topic, Verdict
from sysid.advice.record import Record
from sysid.estimation.nonparametric.evidence import triangle
from sysid.estimation.nonparametric.excitation_order import NEEDED, excitation_order, largest_order
from sysid.estimation.nonparametric.segments import columns_of_lags

ENOUGH = 20
"""Order of excitation from which all of it can be fitted."""
SAME, ALIKE = 0.98, 0.8
ACROSS = 6
"""Lags to either side at which one input is looked for in another."""


def check_excitation(record: Record) -> Iterator[Finding]:
    """Look at the inputs, one by one and together.

    Args:
        record: The record.

    Yields:
        Order and band of each, and which cannot be told apart.
    """
    for name in record.moving:
        yield from _input(record, name)
    if len(record.moving) > 1:
        yield from _together(record)


def _input(record: Record, name: str) -> Iterator[Finding]:
    j = record.mapping.inputs.index(name)
    parts = [run.inputs[:, j] for run in record.runs]
    order, condition = excitation_order(parts)
    moves = sum(int(np.count_nonzero(np.diff(part))) for part in parts)
    levels = max(len(np.unique(part)) for part in parts)
    figures = {
        "order": order,
        "condition": condition,
        "moves": moves,
        "levels": levels,
        "band": _band(parts) / record.sample_time,
        "nyquist": 0.5 / record.sample_time,
        "looked_for": largest_order(parts),
    }
    if order < min(NEEDED, figures["looked_for"]):
        code, verdict = "excitation.low", Verdict.LOOK
    elif moves < 5:
        code, verdict = "excitation.few_moves", Verdict.LOOK
    elif order < min(ENOUGH, figures["looked_for"]):
        code, verdict = "excitation.some", Verdict.NOTE
    else:
        code, verdict = "excitation.rich", Verdict.FINE
    yield Finding(topic=Topic.EXCITATION, code=code, verdict=verdict, subject=(name,), figures=figures)
    if levels == 2:
        yield Finding(topic=Topic.EXCITATION, code="excitation.two_levels", verdict=Verdict.NOTE, subject=(name,))


def _band(parts: list[NDArray[np.float64]]) -> float:
    """Frequency below which 99 % of a signal's power is, in cycles a sample."""
    longest = max(parts, key=len)
    power = np.abs(np.fft.rfft((longest - longest.mean()) * np.hanning(len(longest)))) ** 2
    total = np.cumsum(power)
    if total[-1] <= 0.0:
        return 0.0
    return float(np.searchsorted(total, 0.99 * total[-1]) / len(longest))


def _together(record: Record) -> Iterator[Finding]:
    """How much of each input the others hold, at lags to both sides."""
    names = record.moving
    places = [record.mapping.inputs.index(name) for name in names]
    enough = 4 * (2 * ACROSS + 1) * (len(names) - 1)
    across = ACROSS if sum(len(s) for s in record.runs) > 2 * enough else 0
    shares = dict[str, float]()
    for j, name in zip(places, names, strict=True):
        blocks = []
        for segment in record.some.runs if len(names) == len(record.mapping.inputs) else record.runs:
            if len(segment) > 2 * across + 2:
                rows = slice(across, len(segment) - across)
                others = [
                    columns_of_lags(segment.inputs[:, k], range(-across, across + 1), rows) for k in places if k != j
                ]
                block = np.column_stack([*others, segment.inputs[rows, j]])
                blocks.append(block - block.mean(axis=0))
        rows_in_all = sum(map(len, blocks))
        width = (2 * across + 1) * (len(names) - 1)
        if rows_in_all <= 2 * width:
            continue
        found = triangle(blocks, free=0)
        total = float(found.z @ found.z)
        share = 1.0 - float(np.sum(found.z[width:] ** 2)) / total if total > 0.0 else 0.0
        # What so many columns explain of anything by chance is not counted.
        shares[name] = max(0.0, 1.0 - (1.0 - share) * rows_in_all / max(rows_in_all - width, 1))
    if not shares:
        yield Finding(topic=Topic.EXCITATION, code="collinearity.unknown", verdict=Verdict.UNKNOWN, subject=names)
        return
    worst = max(shares.values())
    alike = tuple(name for name, share in shares.items() if share > (SAME if worst > SAME else ALIKE))
    if worst > SAME:
        code, verdict, subject = "collinearity.same", Verdict.LOOK, alike
    elif worst > ALIKE:
        code, verdict, subject = "collinearity.alike", Verdict.NOTE, alike
    else:
        code, verdict, subject = "collinearity.none", Verdict.FINE, names
    yield Finding(topic=Topic.EXCITATION, code=code, verdict=verdict, subject=subject, figures={"share": worst})
