"""Are the channels sound: constants, coarse resolution, clipping, spikes, holds, drift and jumps of level."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.advice.answered import answered
from sysid.advice.finding import Finding, Topic, Verdict
from sysid.advice.record import Record, stacked
from sysid.advice.stuck import check_stuck
from sysid.estimation.remarks.held_output import held_for, straight_for
from sysid.estimation.remarks.record_drift import sums_up, trend_of
from sysid.estimation.remarks.wrapped import jumping, period_of
from sysid.traces.converter import coarse_step, converter_step

COARSE = 0.1
"""Of a channel's standard deviation: a step of its converter that is larger is coarse."""
FEW_LEVELS = 20
"""A channel with fewer different values is a command and has no resolution of its own."""
SPIKE_FACTOR, MOST_SPIKES = 4.0, 0.02
"""How much further than all others a spike jumps away and back, and the most samples of a channel that do."""
AT_END, LONG_STAY, VERY_LONG_STAY, STANDING = 0.002, 3, 10, 0.1
"""Part of a channel's span that counts as its end, samples in a row there that are a stay (and where the channel stands
still elsewhere too), and part of its usual roughness that it has at a limit."""


def check_channels(record: Record) -> Iterator[Finding]:
    """Look at each channel by itself.

    Args:
        record: The record.

    Yields:
        What is wrong with them, or that nothing is.
    """
    found = []
    for name in (*record.mapping.inputs, record.mapping.output):
        found += list(_channel(record, name))
    found += list(_trends(record))
    found += list(_held(record))
    found += list(_wraps(record))
    found += list(check_stuck(record))
    if not any(one.verdict is Verdict.LOOK for one in found):
        yield Finding(topic=Topic.CHANNELS, code="channels.sound", verdict=Verdict.FINE)
    yield from found


def _held(record: Record) -> Iterator[Finding]:
    """An output that is measured more slowly than it is recorded, by holds or by lines between its samples."""
    held = held_for(record.segments)
    samples = held if held > 1 else straight_for(record.segments)
    if samples > 1:
        yield Finding(
            topic=Topic.CHANNELS,
            code="channel.held" if held > 1 else "channel.interpolated",
            verdict=Verdict.LOOK,
            subject=(record.mapping.output,),
            figures={"samples": samples, "seconds": samples * record.sample_time},
        )


def _wraps(record: Record) -> Iterator[Finding]:
    """Angles and counters that jump where they wrap."""
    moved = [jumping(segment.inputs) for segment in record.segments]
    for name in (*record.mapping.inputs, record.mapping.output):
        found = period_of(record.values(name), moved if name == record.mapping.output else ())
        if found is not None:
            yield Finding(
                topic=Topic.CHANNELS,
                code="channel.wraps",
                verdict=Verdict.LOOK,
                subject=(name,),
                figures={"period": found[0], "jumps": found[1]},
            )


def _channel(record: Record, name: str) -> Iterator[Finding]:
    parts = record.values(name)
    x = stacked(parts)
    if not len(x) or np.ptp(x) <= 1e-12 * np.abs(x).max(initial=0.0):
        output = name == record.mapping.output
        code = "channel.constant_output" if output else "channel.constant_input"
        yield Finding(
            topic=Topic.CHANNELS, code=code, verdict=Verdict.LOOK, subject=(name,),
            figures={"value": float(x[0]) if len(x) else float("nan")},
        )  # fmt: skip
        return
    levels = np.unique(x)
    if len(levels) <= FEW_LEVELS and len(x) > 2 * FEW_LEVELS:
        if name == record.mapping.output:
            yield Finding(
                topic=Topic.CHANNELS, code="channel.few_levels", verdict=Verdict.NOTE, subject=(name,),
                figures={"levels": len(levels)},
            )  # fmt: skip
        return
    # An input whose levels are held is a command: where it stands, and in which steps, was somebody's choice.
    if name == record.mapping.output or _roughness(parts) > 0.0:
        yield from _resolution(name, parts, levels)
    # Of coarse steps the outermost is an end that is stayed at, and none that anything runs into.
    if name == record.mapping.output and not any(map(coarse_step, parts)):
        yield from _ends(record, name, parts, x)
    yield from _spikes(record, name, levels)


