"""The YAML of a pipeline that finds its model by itself: data, mapping, and how much may be spent."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, Field, FiniteFloat, model_validator

from sysid.field_checks import FieldError, FolderName
from sysid.models import AbstractStructure, Start, StartKind
from sysid.workbench.auto.finish import drawn_in
from sysid.workbench.fields import MappingField, StartField
from sysid.workbench.fits.config import ExportConfig, ReportConfig
from sysid.workbench.old_words import STRICT
from sysid.workbench.stability import StabilityConfig
from sysid.workbench.sweep.config import SweepConfig

MINUTES = 10.0
"""Spent where nothing is said."""


class AutoConfig(BaseModel):
    """A search for a model.

    Args:
        kind: ``auto``.
        name: Name of the run folder; letters, digits, dots, dashes and underscores.
        description: What it is for.
        data: Name of a data set, path of its ``dataset.yaml``, or a file with traces.
        selection: Data set with traces that choose. Where there are none, parts of the estimation traces are held out;
            validation and test cases never choose.
        mapping: Inputs and outputs, such as ``u1+u2 -> y``.
        start: How each free run begins.
        rest: Value at rest of the output, by channel name, in its unit.
        seed: Seed of everything random.
        minutes: Wall time of all but loading: a look at the data, search, last fits, scores, export and report.
        iterations: In place of minutes: iterations of training, all starts together. The same search then comes to the
            same result on every machine.
        workers: Processes that train, one thread each; 1 trains in this process.
        tolerance: Share of each output's range: what chooses is first over how many traces the root mean square error
            of the free run stays within it, then the error; the error alone where none is given.
        stability: How a network's free run is checked.
        export: What leaves the workbench; ``null`` for nothing.
        report: What the report shows.
    """

    model_config = STRICT

    kind: Literal["auto"]
    name: FolderName
    description: str = ""
    data: str
    selection: str | None = None
    mapping: MappingField
    start: StartField = Start(kind=StartKind.ESTIMATED)
    rest: dict[str, FiniteFloat] = Field(default_factory=dict)
    seed: int = Field(default=0, ge=0)
    minutes: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)
    iterations: int | None = Field(default=None, ge=1)
    workers: int = Field(default=2, ge=1)
    tolerance: float | None = Field(default=None, gt=0.0, lt=1.0)
    stability: StabilityConfig = StabilityConfig()
    export: ExportConfig | None = ExportConfig()
    report: ReportConfig = ReportConfig()

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
        names = ("name", "description", "data", "selection", "mapping", "start", "rest", "seed", "workers")
        given: dict[str, Any] = {name: getattr(self, name) for name in (*names, "stability", "export")}
        drawn = self.report.drawn or drawn_in(self.wall_s, len(self.mapping.outputs))
        given["report"] = self.report.model_copy(update={"drawn": drawn})
        return SweepConfig(kind="sweep", structure=(structure.to_dict(),), objectives=OBJECTIVES, **given)


OBJECTIVES = ("free_run_mse", "operations")
"""The front that is reported: accuracy against size. Run times are measured too; the search does not depend on them."""
