"""What holds a motion, or an input, where records show it: equations that are tried before networks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sysid.estimation import friction, play
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
    """Find what holds an output, or what an input moves.

    Args:
        traces: Records that begin at rest, at one place.
        mapping: What moves, and what answers.

    Returns:
        It; ``None`` where nothing is found.
    """
    if any(trace.usable is not None for trace in traces):
        return None
    records = [(trace.columns(mapping.inputs), trace.columns(mapping.outputs)) for trace in traces]
    rubs = friction.found_friction(records)
    if rubs is not None:
        told = RUBS.format(output=mapping.outputs[rubs.output])
        return Mechanism(structures=tuple(friction.grey_boxes_of(rubs, mapping)), told=told)
    plays = play.found_play(records)
    if plays is None:
        return None
    told = PLAYS.format(input=mapping.inputs[plays.input], width=plays.width)
    return Mechanism(structures=tuple(play.grey_boxes_of(plays, records, mapping)), told=told)
