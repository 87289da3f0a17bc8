"""Windows on which a second start of a whole is trained first, and when it needs one.

A whole that is far off is led back by the free run over windows that begin with what is measured (``joint_record.py``),
the shortest first. It costs more than the training itself, and a start that runs well needs none of it. So the start
is looked at: is its free run far off, or much worse than over short windows?
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.networks.together.options import AUTO
from sysid.estimation.networks.together.provider import CascadeProvider
from sysid.traces import Trace

FAR, TIMES, NEAR = 0.1, 2.0, 1e-3
"""Mean squared error of a free run over the target's variance from which on it is far off; over that of the windows;
and over the variance up to which it is near, whatever the windows say."""

OF_MEMORY, LEAST, LONGER, PARTS = 0.5, 10, 4, 2
"""Samples of the shortest window, over those after which a target is another one, and at least; how many times as long
the next one is; and how many of the longest a record holds at least."""

ENOUGH, PATIENCE, SHARE = 1e-2, 10, 0.5
"""Training on windows ends with less improvement than this over so many iterations: it need not come to a minimum, for
the free run has another one. And the share of the time that it may take."""


def lengths(traces: Sequence[Trace], targets: Sequence[str], inputs: Sequence[str] = ()) -> tuple[int, ...]:
    """Samples of windows by how long the targets remember, and by how long the records are.

    Args:
        traces: The records.
        targets: Names of the channels that count.
        inputs: Names of the inputs, which may be masked too.

    Returns:
        The shortest first; none where the records are too short to be cut.

    Example:
        >>> from sysid.traces import Channel
        >>> held = np.repeat(np.random.default_rng(0).standard_normal(30), 40)
        >>> y = Channel(name="y", unit="bar")
        >>> lengths([Trace(name="held", sample_time=0.1, channels=(y,), values=held[:, None])], ["y"])
        (27, 108, 432)
    """
    memory = []
    for trace in traces:
        counts = trace.counted(inputs, targets)
        for name, own in zip(targets, counts.T, strict=True):
            values = trace[name][own]
            if len(values) and np.ptp(values) > 0.0:
                memory.append(correlation_time(values - np.mean(values)))
    most = int(np.median([len(trace) for trace in traces])) // PARTS
    if not memory:
        return ()
    shortest = max(LEAST, round(OF_MEMORY * float(np.median(memory))))
    found = []
    while shortest <= most:
        found.append(shortest)
        shortest *= LONGER
    return tuple(found)


def possible_lengths(asked: str | tuple[int, ...], whole: CascadeProvider) -> tuple[int, ...]:
    """Samples of the windows that a training may use.

    Args:
        asked: Samples, or ``auto``.
        whole: The residuals over whole records.

    Returns:
        The shortest first.
    """
    if asked != AUTO:
        return tuple(int(one) for one in asked)
    return lengths(whole.traces, list(whole.errors), whole.cascade.inputs)


@dataclass(frozen=True, kw_only=True, eq=False)
class LeadingWindows:
    """What leads a second start.

    Args:
        providers: The residuals over windows, the shortest first; none where no second start is trained.
        told: Why, in sentences.
    """

    providers: tuple[CascadeProvider, ...] = ()
    told: tuple[str, ...] = ()

    @classmethod
    def of(cls, asked: str | tuple[int, ...], whole: CascadeProvider, theta: NDArray[np.float64]) -> LeadingWindows:
        """Look at a start.

        Args:
            asked: Samples of the windows, or ``auto``.
            whole: The residuals over whole records.
            theta: Plain parameters of the start.

        Returns:
            The windows.
        """
        used = possible_lengths(asked, whole)
        if asked != AUTO:
            return cls(providers=_cut(whole, used), told=(f"{_second(used)}, as asked.",) if used else ())
        if not used:
            return cls()
        short = replace(whole, window=used[0])
        why = _far_off(whole, short, theta)
        if not why:
            return cls()
        told = f"{why}. So {_second(used)[0].lower()}{_second(used)[1:]} (windows: [] for none)."
        return cls(providers=(short, *_cut(whole, used[1:])), told=(told,))


def _cut(whole: CascadeProvider, lengths: Sequence[int]) -> tuple[CascadeProvider, ...]:
    return tuple(replace(whole, window=one) for one in lengths)


def _second(lengths: Sequence[int]) -> str:
    samples = ", ".join(map(str, lengths))
    return f"A second start was trained on windows of {samples} samples first, and raced with the one that was given"


def _far_off(whole: CascadeProvider, short: CascadeProvider, theta: NDArray[np.float64]) -> str:
    """Of which target the free run is far off, and how; nothing where none is."""
    free, begun, spread = whole.mean_squares(theta), short.mean_squares(theta), whole.variances
    for name, run, window, own in zip(whole.errors, free, begun, spread, strict=True):
        if own > 0.0 and (not run <= FAR * own or run > max(TIMES * window, NEAR * own)):
            share = f"{100.0 * run / own:.3g} % of its variance" if np.isfinite(run) else "without bound"
            return (
                f"The free run of {name} goes astray from where it began (squared error {share}, over windows "
                f"of {short.window} samples that begin with what is measured {100.0 * window / own:.3g} %)"
            )
    return ""
