"""The YAML of an assembly's members: those that are fitted, and those that are declared."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, cast

from pydantic import (
    BaseModel,
    Field,
    FiniteFloat,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_validator,
    model_validator,
)

from sysid.composite import FixedMember, Member
from sysid.errors import ConfigError
from sysid.estimation import StabilityOptions, Training
from sysid.field_checks import FieldError
from sysid.models import NARX
from sysid.workbench.fields import (
    SingleMappingField,
    StructureField,
    TrainingConfig,
    as_field_error,
    given_options,
    options_config,
)
from sysid.workbench.old_words import STRICT, Words

TablesField = dict[str, list[tuple[float, float]]]
"""Functions by their points."""

ParametersField = dict[str, float | dict[str, Any]]
"""What is estimated: by name a start, or ``{start:, low:, high:, prior:, fixed:, unit:}``."""


class StandingConfig(Words):
    """One member, or the same in several instances.

    Args:
        mapping: Inputs and output, such as ``BP+AR -> BC``; those of the first instance as they are.
        instances: Suffixes of the channel names, one for each instance: ``["", "10"]`` puts it at
            ``BP -> AR`` and ``BP10 -> AR10``.
        shared: Inputs that have the same name in every instance.
    """

    OLD: ClassVar[Mapping[str, str]] = {"places": "instances"}

    mapping: SingleMappingField
    instances: Annotated[tuple[str, ...], Field(min_length=1)] = ("",)
    shared: tuple[str, ...] = ()

    def standing(self) -> dict[str, Any]:
        """Where it stands, in the words of :class:`sysid.composite.Standing`."""
        return {"mapping": self.mapping, "instances": self.instances, "shared": self.shared}


class SweepSource(BaseModel):
    """A sweep whose best fits are candidates, as they are.

    Args:
        run: Its run folder, seen from the folder of the YAML.
        keep: So many of the fits that it trained to the end, the best by the figure that chose in it.
    """

    model_config = STRICT

    run: str
    keep: int = Field(default=10, ge=1)


class MemberConfig(StandingConfig):
    """One member, fitted on traces of all its instances.

    Args:
        structure: What is fitted, with its ``kind``.
        alternatives: Other structures that are fitted too, among which the whole chooses as well.
        training: How a network is trained.
        rest: The output at rest, in its unit.
        candidates: Fits of each structure from different seeds, among which the whole chooses; 0 for a sweep's alone.
        sweep: A sweep of this mapping, whose best fits the whole chooses among as well.
        traces: Estimation traces that it is fitted on, the first so many; all by default.
    """

    structure: StructureField
    alternatives: tuple[StructureField, ...] = ()
    training: TrainingConfig | None = None
    rest: FiniteFloat
    candidates: int = Field(default=1, ge=0)
    sweep: SweepSource | None = None
    traces: int | None = Field(default=None, ge=1)

    @field_validator("training", mode="wrap")
    @classmethod
    def _for_the_structure(cls, value: object, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        structure = info.data.get("structure")  # absent where it is wrong itself, which is told
        return handler(value) if structure is None else options_config(structure, value)

    @model_validator(mode="after")
    def _check(self) -> MemberConfig:
        try:
            self.member(seed=0)
        except ConfigError as error:
            raise as_field_error(error) from error
        if self.candidates == 0 and self.sweep is None:
            raise FieldError(
                f"{self.mapping} has no candidates",
                expected="candidates from 1 on, or a sweep to take them from",
                got="candidates: 0, and no sweep",
                remedy="name a sweep, or leave candidates out",
            )
        return self

    def member(self, seed: int, stability: StabilityOptions | None = None) -> Member:
        """The member, as it is trained.

        Args:
            seed: Of its first candidate, where its training names none.
            stability: How its free run is checked.

        Returns:
            The member.

        Raises:
            ConfigError: If it cannot be trained.
        """
        return Member(
            **self.standing(),
            structure=cast("NARX", self.structure),  # the member refuses any other kind
            alternatives=cast("tuple[NARX, ...]", self.alternatives),
            training=Training(**{"seed": seed, **(given_options(self.training) or {})}),
            rest=self.rest,
            candidates=self.candidates,
            traces=self.traces,
            stability=stability,
        )


class FixedConfig(StandingConfig):
    """A member that is declared and not fitted: an expression of its inputs, held between two bounds.

    Args:
        gains: The weight of each input, in the output's unit per the input's, or its weights by lag (``{0: 2, 1: -1}``
            looks one sample ahead); under the output's own name the weight of its last value: 1 sums up, more is a
            relay with hysteresis.
        equation: In the place of gains any expression of the inputs: ``max(BP, AR[k-1])*RL``.
        tables: By name the points ``[[x, y], ...]`` of functions that it calls.
        parameters: What of it is estimated: by name a start, or ``{start:, low:, high:, prior:, fixed:, unit:}``.
        constant: What is added, in the output's unit.
        low: Least value; none where it is left out.
        high: Greatest value; none where it is left out.
        rest: Value at rest.
        unit: Of the output; a pure number by default.
    """

    gains: dict[str, float | Annotated[dict[Annotated[int, Field(ge=0)], float], Field(min_length=1)]] = Field(
        default_factory=dict
    )
    equation: str = ""
    tables: TablesField = Field(default_factory=dict)
    parameters: ParametersField = Field(default_factory=dict)
    constant: float = 0.0
    low: float = -math.inf
    high: float = math.inf
    rest: FiniteFloat
    unit: str = "1"

    @model_validator(mode="after")
    def _check(self) -> FixedConfig:
        try:
            self.fixed()
        except ConfigError as error:
            raise as_field_error(error) from error
        return self

    def fixed(self) -> FixedMember:
        """The fixed submodel.

        Returns:
            It.

        Raises:
            ConfigError: If its gains or bounds cannot be.
        """
        return FixedMember(
            **self.standing(),
            gains=self.gains, equation=self.equation, tables=self.tables,
            parameters=self.parameters, constant=self.constant, low=self.low, high=self.high, rest=self.rest,
            unit=self.unit,
        )  # fmt: skip
