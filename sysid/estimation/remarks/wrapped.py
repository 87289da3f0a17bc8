"""Channels that wrap: angles that go on at 0 after 360 degrees, counters that go on at 0 when they are full.

The jump is none of the plant's, and squared errors see little else.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

LOOKED_AT = 20_000
"""Samples of a stretch that are looked at."""
FEWEST, HALF = 2, 0.5
"""Jumps that it takes to say so, and the part of the channel's span that a jump goes over."""
FULL, BEYOND, SMOOTH, FAST = 1.1, 1.2, 0.1, 0.3
"""Spans that a period is at most, spans that the channel goes over when it is put together, at least, and the part of a
period that it moves in a sample, at most, and where the period is a known one: what moves faster cannot be told from a
jump."""
KNOWN = (360.0, 2.0 * np.pi, *(2.0**k for k in range(8, 33)))
"""Periods of angles and counters."""
NEAR = 0.01
"""Part of a period by which a jump may miss it."""


def period_of(
    parts: Sequence[NDArray[np.float64]], moved: Sequence[NDArray[np.bool_]] = ()
) -> tuple[float, int] | None:
    """At what a channel wraps.

    Args:
        parts: The channel over stretches of samples that count.
        moved: For an output, of each stretch where an input jumps from one sample to the next, shape
            ``(n_samples - 1,)``: what jumps there may follow it. Of an input itself there are none, and only the
            periods of angles and counters are taken for one: a ramp that begins anew is a test signal.

    Returns:
        The period and the number of jumps; ``None`` where it does not wrap.
    """
    moved = [one[: LOOKED_AT - 1] for one, part in zip(moved, parts, strict=True) if len(part) > 3] if moved else ()
    parts = [part[:LOOKED_AT] for part in parts if len(part) > 3]
    span = max((float(np.ptp(part)) for part in parts), default=0.0)
    if not span > 0.0:
        return None
    jumps, others, with_input = list[float](), [np.zeros(1)], 0
    for number, part in enumerate(parts):
        steps = np.diff(part)
        at = np.abs(steps) > HALF * span
        usual = np.where(at, 0.0, steps)
        beside = 0.5 * (np.r_[0.0, usual[:-1]] + np.r_[usual[1:], 0.0])
        jumps += (np.abs(steps - beside)[at]).tolist()
        others.append(np.abs(usual))
        with_input += int(np.count_nonzero(at & moved[number])) if moved else 0
    if len(jumps) < FEWEST or with_input > HALF * len(jumps):
        return None
    period = float(np.median(jumps))
    known = next((one for one in KNOWN if abs(one - period) <= NEAR * one), None)
    if not span * (1.0 - NEAR) <= period <= FULL * span or (known is None and not moved):
        return None
    period = period if known is None else known
    gone = max(float(np.ptp(np.unwrap(part, period=period))) for part in parts)
    alike = np.mean(np.abs(np.array(jumps) - period) <= SMOOTH * period) > 1.0 - SMOOTH
    calm = float(np.quantile(np.concatenate(others), 0.99)) <= (SMOOTH if known is None else FAST) * period
    return (period, len(jumps)) if alike and calm and gone > BEYOND * span else None


def jumping(inputs: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Where an input jumps.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``.

    Returns:
        Shape ``(n_samples - 1,)``.
    """
    steps = np.abs(np.diff(inputs, axis=0))
    return np.asarray((steps > HALF * np.ptp(inputs, axis=0)).any(axis=1) if len(inputs) else steps.any(axis=1))


def told(name: str, period: float, count: int) -> str:
    """What is said of it.

    Args:
        name: The channel.
        period: At what it wraps.
        count: Its jumps.

    Returns:
        A sentence.
    """
    return (
        f"{name} jumps by {period:.6g} {count} times and goes on from there, as an angle or a counter does that wraps: "
        f"no model follows that. If it is one, put it together first: numpy.unwrap({name}, period={period:.6g})."
    )