def _resolution(name: str, parts: Sequence[NDArray[np.float64]], levels: NDArray[np.float64]) -> Iterator[Finding]:
    """The step of a converter, where all values are multiples of one."""
    x = stacked(parts)
    step, size = converter_step(x), float(x.std())
    if step is not None and size > 0.0 and step > 0.002 * size:
        yield Finding(
            topic=Topic.CHANNELS,
            code="channel.resolution",
            verdict=Verdict.LOOK if step > COARSE * size or any(map(coarse_step, parts)) else Verdict.NOTE,
            subject=(name,),
            figures={"step": step, "share": step / size, "levels": len(levels)},
        )


def _ends(record: Record, name: str, parts: list[NDArray[np.float64]], x: NDArray[np.float64]) -> Iterator[Finding]:
    """Stays at an end of the range that begin abruptly: a limit, and not a level that was settled at."""
    answering = _answering(record)
    span = float(np.ptp(x))
    moves = [np.abs(np.diff(part)) for part in parts if len(part) > 1]
    usual = float(np.sqrt(np.mean(np.concatenate(moves) ** 2))) if moves else 0.0
    rough = _roughness(parts)
    for end, sign, code in (
        (float(x.max()), 1.0, "channel.clipped_above"),
        (float(x.min()), -1.0, "channel.clipped_below"),
    ):
        stays, abrupt = list[NDArray[np.float64]](), list[float]()
        for part, moves_on in zip(parts, answering, strict=True):
            near = (sign * (end - part) <= AT_END * span) & moves_on
            edges = np.flatnonzero(np.diff(np.concatenate([[0], near.astype(np.int8), [0]])))
            for a, b in zip(edges[::2], edges[1::2], strict=True):
                if b - a >= (LONG_STAY if rough > 0.0 else VERY_LONG_STAY):
                    stays.append(part[a:b])
                    # How fast it still was when it arrived: where it had settled, hardly at all.
                    abrupt += [abs(float(part[a] - part[a - 2])) / 2.0] if a >= 2 else []
        share = sum(map(len, stays)) / len(x)
        # Where it only lingers its noise goes on; at a limit it stands.
        still = bool(stays) and _roughness(stays) <= STANDING * rough
        if still and abrupt and share > 0.005 and usual > 0.0 and float(np.median(abrupt)) > 0.5 * usual:
            yield Finding(
                topic=Topic.CHANNELS,
                code=code,
                verdict=Verdict.LOOK,
                subject=(name,),
                figures={"share": share, "stays": len(stays), "value": end},
            )


def _answering(record: Record) -> list[NDArray[np.bool_]]:
    """Where the output may still answer an input: one that has answered stands still, at an end of its range too."""
    found = record.impulse
    if isinstance(found, str) or not found.settled:
        return [np.ones(len(segment), dtype=np.bool_) for segment in record.segments]
    longest, places = max(found.settling(AT_END)), [record.mapping.inputs.index(name) for name in record.moving]
    made = []
    for segment in record.segments:
        moved = np.concatenate([[True], np.any(np.diff(segment.inputs[:, places], axis=0) != 0.0, axis=1)])
        last = np.maximum.accumulate(np.where(moved, np.arange(len(segment)), 0))
        made.append(np.arange(len(segment)) - last <= longest)
    return made


def _roughness(parts: Sequence[NDArray[np.float64]]) -> float:
    """How much samples differ from the line through their neighbours, in the median."""
    bends = [np.abs(np.diff(part, 2)) for part in parts if len(part) > 2]
    return float(np.median(np.concatenate(bends))) if bends else 0.0


