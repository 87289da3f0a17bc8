"""Does the output act on the inputs? Then inputs to come tell something of the output now that its past does not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.nonparametric.evidence import triangle
from sysid.estimation.nonparametric.memory import Memory, key_of
from sysid.estimation.nonparametric.segments import Segment, columns_of_lags, segments_of
from sysid.estimation.records.informative import beyond_chance, by_chance, informative
from sysid.models import Mapping
from sysid.traces import Trace

PAST, AHEAD, CURVED = 20, 6, 4
"""Lags of inputs and output that are known, samples to come that are asked, and curved columns of each channel."""
SURE, PART, FAINT_AT_ONCE, AT_ONCE = 1e-5, 0.02, 0.02, 0.03
"""Probability below which chance is no answer; part of an error from which feedback is sure, as a controller that is
moved by little else than its set point leaves no more; and parts within the sample from which it is told, and sure."""
MOST_SAMPLES = 20_000
"""Samples that are looked at; of longer records the first ones."""
TURNS = 499
"""Inputs with turned moves beside which one is set."""
NOISELESS = 1e-7
"""Part of the output's variance below which what is left is rounding and nothing can be told from it."""


MOST = 64
"""Answers that a process remembers."""
_memory = Memory["Feedback | str"](MOST)

EXACT = (
    "inputs and output of one sample tell each other without a rest. Either the output answers at once and without "
    "noise, or a controller sets an input from the output and nothing else moves it: then the record holds the "
    "controller and not the plant, and needs a set point or a test signal that moves"
)
"""Why nothing can be said where it matters most."""


@dataclass(frozen=True, kw_only=True)
class Feedback:
    """What future inputs and the output of the same sample tell of each other.

    Args:
        p: Probability that chance explains as much of the output by inputs to come.
        share: The part of what the past leaves open of the output that inputs to come explain.
        share_at_once: What past outputs add to the past inputs where they foretell an input, and the output of the
            same sample too; of the clearest input.
    """

    p: float
    share: float
    share_at_once: float

    @property
    def found(self) -> bool:
        """Whether it is sure."""
        return (self.p < SURE and self.share > PART) or self.at_once

    @property
    def at_once(self) -> bool:
        """Whether an input is set from the output of its own sample: the plant cannot answer within it then."""
        return self.share_at_once > AT_ONCE

    @property
    def slight(self) -> bool:
        """Whether there is a sign of it."""
        return self.p < SURE or self.share_at_once > FAINT_AT_ONCE


def find_feedback(segments: Sequence[Segment]) -> Feedback | str:
    """Sims's test, with past outputs known: future inputs in a regression of the output (Sims 1972; Geweke 1982).

    Args:
        segments: Stretches of samples that count; every input moves.

    Returns:
        What was found, or why nothing can be said.
    """
    some = _first(segments)
    return _memory.get(key_of(some), lambda: _found(some))


