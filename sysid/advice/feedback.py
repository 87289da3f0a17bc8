"""Does the output act on the inputs? Then inputs to come tell something of the output now that its past does not."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.advice.finding import Finding, Topic, Verdict
from sysid.advice.record import Record
from sysid.estimation.nonparametric.evidence import triangle
from sysid.estimation.nonparametric.segments import Segment, columns_of_lags

PAST, AHEAD, CURVED = 20, 6, 4
"""Lags of inputs and output that are known, samples to come that are asked, and curved columns of each channel."""
SURE, FAINT, PART = 1e-5, 0.02, 0.05
"""Probability below which chance is no answer, and parts of an error from which feedback is told, and sure."""
NOISELESS = 1e-7
"""Part of the output's variance below which what is left is rounding and nothing can be told from it."""


def check_feedback(record: Record) -> Iterator[Finding]:
    """Sims's test, with past outputs known: future inputs in a regression of the output (Sims 1972; Geweke 1982).

    Args:
        record: The record.

    Yields:
        Whether there is feedback.
    """
    names = record.moving
    if not names:
        return
    some = record.some
    m, longest = len(names), max(map(len, some.segments), default=0)
    total = sum(map(len, some.segments))
    past = min(PAST, total // (8 * (m + 1)), longest // 4)
    columns = m * (past + 1) + past + CURVED * (m + 1) + AHEAD * m
    rows = sum(max(len(s) - past - AHEAD, 0) for s in some.segments)
    if past < 2 or rows < 3 * columns:
        yield _unknown("the record is too short")
        return
    blocks = []
    for s in some.segments:
        if len(s) > past + AHEAD + 1:
            at = slice(past, len(s) - AHEAD)
            known = [columns_of_lags(u, range(past + 1), at) for u in s.inputs.T]
            ahead = [columns_of_lags(u, range(-1, -AHEAD - 1, -1), at) for u in s.inputs.T]
            own = columns_of_lags(s.output, range(1, past + 1), at)
            block = np.column_stack([*known, own, *_curved(s, at), *ahead, s.output[at]])
            blocks.append(block - block.mean(axis=0))
    found = triangle(blocks, free=0)
    first = columns - AHEAD * m
    z = found.z**2
    without, with_them = float(z[first:].sum()), float(z[columns:].sum())
    if with_them <= NOISELESS * float(z.sum()):
        yield _unknown("the output follows from its past without a rest")
        return
    p, share = _tested(without, with_them, AHEAD * m, (rows - first, rows - columns - len(blocks)))
    at_once = _at_once(some, past)
    figures = {"p": p, "share": share, "share_at_once": at_once}
    if (p < SURE and share > PART) or at_once > PART:
        code, verdict = "feedback.found", Verdict.LOOK
    elif p < SURE or at_once > FAINT:
        code, verdict = "feedback.slight", Verdict.NOTE
    else:
        code, verdict = "feedback.none", Verdict.FINE
    yield Finding(topic=Topic.FEEDBACK, code=code, verdict=verdict, subject=names, figures=figures)


def _tested(without: float, with_them: float, count: int, free: tuple[int, int]) -> tuple[float, float]:
    """Probability that chance explains as much, and the share explained less what chance does of it."""
    F = (without - with_them) / count / max(with_them / free[1], 1e-300)
    share = 1.0 - with_them / max(without, 1e-300)
    return float(scipy.stats.f.sf(F, count, free[1])), max(0.0, 1.0 - (1.0 - share) * free[0] / free[1])


def _at_once(some: Record, past: int) -> float:
    """How much the past output adds to the past inputs where they foretell an input, by the clearest of them.

    A controller that acts within the sample leaves nothing for inputs to come. A plant that answers within the sample
    looks alike from the output, but not from the input: this is asked only where the input and the output of a sample
    belong together.
    """
    found, m = 0.0, some.segments[0].inputs.shape[1]
    count = past * m
    for j in range(m):
        blocks = []
        for s in some.segments:
            if len(s) > past + 1:
                at = slice(past, len(s))
                inputs = [columns_of_lags(u, range(1, past + 1), at) for u in s.inputs.T]
                output = columns_of_lags(s.output, range(past + 1), at)
                # Last but one: the output of this sample; last: the input of this sample.
                block = np.column_stack([*inputs, output[:, 1:], output[:, 0], s.inputs[at, j]])
                blocks.append(block - block.mean(axis=0))
        data = triangle(blocks, free=0)
        z, rows = data.z**2, sum(map(len, blocks))
        whole, known, with_past, with_now = (float(z[k:].sum()) for k in (0, count, count + past, count + past + 1))
        if with_now <= NOISELESS * whole:
            continue
        free = rows - count - past - 1 - len(blocks)
        p, share = _tested(known, with_past, past, (rows - count, free))
        now, now_share = _tested(with_past, with_now, 1, (free + 1, free))
        if max(p, now) < SURE and now_share > PART:
            found = max(found, share)
    return found


def _curved(s: Segment, at: slice) -> list[NDArray[np.float64]]:
    """Squares and cubes of what came last: a system that is not linear must not be taken for feedback."""
    found = []
    for x, newest in ((s.output, 1), *((u, 0) for u in s.inputs.T)):
        z = columns_of_lags((x - x.mean()) / (x.std() or 1.0), (newest, newest + 1), at)
        found += [z**2, z**3]
    return found


def _unknown(reason: str) -> Finding:
    return Finding(topic=Topic.FEEDBACK, code="feedback.unknown", verdict=Verdict.UNKNOWN, reason=reason)
