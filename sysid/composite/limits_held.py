"""Which limits hold the outputs in free run, and for how much of it: what a declared constraint does to the answer.

A limit that is hardly ever reached is a guard, one that holds an output for half of the time a part of the model. Which
of them act is said of the scored cases, and of the random sequences where there are such.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from sysid.models import Activity, Cascade
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True)
class Holding:
    """The limits of an output, and how often it is at them.

    Args:
        output: The output.
        unit: Its unit.
        low: Its lower limit, a value or a channel; ``None`` without one.
        high: Its upper limit, likewise.
        cases: Over the scored cases.
        sequences: Over the random sequences; ``None`` where there are none.
    """

    output: str
    unit: str
    low: float | str | None
    high: float | str | None
    cases: Activity
    sequences: Activity | None


def holding(
    whole: Cascade, outputs: Sequence[str], cases: Sequence[Trace], sequences: Sequence[Trace]
) -> list[Holding]:
    """Run a whole, and count.

    Args:
        whole: The whole.
        outputs: Outputs to tell of.
        cases: The scored cases.
        sequences: The random sequences; none is fine.

    Returns:
        Of each output that has a limit how often it is there; of a mean, each of its parts.
    """
    told = [name for out in outputs for name, limit in whole.limits.items() if limit.tells_of(name, out)]
    if not told:
        return []
    over_cases, over_sequences = _counted(whole, cases), _counted(whole, sequences)
    return [
        Holding(
            output=name,
            unit=whole.units[name],
            low=whole.limits[name].low,
            high=whole.limits[name].high,
            cases=over_cases[name],
            sequences=over_sequences.get(name),
        )
        for name in told
    ]


def _counted(whole: Cascade, traces: Sequence[Trace]) -> dict[str, Activity]:
    """How often each output is held, over all traces."""
    runs = [whole.simulate_trace(trace).activity for trace in traces]
    return {name: _sum(run[name] for run in runs) for name in whole.outputs} if runs else {}


def _sum(activities: Iterable[Activity]) -> Activity:
    found = list(activities)
    return Activity(
        low=sum(one.low for one in found),
        high=sum(one.high for one in found),
        lost=sum(one.lost for one in found),
        samples=sum(one.samples for one in found),
    )
