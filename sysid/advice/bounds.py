"""How many outputs a search looks at: with many inputs a look at one takes longer than all trials of a short search."""

from __future__ import annotations

from sysid.models import Mapping

MOST_S, EACH_S = 20.0, 0.08
"""Processor seconds of all looks at most, and about those of a look at an output, times the square of its inputs (with
fourteen 15 s: most of it is the response to impulses of all inputs at once)."""


def looked_at(mapping: Mapping, share: float = 1.0) -> tuple[Mapping, ...]:
    """Those outputs, each with all inputs, that are looked at before anything is tried.

    Args:
        mapping: Inputs and outputs.
        share: Of what a look takes, where it is a shorter one.

    Returns:
        The first of its outputs, one at least; all where that is little work.

    Example:
        >>> many = Mapping(inputs=tuple(f"u{k}" for k in range(14)), outputs=tuple(f"y{k}" for k in range(13)))
        >>> len(looked_at(many)), len(looked_at(many, 0.2)), len(looked_at(Mapping.parse("u1+u2+u3 -> y1+y2")))
        (1, 6, 2)
    """
    each = max(share * EACH_S * len(mapping.inputs) ** 2, 1e-9)
    return mapping.each[: max(1, int(MOST_S / each))]
