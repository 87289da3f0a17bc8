"""The head end of a two-way end-of-train device: buffers, transitions and orders, and what it finds in traces."""

import numpy as np
import pytest

from sysid.airbrake.command import Command
from sysid.airbrake.machine import Probe
from sysid.airbrake.simulate import simulate
from sysid.errors import ConfigError
from sysid.ingest import load_dataset
from sysid.rail.end_of_train.brake_computer import BrakeComputer, ComputerSettings, Message, Order, Reading, State
from sysid.rail.end_of_train.ring import Ring
from sysid.rail.traces.annotate import (
    STATE_CHANNEL,
    EventKind,
    annotate,
    annotated,
    annotator,
    equalising_from_handle,
)
from sysid.traces import Channel, Trace
from sysid.units import Reference
from tests.rail.end_of_train.handle_events import agreement, events_of_handle

STEP = 0.1


def run(
    equalising: np.ndarray, head: np.ndarray | None = None, *, charged: bool = True, tail: np.ndarray | None = None
) -> tuple[list[State], list[Message]]:
    computer = BrakeComputer(sample_time=STEP, charged=charged)
    head = equalising if head is None else head
    tail = head if tail is None else tail
    states, messages = [], []
    for er, bp, end in zip(equalising, head, tail, strict=True):
        outcome = computer.step(Reading(equalising=float(er), head=float(bp), tail=float(end)))
        states.append(outcome.state)
        if outcome.message is not None:
            messages.append(outcome.message)
    return states, messages


def path(states: list[State]) -> list[State]:
    """States in the order in which they were entered."""
    return [state for k, state in enumerate(states) if k == 0 or state is not states[k - 1]]


def hold(value: float, seconds: float) -> np.ndarray:
    return np.full(round(seconds / STEP), value)


def ramp(start: float, stop: float, rate: float) -> np.ndarray:
    return np.linspace(start, stop, round(abs(stop - start) / rate / STEP) + 1)[1:]


# --- the buffers


def test_a_ring_forgets_the_oldest() -> None:
    ring = Ring(seconds=1.0, sample_time=0.25)
    for value in range(8):
        ring.push(float(value))
    assert ring.full
    assert ring.recent(9.0).tolist() == [3.0, 4.0, 5.0, 6.0, 7.0]
    assert (ring.newest, ring.change(0.5), ring.rate(0.5), ring.swing(0.75)) == (7.0, 2.0, 4.0, 3.0)
    assert ring.covers(1.0)


def test_a_single_value_has_no_rate() -> None:
    ring = Ring(seconds=1.0, sample_time=0.25)
    ring.push(5.0)
    assert (ring.rate(1.0), ring.swing(1.0), ring.covers(0.25)) == (0.0, 0.0, False)


# --- transitions

CHARGED = hold(90.0, 20.0)
S, Q1, Q2, Q3 = State.STABILITY, State.QUALIFY_MINIMUM, State.QUALIFY_SERVICE, State.QUALIFY_DEEPER

