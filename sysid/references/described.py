"""What an FMU's model description proposes: ports, ranges, sample time and duration; and what it does not say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ConfigError, did_you_mean
from sysid.references.fmu import read_fmu
from sysid.references.fmu_variables import INTEGERS, declared_unit

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
    """

    ranges: Mapping[str, tuple[float, float]]
    parameters: Mapping[str, tuple[float, float]]
    outputs: Sequence[str] = ()
    sample_time: float | None = None
    duration: float | None = None


def proposed(path: Path, wish: Wish) -> tuple[dict[str, Any], float, list[str]]:
    """A reference as its description proposes it.

    Args:
        path: The FMU.
        wish: What is said beside it.

    Returns:
        Fields of a :class:`~sysid.references.config.ReferenceConfig`, seconds of an experiment, and what was taken
        from where, in words.

    Raises:
        ConfigError: If something is neither described nor said; the remedy is the options that say it.
    """
    described = read_fmu(path)
    variables = {one.name: one for one in described.modelVariables}
    missing = [name for name in (*wish.ranges, *wish.parameters, *wish.outputs) if name not in variables]
    if missing:
        raise ConfigError(
            f"the FMU has no variable {missing[0]}", where=path, expected=f"one of {', '.join(list(variables)[:40])}",
            got=missing[0], remedy=did_you_mean(missing[0], variables, "correct the name"),
        )  # fmt: skip
    notes: list[str] = []
    inputs = {one.name: _input(one, wish, notes) for one in variables.values() if one.causality == "input"}
    unknown = [name for name, port in inputs.items() if "range" not in port]
    sample_time, duration = _times(described, wish, notes)
    asked = [f"--range {name}=LOW:HIGH" for name in unknown]
    asked += [] if sample_time else ["--sample-time SECONDS"]
    asked += [] if duration else ["--duration SECONDS"]
    outputs = list(wish.outputs) or [one.name for one in variables.values() if one.causality == "output"]
    asked += [] if outputs else ["--output NAME"]
    asked += [] if inputs or wish.parameters else ["--parameter NAME=LOW:HIGH"]
    if asked:
        raise ConfigError(
            "the model description does not say all that an experiment needs", where=path,
            expected="ranges of inputs (min and max), an input or a parameter that varies, sample time and duration",
            got=f"nothing for {', '.join(one.split()[-1].partition('=')[0] for one in asked)}",
            remedy=f"say it: {' '.join(asked)}",
        )  # fmt: skip
    fields = {
        "fmu": str(path.resolve()),
        "sample_time": sample_time,
        "inputs": inputs,
        "parameters": dict(_parameter(variables[n], r, {*inputs, *outputs}) for n, r in wish.parameters.items()),
        "outputs": {name: {"unit": _unit(variables[name])} for name in outputs},
    }
    return {key: value for key, value in fields.items() if value}, float(duration or 0.0), notes


def _parameter(variable: Any, span: tuple[float, float], ports: set[str]) -> tuple[str, dict[str, Any]]:
    """The name of a parameter, and its fields; of a variable that is an output, it is the start value."""
    fields: dict[str, Any] = {"unit": _unit(variable), "range": list(span), **_levels(variable, *span)}
    if variable.name not in ports:
        return variable.name, fields
    return f"{variable.name}_start", {**fields, "variable": variable.name}


def _input(variable: Any, wish: Wish, notes: list[str]) -> dict[str, Any]:
    low, high, start = (_number(getattr(variable, one)) for one in ("min", "max", "start"))
    found: dict[str, Any] = {"unit": _unit(variable)}
    if variable.name in wish.ranges:
        found["range"] = list(wish.ranges[variable.name])
    elif low is not None and high is not None and low < high and max(abs(low), abs(high)) < 1e30:
        found["range"] = [low, high]
        notes.append(f"{variable.name}: {low:g} to {high:g}, as the model description has min and max")
    elif str(variable.type) == "Boolean":
        found["range"] = [0.0, 1.0]
        notes.append(f"{variable.name}: 0 and 1, as it is a truth value")
    if "range" in found:
        low, high = found["range"]
        if start is not None and low <= start <= high:
            found["start"] = start
        found |= _levels(variable, low, high)
    return found


def _levels(variable: Any, low: float, high: float) -> dict[str, list[float]]:
    """The values of what is a whole number or a truth value; nothing of any other."""
    if str(variable.type) not in {*INTEGERS, "Boolean"}:
        return {}
    return {"levels": [float(k) for k in range(int(np.ceil(low)), min(int(high), int(low) + 200) + 1)]}


def _times(described: Any, wish: Wish, notes: list[str]) -> tuple[float | None, float | None]:
    default = described.defaultExperiment
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
        value = float(str(text))
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def _unit(variable: Any) -> str:
    return declared_unit(variable) or "1"