def _found(segments: Sequence[Segment]) -> Feedback | str:
    m, longest = segments[0].inputs.shape[1] if segments else 0, max(map(len, segments), default=0)
    total = sum(map(len, segments))
    past = min(PAST, total // (8 * (m + 1)), longest // 4)
    columns = m * (past + 1) + past + CURVED * (m + 1) + AHEAD * m
    rows = sum(max(len(s) - past - AHEAD, 0) for s in segments)
    if past < 2 or rows < 3 * columns:
        return "the record is too short"
    blocks = []
    for s in segments:
        if len(s) > past + AHEAD + 1:
            at = slice(past, len(s) - AHEAD)
            before = [columns_of_lags(u, range(1, past + 1), at) for u in s.inputs.T]
            own = columns_of_lags(s.output, range(1, past + 1), at)
            ahead = [columns_of_lags(u, range(-1, -AHEAD - 1, -1), at) for u in s.inputs.T]
            block = np.column_stack([*before, own, *_curved(s, at), s.inputs[at], *ahead, s.output[at]])
            blocks.append(block - block.mean(axis=0))
    z = triangle(blocks, free=0).z ** 2
    first = columns - AHEAD * m
    past_alone, without, with_them = (float(z[k:].sum()) for k in (first - m, first, columns))
    if with_them <= NOISELESS * float(z.sum()):
        if past_alone <= NOISELESS * float(z.sum()):
            return "the output follows from its past without a rest"
        return EXACT
    p, share = _tested(without, with_them, AHEAD * m, (rows - first, rows - columns - len(blocks)))
    return Feedback(p=p, share=share, share_at_once=_at_once(segments, past))


def feedback_of(traces: Sequence[Trace], mapping: Mapping) -> Feedback | str:
    """The same of records, by their inputs that move and are not made of others.

    Args:
        traces: The records.
        mapping: Which channels go in, which comes out.

    Returns:
        What was found, or why nothing can be said.
    """
    segments = _first(segments_of(traces, mapping))
    kept = informative(np.concatenate([s.inputs for s in segments])) if segments else ()
    if not kept:
        return "no input moves"
    return find_feedback([replace(s, inputs=s.inputs[:, list(kept)]) for s in segments])


def _first(segments: Sequence[Segment]) -> list[Segment]:
    kept, left = list[Segment](), MOST_SAMPLES
    for s in segments:
        if left > 0:
            kept.append(replace(s, inputs=s.inputs[:left], output=s.output[:left]))
            left -= len(kept[-1])
    return kept


def _tested(without: float, with_them: float, count: int, free: tuple[int, int]) -> tuple[float, float]:
    """Probability that chance explains as much, and the share explained less what chance does of it."""
    share = 1.0 - with_them / max(without, 1e-300)
    return by_chance(share, count, free[1]), beyond_chance(share, *free)


def _at_once(segments: Sequence[Segment], past: int) -> float:
    """How much the past output adds to the past inputs where they foretell an input, by the clearest of them.

    A controller that acts within the sample leaves nothing for inputs to come. A plant that answers within the sample
    looks alike from the output, but not from the input: this is asked only where the input and the output of a sample
    belong together.
    """
    found, m = 0.0, segments[0].inputs.shape[1]
    count, blocks = past * m, []
    for s in segments:
        if len(s) > past + 1:
            at = slice(past, len(s))
            inputs = [columns_of_lags(u, range(1, past + 1), at) for u in s.inputs.T]
            output = columns_of_lags(s.output, range(past + 1), at)
            # After what is known: the output of this sample, and the inputs of it, each asked by itself.
            block = np.column_stack([*inputs, output[:, 1:], output[:, 0], s.inputs[at]])
            blocks.append(block - block.mean(axis=0))
    data, rows = triangle(blocks, free=0), sum(map(len, blocks))
    for j, z in enumerate((np.column_stack([data.R, data.z]) ** 2).T[count + past + 1 :]):
        whole, known, with_past, with_now = (float(z[k:].sum()) for k in (0, count, count + past, count + past + 1))
        if with_now <= NOISELESS * whole:
            continue
        free = rows - count - past - 1 - len(blocks)
        p, share = _tested(known, with_past, past, (rows - count, free))
        now, now_share = _tested(with_past, with_now, 1, (free + 1, free))
        if share > found and max(p, now) < SURE and now_share > AT_ONCE and _beyond_turns(blocks, count, past, j):
            found = share
    return found


def _beyond_turns(blocks: Sequence[NDArray[np.float64]], count: int, past: int, j: int) -> bool:
    """Whether past outputs foretell an input better than each of many inputs whose moves were turned around by chance.

    An input that moves in few of its samples has as few chances to be alike by accident as it has moves, not samples:
    two inputs that step on one beat were taken for a loop in 1 of 12 records of a plant that is not linear.
    """
    table = np.concatenate(blocks)
    known, output, moves = table[:, :count], table[:, count : count + past], table[:, count + past + 1 + j]
    Q = np.linalg.qr(known)[0]
    moves = moves - Q @ (Q.T @ moves)
    Q = np.linalg.qr(output - Q @ (Q.T @ output))[0]
    rng, own = np.random.default_rng(0), float(np.sum((Q.T @ moves) ** 2))
    # One by one: all at once would be as many copies of the record.
    turned = (rng.choice([-1.0, 1.0], len(moves)) * moves for _ in range(TURNS))
    return all(float(np.sum((one @ Q) ** 2)) < own for one in turned)


def _curved(s: Segment, at: slice) -> list[NDArray[np.float64]]:
    """Squares and cubes of what came last: a system that is not linear must not be taken for feedback."""
    found = []
    for x, newest in ((s.output, 1), *((u, 0) for u in s.inputs.T)):
        z = columns_of_lags((x - x.mean()) / (x.std() or 1.0), (newest, newest + 1), at)
        found += [z**2, z**3]
    return found
