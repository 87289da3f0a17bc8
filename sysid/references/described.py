"""What an FMU's model description proposes: ports, ranges, sample time and duration; and what it does not say."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ConfigError, did_you_mean
from sysid.references.fmu import read_fmu
from sysid.references.fmu_variables import INTEGERS, declared_unit, is_number
from sysid.references.guessed import GUESS, guessed, named_values, range_told

OURS, DECLARED = "sysid-workbench ", re.compile(r"declared from (\S+) to (\S+)")
"""What the tool of an FMU is called that was exported here, and what such an FMU says of an input's range."""
TRUTH = {"false": "0", "true": "1"}
UNBOUNDED = 1e30
"""A min or max of this size is a tool's word for none."""
SAMPLES = 500
"""Of an experiment, where the description says how long one is and not how finely it is sampled."""


@dataclass(frozen=True, kw_only=True)
class Wish:
    """What is said beside the description.

    Args:
        ranges: Of inputs, by name.
        parameters: Ranges of the parameters that vary, by name.
        outputs: Names; all outputs by default.
        sample_time: Seconds.
        duration: Seconds.
        units: What is said of the unit of any of them, by name: the fields ``unit`` and ``reference`` of a port.
    """

    ranges: Mapping[str, tuple[float, float]]
    parameters: Mapping[str, tuple[float, float]]
    outputs: Sequence[str] = ()
    sample_time: float | None = None
    duration: float | None = None
    units: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


def described(path: Path, wish: Wish) -> tuple[dict[str, Any], float | None, list[str]]:
    """A reference as its description proposes it, with gaps where that says nothing.

    Args:
        path: The FMU.
        wish: What is said beside it.

    Returns:
        Fields of a :class:`~sysid.references.config.ReferenceConfig`, seconds of an experiment, and what was taken
        from where, in words.

    Raises:
        ConfigError: If it is no FMU that can be read, or has no such variable.
    """
    description = read_fmu(path)
    variables = {one.name: one for one in description.modelVariables}
    missing = [name for name in (*wish.ranges, *wish.parameters, *wish.outputs) if name not in variables]
    if missing:
        raise ConfigError(
            f"the FMU has no variable {missing[0]}", where=path, expected=f"one of {', '.join(list(variables)[:40])}",
            got=missing[0], remedy=did_you_mean(missing[0], variables, "correct the name"),
        )  # fmt: skip
    notes: list[str] = []
    ours = str(getattr(description, "generationTool", "")).startswith(OURS)
    ports = _numbers_of(variables.values(), wish, notes, ours=ours)
    inputs = {one.name: _input(one, wish, notes, ours=ours) for one in ports if _moves(one, wish)}
    _check_roles(path, wish, variables, inputs)
    sample_time, duration = _times(description, wish, notes)
    outputs = list(wish.outputs) or [one.name for one in ports if one.causality == "output"]
    for name, span in wish.parameters.items():
        _told_beyond(variables[name], span, notes)
    fields = {
        "fmu": str(path),
        "sample_time": sample_time,
        "inputs": inputs,
        "parameters": dict(_parameter(variables[n], r, wish, {*inputs, *outputs}) for n, r in wish.parameters.items()),
        "outputs": {name: {"unit": _unit(variables[name]), **wish.units.get(name, {})} for name in outputs},
    }
    return fields, duration, notes


def _numbers_of(variables: Iterable[Any], wish: Wish, notes: list[str], *, ours: bool) -> list[Any]:
    """The variables that are numbers; of inputs and outputs that are none it is told that nothing is done with them."""
    found = []
    for one in variables:
        if ours and one.causality == "output" and str(one.type) in INTEGERS and not wish.outputs:
            notes.append(f"{one.name}: left out, as it says how far the values of this surrogate may be trusted")
        elif is_number(one):
            found.append(one)
        elif one.causality in {"input", "output"}:
            notes.append(f"{one.name}: left out, as it is no number but {one.type}; an input stays at its start")
    return found


def _moves(variable: Any, wish: Wish) -> bool:
    """Whether experiments move a variable: an input, or a parameter of which it was said, where it may be."""
    return variable.causality == "input" or (variable.name in wish.ranges and variable.variability == "tunable")


def _check_roles(path: Path, wish: Wish, variables: Mapping[str, Any], inputs: Mapping[str, Any]) -> None:
    """Refuse what was said of a variable that is another thing, and would be passed over."""
    for name in wish.ranges:
        if name not in inputs:
            one = variables[name]
            numeric = is_number(one)
            raise ConfigError(
                f"{name} cannot be moved in a run", where=path, expected="--range of an input, or of what is tunable",
                got=f"{one.causality}, {one.variability}" if numeric else f"{one.type}",
                remedy=f"say --parameter {name}=LOW:HIGH, for a value that stays the same in each experiment"
                if numeric and one.causality == "parameter" else "leave its --range out",
            )  # fmt: skip
    for name in wish.parameters:
        if name in inputs:
            one = variables[name]
            raise ConfigError(
                f"{name} moves in a run", where=path, expected="--parameter of what stays the same in each experiment",
                got=f"{one.causality}, {one.variability}", remedy=f"say --range {name}=LOW:HIGH",
            )  # fmt: skip


