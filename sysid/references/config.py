"""What a reference is, as it stands in YAML: what it is run by, its ports, its sample time and its limits."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from sysid.errors import UnitError
from sysid.field_checks import FieldError
from sysid.ingest.writers import TAKEN
from sysid.units import Reference, check_unit, is_pressure
from sysid.written_units import plain_unit

MOST_SAMPLES = 5_000_000
"""Of one run."""
PLACEHOLDER = re.compile(r"\{([^{}]*)\}")
"""In the command line of a program."""
FILES = ("inputs", "outputs")
"""What has to stand in it: the files that are passed."""


def _unit(text: str) -> str:
    try:
        # As the head of a column has it, where records are written: K for kelvin.
        return plain_unit(check_unit(text)) or text
    except UnitError as error:
        raise FieldError(
            error.what, expected=error.expected, got=error.got, remedy=error.remedy or "correct the unit"
        ) from None


def _range(pair: tuple[float, float]) -> tuple[float, float]:
    if not pair[0] < pair[1]:
        raise FieldError(
            "not a range", expected="two rising numbers, as [0, 10]", got=str(list(pair)), remedy="correct the range"
        )
    return pair


Unit = Annotated[str, AfterValidator(_unit)]
Span = Annotated[tuple[float, float], AfterValidator(_range)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Port(_Strict):
    """What goes in or comes out.

    Args:
        unit: Its unit.
        reference: Of a pressure, what it is measured from; ``none`` where the model does not say.
    """

    unit: Unit = "1"
    reference: Reference = Reference.NONE

    @model_validator(mode="after")
    def _pressure(self) -> Port:
        if self.reference is not Reference.NONE and not is_pressure(self.unit):
            raise FieldError(
                "only pressures are measured from something", expected="reference: none, or a unit of pressure",
                got=f"reference: {self.reference.value}, unit: {self.unit}",
                remedy="leave reference out, or correct unit",
            )  # fmt: skip
        return self


def with_range(port: Any) -> Any:
    """A port as it is written; where it has levels and no range, from the least level to the greatest.

    Args:
        port: Its fields.

    Returns:
        The same, with a range where one follows.
    """
    levels = port.get("levels") if isinstance(port, Mapping) and port.get("range") is None else None
    numbers = isinstance(levels, list | tuple) and all(isinstance(one, int | float) for one in levels)
    return {**port, "range": (min(levels), max(levels))} if levels and numbers else port


def _not_required(schema: dict[str, Any]) -> None:
    """Levels stand for a range, which no validator of a single field can say."""
    schema["required"] = [name for name in schema.get("required", []) if name != "range"]
    schema["anyOf"] = [{"required": ["range"]}, {"required": ["levels"]}]


class VariedPort(Port):
    """What experiments choose values of.

    Args:
        range: The values, never left; by default from the least level to the greatest.
        levels: The only ones that it may have, where it cannot have all in its range.
    """

    model_config = ConfigDict(json_schema_extra=_not_required)

    range: Span
    levels: tuple[float, ...] | None = None

    _ranged = model_validator(mode="before")(with_range)

    @model_validator(mode="after")
    def _within(self) -> VariedPort:
        low, high = self.range
        outside = [value for value in self._named if not low <= value <= high]
        if outside or self.levels == ():
            raise FieldError(
                "a level or the start is outside the range" if outside else "no level is allowed",
                expected=f"numbers from {low:g} to {high:g}", got=", ".join(f"{v:g}" for v in outside) or "none",
                remedy="correct levels, start or range",
            )  # fmt: skip
        return self

    @property
    def _named(self) -> tuple[float, ...]:
        """Values that are asked for by number."""
        return self.levels or ()

    def at_levels(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values as they may be.

        Args:
            x: Values, shape ``(n,)``.

        Returns:
            The nearest levels, where there are some.
        """
        if self.levels is None:
            return x
        levels = np.sort(np.array(self.levels))
        return np.asarray(levels[np.argmin(np.abs(x[:, np.newaxis] - levels), axis=1)], dtype=np.float64)


class InputPort(VariedPort):
    """An input that experiments move.

    Args:
        range: Levels, never left; by default from the least of those that are named to the greatest.
        rate: Largest change in a second, in its unit; ``None`` for steps.
        levels: The only levels that it may have, where it cannot have all in its range.
        start: Where every experiment begins; the middle of the range by default.
    """

    rate: Annotated[float, Field(gt=0.0)] | None = None
    start: float | None = None

    @property
    def _named(self) -> tuple[float, ...]:
        return (*(self.levels or ()), *(() if self.start is None else (self.start,)))

    @property
    def begin(self) -> float:
        """Where experiments begin: one of the levels where there are some."""
        wish = 0.5 * sum(self.range) if self.start is None else self.start
        return wish if self.levels is None else min(self.levels, key=lambda level: abs(level - wish))


class ParameterPort(VariedPort):
    """A parameter that differs from experiment to experiment; a constant input of the surrogate.

    Args:
        range: Its values.
        levels: The only ones that it may have.
        variable: Of an FMU, the variable that is set where it has another name: ``variable: x`` of a parameter
            ``x_start`` gives the start value of an output ``x``.
    """

    variable: str | None = None


class OutputPort(Port):
    """An output that the surrogate is to have."""


