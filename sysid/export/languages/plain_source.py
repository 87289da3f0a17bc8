"""What templates of languages that are not C say of a surrogate: places, numbers and programs, in no language yet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from typing import Any

import numpy as np

from sysid.export.flags import Flag
from sysid.export.forms.layout import EquationState, HiddenState
from sysid.export.forms.operations import Operation, Points
from sysid.export.forms.programs import INPUT, STATE, Listing, ProgramForm, Read
from sysid.export.forms.stage import Level, Stage
from sysid.export.forms.state_space import StateSpaceForm
from sysid.export.surrogate import Surrogate


def plain_stage(stage: Stage) -> dict[str, Any]:
    """What every language says of a stage.

    Args:
        stage: The stage.

    Returns:
        Values by name; places count from 0.
    """
    form, n = stage.form, stage.form.n_inputs
    common = {
        "title": f"{stage.model.mapping}, {stage.model.label}",
        "first": stage.first,
        "size": stage.state.size,
        "form": form,
        "neuron": stage.neuron,
        "scaled": list(zip(stage.known_sources, form.offset, form.scale, strict=False)),
        "outputs": [_output(stage, j) for j in range(form.n_outputs)],
        "low": form.low if np.isfinite(form.low) else None,
        "high": form.high if np.isfinite(form.high) else None,
        "n": n,
        # each delay line: where it begins, its length, and what comes into it, an input or, behind them, an output
        "moves": [
            (stage.first + line.first, line.length, i) for i, line in enumerate(stage.state.lines) if line.length
        ],
    }
    if isinstance(form, ProgramForm):
        return common | {"kind": "equations"} | _equations(stage)
    if isinstance(form, StateSpaceForm):
        return common | {"kind": "space", "bound": form.bound if np.isfinite(form.bound) else None}
    _, layout = stage.lagged
    columns = [layout.column(channel, lag) for channel, own in enumerate(form.lags) for lag in own]
    return common | {"kind": "lagged", "columns": columns, "next": layout.next_columns().tolist()}


def _output(stage: Stage, j: int) -> dict[str, Any]:
    """An output of a stage; ``held`` is the flag of its limits, 0 where nobody is told."""
    form, ends, n = stage.form, stage.form.ends, stage.form.n_inputs
    flag = Flag.IN_DOUBT if stage.doubts[j] else Flag.AT_LIMIT
    return {
        "name": ends.outputs[j],
        "unit": ends.output_units[j],
        "target": stage.targets[j],
        "offset": form.offset[n + j],
        "scale": form.scale[n + j],
        "sides": stage.limits[j],
        "held": int(flag) if stage.told[j] else 0,
    }


def _equations(stage: Stage) -> dict[str, Any]:
    """Where the programs' inputs and the past samples of the next state come from in ``[inputs | state]``."""
    form, layout = stage.equations
    given = [
        [
            (form.n_inputs + layout.lines[channel].column(lag) if lag else channel, weight)
            for channel, lag, weight in parts
        ]
        for parts in form.given
    ]
    return {"given": given, "next": layout.next_columns().tolist()}


def program_lines(
    listing: Listing,
    text: Callable[[Operation], str],
    *,
    number: Callable[[float], str],
    first: int,
    points: Callable[[Points], str],
    functions: Dict[str, str] | None = None,
) -> tuple[list[tuple[str, str]], list[str]]:
    """A program in a language.

    Args:
        listing: The program.
        text: What the language makes of an operation.
        number: What it makes of a number.
        first: Where its arrays begin.
        points: What it makes of a table.
        functions: What functions that the texts name in braces are called.

    Returns:
        A name and an expression an instruction; and the results.
    """
    brackets = {0: "[{}]", 1: "({})"}[first]

    def read(one: Read) -> str:
        if isinstance(one, float):
            return number(one)
        at = brackets.format(one.at + first) if one.kind in (STATE, INPUT) else str(one.at)
        return f"{one.kind}{at}"

    lines = []
    for at, one in enumerate(listing.instructions):
        reads = dict(zip("abc", map(read, one.reads), strict=False))
        lines.append((f"v{at}", text(one.operation).format(**reads, points=points(one.points), **(functions or {}))))
    return lines, [read(one) for one in listing.results]


def tables(surrogate: Surrogate) -> dict[Points, int]:
    """Every table of a surrogate's equations once, with its number."""
    found: dict[Points, int] = {}
    for stage in surrogate.stages:
        for listing in stage.form.run.values() if isinstance(stage.form, ProgramForm) else ():
            for one in listing.instructions:
                if one.points:
                    found.setdefault(one.points, len(found))
    return found


def rest_values(surrogate: Surrogate) -> dict[str, Any]:
    """How a state at rest is found.

    Args:
        surrogate: What is written.

    Returns:
        ``levels``, of every channel a number or the place of the input whose first sample it is; ``lines``, each past
        sample's place, channel, offset and scale; ``spaces``; ``declared``, states of equations with a value; and
        ``searched``, states of equations that stand where nothing changes.
    """
    names = [port.name for port in surrogate.channels]
    lines = [(line.first, line.length, names.index(line.channel), line.offset, line.scale) for line in surrogate.lines]
    spaces, declared, searched = [], [], []
    for stage in surrogate.stages:
        form = stage.form
        if isinstance(stage.state, HiddenState) and isinstance(form, StateSpaceForm) and stage.state.size:
            places: Sequence[int] = (*stage.sources, *stage.targets)
            channels = [
                (source, offset, scale)
                for source, offset, scale, _ in zip(places, form.offset, form.scale, form.rest_channels, strict=False)
            ]
            bound = form.bound if np.isfinite(form.bound) else None
            spaces.append({"first": stage.first, "form": form, "channels": channels, "bound": bound})
        if isinstance(stage.state, EquationState) and isinstance(form, ProgramForm):
            known = [(stage.first + i, value) for i, value in enumerate(form.declared) if value is not None]
            declared += known
            searched += [name for name, value in zip(form.states, form.declared, strict=True) if value is None]
    return {
        "levels": [_level(surrogate, port.level) for port in surrogate.channels],
        "lines": [line for line in lines if line[1]],
        "spaces": spaces,
        "declared": declared,
        "searched": searched,
    }


def _level(surrogate: Surrogate, level: Level) -> dict[str, Any]:
    if isinstance(level, str):
        return {"input": [port.name for port in surrogate.inputs].index(level), "value": None}
    return {"input": None, "value": float(level)}
