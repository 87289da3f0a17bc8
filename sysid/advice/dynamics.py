"""How fast, how late, how strong, how noisy: what the regularised impulse response says."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sysid.advice.finding import Finding, Topic, Verdict
from sysid.advice.record import BARELY, Record, stacked
from sysid.estimation.nonparametric.impulse_response import ImpulseResponse, settled

INTEGRATES = "settling.integrates"
"""Of a plant whose output stays wherever it is left."""
TOO_FAST, FAR_TOO_FAST, TOO_SLOW, GOOD = 30.0, 100.0, 1.5, 8.0
"""Samples from 10 to 90 % of a step response: above and below which the rate is not good, and what it should be."""
VISIBLE = 0.05
"""Part of its peak from which a response is seen with the naked eye."""
RINGS = 0.3
"""Damping ratio below which a response is told to ring."""
MOST_LOST = 0.1
"""Share of the output's variance that a slower rate may lose."""
SUMS = "the plant integrates, and a step response that does not end has no time in which it rises"
QUICKER = "the output moves faster than the linear response that was found, which does not show how fast it answers"
CURVED, MOST_EXPLAINED = "past outputs act along a curve, and a linear response does not show how fast it answers", 0.9
"""Also the share of the output from which a linear response shows it all the same."""
AWAY = "the plant runs away by itself, and what is seen is the loop"
QUIET, LOUD = 20.0, 5.0
"""Signal-to-noise ratios in decibel from which a record is quiet, and below which it is loud."""
LITTLE = 1.0 / (1.0 + 10.0 ** (-LOUD / 10.0))
"""Share of the output that a response explains, below which what is read off it rests on little: it is as loud."""


def check_dynamics(record: Record) -> Iterator[Finding]:
    """Dead times, settling and gains.

    Args:
        record: The record.

    Yields:
        What each input does.
    """
    found = record.impulse
    if isinstance(found, str):
        if record.mapping.inputs:
            yield Finding(topic=Topic.DYNAMICS, code="dynamics.unknown", verdict=Verdict.UNKNOWN, reason=found)
        return
    whole = record.slowed[0].impulse
    assert isinstance(whole, ImpulseResponse)  # noqa: S101 - it is slowed only where there is one
    if record.runs_away:
        yield _runs_away(record)
        return
    if record.lasts and not record.integrates:
        yield _lasts(record, whole)
    for j, name in enumerate(found.mapping.inputs):
        dead = found.dead_times[j]
        if name in record.shared:
            yield Finding(topic=Topic.DYNAMICS, code="effect.shared", verdict=Verdict.UNKNOWN, subject=(name,))
            continue
        if not dead.acts and not whole.dead_times[j].acts:
            yield _no_effect(name, dead.odds, alone=len(found.mapping.inputs) == 1)
            continue
        yield _dead_time(found, j, name)
        yield _settling(record, whole, j, name)


def _no_effect(name: str, odds: float, *, alone: bool) -> Finding:
    """What is said of an input that no lag shows: the only one is all that the output can be explained by."""
    code, figures = "effect.unseen" if alone else "effect.none", {"odds": odds}
    return Finding(topic=Topic.DYNAMICS, code=code, verdict=Verdict.LOOK, subject=(name,), figures=figures)


def _runs_away(record: Record) -> Finding:
    """Dead times and gains of a plant that a controller holds would be those of the loop."""
    assert record.equation is not None  # noqa: S101 - by which it is known
    size = abs(record.equation.pole)
    figures = {"pole": size, "seconds": record.sample_time / np.log(size)}
    code, subject = "dynamics.runs_away", (record.mapping.output,)
    return Finding(topic=Topic.DYNAMICS, code=code, verdict=Verdict.LOOK, subject=subject, figures=figures)


def _lasts(record: Record, whole: ImpulseResponse) -> Finding:
    """What rings or is slow beyond the lags that are looked at."""
    assert record.equation is not None  # noqa: S101 - by which it is known
    # A pole on the circle, which is not known to lie beyond it, is as slow as the record is long at least.
    slowest = np.log(min(max(abs(record.equation.pole), 1e-300), 1.0 - 1.0 / sum(map(len, record.segments))))
    rate = complex(slowest, np.angle(record.equation.pole)) / record.sample_time
    figures = {
        "explained": record.equation.explained,
        "response": max(whole.explained, 0.0),
        "lags_seconds": float(whole.time[-1]),
        "hertz": float(abs(rate.imag) / (2.0 * np.pi)),
        "damping": float(-rate.real / abs(rate)),
        "seconds": float(-1.0 / rate.real),
    }
    code = "dynamics.rings" if figures["damping"] < RINGS else "dynamics.lasts"
    subject = (record.mapping.output,)
    return Finding(topic=Topic.DYNAMICS, code=code, verdict=Verdict.NOTE, subject=subject, figures=figures)


