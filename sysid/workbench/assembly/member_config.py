"""The YAML of an assembly's members: those that are fitted, and those that are declared."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field, model_validator

from sysid.errors import ConfigError
from sysid.estimation import Training
from sysid.models import NARX, AbstractStructure
from sysid.workbench.fields import STRICT, MappingField, StructureField, TrainingConfig, as_field_error
from sysid.workbench.runner.naming import slug
from sysid.yaml_files import FieldError


class StandingConfig(BaseModel):
    """What stands in one place or in several.

    Args:
        mapping: Inputs and output, such as ``BP+AR -> BC``; in the first place as they are.
        places: Suffixes of the channel names, one for each place where it stands: ``["", "10"]`` puts it at
            ``BP -> AR`` and ``BP10 -> AR10``.
        shared: Inputs that have the same name in every place.
    """

    model_config = STRICT

    mapping: MappingField
    places: Annotated[tuple[str, ...], Field(min_length=1)] = ("",)
    shared: tuple[str, ...] = ()


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
    """One member, fitted on traces of all its places.

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
    rest: float
    candidates: int = Field(default=1, ge=0)
    sweep: SweepSource | None = None
    traces: int | None = Field(default=None, ge=1)

    @property
    def slug(self) -> str:
        """Name of its folder."""
        return slug(str(self.mapping))

    @model_validator(mode="after")
    def _check(self) -> MemberConfig:
        for structure in (self.structure, *self.alternatives):
            if not isinstance(structure, NARX):
                raise FieldError(
                    f"{self.mapping} is {structure.kind}",
                    expected="NARX; 0 neurons make it linear",
                    got=structure.kind,
                    remedy="write structure: {kind: NARX, ...}",
                )
            try:
                structure.lags(len(self.mapping.inputs))
                self.training_options(seed=0)
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

    @property
    def variants(self) -> tuple[MemberConfig, ...]:
        """The member with each of its structures alone."""
        structures = (self.structure, *self.alternatives)
        return tuple(self.of_structure(structure) for structure in structures)

    def of_structure(self, structure: AbstractStructure) -> MemberConfig:
        """The member with one structure and no other.

        Args:
            structure: The structure.

        Returns:
            The member.
        """
        return self.model_copy(update={"structure": structure, "alternatives": (), "sweep": None})

    def training_options(self, seed: int) -> Training:
        """The options of the training, with a seed where none is named.

        Args:
            seed: The seed.

        Returns:
            The options.
        """
        given = {} if self.training is None else {n: getattr(self.training, n) for n in self.training.model_fields_set}
        return Training(**{"seed": seed, **given})


class KnownConfig(StandingConfig):
    """A member that is declared and not fitted: a weighted sum of its inputs, held between two bounds.

    Args:
        gains: The weight of each input, in the output's unit per the input's, or its weights by lag (``{0: 2, 1: -1}``
            looks one sample ahead); under the output's own name the weight of its last value: 1 sums up, more is a
            relay with hysteresis.
        constant: What is added, in the output's unit.
        low: Least value.
        high: Greatest value.
        rest: Value at rest.
        unit: Of the output; a pure number by default.
    """

    gains: dict[str, float | Annotated[dict[Annotated[int, Field(ge=0)], float], Field(min_length=1)]]
    constant: float = 0.0
    low: float
    high: float
    rest: float
    unit: str = "1"

    @model_validator(mode="after")
    def _check(self) -> KnownConfig:
        if set(self.gains) - {self.mapping.output} != set(self.mapping.inputs):
            raise FieldError(
                f"the gains of {self.mapping} are not those of its inputs",
                expected=f"one for each of {', '.join(self.mapping.inputs)}, with or without {self.mapping.output}",
                got=", ".join(self.gains) or "none",
                remedy="correct the gains or the mapping",
            )
        own = self.gains.get(self.mapping.output, 0.0)
        if isinstance(own, dict):
            raise FieldError(
                f"{self.mapping.output} has weights by lag for its own past",
                expected="one number, the weight of its last value",
                got=", ".join(f"{lag}: {weight:g}" for lag, weight in own.items()),
                remedy="write the weight of its last value",
            )
        if not self.low <= self.rest <= self.high or self.low == self.high:
            raise FieldError(
                f"the bounds of {self.mapping.output} do not hold its rest",
                expected="low at most rest, rest at most high, low below high",
                got=f"low {self.low:g}, rest {self.rest:g}, high {self.high:g}",
                remedy="correct the bounds",
            )
        return self

    @property
    def weights(self) -> tuple[dict[int, float], ...]:
        """For each input its weights by lag."""
        given = (self.gains[name] for name in self.mapping.inputs)
        return tuple(one if isinstance(one, dict) else {0: one} for one in given)

    @property
    def memory(self) -> float:
        """The weight of its own last value."""
        own = self.gains.get(self.mapping.output, 0.0)
        return 0.0 if isinstance(own, dict) else own
