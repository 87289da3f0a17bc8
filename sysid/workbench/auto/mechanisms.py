"""What holds a motion or an input, or closes a loop, where records show it: equations that are tried first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from sysid.estimation import friction, loops, play
from sysid.models import Mapping, VectorGreyBox
from sysid.traces import Trace

RUBS = (
    "{output} stands while an input moves on, as what dry friction holds: equations of a motion with friction are "
    "tried first (docs/how/friction.md)"
)
"""What is said of an output that friction holds."""
PLAYS = (
    "{input} acts as through play of {width:.3g} to either side, as a stem that sticks: equations with it are tried "
    "first (docs/how/friction.md)"
)
"""What is said of an input with play."""
CLOSED = (
    "Most samples follow one linear law, and the others another: equations of {states} linear states that are closed "
    "by {element} come to {left:.2g} % of the outputs' ranges, and are tried first (docs/how/loops.md)"
)
"""What is said of a linear loop with one element that is not linear."""


@dataclass(frozen=True, kw_only=True)
class Mechanism:
    """What was found.

    Args:
        structures: Equations of it, the likeliest first.
        told: What it is, in words.
    """

    structures: tuple[VectorGreyBox, ...]
    told: str


def mechanism_of(traces: Sequence[Trace], mapping: Mapping) -> Mechanism | None:
    """Find what holds an output, or what an input moves, or what closes a loop.

    Args:
        traces: Records that begin at rest, at one place.
        mapping: What moves, and what answers.

    Returns:
        It; ``None`` where nothing is found.
    """
    return _found(tuple(traces), mapping)


@lru_cache(maxsize=2)
def _found(traces: tuple[Trace, ...], mapping: Mapping) -> Mechanism | None:
    """The same, once for who tells of it and for who searches."""
    if any(trace.usable is not None for trace in traces):
        return None
    records = [(trace.columns(mapping.inputs), trace.columns(mapping.outputs)) for trace in traces]
    rubs = friction.found_friction(records)
    if rubs is not None:
        told = RUBS.format(output=mapping.outputs[rubs.output])
        return Mechanism(structures=tuple(friction.grey_boxes_of(rubs, mapping)), told=told)
    closed = loops.found_loop(records)
    if closed is not None:
        told = CLOSED.format(states=closed.loop.states, element=closed.loop.element, left=100.0 * closed.left)
        return Mechanism(structures=(loops.grey_box_of(closed, mapping),), told=told)
    plays = play.found_play(records)
    if plays is None:
        return None
    told = PLAYS.format(input=mapping.inputs[plays.input], width=plays.width)
    return Mechanism(structures=tuple(play.grey_boxes_of(plays, records, mapping)), told=told)