def _dead_time(found: ImpulseResponse, j: int, name: str) -> Finding:
    dead, T = found.dead_times[j], found.sample_time
    peak = np.abs(found.values[j])
    visible = int(found.lags[np.argmax(peak >= VISIBLE * peak.max())])
    figures = {"best": dead.best, "low": dead.low, "high": dead.high, "seconds": dead.best * T, "visible": visible}
    if not dead.acts or found.explained < BARELY:
        code, verdict = "dead_time.unknown", Verdict.UNKNOWN
    elif figures["high"] - dead.low > 2:
        code, verdict = "dead_time.vague", Verdict.NOTE
    else:
        code, verdict = "dead_time", Verdict.FINE
    return Finding(topic=Topic.DYNAMICS, code=code, verdict=verdict, subject=(name,), figures=figures)


def _settling(record: Record, whole: ImpulseResponse, j: int, name: str) -> Finding:
    step, deviation = whole.step()
    seconds = whole.settling()[j] * whole.sample_time
    total = sum(map(len, record.segments)) * record.sample_time
    figures = {
        "samples": seconds / record.sample_time,
        "seconds": seconds,
        "gain": float(step[j, -1]),
        "gain_deviation": float(deviation[j, -1]),
        "length": total / seconds if seconds > 0.0 else np.inf,
        "lags_seconds": float(whole.time[-1]),
        "explained": whole.explained,
    }
    ends = settled(whole.values[j]) and not record.lasts
    # What a linear model leaves, a curve or noise, may hold the end of its response up as well as a slow mode does.
    if record.integrates:
        code, verdict = INTEGRATES, Verdict.NOTE
    elif (whole.explained if ends else record.explained) < (BARELY if ends else MOST_EXPLAINED):
        code, verdict = "settling.unknown", Verdict.UNKNOWN
        figures["explained"] = record.explained
    elif not ends:
        code, verdict = "settling.never", Verdict.LOOK
    elif figures["length"] < 10.0:
        code, verdict = "settling.short_record", Verdict.LOOK
    elif whole.explained < LITTLE:
        code, verdict = "settling.little", Verdict.NOTE
    else:
        code, verdict = "settling", Verdict.FINE
    return Finding(topic=Topic.DYNAMICS, code=code, verdict=verdict, subject=(name,), figures=figures)


def rise(response: NDArray[np.float64]) -> float:
    """Samples from 10 to 90 % of the way of a step response, between samples by a line.

    Args:
        response: Shape ``(n,)``.

    Returns:
        The number; 0 where it jumps.
    """
    x = np.concatenate([[0.0], response]) / (response[np.argmax(np.abs(response))] or 1.0)
    places = []
    for level in (0.1, 0.9):
        k = int(np.argmax(x >= level))
        step = x[k] - x[k - 1] if k else 0.0
        places.append(k - (x[k] - level) / step if step > 0.0 else float(k))
    return float(places[1] - places[0])


