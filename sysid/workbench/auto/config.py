"""The YAML of a pipeline that finds its model by itself: data, mapping, and how much may be spent."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from sysid.field_checks import FieldError
from sysid.models import AbstractStructure
from sysid.workbench.auto.finish import drawn_in
from sysid.workbench.fits.shared_config import SharedConfig
from sysid.workbench.sweep.config import SweepConfig

MINUTES = 10.0
"""Spent where nothing is said."""


class AutoConfig(SharedConfig):
    """A search for a model; what others say as well stands in :class:`SharedConfig`.

    Where no traces are given that choose, parts of the estimation traces are held out.

    Args:
        kind: ``auto``.
        minutes: Wall time of all but loading: a look at the data, search, last fits, scores, export and report.
        iterations: In place of minutes: iterations of training, all starts together. The same search then comes to the
            same result on every machine.
        workers: Processes that train, one thread each; 1 trains in this process.
        tolerance: Share of each output's range: what chooses is first over how many traces the root mean square error
            of the free run stays within it, then the error; the error alone where none is given.
    """

    kind: Literal["auto"]
    minutes: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)
    iterations: int | None = Field(default=None, ge=1)
    workers: int = Field(default=2, ge=1)
    tolerance: float | None = Field(default=None, gt=0.0, lt=1.0)

    @model_validator(mode="after")
    def _one_budget(self) -> AutoConfig:
        if self.minutes is not None and self.iterations is not None:
            raise FieldError(
                "two budgets are given",
                expected="minutes or iterations",
                got=f"minutes: {self.minutes:g} and iterations: {self.iterations}",
                remedy="leave one of them out",
            )
        return self

    @property
    def wall_s(self) -> float | None:
        """Seconds of the search; ``None`` where iterations are counted."""
        return None if self.iterations is not None else 60.0 * (self.minutes or MINUTES)

    def sweep(self, structure: AbstractStructure) -> SweepConfig:
        """The sweep that does the trials.

        Args:
            structure: Any that is tried.

        Returns:
            Its configuration.
        """
        drawn = self.report.drawn or drawn_in(self.wall_s, len(self.mapping.outputs))
        given = {**self.shared, "report": self.report.model_copy(update={"drawn": drawn}), "workers": self.workers}
        return SweepConfig(kind="sweep", structure=(structure.to_dict(),), objectives=OBJECTIVES, **given)


OBJECTIVES = ("free_run_mse", "operations")
"""The front that is reported: accuracy against size. Run times are measured too; the search does not depend on them."""