# On its way down a pressure is first no longer stable and then an application: Release, Stability, Application.
TRANSITIONS = {
    "setup waits for the minute": (hold(90.0, 59.0), False, [State.SETUP]),
    "setup ends, pressures are stable": (hold(90.0, 90.0), False, [State.SETUP, S, State.RELEASE]),
    "setup waits for the pressure": (hold(40.0, 100.0), False, [State.SETUP]),
    "released and stable": (hold(90.0, 100.0), True, [State.RELEASE]),
    "released and leaking slowly": (ramp(90.0, 85.0, 0.03), True, [State.RELEASE]),
    "released and drifting": (np.concatenate([CHARGED, ramp(90.0, 84.0, 0.1)]), True, [State.RELEASE, S]),
    "a minimum application, held": (
        np.concatenate([CHARGED, ramp(90.0, 84.0, 4.0), hold(84.0, 9.0)]), True, [State.RELEASE, S, Q1, Q2, Q3]),
    "a deeper one": (
        np.concatenate([CHARGED, ramp(90, 84, 4.0), hold(84, 9), ramp(84, 70, 4.0), hold(70, 9)]), True,
        [State.RELEASE, S, Q1, Q2, Q3, Q2, Q3]),
    "applied and released": (
        np.concatenate([CHARGED, ramp(90, 84, 4.0), hold(84, 9), ramp(84, 90, 3.0), hold(90, 40)]), True,
        [State.RELEASE, S, Q1, Q2, Q3, S, State.RELEASE]),
    "released while still applying": (
        np.concatenate([CHARGED, ramp(90, 80, 4.0), ramp(80, 90, 4.0), hold(90, 5)]), True,
        [State.RELEASE, S, Q1, Q2, S]),
    "an emergency out of release": (
        np.concatenate([CHARGED, ramp(90, 0, 60.0), hold(0, 30)]), True, [State.RELEASE, State.EMERGENCY]),
    "an emergency out of setup": (
        np.concatenate([hold(90, 5), ramp(90, 0, 60.0), hold(0, 5)]), False, [State.SETUP, State.EMERGENCY]),
    "an emergency out of an application": (
        np.concatenate([CHARGED, ramp(90, 80, 4.0), hold(80, 9), ramp(80, 0, 60.0)]), True,
        [State.RELEASE, S, Q1, Q2, Q3, State.EMERGENCY]),
    "an emergency that ends before the setup goes back to it": (
        np.concatenate([hold(90, 5), ramp(90, 0, 60.0), hold(0, 9), ramp(0, 60, 2.0)]), False,
        [State.SETUP, State.EMERGENCY, State.SETUP]),
}  # fmt: skip


@pytest.mark.parametrize(("pressure", "charged", "expected"), TRANSITIONS.values(), ids=TRANSITIONS.keys())
def test_transitions(pressure: np.ndarray, charged: bool, expected: list[State]) -> None:
    assert path(run(pressure, charged=charged)[0]) == expected


def test_an_emergency_that_ends_after_the_setup_goes_to_release() -> None:
    pressure = np.concatenate([CHARGED, ramp(90, 0, 60.0), hold(0, 9), ramp(0, 30, 2.0)])
    assert path(run(pressure)[0])[:3] == [State.RELEASE, State.EMERGENCY, State.RELEASE]


def test_a_falling_pipe_without_the_reservoir_is_no_application() -> None:
    """Claim 13 prints that the reservoir has increased; it must have decreased."""
    head = np.concatenate([CHARGED, ramp(90.0, 86.0, 1.5), hold(86.0, 9.0)])
    states, messages = run(np.full(len(head), 90.0), head)
    assert path(states)[:4] == [State.RELEASE, S, Q1, S]
    assert [m for m in messages if m.order is not Order.UPDATE] == []


def test_an_unstable_tail_keeps_the_train_from_release() -> None:
    tail = 80.0 + 5.0 * np.sin(np.arange(1200) / 30.0)
    states, messages = run(np.full(1200, 90.0), charged=False, tail=tail)
    assert path(states) == [State.SETUP, S]
    assert messages == []


def test_orders_of_an_application() -> None:
    pressure = np.concatenate([CHARGED, ramp(90, 80, 4.0), hold(80, 9), ramp(80, 90, 4.0), hold(90, 40)])
    messages = run(pressure)[1]
    orders = [message.order for message in messages]
    assert orders[0] is Order.MINIMUM
    assert orders[-2:] == [Order.RELEASE, Order.UPDATE]
    service = [message for message in messages if message.order is Order.SERVICE]
    assert service[-1].reduction == pytest.approx(10.0, abs=0.2)
    assert [m.time for m in messages] == sorted(m.time for m in messages)
    assert 20.0 < messages[0].time < 22.0


def test_settings_are_checked() -> None:
    with pytest.raises(ConfigError, match="settings"):
        ComputerSettings(drop=0.0)
    with pytest.raises(ConfigError, match="settings"):
        ComputerSettings(stable_window=90.0)


# --- traces


