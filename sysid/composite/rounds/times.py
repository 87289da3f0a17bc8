"""How long rounds of training end to end will take, before there is a whole: timed with stand-ins for its members."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from sysid.composite.composite import Composite, Member
from sysid.composite.fixed_members import fixed_model
from sysid.composite.members import assembled
from sysid.composite.plan import RoundPlan
from sysid.composite.rounds.rehearsal import untaught
from sysid.composite.rounds.round import JointRound
from sysid.composite.stages import reading_more
from sysid.estimation.networks.together.leading_windows import possible_lengths
from sysid.estimation.networks.together.options import AUTO
from sysid.models import Cascade
from sysid.traces import Trace

SAMPLED = 2
"""Traces on which a round is timed; its work is proportional to the samples."""


@dataclass(frozen=True, kw_only=True)
class RoundTime:
    """How long a round takes.

    Args:
        iteration_s: Seconds of one iteration, on all of its samples.
        choosing_s: Seconds of one run over the traces that choose.
        iterations: At most so many.
        checkpoints: How often the traces that choose are run.
        limit_s: At most so many seconds of training.
        windows: Lengths of windows on which a second start may be trained: in each as many iterations again, and then
            as many over whole traces.
        asked: Whether it is trained wherever the first begins; else only where that is far off.
    """

    iteration_s: float
    choosing_s: float
    iterations: int
    checkpoints: int
    limit_s: float
    windows: int = 0
    asked: bool = False

    @property
    def seconds(self) -> float:
        """At most so long: a round that converges ends early. A second start counts where it was asked for."""
        second = self.windows + 1 if self.windows and self.asked else 0
        choosing = (self.checkpoints + 2) * self.choosing_s * (2 if second else 1)
        return min((1 + second) * self.iterations * self.iteration_s + choosing, self.limit_s)


def stand_in(composite: Composite, like: Trace) -> Cascade:
    """A whole of the right size, of members that know nothing.

    Args:
        composite: What is declared.
        like: A trace of the training data, for units and the sample time.

    Returns:
        The whole; it is good for nothing but being timed.
    """
    models = {one.output: untaught(_full_size(one), like) for one in composite.members}
    return assembled(composite, models | {one.output: fixed_model(one, like) for one in composite.fixed})


def _full_size(member: Member) -> Member:
    # An ensemble has the neurons of all that it unites.
    neurons = member.structure.neurons * member.training.ensemble
    return member.of_structure(replace(member.structure, neurons=neurons))


def time_round(
    composite: Composite, asked: RoundPlan, whole: Cascade, *, estimation: Sequence[Trace], selection: Sequence[Trace]
) -> tuple[RoundTime, Cascade]:
    """Time what a round does again and again.

    Args:
        composite: What is declared.
        asked: The round.
        whole: Where it starts, or a stand-in for it.
        estimation: Traces of the whole to fit, all that the round has.
        selection: Traces of the whole that choose.

    Returns:
        How long it takes, and the whole as the next round gets it.
    """
    used, some, few = estimation[: asked.traces], estimation[: asked.traces][:SAMPLED], selection[:SAMPLED]
    started = reading_more(whole, asked.reads)
    ready = JointRound.of(composite, asked, started, estimation=some, selection=few)
    provider = ready.training.provider(ready.part, ready.estimation, ready.targets, ready.trained)
    theta = provider.theta
    # A step is tried, and linearised where it is taken.
    step = _seconds(lambda: (provider.loss(theta), provider.linearise(theta)))
    choosing = _seconds(lambda: ready.error(ready.part))
    found = RoundTime(
        iteration_s=step * _samples(used) / _samples(some),
        choosing_s=choosing * _samples(selection) / _samples(few),
        iterations=ready.training.max_iterations,
        checkpoints=ready.training.checkpoints,
        limit_s=ready.training.max_time_s,
        windows=len(possible_lengths(ready.training.windows, provider)),
        asked=ready.training.windows != AUTO,
    )
    return found, started


def _seconds(run: Callable[[], object]) -> float:
    """Seconds of a run, the first of which may compile."""
    run()
    began = time.perf_counter()
    run()
    return time.perf_counter() - began


def _samples(traces: Sequence[Trace]) -> int:
    return sum(len(trace) for trace in traces)
