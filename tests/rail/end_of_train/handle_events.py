"""What a driver's handle does, and how what is found of it agrees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.rail.dynamics.equalising import EQUALISING_RATE, equalising_from_handle
from sysid.rail.traces.annotate import Event, EventKind


def events_of_handle(
    handle: NDArray[np.float64], sample_time: float, *, rate: float = EQUALISING_RATE
) -> tuple[Event, ...]:
    """What a driver's handle does, to hold an annotation against.

    A step down is an application, and a lap once the equalising reservoir has followed it; a step up is a release;
    a step to 0 is an emergency.

    Args:
        handle: Psi gauge, shape ``(n_samples,)``.
        sample_time: In s.
        rate: Of the equalising reservoir in psi/s.

    Returns:
        Events in order of time.
    """
    events = []
    reservoir = equalising_from_handle(handle, sample_time, rate=rate)
    for k in np.flatnonzero(np.diff(handle)) + 1:
        now = float(k * sample_time)
        if handle[k] == 0.0:
            events.append(Event(kind=EventKind.EMERGENCY, time=now))
        elif handle[k] > handle[k - 1]:
            events.append(Event(kind=EventKind.RELEASE, time=now))
        else:
            events.append(Event(kind=EventKind.APPLICATION, time=now))
            arrived = k + int(np.argmax(reservoir[k:] <= handle[k] + 1e-9))
            if np.all(handle[k : arrived + 1] == handle[k]):
                events.append(Event(kind=EventKind.LAP, time=float(arrived * sample_time)))
    return tuple(sorted(events, key=lambda event: event.time))


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Events found against events that were.

    Args:
        delays: For each true event that was found, by how many seconds after it.
        missed: True events that were not found.
        invented: Events found that were none.
    """

    delays: tuple[float, ...]
    missed: tuple[Event, ...]
    invented: tuple[Event, ...]


def agreement(found: tuple[Event, ...], truth: tuple[Event, ...], *, within: float) -> Agreement:
    """Match events of the same kind, each once.

    Args:
        found: By an annotation.
        truth: As they were.
        within: Largest distance in time in s.

    Returns:
        The agreement.
    """
    left, delays, missed = list(found), [], []
    for event in truth:
        near = [one for one in left if one.kind is event.kind and abs(one.time - event.time) <= within + 1e-9]
        if near:
            best = min(near, key=lambda one: abs(one.time - event.time))
            left.remove(best)
            delays.append(best.time - event.time)
        else:
            missed.append(event)
    return Agreement(delays=tuple(delays), missed=tuple(missed), invented=tuple(left))
