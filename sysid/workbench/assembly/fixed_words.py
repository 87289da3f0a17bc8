"""``fixed`` as equations: an entry with ``equations`` stands for one fixed submodel an equation, in plain words.

Whoever extends a pipeline, and what a run stores, sees the submodels one by one, as if each were written as weights.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Annotated, Any

from pydantic import BaseModel, Field, FiniteFloat

from sysid.composite import FixedMember, equation_of, fixed_by_equations
from sysid.errors import ConfigError
from sysid.field_checks import Loc, Origins, check
from sysid.workbench.assembly.member_config import ParametersField, TablesField
from sysid.workbench.old_words import STRICT
from sysid.yaml_files import yaml_text


class FixedEquations(BaseModel):
    """Members that are declared and not fitted, by equations: expressions of channels, held between two bounds.

    Args:
        equations: One a line: ``y = clamp(2*u - x[k-1], -5, 5)``, ``y = switch(u - 3)`` between 0 and 1,
            ``y = relay(u - x, on=2, off=1, slope=20)``, or any expression of channels now and whole samples ago.
            ``#`` begins a remark.
        instances: Suffixes of the channel names, one for each instance of each of them.
        shared: Inputs that have the same name in every instance.
        rest: Values at rest: one for all, or by output; 0 where none is given.
        unit: Units: one for all but switches and relays, or by output; a pure number where none is given.
        tables: By name the points ``[[x, y], ...]`` of functions that equations call.
        parameters: What is estimated: by name a start, or ``{start:, low:, high:, prior:, fixed:, unit:}``. One that
            several entries, or limits, name is declared alike in each entry, and is one.
    """

    model_config = STRICT

    equations: str
    instances: Annotated[tuple[str, ...], Field(min_length=1)] = ("",)
    shared: tuple[str, ...] = ()
    rest: FiniteFloat | dict[str, FiniteFloat] = 0.0
    unit: str | dict[str, str] = "1"
    tables: TablesField = Field(default_factory=dict)
    parameters: ParametersField = Field(default_factory=dict)


def one_by_one(entries: Sequence[Any], origins: Origins) -> list[tuple[Any, Loc]]:
    """The entries of ``fixed``, those with equations as one an equation.

    Args:
        entries: As they are written.
        origins: Where they stand.

    Returns:
        Each entry in plain words, and the location of the one that it was written as.

    Raises:
        ConfigError: If the fields of one with equations, or its equations, cannot be used.
    """
    found: list[tuple[Any, Loc]] = []
    for at, entry in enumerate(entries):
        loc: Loc = ("fixed", at)
        written = isinstance(entry, Mapping) and "equations" in entry
        found += [(one, loc) for one in (_members(entry, loc, origins) if written else [entry])]
    return found


def _members(entry: Mapping[str, Any], loc: Loc, origins: Origins) -> list[dict[str, Any]]:
    parts: dict[Loc, tuple[Origins, Loc]] = {
        (name,): (origins, (*loc, name)) for name in {*entry, *FixedEquations.model_fields}
    }
    asked = check(FixedEquations, entry, where=Origins(file=origins.file, parts=parts))
    try:
        members = fixed_by_equations(
            asked.equations, rest=asked.rest, unit=asked.unit, instances=asked.instances, shared=asked.shared,
            tables=asked.tables, parameters=asked.parameters,
        )  # fmt: skip
    except ConfigError as error:
        place = origins.place((*loc, "equations"))
        raise ConfigError(
            error.what,
            where=f"{place}: {error.where}" if error.where else place,
            expected=error.expected,
            got=error.got,
            remedy=error.remedy,
        ) from None
    return [_plain_words(one) for one in members]


def _plain_words(fixed: FixedMember) -> dict[str, Any]:
    """A fixed submodel in the words of one entry, as :class:`FixedConfig` reads it; what is usual is left out."""
    words = {
        "mapping": str(fixed.mapping),
        "gains": {name: dict(one) if isinstance(one, Mapping) else one for name, one in fixed.gains.items()},
        "equation": fixed.equation,
        "tables": _points(fixed),
        "parameters": _parameters(fixed),
        "constant": fixed.constant,
        "low": fixed.low,
        "high": fixed.high,
        "rest": fixed.rest,
        "unit": fixed.unit,
        "instances": list(fixed.instances),
        "shared": list(fixed.shared),
    }
    usual = {
        "gains": {}, "equation": "", "tables": {}, "parameters": {}, "constant": 0.0, "unit": "1", "instances": [""],
        "shared": [],
    }  # fmt: skip
    return {name: value for name, value in words.items() if name not in usual or value != usual[name]}


def _points(fixed: FixedMember) -> dict[str, list[list[float]]]:
    return {name: [list(point) for point in points] for name, points in fixed.points.items()}


def _parameters(fixed: FixedMember) -> dict[str, Any]:
    return {one.name: one.to_dict() for one in fixed.named}


def equations_text(members: Sequence[FixedMember]) -> str:
    """Fixed submodels as a pipeline has them in equations.

    Args:
        members: The submodels.

    Returns:
        YAML, ``fixed`` and its entries: neighbours with the same instances and unit are one.
    """
    lines = ["fixed:"]
    for _, neighbours in groupby(members, key=lambda one: (one.instances, one.shared)):
        group = list(neighbours)
        units = {one.output: one.unit for one in group if " = switch(" not in equation_of(one)}
        words = {
            "instances": list(group[0].instances),
            "shared": list(group[0].shared),
            "tables": {name: points for one in group for name, points in _points(one).items()},
            "parameters": {name: known for one in group for name, known in _parameters(one).items()},
            "unit": units if len(set(units.values())) > 1 else next(iter(units.values()), "1"),
            "rest": {
                one.output: int(one.rest) if float(one.rest).is_integer() else one.rest for one in group if one.rest
            },
        }
        usual: dict[str, Any] = {
            "instances": [""],
            "shared": [],
            "tables": {},
            "parameters": {},
            "unit": "1",
            "rest": {},
        }
        given = {name: value for name, value in words.items() if value != usual[name]}
        head = yaml_text({**given, "equations": []}).splitlines()[:-1]  # what holds a list is never put on one line
        entry = [*head, "equations: |", *(f"  {equation_of(one)}" for one in group)]
        lines += [f"  {'- ' if at == 0 else '  '}{line}" for at, line in enumerate(entry)]
    return "\n".join(lines) + "\n"


def fixed_schema(schema: dict[str, Any]) -> None:
    """Let editors know that an entry of ``fixed`` may be equations.

    Args:
        schema: The JSON schema of a pipeline; changed in place.
    """
    one = schema["properties"]["fixed"]
    one["items"] = {"anyOf": [one["items"], FixedEquations.model_json_schema()]}