class ReferenceConfig(_Strict):
    """A slow model that can be run. One of ``fmu``, ``python`` and ``program`` says by what.

    Args:
        fmu: File of an FMU, version 2.0 or 3.0. **It is code**, and runs with your rights.
        interface: Which half of an FMU is run, where it has both.
        python: A function as ``package.module:function``, or ``file.py:function`` in ``folder``. It is called as
            ``function(time, inputs, parameters)``: times of the samples in seconds, shape ``(n,)``; inputs, shape
            ``(n, n_inputs)``; parameters by name. It gives the outputs, shape ``(n, n_outputs)``, each of the instant
            at which its inputs hold.
        program: A command line as a list; ``{inputs}`` and ``{outputs}`` in it stand for the files that are passed, and
            ``{name}`` for a parameter. No shell is in between.
        format: Of the files of a program.
        exit_codes: With which a program ends when all is well.
        files: Further files that a result depends on, such as the program's own input: a change of them runs anew.
        folder: Where modules are found and programs run, relative to the YAML; the YAML's folder by default.
        sample_time: Seconds between samples.
        inputs: By name.
        parameters: By name; those that vary.
        constants: Parameters that are set and do not vary, by name.
        outputs: By name.
        settling: Seconds that the reference is run at the start of its inputs before a record begins.
        time_limit: Seconds that one run may take.
        cost: Processor seconds that one run takes, where that is known before any is made.
    """

    fmu: str | None = None
    interface: Literal["co-simulation", "model-exchange"] | None = None
    python: Annotated[str, Field(pattern=r"^([A-Za-z_][\w.]*|.+\.py):[A-Za-z_]\w*$")] | None = None
    program: Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    format: Literal["csv", "parquet"] = "csv"
    exit_codes: Annotated[tuple[int, ...], Field(min_length=1)] = (0,)
    files: tuple[str, ...] = ()
    folder: str = "."
    sample_time: Annotated[float, Field(gt=0.0)]
    inputs: dict[str, InputPort] = Field(default_factory=dict)
    parameters: dict[str, ParameterPort] = Field(default_factory=dict)
    constants: dict[str, float] = Field(default_factory=dict)
    outputs: Annotated[dict[str, OutputPort], Field(min_length=1)]
    settling: Annotated[float, Field(ge=0.0)] = 0.0
    time_limit: Annotated[float, Field(gt=0.0)] = 60.0
    cost: Annotated[float, Field(gt=0.0)] | None = None

    @model_validator(mode="after")
    def _consistent(self) -> ReferenceConfig:
        named = [name for name in ("fmu", "python", "program") if getattr(self, name) is not None]
        if len(named) != 1:
            raise FieldError(
                "a reference is run by one thing", expected="one of fmu, python and program",
                got=" and ".join(named) or "none of them", remedy="name what is run, and nothing else",
            )  # fmt: skip
        names = [*self.inputs, *self.parameters, *self.constants, *self.outputs]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise FieldError(
                f"{twice[0]} is named twice", expected="a name for each port", got=", ".join(names),
                remedy="an input, a parameter, a constant or an output: say which it is",
            )  # fmt: skip
        taken = [name for name in names if name in TAKEN]
        if taken:
            raise FieldError(
                f"{taken[0]} is what records call their own", expected=f"another name than {' and '.join(TAKEN)}",
                got=taken[0], remedy="rename it in the reference, or leave it out",
            )  # fmt: skip
        renamed = [name for name, port in self.parameters.items() if port.variable is not None]
        if renamed and self.fmu is None:
            raise FieldError(
                f"{renamed[0]} names a variable", expected="variable of parameters of an FMU alone", got=self.kind,
                remedy="leave variable out: functions and programs get their parameters by name",
            )  # fmt: skip
        self._check_command()
        if not self.inputs and not self.parameters:
            raise FieldError(
                "nothing of the reference can be varied", expected="an input or a parameter", got="neither",
                remedy="name an input under inputs, or a parameter that varies under parameters, with its range",
            )  # fmt: skip
        return self

    def _check_command(self) -> None:
        """Refuse the command line of a program that passes no file, or names what is none of the parameters."""
        asked = {name for word in self.program or () for name in PLACEHOLDER.findall(word)}
        known = {*FILES, *self.parameters, *self.constants}
        if self.program is not None and (asked - known or set(FILES) - asked):
            raise FieldError(
                "the command of the program cannot be filled in",
                expected="{inputs} and {outputs}, and no other braces than of parameters and constants",
                got=" ".join(self.program),
                remedy="pass the two files, as in [solver, '{inputs}', '{outputs}'], and name what else stands in "
                "braces under parameters",
            )  # fmt: skip

    @property
    def kind(self) -> str:
        """By what it is run: ``fmu``, ``python`` or ``program``."""
        return next(name for name in ("fmu", "python", "program") if getattr(self, name) is not None)

    @property
    def variables(self) -> dict[str, str]:
        """The variables of an FMU that parameters set, by the names of these."""
        return {name: port.variable or name for name, port in self.parameters.items()}

    @property
    def begin(self) -> NDArray[np.float64]:
        """Where inputs begin, shape ``(n_inputs,)``."""
        return np.array([port.begin for port in self.inputs.values()])

    def at(self, folder: Path) -> ReferenceConfig:
        """The same with its folder and its FMU as whole paths.

        Args:
            folder: Of the YAML.

        Returns:
            It.
        """
        place = (Path(folder) / self.folder).resolve()
        fmu = None if self.fmu is None else str((place / self.fmu).resolve())
        return self.model_copy(update={"folder": str(place), "fmu": fmu})
