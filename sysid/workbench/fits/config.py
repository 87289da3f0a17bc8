"""The pipeline's YAML: what is fitted to which data, how, and what comes out; every field checked by name."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    Field,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_validator,
    model_validator,
)

from sysid.content import content_folders, nearest_file, nearest_name, what_to_do_with_data
from sysid.errors import ConfigError, did_you_mean
from sysid.estimation.estimator import Options
from sysid.estimation.estimators import estimator_of
from sysid.estimation.fitting import check as check_request
from sysid.field_checks import FieldError
from sysid.models import AbstractStructure
from sysid.names import slug
from sysid.workbench.annotation import AnnotateConfig
from sysid.workbench.fields import (
    OptionsConfig,
    StructureField,
    as_field_error,
    given_options,
    options_config,
)
from sysid.workbench.fits.orders import OrdersConfig
from sysid.workbench.fits.shared_config import SharedConfig
from sysid.workbench.old_words import STRICT
from sysid.workbench.written import Written


class FitConfig(BaseModel):
    """One fit.

    Args:
        name: Name in tables, different for each fit.
        structure: What is fitted, with its ``kind``.
        training: Options of the structure's estimator; an ARX model has nothing to choose.
        initial: Name of an earlier fit to start from: of the same network, a smaller one, or an ARX model.
    """

    model_config = STRICT

    name: str = Field(min_length=1)
    structure: StructureField
    training: OptionsConfig | None = None
    initial: str | None = None

    @property
    def slug(self) -> str:
        """Name of the fit's folder."""
        return slug(self.name)

    @field_validator("training", mode="wrap")
    @classmethod
    def _for_the_structure(cls, value: object, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        structure = info.data.get("structure")  # absent where it is wrong itself, which is told
        return handler(value) if structure is None else options_config(structure, value)

    def training_options(self, seed: int) -> Options | None:
        """The options of the training, with the pipeline's seed where the fit names none.

        Args:
            seed: The pipeline's seed.

        Returns:
            The options; ``None`` for a structure that takes none.
        """
        return estimator_of(self.structure).options(given_options(self.training), seed=seed)


def _as_list(value: object) -> object:
    return [value] if isinstance(value, str) else value


class PipelineConfig(SharedConfig):
    """A pipeline; what others say as well stands in :class:`SharedConfig`.

    Args:
        kind: ``fits``; other kinds of pipelines are in :mod:`sysid.workbench.kinds`.
        fits: What is fitted, in order.
        tolerance: Share of each output's range: the best fit is first that whose free run stays within it (root mean
            square) over most selection traces, then that of the least error; the error alone where none is given.
        orders: A search over the orders of ARX models for the report; ``null`` for none.
        annotate: Who says in which state each sample is, for errors by state and weights.
    """

    kind: Literal["fits"] = "fits"
    fits: Annotated[tuple[FitConfig, ...], BeforeValidator(_as_list)] = Field(min_length=1)
    tolerance: float | None = Field(default=None, gt=0.0, lt=1.0)
    orders: OrdersConfig | None = None
    annotate: AnnotateConfig | None = None

    @field_validator("fits")
    @classmethod
    def _check_fits(cls, fits: tuple[FitConfig, ...]) -> tuple[FitConfig, ...]:
        earlier: dict[str, FitConfig] = {}
        slugs: set[str] = set()
        for fit in fits:
            if fit.slug in slugs or fit.name == "best":
                raise FieldError(
                    f"the name {fit.name!r} cannot be told from another",
                    expected="a different name for each fit, in letters and digits too, and not the word best",
                    got=", ".join(other.name for other in fits),
                    remedy="rename one of them",
                )
            if fit.initial is not None and fit.initial not in earlier:
                raise FieldError(
                    f"the fit {fit.name!r} starts from {fit.initial!r}, which is not an earlier fit",
                    expected=f"one of {', '.join(earlier)}" if earlier else "no initial fit for the first one",
                    got=fit.initial,
                    remedy=did_you_mean(fit.initial, earlier, "name a fit that stands above it"),
                )
            earlier[fit.name] = fit
            slugs.add(fit.slug)
        return fits

    @model_validator(mode="after")
    def _check_names(self) -> PipelineConfig:
        names = [fit.name for fit in self.fits]
        if self.export is not None and self.export.fit not in ["best", *names]:
            raise FieldError(
                f"export names the fit {self.export.fit!r}, which there is not",
                expected=f"best, or one of {', '.join(names)}",
                got=self.export.fit,
                remedy=did_you_mean(self.export.fit, names, "correct the name"),
            )
        return self

    @model_validator(mode="after")
    def _check_case(self) -> PipelineConfig:
        case = None if self.export is None else self.export.case
        asked = [fit for fit in self.fits if self.export and self.export.fit in {"best", fit.name}]
        for fit in asked if case is not None else ():
            if not fit.structure.names_records:
                raise FieldError(
                    f"export names the case {case!r}, and no parameter of {fit.name} differs by case",
                    expected="a fit of equations with a parameter that is per: case",
                    got=fit.structure.label,
                    remedy="remove case, or export such a fit",
                )
        return self

    @model_validator(mode="after")
    def _check_inputs(self) -> PipelineConfig:
        for fit in self.fits:
            try:
                initial = None if fit.initial is None else self.fitted_as(self._named(fit.initial))
                check_request(self.fitted_as(fit), self.mapping, initial=initial)
            except ConfigError as error:
                raise as_field_error(error, f"the fit {fit.name!r}") from error
        return self

    def fitted_as(self, fit: FitConfig) -> AbstractStructure:
        """The structure that is fitted: of several outputs the one that all share, where there is one.

        What begins with a fit that has a model an output is a model an output itself.

        Args:
            fit: One of the fits.

        Returns:
            The structure.
        """
        n = len(self.mapping.outputs)
        alone = fit.initial is not None and n > 1 and not self.fitted_as(self._named(fit.initial)).several_outputs
        return fit.structure if alone else fit.structure.for_outputs(n)

    def _named(self, name: str) -> FitConfig:
        return next(one for one in self.fits if one.name == name)

    @property
    def rest_output(self) -> float | dict[str, float] | None:
        """The output's declared value at rest, ``None`` where none is declared; of several outputs those, by name."""
        return self.rest.get(self.mapping.output) if len(self.mapping.outputs) == 1 else dict(self.rest)


Pipeline = Written[PipelineConfig]
"""A pipeline of fits and where it was read from."""


def find_pipeline(name_or_path: str) -> Path:
    """The file of a pipeline.

    Args:
        name_or_path: A built-in or workspace pipeline's name, in a folder as ``benchmarks/silverbox``; or a YAML file.

    Returns:
        The file.

    Raises:
        ConfigError: If there is none.
    """
    given, folders = Path(name_or_path), content_folders("pipelines")
    built_in = [folder / f"{name_or_path}.yaml" for folder in folders if not given.is_absolute()]
    if given.suffix in {".yaml", ".yml"} or len(given.parts) > 1:
        found = next((file for file in (given, *built_in) if file.is_file()), None)
        if found is not None:
            return found
        if (given / "results.json").is_file():
            raise ConfigError(
                "the folder of a run is no pipeline",
                expected="a pipeline's name, or the path of its YAML file",
                got=name_or_path,
                remedy=f"name the pipeline that was run, {given.name}, or its file",
            )
        beside = nearest_file(given, {".yaml", ".yml"})
        raise ConfigError(
            "there is no such pipeline file",
            expected="a YAML file",
            got=name_or_path,
            remedy=f"did you mean {beside}?" if beside else "check the path",
        )
    groups = [sorted(folder.glob("*.yaml")) for folder in folders]
    known: dict[str, Path] = {}  # one's own first
    for file in (file for group in groups for file in group):
        known.setdefault(file.stem, file)
    if name_or_path in known:
        return known[name_or_path]
    data_sets = content_folders("datasets")
    if any((folder / name_or_path / "dataset.yaml").is_file() for folder in data_sets):
        raise ConfigError(
            f"{name_or_path} is a data set and no pipeline",
            expected="a pipeline's name, or the path of its YAML file",
            got=name_or_path,
            remedy=what_to_do_with_data(name_or_path),
        )
    near = nearest_name(name_or_path, [[file.stem for file in group] for group in groups])
    raise ConfigError(
        f"there is no pipeline named {name_or_path}",
        expected=f"one of {', '.join(known)}, or the path of a YAML file" if known else "the path of a YAML",
        got=name_or_path,
        remedy=f"did you mean {near}?" if near else "make a workspace with one: sysid init DIR",
    )
