"""Such a map as equations of a grey box, which every export knows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from collections.abc import Mapping as Dict
from functools import partial

import numpy as np

from sysid.equations.system import written_name
from sysid.estimation.resets.reset_map import Array, Guard, ResetMap, Rest
from sysid.models import Mapping, VectorGreyBox
from sysid.models.blocks.curves import Text

DIGITS = 13
"""Of a number: what is behind them is rounding."""

Own = Callable[[str], str]
"""Gives a name that no channel has."""


def grey_box_of(found: ResetMap, mapping: Mapping, others: Dict[str, Array] | None = None) -> VectorGreyBox:
    """The equations, with the outputs of the sample before as states.

    Args:
        found: The map.
        mapping: Names of inputs and outputs, those of the map in its order.
        others: Outputs that the map does not have: what each is of its outputs and of 1, by name.

    Returns:
        The structure; nothing of it is left to estimate.
    """
    derived = others or {}
    own = Text(taken=frozenset(mapping.channels)).name
    names = [written_name(name) for name in mapping.outputs if name not in derived]
    inputs = list(map(written_name, mapping.inputs))
    inputs += [f"({'1' if above is None else inputs[above]}/{inputs[below]})" for above, below in found.ratios]
    before = [own(f"before_{k}") for k in range(len(names))]
    lines, now = list[str](), before
    for step in range(found.steps):
        last = step + 1 == found.steps
        after = names if last else [own(f"at_{step}_{k}") for k in range(len(names))]
        lines += _step(found, now, after, inputs, partial(_of_step, own, step))
        now = after
    lines += [f"{written_name(name)} = {_sum(row, [*names, ''])}" for name, row in derived.items()]
    lines += [f"{one}[k+1] = {name}" for one, name in zip(before, names, strict=True)]
    initial = {
        one: {"start": float(f"{value:.{DIGITS}g}"), "fixed": True}
        for one, value in zip(before, found.begin, strict=True)
    }
    return VectorGreyBox(equations="\n".join(lines), initial=initial)


def _of_step(own: Own, step: int, name: str) -> str:
    return own(f"{name}_{step}")


def _step(found: ResetMap, now: Sequence[str], after: Sequence[str], inputs: Sequence[str], own: Own) -> Iterator[str]:
    between = [own(f"on_{k}") for k in range(len(now))]
    if found.looks_first:
        yield from _looked(found, now, between, inputs, own)
        yield from _flown(found, between, after, inputs)
    else:
        yield from _flown(found, now, between, inputs)
        yield from _looked(found, between, after, inputs, own)


def _flown(found: ResetMap, now: Sequence[str], after: Sequence[str], inputs: Sequence[str]) -> Iterator[str]:
    for name, row in zip(after, found.flow, strict=True):
        yield f"{name} = {_sum(row, [*now, *inputs, ''])}"


def _looked(
    found: ResetMap, now: Sequence[str], after: Sequence[str], inputs: Sequence[str], own: Own
) -> Iterator[str]:
    value = list(now)
    for number, guard in reversed(list(enumerate(found.guards))):
        event = own(f"event_{number}")
        yield f"{event} = {_event(guard, now, inputs)}"
        set_to = [own(f"set_{number}_{k}") for k in range(len(now))]
        yield from _set(guard, now, inputs, set_to)
        value = [
            f"where({event}, {one}, {other})" for one, other in zip(_resting(found.rest, set_to), value, strict=True)
        ]
    for name, one in zip(after, value, strict=True):
        yield f"{name} = {one}"


def _event(guard: Guard, now: Sequence[str], inputs: Sequence[str]) -> str:
    said = f"{_sum(guard.row, [*now, *inputs])} {_side(guard.sign)} {_number(guard.level)}"
    armed = guard.armed
    return said if armed is None else f"{said} and {now[armed.output]} {_side(armed.sign)} {_number(armed.level)}"


def _side(sign: int) -> str:
    return "<=" if sign > 0 else ">="


def _set(guard: Guard, now: Sequence[str], inputs: Sequence[str], names: Sequence[str]) -> Iterator[str]:
    own = [*now, ""]
    terms = [*own, *(f"{one}*{other}" if one else other for other in inputs for one in own)]
    for name, column in zip(names, guard.reset.T, strict=True):
        yield f"{name} = {_sum(column, terms)}"


def _resting(rest: Rest | None, names: Sequence[str]) -> list[str]:
    if rest is None:
        return list(names)
    stands = f"abs({names[rest.output]}) < {_number(rest.below)}"
    return [f"where({stands}, {_number(value)}, {one})" for one, value in zip(names, rest.values, strict=True)]


def _sum(row: Array, terms: Sequence[str]) -> str:
    """A sum of those terms that are there; the last, or one without a name, is a number."""
    parts = []
    for value, term in zip(row, terms, strict=True):
        if value == 0.0:
            continue
        number = _number(float(value))
        factor = "" if number == "1" else "-" if number == "-1" else f"{number}*"
        parts.append(f"{factor}{term}" if term else number)
    return " + ".join(parts).replace("+ -", "- ") or "0"


def _number(value: float) -> str:
    """A number in as few digits as come to it.

    Example:
        >>> _number(0.010000000000000002), _number(-0.98), _number(2e-308)
        ('0.01', '-0.98', '2e-308')
    """
    return (
        np.format_float_positional(float(f"{value:.{DIGITS}g}"), trim="-")
        if 1e-4 <= abs(value) < 1e6
        else f"{value:.{DIGITS}g}"
    )
