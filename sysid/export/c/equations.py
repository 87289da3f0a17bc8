"""Equations as C: each program a function of straight lines; with tangents where the state at rest is searched for."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence, Set
from typing import Any

import numpy as np

from sysid.export.forms.layout import EquationState
from sysid.export.forms.operations import Points
from sysid.export.forms.programs import INPUT, STATE, VALUE, Listing, Place, ProgramForm, Read
from sysid.export.forms.stage import Stage
from sysid.export.templating import c_real
from sysid.kernels import register_machine as machine
from sysid.kernels.neurons import NEURONS

FAR = 1e300
"""A bound that is none."""


def equation_values(stage: Stage, number: int) -> dict[str, Any]:
    """What the template says of a stage that is equations.

    Args:
        stage: The stage.
        number: Its place among the stages.

    Returns:
        Values by name.
    """
    form, layout = stage.equations
    tables = _tables(form)
    stands = form.stands if form.searches else {}
    listings = form.run | stands
    names = {name: _names(listing, tables, number) for name, listing in listings.items()}
    tangents = {name: _tangents(listing, names[name]) for name, listing in stands.items()}
    used = {one.number for listing in listings.values() for one in listing.instructions}
    return {
        "kind": "equations",
        "short": True,
        "neurons": int(machine.TANH in used),
        "neuron": NEURONS["tanh"],
        "adds": form.n_continuous > 0,
        "n": form.n_state,
        "remembers": layout.size > 0,
        "n_c": form.n_continuous,
        "ahead": form.ahead,
        "n_given": max(1, len(form.given) + form.ahead),
        "states": form.states,
        "substeps": form.substeps,
        "stages": [(share * form.step, *others) for share, *others in form.stages],
        "given": [_sum_of(layout, parts) for parts in form.given],
        "held": [form.given[j][0][0] for j in range(len(form.given))],
        "tables": tables,
        "programs": {
            name: {"lines": _lines(listing, names[name]), "results": [_read(one) for one in listing.results]}
            for name, listing in form.run.items()
        },
        "tangents": tangents,
        "sloped": any("table_slope" in line for one in tangents.values() for line in one["lines"]),
        "uses": {name: _kinds(listing) for name, listing in form.run.items()},
        "searches": form.searches,
        "terms": _terms(form),
        "lines": [
            # Of what a later stage computes the newest sample is set behind the step; those before it move on here.
            {
                "first": line.first,
                "length": line.length,
                "newest": f"u{i}" if stage.sources[i] < stage.targets[0] else "",
            }
            for i, line in enumerate(layout.lines)
            if line.length
        ],
    }


def _sum_of(layout: EquationState, parts: Sequence[tuple[int, int, float]]) -> str:
    terms = []
    for channel, lag, weight in parts:
        sample = f"past[{layout.lines[channel].column(lag)}]" if lag else f"u{channel}"
        terms.append(sample if weight == 1.0 else f"R({c_real(weight)}) * {sample}")
    return " + ".join(terms)


def _terms(form: ProgramForm) -> Dict[str, Any]:
    """What is known of the states, for the search of the state at rest."""
    terms = form.lowered.terms
    if not form.searches:
        return {"level": [level or 0.0 for level in form.declared]}
    return {
        "level": terms.held(terms.level),
        "scale": terms.scale,
        "low": np.maximum(terms.low, -FAR),
        "high": np.minimum(terms.high, FAR),
        "free": np.flatnonzero(~terms.declared).tolist(),
        "output_scale": form.lowered.output_scale,
    }


def _tables(form: ProgramForm) -> dict[Points, int]:
    """Every table once, with its number."""
    found: dict[Points, int] = {}
    for listing in (*form.run.values(), *form.stands.values()):
        for one in listing.instructions:
            if one.points:
                found.setdefault(one.points, len(found))
    return found


def _kinds(listing: Listing) -> set[str]:
    """Whether a program reads states, and inputs."""
    every = [*(read for one in listing.instructions for read in one.reads), *listing.results]
    return {read.kind for read in every if isinstance(read, Place)} & {STATE, INPUT}


def _read(one: Read) -> str:
    if isinstance(one, float):
        return f"R({c_real(one)})"
    return f"{one.kind}{one.at}" if one.kind not in (STATE, INPUT) else f"{one.kind}[{one.at}]"


def _tangent(one: Read, still: Set[int]) -> str:
    """How a number moves; "" for one that does not."""
    if isinstance(one, float) or one.kind == INPUT:
        return ""
    if one.kind == STATE:
        return f"dx[{one.at}]"
    return "" if one.at in still else f"d{one.at}"


def _lines(listing: Listing, names: Sequence[Dict[str, str]]) -> list[str]:
    """The instructions, each a line."""
    return [
        f"const real v{at} = {one.operation.c.format(**own)};"
        for at, (one, own) in enumerate(zip(listing.instructions, names, strict=True))
    ]


def _names(listing: Listing, tables: Dict[Points, int], number: int) -> list[dict[str, str]]:
    """What each instruction reads, in C."""
    found = []
    for one in listing.instructions:
        reads = dict(zip("abc", map(_read, one.reads), strict=False))
        if one.points:
            reads["points"] = f"table{number}_{tables[one.points]}[0], {len(one.points)}"
        found.append(reads)
    return found


def _tangents(listing: Listing, names: Sequence[Dict[str, str]]) -> dict[str, list[str]]:
    """Lines with how each value moves behind it, where it moves and that is asked for; and how the results move."""
    still: set[int] = set()
    moves: dict[int, str] = {}
    for at, (one, own) in enumerate(zip(listing.instructions, names, strict=True)):
        parts = [
            f"{slope.format(**own, r=f'v{at}')} * {moved}"
            for slope, read in zip(one.operation.slopes, one.reads, strict=True)
            if slope and (moved := _tangent(read, still))
        ]
        if parts:
            moves[at] = " + ".join(parts)
        else:
            still.add(at)
    asked = {one.at for one in listing.results if isinstance(one, Place) and one.kind == VALUE} - still
    for at in reversed(range(len(listing.instructions))):
        if at in asked:
            one = listing.instructions[at]
            asked |= {
                read.at
                for slope, read in zip(one.operation.slopes, one.reads, strict=True)
                if slope and isinstance(read, Place) and read.kind == VALUE and read.at not in still
            }
    lines = []
    for at, line in enumerate(_lines(listing, names)):
        lines.append(line)
        if at in asked:
            lines.append(f"const real d{at} = {moves[at]};")
    return {
        "lines": lines,
        "results": [_read(one) for one in listing.results],
        "moves": [_tangent(one, still) for one in listing.results],
    }
