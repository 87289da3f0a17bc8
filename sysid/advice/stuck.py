"""An output that stands exactly still now and then, though its inputs go on: a sensor that is stuck, or a held plant.

A sensor that works shows noise and motion, so that two values in a row are seldom the same. How seldom says how long a
stay chance makes; and a linear response says whether the output had reason to move meanwhile.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence

import numpy as np

from sysid.advice.finding import Finding, Topic, Verdict
from sysid.advice.record import Record

LEAST, CHANCE = 10, 1e-6
"""Samples of a stay at least, and how many stays as long chance may make of the repeats elsewhere in the record."""
MOVES, EXPLAINED = 0.1, 0.3
"""Part of its span by which the response to the inputs has to move meanwhile; what it has to explain to be asked."""
AT_END = 0.002
"""Part of the output's span that counts as its end: what stands there is told as a limit."""
TOLD = 12
"""Stays of which it is written out how they are masked, the longest ones."""


def check_stuck(record: Record) -> Iterator[Finding]:
    """Look for stays of the output.

    Args:
        record: The record.

    Yields:
        A finding, where there are some that nothing but a stuck sensor or a held plant makes.
    """
    found = record.impulse
    y = record.values(record.mapping.output)
    if isinstance(found, str) or found.explained < EXPLAINED or not sum(map(len, y)):
        return
    low, high = min(part.min() for part in y if len(part)), max(part.max() for part in y if len(part))
    places = [record.mapping.inputs.index(name) for name in found.mapping.inputs]
    moved = [found.simulate(segment.inputs[:, places]) for segment in record.segments]
    span = max((float(np.ptp(one)) for one in moved if len(one)), default=0.0)
    repeats, pairs, stays = 0, 0, list[tuple[int, float, float, str]]()
    for segment, run in zip(record.segments, moved, strict=True):
        edges = np.flatnonzero(np.diff(segment.output, prepend=np.nan, append=np.nan) != 0.0)
        lengths = np.diff(edges)
        repeats, pairs = repeats + int(np.sum(lengths - 1)), pairs + int(np.sum(lengths))
        for k in np.flatnonzero(lengths >= LEAST):
            begin, end = int(edges[k]), int(edges[k + 1])
            value = float(segment.output[begin])
            inside = min(value - low, high - value) > AT_END * (high - low)
            if inside and np.ptp(run[begin:end]) > MOVES * span:
                seconds = record.time_of(segment.trace, segment.first + begin)
                stays.append((end - begin, seconds, value, segment.trace))
                repeats, pairs = repeats - (end - begin - 1), pairs - (end - begin)
    share, samples = (repeats + 1.0) / (pairs + 2.0), sum(map(len, y))
    stays = [one for one in stays if samples * share ** (one[0] - 1) < CHANCE]
    if stays:
        length, seconds, value, trace = max(stays)
        yield Finding(
            topic=Topic.CHANNELS,
            code="channel.stuck",
            verdict=Verdict.LOOK,
            subject=(record.mapping.output, trace),
            figures={
                "stays": len(stays), "samples": length, "value": value, "seconds": seconds,
                "until": seconds + (length - 1) * record.sample_time,
            },
            reason=_masks(record, stays),
        )  # fmt: skip


def _masks(record: Record, stays: Sequence[tuple[int, float, float, str]]) -> str:
    """What masks these stays in a ``dataset.yaml``; a case is named where others are recorded at that time, too."""
    lines = []
    for length, start, _, trace in sorted(sorted(stays)[-TOLD:], key=lambda one: (one[3], one[1])):
        stop = start + (length - 1) * record.sample_time
        there = [one for one in (*record.traces, *record.others) if one.time[0] <= stop and one.time[-1] >= start]
        case = f", cases: [{_plain(trace)}]" if len(there) > 1 else ""
        lines.append(f"{{channel: {_plain(record.mapping.output)}, start: {start:.15g}, stop: {stop:.15g}{case}}}")
    more = f", and {len(stays) - TOLD} shorter ones" if len(stays) > TOLD else ""
    return f"repairs: {{mask: [{', '.join(lines)}]}}{more}"


def _plain(name: str) -> str:
    """A name as YAML has it."""
    return name if re.fullmatch(r"(?!(?i:true|false|null|yes|no|on|off)$)[A-Za-z_]\w*", name) else json.dumps(name)
