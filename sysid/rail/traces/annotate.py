"""States of the brake along a trace, by which pipelines weigh fits and tell figures of merit."""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.rail.dynamics.equalising import equalising_from_handle
from sysid.rail.end_of_train.brake_computer import APPLICATION, BrakeComputer, ComputerSettings, Reading, State
from sysid.traces import Channel, Trace
from sysid.units import Reference, convert


class EventKind(enum.Enum):
    """What happens to a brake."""

    APPLICATION = "the pressure is being reduced, for the first time or further"
    LAP = "the reduction is made and held"
    RELEASE = "the pressure is let rise"
    EMERGENCY = "the pressure is dumped"


@dataclass(frozen=True, kw_only=True)
class Event:
    """Something that happens to a brake.

    Args:
        kind: What.
        time: In s.
    """

    kind: EventKind
    time: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Annotation:
    """A state for every sample of a trace.

    Args:
        case: Name of the trace.
        time: In s, shape ``(n_samples,)``.
        states: Shape ``(n_samples,)``, indices into ``list(State)``.
        events: In order of time.
    """

    case: str
    time: NDArray[np.float64]
    states: NDArray[np.int64]
    events: tuple[Event, ...]


def annotate(
    trace: Trace,
    *,
    pipe: str = "BP",
    equalising: str | None = None,
    handle: str | None = "STP",
    tail: str | None = None,
    settings: ComputerSettings | None = None,
) -> Annotation:
    """Run the brake computer over a trace that begins charged.

    Args:
        trace: With a brake pipe pressure in any unit of pressure.
        pipe: Its channel.
        equalising: Channel of the equalising reservoir at the driver's valve, if it was recorded.
        handle: Channel of the handle from which the equalising reservoir is computed otherwise; with neither, the
            pipe stands for it, and a lap is found only when the pipe has settled.
        tail: Channel of the pipe at the end of the train; the pipe's if there is none.
        settings: Thresholds.

    Returns:
        The annotation.

    Raises:
        ChannelError: If a channel is not there.
    """
    head = _psi(trace, pipe)
    if equalising is not None:
        reservoir = _psi(trace, equalising)
    elif handle is not None:
        reservoir = equalising_from_handle(_psi(trace, handle), trace.sample_time)
    else:
        reservoir = head
    end = head if tail is None else _psi(trace, tail)
    settings = settings or ComputerSettings()
    if equalising is None and handle is None:
        # A pipe never stands as still as a reservoir: its lap is a fall of less than 0.6 psi in 2 s (ours).
        settings = replace(settings, held_swing=0.6, held_window=2.0)
    computer = BrakeComputer(sample_time=trace.sample_time, settings=settings, charged=True)
    names, states = list(State), np.empty(len(trace), dtype=np.int64)
    events: list[Event] = []
    before = State.RELEASE
    for k in range(len(trace)):
        reading = Reading(equalising=float(reservoir[k]), head=float(head[k]), tail=float(end[k]))
        after = computer.step(reading).state
        states[k] = names.index(after)
        kind = _event(before, after)
        if kind is not None:
            events.append(Event(kind=kind, time=float(trace.time[k])))
        before = after
    return Annotation(case=trace.name, time=trace.time, states=states, events=tuple(events))


def _event(before: State, after: State) -> EventKind | None:
    if after is before:
        return None
    if after is State.EMERGENCY:
        return EventKind.EMERGENCY
    if after is State.QUALIFY_SERVICE:
        return EventKind.APPLICATION
    if after is State.QUALIFY_DEEPER:
        return EventKind.LAP
    confirmed = before in {State.QUALIFY_SERVICE, State.QUALIFY_DEEPER, State.EMERGENCY}
    return EventKind.RELEASE if confirmed and after not in APPLICATION else None


def _psi(trace: Trace, name: str) -> NDArray[np.float64]:
    channel = trace.channel(name)
    reference = channel.reference
    return convert(
        np.array(trace[name]),
        channel.unit,
        "psi",
        reference=reference,
        to_reference=reference if reference is Reference.NONE else Reference.GAUGE,
    )


STATE_CHANNEL = "STATE"
"""Channel that an annotation adds: the index of the state in ``State``."""


def annotated(trace: Trace, annotation: Annotation) -> Trace:
    """The trace with its states as a further channel, so that they can be written and read.

    Args:
        trace: The trace.
        annotation: Of it.

    Returns:
        The trace with the channel ``STATE``.

    Raises:
        ConfigError: If the annotation is of another trace.
    """
    if annotation.case != trace.name or len(annotation.states) != len(trace):
        raise ConfigError(
            "the annotation is of another trace", where=f"trace {trace.name}", expected=trace.name, got=annotation.case
        )
    names = ", ".join(f"{k} {state.name.lower()}" for k, state in enumerate(State))
    channel = Channel(name=STATE_CHANNEL, unit="1", description=names)
    return replace(
        trace,
        channels=(*trace.channels, channel),
        values=np.column_stack([trace.values, annotation.states.astype(np.float64)]),
        provenance=(*trace.provenance, "states of the brake by the end-of-train brake computer"),
    )


class BrakeStates:
    """The annotator of brake traces: what ``sysid ingest --annotate`` and pipelines ask of a field of application."""

    channel = STATE_CHANNEL
    labels = tuple(state.name.lower().replace("_", " ") for state in State)

    def __call__(self, trace: Trace) -> Trace:
        """The trace with its states.

        Args:
            trace: With the channel ``BP`` and, for laps to be found at once, ``STP``.

        Returns:
            The trace with the channel ``STATE``.

        Raises:
            ChannelError: If there is no ``BP``.
        """
        handle = "STP" if "STP" in trace.channel_names else None
        return annotated(trace, annotate(trace, handle=handle))


annotator = BrakeStates()
"""What the entry point ``brake-states`` names."""