def _spikes(record: Record, name: str, levels: NDArray[np.float64]) -> Iterator[Finding]:
    """Single samples that jump away and back, further than any other does, and that no output answers."""
    parts = record.values(name)
    x, heights = stacked(parts), [_heights(part) for part in parts]
    height = np.abs(stacked([one[1:-1] for one in heights]))
    if len(height) < 20:
        return
    # Spikes must not set the scale that they are measured by.
    core = np.quantile(x, [0.01, 0.99])
    floor = max(0.1 * float(core[1] - core[0]), 2.0 * float(np.diff(levels).min()))
    bound = max(SPIKE_FACTOR * float(np.quantile(height, 1.0 - MOST_SPIKES)), floor)
    count = int(np.count_nonzero(height > bound))
    if 0 < count <= max(1, MOST_SPIKES * len(height)):
        count -= _answered(record, name, heights, bound)
    if 0 < count <= max(1, MOST_SPIKES * len(height)):
        yield Finding(
            topic=Topic.CHANNELS,
            code="channel.spikes",
            verdict=Verdict.LOOK,
            subject=(name,),
            figures={
                "count": count,
                "largest": float(height.max()),
                "usual": float(np.quantile(height, 1.0 - MOST_SPIKES)),
            },
        )


def _answered(record: Record, name: str, heights: Sequence[NDArray[np.float64]], bound: float) -> int:
    """How many samples beyond a bound the output answers; those far larger than the others are asked by themselves."""
    if name == record.mapping.output:
        return 0
    sizes = np.abs(stacked(heights))
    far, count = SPIKE_FACTOR * float(np.median(sizes[sizes > bound])), 0
    for low, high in ((bound, far), (max(bound, far), np.inf)):
        away = [np.where((np.abs(one) > low) & (np.abs(one) <= high), one, 0.0) for one in heights]
        some = sum(int(np.count_nonzero(one)) for one in away)
        if some and answered(record.segments, record.mapping.inputs.index(name), away):
            count += some
    return count


def _heights(part: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far each sample stands off both neighbours, on one side of them; nothing at the ends."""
    height = np.zeros(len(part))
    if len(part) >= 3:
        before, after = part[1:-1] - part[:-2], part[1:-1] - part[2:]
        nearer = np.where(np.abs(before) < np.abs(after), before, after)
        height[1:-1] = np.where(before * after > 0.0, nearer, 0.0)
    return height


def _trends(record: Record) -> Iterator[Finding]:
    """What moves the output slowly or at once and is no input."""
    size = float(stacked(record.values(record.mapping.output)).std()) if record.segments else 0.0
    if size == 0.0:
        return
    if record.moving:
        known = record.slowed[0].impulse
        parts = [(one.left, one) for one in record.residuals] if not isinstance(known, str) and known.settled else []
        factor = record.slowed[1]
        for left, one in parts:
            by = sums_up(left, one.segment.inputs[-len(left) :])
            summed = () if by is None else (record.moving[by],)
            yield from _trend(record, left, (one.segment.trace, one.first, factor), size, summed)
    else:
        for segment in record.segments:
            yield from _trend(record, segment.output, (segment.trace, segment.first, 1), size)


def _trend(
    record: Record,
    part: NDArray[np.float64],
    place: tuple[str, int, int],
    size: float,
    summed: tuple[str, ...] = (),
) -> Iterator[Finding]:
    (trace, first, factor), found = place, trend_of(part, size)
    if found is None:
        return
    figures = {"size": found.size, "share": abs(found.size) / size}
    if found.at is not None:
        figures["seconds"] = record.time_of(trace, first + found.at * factor)
    code = "output.jump" if found.at is not None else "output.sums" if summed else "output.drift"
    subject = (*summed, *([] if summed else [record.mapping.output]), trace)
    yield Finding(topic=Topic.CHANNELS, code=code, verdict=Verdict.LOOK, subject=subject, figures=figures)
