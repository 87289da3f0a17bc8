"""A sweep's YAML: ranges on the fields of structures and of the training, how they are gone through, what chooses."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, Field, field_validator, model_validator

from sysid.errors import ConfigError
from sysid.estimation import Training
from sysid.field_checks import FieldError
from sysid.reporting.sweep_record import FIGURES
from sysid.workbench.fields import as_field_error, with_short_kind
from sysid.workbench.fits.config import FitConfig, PipelineConfig
from sysid.workbench.fits.shared_config import SharedConfig
from sysid.workbench.old_words import STRICT, TRAINING, with_new_words
from sysid.workbench.sweep.search_space import Space, parse_space

WINNER = "sweep winner"
"""Name of the fit that the sweep hands to the pipeline."""


class ChooseConfig(BaseModel):
    """What chooses the winner, and who stays when trials are dropped.

    Args:
        by: A figure of merit.
        on: ``selection``: the traces that choose between fits; ``estimation``: those that are fitted; ``cases``: all
            cases of the data set, validation included, which a pipeline may do only if it reproduces a published
            sweep that did.
        tolerance: Share of each output's range: who stays within it (root mean square of the free run) over more
            selection traces comes first, then the figure decides; the figure alone where none is given.
    """

    model_config = STRICT

    by: str = "free_run_mse"
    on: Literal["selection", "estimation", "cases"] = "selection"
    tolerance: float | None = Field(default=None, gt=0.0, lt=1.0)

    @field_validator("by")
    @classmethod
    def _known(cls, by: str) -> str:
        return _figure(by)


class RungConfig(BaseModel):
    """A rung of successive halving: all trials that are still in, after which only some go on.

    Args:
        iterations: How far each is trained by then.
        record: Share of each estimation trace that it is trained on so far, from its beginning.
        keep: Share of the trials that goes on.
    """

    model_config = STRICT

    iterations: int = Field(ge=1)
    record: float = Field(default=1.0, gt=0.0, le=1.0)
    keep: float = Field(gt=0.0, lt=1.0)


class MethodConfig(BaseModel):
    """How the points are gone through.

    Args:
        name: ``grid``: every point once. ``random``: so many different points. ``tpe``: each batch where the figure
            that chooses promises most. ``nsga-ii``: generations towards the Pareto front of the objectives.
        trials: How many points; all of a grid.
        batch: Points that are asked for at once. The next batch knows the results of all before it, whatever the
            number of workers, so that a sweep does not depend on it.
    """

    model_config = STRICT

    name: Literal["grid", "random", "tpe", "nsga-ii"] = "grid"
    trials: int | None = Field(default=None, ge=1)
    batch: int = Field(default=20, ge=1)

    @model_validator(mode="after")
    def _counted(self) -> MethodConfig:
        if (self.name == "grid") != (self.trials is None):
            raise FieldError(
                f"the method {self.name} {'does not take' if self.name == 'grid' else 'needs'} a number of trials",
                expected="trials for random, tpe and nsga-ii; none for a grid, which takes every point",
                got=str(self.trials),
                remedy="write for example method: {name: tpe, trials: 100}, or method: grid",
            )
        return self


def _figure(name: str) -> str:
    if name not in FIGURES:
        raise as_field_error(ConfigError.unknown("unknown figure of merit", name, FIGURES, "choose one of these"))
    return name


def _named(value: object) -> object:
    return {"name": value} if isinstance(value, str) else value


def _as_list(value: object) -> object:
    return [value] if isinstance(value, dict) else value


class SweepConfig(SharedConfig):
    """A sweep; what others say as well stands in :class:`SharedConfig`.

    Of several outputs errors count over their variances. Each trial's own seed follows from the sweep's and from the
    trial's point. A network's free run is checked where it is one of the best, until one is stable, and of every trial
    that chooses among several starts.

    Args:
        kind: ``sweep``.
        structure: One structure or several, each with a range in any of its fields.
        training: How networks are trained, with a range in any field.
        method: How the points are gone through.
        objectives: Figures of merit whose Pareto front is shown, and sought by ``nsga-ii``.
        choose: What chooses the winner.
        pruning: Rungs of successive halving, at which trials are dropped; none for every trial in full.
        warm_start: ``none``: each network begins at random. ``linear``: at the open-loop linear fit over its delays,
            which all networks with these delays share. ``smaller``: at the next smaller network with the same delays.
        workers: Processes that train, one thread each.
        cluster: Address of a Dask scheduler, whose workers then train instead.
        storage: URL of a database that Optuna's own tools can read the trials from.
        beside: Structures, chosen by hand, that are trained like the trials and set beside the winner.
        reproduces: Which published sweep this one repeats to the letter, if it does.
    """

    kind: Literal["sweep"]
    structure: Annotated[
        tuple[Annotated[dict[str, Any], BeforeValidator(with_short_kind)], ...],
        BeforeValidator(_as_list, json_schema_input_type=dict[str, Any] | tuple[dict[str, Any], ...]),
    ] = Field(min_length=1)
    training: Annotated[dict[str, Any], BeforeValidator(lambda given: with_new_words(given, TRAINING))] = Field(
        default_factory=dict
    )
    method: Annotated[MethodConfig, BeforeValidator(_named, json_schema_input_type=str | MethodConfig)] = MethodConfig()
    objectives: tuple[str, ...] = Field(default=("free_run_mse", "run_time"), min_length=1)
    choose: ChooseConfig = ChooseConfig()
    pruning: tuple[RungConfig, ...] = ()
    warm_start: Literal["none", "linear", "smaller"] = "none"
    workers: int = Field(default=2, ge=1)
    cluster: str | None = None
    storage: str | None = None
    beside: tuple[Annotated[dict[str, Any], BeforeValidator(with_short_kind)], ...] = ()
    reproduces: str | None = None

    @field_validator("objectives")
    @classmethod
    def _known(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(_figure(name) for name in names)

    @model_validator(mode="after")
    def _check_choice(self) -> SweepConfig:
        if self.choose.on == "cases" and not self.reproduces:
            raise FieldError(
                "validation cases would choose the winner",
                expected="choose on selection or estimation; cases only where a published sweep is reproduced",
                got="choose: {on: cases} without reproduces",
                remedy="choose on selection, or say with reproduces: ... whose sweep this repeats",
            )
        if self.choose.tolerance is not None and self.choose.on != "selection":
            raise FieldError(
                "a tolerance counts selection traces", expected="choose: {on: selection}, or no tolerance",
                got=f"on: {self.choose.on}, tolerance: {self.choose.tolerance:g}", remedy="leave one of them out",
            )  # fmt: skip
        measured = [name for name in self._sought() if FIGURES[name].measured]
        if self.method.name in {"tpe", "nsga-ii"} and measured:
            raise FieldError(
                f"{', '.join(measured)} depends on the load of the machine, and so would every trial after the first",
                expected="figures that are the same wherever they are computed: operations instead of run_time",
                got=", ".join(self._sought()),
                remedy="write operations; the run time is measured and shown either way",
            )
        return self

    def _sought(self) -> tuple[str, ...]:
        return self.objectives if self.method.name == "nsga-ii" else (self.choose.by,)

    @model_validator(mode="after")
    def _check_rungs(self) -> SweepConfig:
        if not self.pruning:
            return self
        if self.method.name in {"tpe", "nsga-ii"}:
            raise FieldError(
                f"{self.method.name} cannot drop trials",
                expected="pruning with grid or random, whose trials are all known before the first",
                got=f"pruning with {self.method.name}",
                remedy="leave pruning out: this method spends few trials on poor points by itself",
            )
        steps = [rung.iterations for rung in self.pruning]
        full = int(self.training.get("max_iterations", Training().max_iterations))
        records = [rung.record for rung in self.pruning]
        if steps != sorted(set(steps)) or steps[-1] >= full or records != sorted(records):
            raise FieldError(
                "the rungs do not follow one another",
                expected=f"rising iterations below the {full} of the training, and records that do not shrink",
                got=f"iterations {steps}, records {records}",
                remedy="put them in order",
            )
        return self

    @model_validator(mode="after")
    def _check_space(self) -> SweepConfig:
        try:
            points = self.space().points()
            for number, structure in enumerate(self.beside):
                parse_space([structure], {}, len(self.mapping.inputs), where=f"beside {number + 1}").points()
            self.pipeline([FitConfig(name=WINNER, structure=points[0].structure)])
        except ConfigError as error:
            raise as_field_error(error) from error
        return self

    def space(self) -> Space:
        """Everything that can be tried.

        Raises:
            ConfigError: If a field or a range cannot be used.
        """
        return parse_space(self.structure, self.training, len(self.mapping.inputs))

    def pipeline(self, fits: list[FitConfig]) -> PipelineConfig:
        """The pipeline that does with some fits what is done with any.

        Args:
            fits: The fits.

        Returns:
            Its configuration.
        """
        export = None if self.export is None else self.export.model_copy(update={"fit": fits[0].name})
        return PipelineConfig(**{**self.shared, "export": export}, fits=tuple(fits))