def _parameter(variable: Any, span: tuple[float, float], wish: Wish, ports: set[str]) -> tuple[str, dict[str, Any]]:
    """The name of a parameter, and its fields; of a variable that is an output, it is the start value."""
    fields: dict[str, Any] = {"unit": _unit(variable), **wish.units.get(variable.name, {}), "range": list(span)}
    fields |= _levels(variable, *span)
    if variable.name not in ports:
        return variable.name, fields
    return f"{variable.name}_start", {**fields, "variable": variable.name}


def _input(variable: Any, wish: Wish, notes: list[str], *, ours: bool) -> dict[str, Any]:
    (low, high), start = _limits(variable), _number(variable.start)
    declared = DECLARED.fullmatch(variable.description or "") if ours else None
    found: dict[str, Any] = {"unit": _unit(variable), **wish.units.get(variable.name, {})}
    if variable.name in wish.ranges:
        found["range"] = list(wish.ranges[variable.name])
        _told_beyond(variable, wish.ranges[variable.name], notes)
    elif low is not None and high is not None and low < high:
        found["range"] = [low, high]
        notes.append(f"{variable.name}: {low:g} to {high:g}, as the model description has min and max")
    elif declared is not None:
        found["range"] = [float(declared[1]), float(declared[2])]
        notes.append(f"{range_told(variable.name, *found['range'])}, for which this surrogate is declared")
    elif str(variable.type) == "Boolean":
        found["range"] = [0.0, 1.0]
        notes.append(f"{variable.name}: 0 and 1, as it is a truth value")
    elif (guess := guessed(variable, low, high, start)) is not None:
        found["range"] = list(guess[:2])
        told = f"; --range {variable.name}=LOW:HIGH says it" if GUESS in guess[2] else ""
        notes.append(f"{range_told(variable.name, *guess[:2])} {guess[2]}{told}")
    if "range" in found:
        low, high = found["range"]
        if start is not None and low <= start <= high:
            found["start"] = start
        elif start is not None:
            notes.append(
                f"{variable.name}: its start of {start:g} is not within {low:g} to {high:g}; experiments begin in the "
                "middle, where the model may not be at rest: settling, or another start, are said in the pipeline"
            )
        found |= _levels(variable, low, high)
    return found


def _limits(variable: Any) -> tuple[float | None, float | None]:
    """Min and max, its own or of its type; what a tool writes for none is none."""
    kind = variable.declaredType
    own = {name: _number(getattr(variable, name)) for name in ("min", "max")}
    found = {name: _number(getattr(kind, name, None)) if x is None else x for name, x in own.items()}
    low, high = (None if x is None or abs(x) >= UNBOUNDED else x for x in found.values())
    return low, high


def _told_beyond(variable: Any, span: tuple[float, float], notes: list[str]) -> None:
    """Tell where values are asked for that the description does not allow."""
    low, high = _limits(variable)
    if (low is not None and span[0] < low) or (high is not None and span[1] > high):
        allowed = " to ".join("anything" if x is None else f"{x:g}" for x in (low, high))
        notes.append(
            f"{variable.name}: {span[0]:g} to {span[1]:g} was asked for; the model description allows {allowed}, and "
            "says nothing of what lies beyond"
        )


def _levels(variable: Any, low: float, high: float) -> dict[str, list[float]]:
    """The values of what is a whole number or a truth value; nothing of any other."""
    if str(variable.type) not in {*INTEGERS, "Boolean"}:
        return {}
    if named := [one for one in named_values(variable) if low <= one <= high]:
        return {"levels": named}
    return {"levels": [float(k) for k in range(int(np.ceil(low)), min(int(high), int(low) + 200) + 1)]}


def _times(description: Any, wish: Wish, notes: list[str]) -> tuple[float | None, float | None]:
    default = description.defaultExperiment
    told = {name: _number(getattr(default, name, None)) for name in ("startTime", "stopTime", "stepSize")}
    duration, sample_time = wish.duration, wish.sample_time
    if duration is None and told["stopTime"] is not None:
        duration = told["stopTime"] - (told["startTime"] or 0.0)
        notes.append(f"{duration:g} s an experiment, as the default experiment of the FMU")
    if sample_time is None and told["stepSize"] is not None:
        sample_time = told["stepSize"]
        notes.append(f"a sample every {sample_time:g} s, the step of the default experiment")
    elif sample_time is None and duration:
        sample_time = float(f"{duration / SAMPLES:.2g}")
        notes.append(f"a sample every {sample_time:g} s: {SAMPLES} an experiment, as the FMU says no step")
    return sample_time, duration


def _number(text: object) -> float | None:
    try:
        value = float(TRUTH.get(str(text).lower(), str(text)))
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def _unit(variable: Any) -> str:
    return declared_unit(variable) or "1"
