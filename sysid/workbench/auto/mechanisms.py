"""What holds a motion, where records show it: equations with numbers to estimate, which are tried before networks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sysid.estimation.friction import found_friction, grey_boxes_of
from sysid.models import Mapping, VectorGreyBox
from sysid.traces import Trace

RUBS = (
    "{output} stands while an input moves on, as what dry friction holds: equations of a motion with friction are "
    "tried first (docs/how/friction.md)"
)
"""What is said of an output that friction holds."""


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
    """Find what holds an output.

    Args:
        traces: Records that begin at rest, at one place.
        mapping: What moves, and what answers.

    Returns:
        It; ``None`` where nothing is found.
    """
    if any(trace.usable is not None for trace in traces):
        return None
    friction = found_friction([(trace.columns(mapping.inputs), trace.columns(mapping.outputs)) for trace in traces])
    if friction is None:
        return None
    structures = tuple(grey_boxes_of(friction, mapping))
    return Mechanism(structures=structures, told=RUBS.format(output=mapping.outputs[friction.output]))
