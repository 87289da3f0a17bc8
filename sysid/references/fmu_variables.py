"""The variables of an FMU: their units and types, and what can be set, by whom and when."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ConfigError, UnitError
from sysid.references.config import ReferenceConfig, VariedPort
from sysid.units import check_unit
from sysid.written_units import plain_unit

TYPES: Mapping[str, Any] = {"Real": np.float64, "Float64": np.float64, "Float32": np.float32, "Boolean": np.bool_}
INTEGERS = ("Integer", "Enumeration", "Int8", "Int16", "Int32", "Int64", "UInt8", "UInt16", "UInt32", "UInt64")
SETTABLE, STARTS = ("parameter", "structuralParameter", "input"), ("exact", "approx")
"""Causalities, and kinds of start values, of what is as it is told before a run."""


def type_of(variable: Any) -> Any:
    """The type of a variable's numbers.

    Args:
        variable: As fmpy has it.

    Returns:
        A type of NumPy.
    """
    kind = str(variable.type)
    return np.int32 if kind in INTEGERS else TYPES.get(kind, np.float64)


def is_number(variable: Any) -> bool:
    """Whether a variable is a number, an integer or a truth value.

    Args:
        variable: As fmpy has it.

    Returns:
        Whether it is, and not text, bytes or a clock.
    """
    return str(variable.type) in {*TYPES, *INTEGERS}


def declared_unit(variable: Any) -> str | None:
    """The unit that the description gives a variable.

    Args:
        variable: As fmpy has it.

    Returns:
        It; ``None`` where there is none, or one that nobody here knows.
    """
    unit = variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None)
    try:
        return None if unit is None else plain_unit(check_unit(str(unit))) or str(unit)
    except UnitError:
        return None


def check_variables(config: ReferenceConfig, variables: Mapping[str, Any], path: Path) -> None:
    """Refuse what cannot be set, which an importer passes over, and numbers that would be set as others.

    Args:
        config: What is asked for; all of it is there.
        variables: Of the FMU, by name.
        path: The FMU, for errors.

    Raises:
        ConfigError: If something is.
    """

    def refused(name: str, what: str, expected: str, got: str, remedy: str) -> ConfigError:
        return ConfigError(f"{name} {what}", where=path, expected=expected, got=got, remedy=remedy)

    set_before = (*config.variables.values(), *config.constants)
    for name in (*config.inputs, *set_before, *config.outputs):
        if not is_number(variables[name]):
            kind = str(variables[name].type)
            raise refused(name, "is no number", "a number, an integer or a truth value", kind, "name another variable")
    for name in config.inputs:
        one = variables[name]
        if one.causality != "input" and one.variability != "tunable":
            raise refused(
                name, "cannot be moved in a run", "an input, or a parameter that is tunable",
                f"{one.causality}, {one.variability}", "name an input, or put it under parameters or outputs",
            )  # fmt: skip
    for name in set_before:
        one = variables[name]
        if one.causality not in SETTABLE and one.initial not in STARTS:
            raise refused(
                name, "cannot be set before a run", "a parameter, an input, or what has a start value of its own",
                f"{one.causality}, initial {one.initial}", "name the parameter that it follows from",
            )  # fmt: skip
    ports: dict[str, VariedPort] = {**config.inputs, **config.parameters}
    for name, port in ports.items():
        if type_of(variables[config.variables.get(name, name)]) not in {np.float64, np.float32} and not _whole(port):
            low, high = int(np.ceil(port.range[0])), int(np.floor(port.range[1]))
            some = ", ".join(map(str, range(low, min(high, low + 3) + 1))) + (", ..." if high > low + 3 else "")
            raise refused(
                name, "is a whole number or a truth value in the FMU", "levels that are, and no rate between them",
                "no levels" if port.levels is None else f"levels {list(port.levels)}",
                f"say which it may have, as levels: [{some}], and leave rate out",
            )  # fmt: skip


def _whole(port: VariedPort) -> bool:
    """Whether a port has whole numbers alone."""
    return port.levels is not None and all(x == round(x) for x in port.levels) and getattr(port, "rate", None) is None
