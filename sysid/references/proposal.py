"""What experiments on a reference need: as it describes itself, as a table says, and as is said beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from sysid.errors import ConfigError
from sysid.references.config import with_range
from sysid.references.described import Wish, described
from sysid.references.sources import Source

AS = {
    "--range": "reference: {{inputs: {{{name}: {{unit: V, range: [LOW, HIGH]}}}}}}",
    "--parameter": "reference: {{parameters: {{{name}: {{range: [LOW, HIGH]}}}}}}",
    "--output": "reference: {{outputs: {{{name}: {{unit: V}}}}}}",
    "--sample-time": "reference: {{sample_time: SECONDS}}",
    "--duration": "experiment: {{duration: SECONDS}}",
}
"""The field that an option stands for."""


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """What is proposed.

    Args:
        content: Fields of a pipeline of kind ``experiment``, but for its name, its runs and its workers where nobody
            has said them.
        notes: What was taken from where, in words.
    """

    content: Mapping[str, Any]
    notes: tuple[str, ...]


def proposed(source: Source, wish: Wish) -> Proposal:
    """Put together what is said of a reference.

    Args:
        source: The reference.
        wish: What is said beside it, by options.

    Returns:
        A pipeline's fields.

    Raises:
        ConfigError: If something is said twice, or nobody says it; the remedy is what says it.
    """
    told, experiment = _ranged(source.reference), dict(source.content.get("experiment") or {})
    _check_said_once(source, wish, experiment)
    duration, notes = experiment.get("duration", wish.duration), list[str]()
    if source.fmu is None:
        own = _as_said(wish)
    else:
        own, duration, notes = described(source.fmu, _with_table(wish, told, duration))
    reference = _over(own, told)
    _check_whole(source, reference, duration)
    content = {**source.content, "kind": "experiment", "reference": {k: v for k, v in reference.items() if v}}
    content["experiment"] = {**experiment, "duration": duration}
    return Proposal(content=content, notes=tuple(notes))


def _ranged(reference: Mapping[str, Any]) -> dict[str, Any]:
    """What a table says of a reference, with the ranges that follow from levels."""
    groups = {name: reference[name] for name in ("inputs", "parameters") if isinstance(reference.get(name), Mapping)}
    return {**reference, **{name: {k: with_range(p) for k, p in ports.items()} for name, ports in groups.items()}}


def _port(name: str, wish: Wish, **more: Any) -> dict[str, Any]:
    return {**wish.units.get(name, {}), **more}


def _as_said(wish: Wish) -> dict[str, Any]:
    """Ports and times of what does not describe itself."""
    return {
        "sample_time": wish.sample_time,
        "inputs": {name: _port(name, wish, range=list(span)) for name, span in wish.ranges.items()},
        "parameters": {name: _port(name, wish, range=list(span)) for name, span in wish.parameters.items()},
        "outputs": {name: _port(name, wish) for name in wish.outputs},
    }


def _with_table(wish: Wish, told: Mapping[str, Any], duration: float | None) -> Wish:
    """What is said of an FMU by options and by a table, as one."""

    def spans(group: str) -> dict[str, tuple[float, float]]:
        ports = told.get(group) or {}
        return {k: tuple(p["range"]) for k, p in ports.items() if "range" in p and "variable" not in p}

    return replace(
        wish, ranges={**spans("inputs"), **wish.ranges}, parameters={**spans("parameters"), **wish.parameters},
        outputs=tuple(wish.outputs) or tuple(told.get("outputs") or ()), duration=duration,
        sample_time=told.get("sample_time", wish.sample_time),
    )  # fmt: skip


def _over(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Fields of one over those of another, table by table."""
    found = dict(below)
    for name, value in above.items():
        both = isinstance(value, Mapping) and isinstance(found.get(name), Mapping)
        found[name] = _over(found[name], value) if both else value
    return found


def _check_said_once(source: Source, wish: Wish, experiment: Mapping[str, Any]) -> None:
    """Refuse what stands in a table and is typed beside it: which of the two is meant, nobody knows."""
    told = source.reference
    twice = [f"--range {name}" for name in wish.ranges if "range" in ((told.get("inputs") or {}).get(name) or {})]
    twice += [f"--parameter {name}" for name in wish.parameters if name in (told.get("parameters") or {})]
    twice += ["--output"] if wish.outputs and told.get("outputs") else []
    twice += ["--sample-time"] if wish.sample_time and "sample_time" in told else []
    twice += ["--duration"] if wish.duration and "duration" in experiment else []
    if twice:
        raise ConfigError(
            f"{', '.join(twice)} stands in the file too", where=source.file, expected="each said once",
            got="an option, and a field of the file", remedy="leave the option out, or the field",
        )  # fmt: skip


def _check_whole(source: Source, reference: Mapping[str, Any], duration: float | None) -> None:
    """Refuse what nobody says, all at once, with what would say it."""
    inputs, parameters = reference.get("inputs") or {}, reference.get("parameters") or {}
    asked = [("--range", name) for name, port in inputs.items() if "range" not in (port or {})]
    asked += [("--parameter", name) for name, port in parameters.items() if "range" not in (port or {})]
    nothing = "--parameter" if source.fmu is not None else "--range"
    asked += [] if inputs or parameters else [(nothing, "NAME")]
    asked += [] if reference.get("outputs") else [("--output", "NAME")]
    asked += [] if reference.get("sample_time") else [("--sample-time", "")]
    asked += [] if duration else [("--duration", "")]
    if not asked:
        return
    if source.table is None:
        values = {"--output": "{name}", "--sample-time": "SECONDS", "--duration": "SECONDS"}
        said = " ".join(f"{flag} {values.get(flag, '{name}=LOW:HIGH').format(name=name)}" for flag, name in asked)
        remedy = f"say it: {said}"
    else:
        lines = "; ".join(AS[flag].format(name=name) for flag, name in asked)
        remedy = f"write in {source.table.name}: {lines}"
    what = "the model description" if source.fmu is not None else source.text
    raise ConfigError(
        f"{what} does not say all that an experiment needs", where=source.file,
        expected="ranges of inputs, an input or a parameter that varies, outputs, sample time and duration",
        got=f"nothing for {', '.join(flag if name in {'', 'NAME'} else name for flag, name in asked)}", remedy=remedy,
    )  # fmt: skip
