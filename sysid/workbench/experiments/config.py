"""The YAML of a pipeline that asks a slow model for data."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field, model_validator

from sysid.field_checks import FieldError, FolderName
from sysid.references.config import ReferenceConfig
from sysid.references.design import Design
from sysid.workbench.fits.config import FitConfig
from sysid.workbench.old_words import STRICT


class GrowConfig(BaseModel):
    """How the experiments of a surrogate grow where it needs them: rounds of run, look, add, train on.

    Args:
        rounds: At most so many.
        candidates: New random experiments that a round looks at.
        keep: How many of them it adds to what is fitted.
        pick: ``worst``: the reference runs all candidates, and those at which the surrogate is worst are added;
            ``uncertain``: only those are run at which models of other starts differ most.
        until: Share of an output's range that the error is to stay under.
        quantile: Share of the selection runs that it has to stay under it for the growth to end.
        control: Whether as many experiments as they come are added to another model beside it.
    """

    model_config = STRICT

    rounds: int = Field(default=3, ge=1, le=100)
    candidates: int = Field(default=24, ge=1, le=100_000)
    keep: int = Field(default=6, ge=1)
    pick: Literal["worst", "uncertain"] = "worst"
    until: float = Field(default=0.01, gt=0.0, allow_inf_nan=False)
    quantile: float = Field(default=0.95, gt=0.0, le=1.0)
    control: bool = True

    @model_validator(mode="after")
    def _some_of_many(self) -> GrowConfig:
        if self.keep > self.candidates:
            raise FieldError(
                "more are kept than there are", expected=f"keep of at most {self.candidates}, the candidates",
                got=str(self.keep), remedy="keep fewer, or look at more candidates",
            )  # fmt: skip
        return self


class ExperimentConfig(BaseModel):
    """Experiments on a reference.

    Args:
        kind: ``experiment``.
        name: Name of the data set and of the run folder; letters, digits, dots, dashes and underscores.
        description: What it is for.
        reference: The slow model. **It is code, and is run**: an FMU holds a compiled library, a program is a program.
        experiment: What is run.
        workers: Processes that run it.
        grow: How ``sysid surrogate`` adds experiments where its model is worst; ``null`` adds none.
        fits: What ``sysid surrogate`` fits in place of a search, as in a pipeline of kind ``fits``: equations that are
            known, or a structure. The best of them on the selection runs is the surrogate.
    """

    model_config = STRICT

    kind: Literal["experiment"]
    name: FolderName
    description: str = ""
    reference: ReferenceConfig
    experiment: Design
    workers: int = Field(default=2, ge=1, le=256)
    grow: GrowConfig | None = None
    fits: tuple[FitConfig, ...] = ()

    @model_validator(mode="after")
    def _one_way(self) -> ExperimentConfig:
        if self.grow is not None and self.fits:
            raise FieldError(
                "experiments grow around what a search has chosen", expected="grow or fits", got="both",
                remedy="leave one of them out",
            )  # fmt: skip
        return self
