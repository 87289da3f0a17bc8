"""A data set as the checks see it: its stretches, and the models of it that several of them share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.advice.curved_state import StateCurve, curve_of_state
from sysid.advice.equation import Equation, least_bic
from sysid.advice.integrators import SAMPLES, integrates
from sysid.errors import UserError
from sysid.estimation.nonparametric.feedback import Feedback, find_feedback
from sysid.estimation.nonparametric.impulse_response import ImpulseResponse
from sysid.estimation.nonparametric.remembered import remembered_response
from sysid.estimation.nonparametric.response import FrequencyResponse, estimate_frequency_response
from sysid.estimation.nonparametric.segments import Segment, segments_of, stretches
from sysid.estimation.records.informative import own_part
from sysid.models import Mapping
from sysid.traces import Trace

SEEN = 20_000
"""Samples that dynamics are judged by; of longer records the first ones."""
LONGEST_RESPONSE, LAGS_IN_ALL, LEAST_LAGS = 128, 192, 32
"""Lags of a response at most, of all inputs together, and of one in any case: the price grows with their third power. A
response that has not settled then is looked at more slowly."""
BARELY = 0.3
"""Share of the output that a linear response explains, below which nothing is built on it."""
HARDLY_OWN = 0.01
"""Part of an input's movement that is its own, below which what it does is not told from what others do."""
ENOUGH = 0.98
"""The same from which no curve is looked for in the state."""
LONGER = 0.1
"""Share of the output that an equation must explain, beyond what the response does, to be told to last longer."""
FEWEST_LEFT = 8
"""A stretch of the output with no more samples says nothing of what a response leaves."""
SLOWER, FEWEST_BLOCKS = (4, 16, 64, 256), 200
"""How many times slower a record with a longer response is looked at, and how many samples that must leave."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    """Experiments for one mapping.

    Args:
        traces: The experiments.
        mapping: Inputs and output.
        others: Experiments of the same data set that are not looked at.
    """

    traces: tuple[Trace, ...]
    mapping: Mapping
    others: tuple[Trace, ...] = ()

    @property
    def sample_time(self) -> float:
        """Seconds."""
        return self.traces[0].sample_time

    def time_of(self, trace: str, sample: float) -> float:
        """When a sample is, in seconds of the record's own time, in which ``start``, ``stop`` and masks are written."""
        start = next(one.start_time for one in self.traces if one.name == trace)
        return start + sample * self.sample_time

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """Inputs that change within a stretch."""
        found = []
        for j, name in enumerate(self.mapping.inputs):
            if any(np.ptp(segment.inputs[:, j]) > 0.0 for segment in self.segments):
                found.append(name)
        return tuple(found)

    @cached_property
    def shared(self) -> frozenset[str]:
        """Inputs that move as others do, so that nobody can tell what each of them brings."""
        if len(self.moving) < 2:
            return frozenset()
        inputs = np.concatenate([segment.inputs for segment in self.some.segments])
        others = [np.delete(inputs, j, axis=1) for j in range(inputs.shape[1])]
        each = zip(self.moving, inputs.T, others, strict=True)
        return frozenset(name for name, own, rest in each if own_part(own, rest) < HARDLY_OWN)

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """All stretches of samples that count."""
        return segments_of(self.traces, self.mapping)

    @cached_property
    def runs(self) -> tuple[Segment, ...]:
        """All stretches whose inputs are known: where the output alone is missing they go on."""
        return segments_of(self.traces, self.mapping, of_inputs=True)

    @cached_property
    def some(self) -> Record:
        """As much of it as dynamics are judged by, with the inputs that move."""
        if self.moving == self.mapping.inputs and sum(map(len, self.traces)) <= SEEN:
            return self
        left, kept = SEEN, []
        for trace in self.traces:
            if left > 0:
                kept.append(_head(trace, left))
                left -= len(kept[-1])
        return Record(traces=tuple(kept), mapping=Mapping(inputs=self.moving, output=self.mapping.output))

    def values(self, channel: str) -> list[NDArray[np.float64]]:
        """A channel, stretch by stretch."""
        if channel == self.mapping.output:
            return [segment.output for segment in self.segments]
        j = self.mapping.inputs.index(channel)
        return [segment.inputs[:, j] for segment in self.segments]

    @cached_property
    def feedback(self) -> Feedback | str:
        """Whether the output acts on the inputs that move, or why that cannot be said."""
        return find_feedback(self.some.segments) if self.moving else "no input moves"

    @cached_property
    def impulse(self) -> ImpulseResponse | str:
        """Its impulse response, or why there is none."""
        if not self.moving:
            return "no input moves"
        if all(np.ptp(y) == 0.0 for y in self.values(self.mapping.output)):
            return "the output never changes"
        if self.some is not self:
            return self.some.impulse
        longest = min(LONGEST_RESPONSE, max(LEAST_LAGS, LAGS_IN_ALL // len(self.moving)))
        try:
            return remembered_response(self.traces, self.mapping, longest=longest)
        except UserError as error:
            return error.what

    @cached_property
    def equation(self) -> Equation | None:
        """The ARX model of least BIC of the inputs that move; ``None`` where they are not seen to act."""
        if self.some is not self:
            return self.some.equation
        impulse = self.impulse
        dead = () if isinstance(impulse, str) else impulse.dead_times
        if self.mapping.inputs and (isinstance(impulse, str) or not _seen(impulse)):
            return None
        at_once = not isinstance(self.feedback, str) and self.feedback.at_once
        return least_bic(self.traces, self.mapping, [one.best for one in dead], at_once=at_once)

    @property
    def runs_away(self) -> bool:
        """Whether the plant by itself does, so that something holds it."""
        found = self.impulse
        if not self.moving or isinstance(found, str) or found.explained > 1.0 - LONGER:
            return False  # the search for an equation takes its time
        return self.equation is not None and self.equation.grows

    @property
    def lasts(self) -> bool:
        """Whether a linear model explains much that a response over some lags does not: what rings, or is slow."""
        found = self.slowed[0].impulse
        if isinstance(found, str) or found.explained > 1.0 - LONGER or self.equation is None or self.runs_away:
            return False
        return self.equation.explained > max(found.explained, 0.0) + LONGER

    @cached_property
    def response(self) -> FrequencyResponse | str:
        """The frequency response at the rate at which the impulse response settles, or why there is none."""
        slow = self.slowed[0].some
        try:
            return estimate_frequency_response(slow.traces, slow.mapping)
        except UserError as error:
            return error.what

    @cached_property
    def slowed(self) -> tuple[Record, int]:
        """The record at a rate at which its response settles within the lags that are looked at, and how much slower.

        Means over blocks of samples; as it is where it settles, or where no rate helps. Where none is slow enough, the
        one at which most is explained.
        """
        found = self.impulse
        if isinstance(found, str) or (found.settled and _seen(found)):
            return self.some, 1
        seen, most, explained = _seen(found), (self.some, 1), found.explained
        for factor in SLOWER:
            slow = _blocks_of(self.traces, factor, self.mapping.output)
            if sum(map(len, slow)) < FEWEST_BLOCKS:
                break
            other = Record(traces=slow, mapping=self.some.mapping)
            slowly = other.impulse
            if isinstance(slowly, str) or not (seen or _seen(slowly)):
                continue
            if slowly.settled:
                # What is fast is gone from means over blocks: they are no view of a record that lives of it.
                return (other, factor) if slowly.explained > found.explained - 0.02 else most
            # Sampled so fast that a sample brings less than its noise, an input hardly seems to act.
            if slowly.explained > explained + LONGER:
                most, explained = (other, factor), slowly.explained
        return most

    @cached_property
    def integrates(self) -> bool:
        """Whether the plant adds up what its inputs bring; see :mod:`sysid.advice.integrators`."""
        found = self.impulse
        if isinstance(found, str) or (found.settled and not self.lasts):
            return False
        factor = -(-sum(map(len, self.some.traces)) // SAMPLES)
        return integrates(_blocks_of(self.some.traces, factor, self.mapping.output), self.some.mapping)

    @property
    def explained(self) -> float:
        """Share of the output that a linear model explains, by its response or by an equation with past outputs."""
        found = self.slowed[0].impulse
        of_equation = self.equation.explained if self.lasts and self.equation is not None else 0.0
        return max(0.0 if isinstance(found, str) else found.explained, of_equation)

    @cached_property
    def state_curve(self) -> StateCurve | None:
        """The curve in the state, where there is one and a linear model leaves something to explain."""
        response = self.some.impulse
        if isinstance(response, str) or self.runs_away or self.explained > ENOUGH:
            return None
        found = curve_of_state(self.some.segments, response)
        return found if found is not None and found.sure else None

    @cached_property
    def residuals(self) -> list[Residual]:
        """What the impulse response leaves at the rate at which it settles, where it has a past to know it by.

        Of each stretch of the output; the inputs are known before it, too, where the output alone is missing.
        """
        record, factor = self.slowed
        found = record.impulse
        if isinstance(found, str):
            return []
        deepest = int(found.lags[-1])
        made = []
        for run in record.some.runs:
            if len(run) <= deepest + FEWEST_LEFT:
                continue
            simulated = found.simulate(run.inputs)
            for part in stretches(run.counts()[deepest:]):
                # From as many samples before it as the response is long.
                whole, a = slice(part.start, part.stop + deepest), part.start + deepest
                if part.stop - part.start > FEWEST_LEFT:
                    segment = Segment(
                        inputs=run.inputs[whole],
                        output=run.output[whole],
                        trace=run.trace,
                        first=run.first + part.start,
                    )
                    made.append(
                        Residual(
                            segment=segment,
                            simulated=simulated[a : part.stop + deepest],
                            left=(run.output - simulated)[a : part.stop + deepest],
                            first=(run.first + a) * factor,
                        )
                    )
        return made


def _seen(found: ImpulseResponse) -> bool:
    """Whether any input is seen to act, or all of them do together."""
    return any(one.acts for one in found.dead_times) or found.explained > BARELY


@dataclass(frozen=True, kw_only=True, eq=False)
class Residual:
    """What a response leaves of a stretch.

    Args:
        segment: The stretch.
        simulated: Response to the inputs, without the samples whose past is not known, shape ``(n,)``.
        left: What it leaves of the output, its level among it, shape ``(n,)``.
        first: The first of them in its trace, in samples of the trace.
    """

    segment: Segment
    simulated: NDArray[np.float64]
    left: NDArray[np.float64]
    first: int


def _blocks_of(traces: Sequence[Trace], factor: int, output: str) -> tuple[Trace, ...]:
    """Means over blocks of the samples that count: at least half of an output's, and all of an input's.

    Traces of less than two blocks are left out.
    """
    slow = []
    for trace in traces:
        n = len(trace) // factor
        if n < 2:
            continue
        whole = slice(0, n * factor)
        usable = np.ones(trace.values.shape, dtype=np.bool_) & (True if trace.usable is None else _by_channel(trace))
        usable &= True if trace.weights is None else (trace.weights > 0.0)[:, None]
        blocks, counts = (x[whole].reshape(n, factor, -1) for x in (trace.values, usable))
        count = counts.sum(axis=1)
        least = np.where([name == output for name in trace.channel_names], factor / 2, factor)
        of_counted = np.where(counts, blocks, 0.0).sum(axis=1) / np.maximum(count, 1)
        mean = np.where(count >= least, of_counted, blocks.mean(axis=1))
        slow.append(
            Trace(
                name=trace.name,
                sample_time=trace.sample_time * factor,
                channels=trace.channels,
                values=mean,
                start_time=trace.start_time,
                usable=count >= least,
            )
        )
    return tuple(slow)


def _by_channel(trace: Trace) -> NDArray[np.bool_]:
    assert trace.usable is not None  # noqa: S101 - asked before
    return trace.usable if trace.usable.ndim == 2 else trace.usable[:, None]


def _head(trace: Trace, count: int) -> Trace:
    if len(trace) <= count:
        return trace
    return replace(
        trace,
        values=trace.values[:count],
        usable=None if trace.usable is None else trace.usable[:count],
        weights=None if trace.weights is None else trace.weights[:count],
    )


def stacked(parts: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Stretches one after the other, for statistics that look at one sample at a time."""
    return np.concatenate(parts) if parts else np.empty(0)