@pytest.fixture(scope="module")
def combined() -> dict[str, Trace]:
    return {trace.name: trace for trace in load_dataset("abdx-combined")}


@pytest.mark.parametrize("case", ["EST01", "VAL01", "VAL02", "VAL03", "VAL04", "VAL05"])
def test_every_event_of_the_command_is_found_within_2_s_and_none_is_invented(
    combined: dict[str, Trace], case: str
) -> None:
    trace = combined[case]
    truth = events_of_handle(trace["STP"], trace.sample_time)
    found = agreement(annotate(trace).events, truth, within=2.0)
    assert (found.missed, found.invented) == ((), ())
    assert len(found.delays) == len(truth)
    assert min(found.delays) >= 0.0
    assert max(found.delays) <= 1.1


def test_the_truth_of_the_estimation_case(combined: dict[str, Trace]) -> None:
    """Eight reductions, six releases and an emergency stand in the command vector."""
    trace = combined["EST01"]
    kinds = [event.kind for event in events_of_handle(trace["STP"], trace.sample_time)]
    counts = {kind: kinds.count(kind) for kind in EventKind}
    handle = np.array([90, 84.2, 64.2, 90, 84.2, 70, 64.2, 90, 84.2, 90, 64.2, 90, 74, 90, 0, 90])
    down = int(np.sum((np.diff(handle) < 0) & (handle[1:] > 0)))
    assert counts == {
        EventKind.APPLICATION: down,
        EventKind.LAP: down,
        EventKind.RELEASE: int(np.sum(np.diff(handle) > 0)),
        EventKind.EMERGENCY: 1,
    }


@pytest.mark.parametrize("case", ["EST01", "VAL01", "VAL05"])
def test_from_the_pipe_alone_all_but_laps_are_found_within_2_s(combined: dict[str, Trace], case: str) -> None:
    """A long pipe settles seconds after the handle is held: laps come late, nothing else does."""
    trace = combined[case]
    truth = events_of_handle(trace["STP"], trace.sample_time)
    events = annotate(trace, handle=None).events
    moves = [tuple(e for e in side if e.kind is not EventKind.LAP) for side in (events, truth)]
    found = agreement(*moves, within=2.0)
    assert (found.missed, found.invented) == ((), ())
    laps = [tuple(e for e in side if e.kind is EventKind.LAP) for side in (events, truth)]
    late = agreement(*laps, within=6.0)
    assert (late.missed, late.invented) == ((), ())


def test_a_recorded_equalising_reservoir_serves_as_the_handle_does() -> None:
    command = Command.from_rows([[0, 90], [10, 64.2], [70, 90], [120, 90]])
    record = simulate(command, probes=(Probe(quantity="pipe", node=1), Probe(quantity="pipe", node=3)))
    channels = tuple(Channel(name=name, unit="Pa", reference=Reference.ABSOLUTE) for name in ("EQ", "BP"))
    trace = Trace(name="recorded", sample_time=0.1, channels=channels, values=record.pressures)
    events = annotate(trace, equalising="EQ").events
    found = agreement(events, events_of_handle(record.command, 0.1), within=2.0)
    assert (found.missed, found.invented, len(found.delays)) == ((), (), 3)


def test_the_reservoir_follows_a_reduction_and_jumps_otherwise() -> None:
    handle = np.array([90.0, 70.0, 70.0, 90.0, 0.0, 90.0])
    assert equalising_from_handle(handle, 1.0, rate=4.0).tolist() == [90.0, 86.0, 82.0, 90.0, 0.0, 90.0]


def test_an_annotated_trace_has_its_states_as_a_channel(combined: dict[str, Trace]) -> None:
    trace = combined["VAL05"]
    annotation = annotate(trace)
    assert len(np.unique(annotation.states)) > 1
    with_states = annotated(trace, annotation)
    np.testing.assert_array_equal(with_states[STATE_CHANNEL], annotation.states)
    np.testing.assert_array_equal(annotator(trace).values, with_states.values)
    with pytest.raises(ConfigError, match="another trace"):
        annotated(combined["VAL04"], annotation)