def lost(record: Record, every: int) -> float:
    """What means over blocks of samples lose of an output, beside its noise: a rate that loses much is no proposal.

    Args:
        record: The record.
        every: Samples of a block.

    Returns:
        The share of the output's variance within its stretches.
    """
    within, power, bends = 0.0, 0.0, list[NDArray[np.float64]]()
    for y in record.values(record.mapping.output):
        n = len(y) // every * every
        blocks = y[:n].reshape(-1, every)
        within += float(np.sum((blocks - blocks.mean(axis=1, keepdims=True)) ** 2))
        power += float(np.sum((y[:n] - y[:n].mean()) ** 2)) if n else 0.0
        bends.append(np.diff(y, 2))
    count = sum(len(y) // every * every for y in record.values(record.mapping.output))
    # White noise is lost as well, and nobody misses it: second differences show hardly anything else here.
    noise = float(np.mean(stacked(bends) ** 2)) / 6.0 if len(stacked(bends)) else 0.0
    return max(within - noise * count * (1.0 - 1.0 / every), 0.0) / max(power, 1e-300)


def check_sampling(record: Record) -> Iterator[Finding]:
    """Samples within the rise of the step response, of the input that moves the output most.

    Args:
        record: The record.

    Yields:
        Whether the rate is good.
    """
    slow, factor = record.slowed
    found = slow.impulse
    if isinstance(found, str) or found.explained < BARELY or record.runs_away:
        if record.moving:
            reason = found if isinstance(found, str) else "a linear response explains too little of the output"
            reason = AWAY if record.runs_away else reason
            yield Finding(topic=Topic.SAMPLING, code="sampling.unknown", verdict=Verdict.UNKNOWN, reason=reason)
        return
    spread = [np.sqrt(np.mean([np.var(s.inputs[:, j]) for s in slow.some.segments])) for j in range(len(found.values))]
    acting = [s * float(np.abs(g).max()) * one.acts for s, g, one in
              zip(spread, found.values, found.dead_times, strict=True)]  # fmt: skip
    j = int(np.argmax(acting))
    samples = rise(found.step()[0][j]) * factor
    subject = (found.mapping.inputs[j],)
    figures = {"rise": samples, "sample_time": record.sample_time, "factor": factor, "explained": found.explained}
    every, response = max(int(samples / GOOD), 2), np.abs(found.values[j])
    # Beside a curve in the state, a linear response that explains little is no measure of how fast the plant is.
    curved = record.state_curve is not None and found.explained < MOST_EXPLAINED
    if samples > TOO_FAST and (record.integrates or curved or lost(record, every) > MOST_LOST):
        reason = SUMS if record.integrates else CURVED if curved else QUICKER
        yield Finding(topic=Topic.SAMPLING, code="sampling.unknown", verdict=Verdict.UNKNOWN, reason=reason)
        return
    if samples > TOO_FAST:
        code, verdict = "sampling.fast", Verdict.LOOK if samples > FAR_TOO_FAST else Verdict.NOTE
        figures["proposed"] = record.sample_time * every
    elif found.settling()[j] <= 1 and response[0] >= VISIBLE * response.max():
        code, verdict = "sampling.at_once", Verdict.NOTE
        figures["proposed"] = record.sample_time / 5.0
    elif samples < TOO_SLOW and found.settling()[j] - found.dead_times[j].best <= 3:
        code, verdict = "sampling.slow", Verdict.LOOK
        figures["proposed"] = record.sample_time / 5.0
    elif found.explained < LITTLE:
        code, verdict = "sampling.little", Verdict.NOTE
    else:
        code, verdict = "sampling.good", Verdict.FINE
    yield Finding(topic=Topic.SAMPLING, code=code, verdict=verdict, subject=subject, figures=figures)


def check_noise(record: Record) -> Iterator[Finding]:
    """What a linear response leaves of the output.

    Args:
        record: The record.

    Yields:
        How much, and of what colour.
    """
    slow, factor = record.slowed
    found = slow.impulse
    if isinstance(found, str) or not record.residuals or record.runs_away:
        reason = found if isinstance(found, str) else "the stretches are shorter than the response"
        reason = AWAY if record.runs_away else reason
        if record.moving:
            yield Finding(topic=Topic.NOISE, code="noise.unknown", verdict=Verdict.UNKNOWN, reason=reason)
        return
    lasts = record.lasts and record.equation is not None
    explained = record.equation.explained if record.equation is not None and lasts else found.explained
    rest, left = max(1.0 - explained, 1e-16), np.mean([np.var(one.left) for one in record.residuals])
    if lasts:
        left = rest * np.var(stacked(record.values(record.mapping.output)))
    ratio = 10.0 * np.log10(max(explained, 1e-16) / rest)
    figures = {
        "explained": max(explained, 0.0),
        "decibel": float(ratio),
        "deviation": float(np.sqrt(left)),
        "order": len(found.noise_ar),
        "factor": factor,
    }
    if ratio < LOUD:
        code, verdict = "noise.loud", Verdict.LOOK
    elif ratio < QUIET:
        code, verdict = "noise.some", Verdict.NOTE
    else:
        code, verdict = "noise.quiet", Verdict.FINE
    yield Finding(topic=Topic.NOISE, code=code, verdict=verdict, subject=(record.mapping.output,), figures=figures)
    if found.noise_ar and ratio < 30.0:
        yield Finding(
            topic=Topic.NOISE, code="noise.coloured", verdict=Verdict.NOTE, subject=(record.mapping.output,),
            figures={"order": len(found.noise_ar)},
        )  # fmt: skip
