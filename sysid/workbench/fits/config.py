"""The pipeline's YAML: what is fitted to which data, how, and what comes out; every field checked by name."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    Field,
    FiniteFloat,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_validator,
    model_validator,
)

from sysid.content import content_folders, nearest_file, nearest_name, what_to_do_with_data
from sysid.errors import ConfigError, did_you_mean
from sysid.estimation.estimator import Options
from sysid.estimation.estimators import check as check_request
from sysid.estimation.estimators import estimator_of
from sysid.field_checks import FieldError, FolderName, check
from sysid.models import Start, StartKind
from sysid.names import slug
from sysid.workbench.annotation import AnnotateConfig
from sysid.workbench.fields import (
    FormatField,
    MappingField,
    OptionsConfig,
    StartField,
    StructureField,
    as_field_error,
    given_options,
    options_config,
)
from sysid.workbench.fits.orders import OrdersConfig
from sysid.workbench.old_words import STRICT
from sysid.workbench.stability import StabilityConfig
from sysid.yaml_files import parse_yaml, read_yaml


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


class ExportConfig(BaseModel):
    """What leaves the workbench.

    Args:
        fit: Name of a fit, or ``best``: least free-run error on the selection traces.
        formats: File formats; by default ONNX and C, as far as they can be written here.
        tolerance: Largest difference allowed between a file and its model, in the output's unit; by default 1e-9 of the
            largest value that each output has over the cases.
        run_times: Whether every file is timed beside the model's own free run; some seconds a format.
        case: Of parameters that differ by case, the case whose values the files have; by default they are inputs.
        unstable: Whether a fit whose free run is unstable (status ``UNSTABLE``) may leave. Without, ``best`` is the
            best of the others, and nothing is exported where there is none.
    """

    model_config = STRICT

    fit: str = "best"
    formats: tuple[FormatField, ...] | None = None
    tolerance: float | None = Field(default=None, gt=0.0)
    run_times: bool = False
    case: str | None = None
    unstable: bool = True


class ReportConfig(BaseModel):
    """What the report shows beside our own figures.

    Args:
        published: Name of a table of published figures.
        drawn: Cases of each fit that are drawn at most, the worst of those that were not fitted first; 12 by default,
            and fewer where a search has little time.
    """

    model_config = STRICT

    published: str | None = None
    drawn: int | None = Field(default=None, ge=1)


def _as_list(value: object) -> object:
    return [value] if isinstance(value, str) else value


class PipelineConfig(BaseModel):
    """A pipeline.

    Args:
        kind: ``fits``; other kinds of pipelines are in :mod:`sysid.workbench.kinds`.
        name: Name of the run folder; letters, digits, dots, dashes and underscores.
        description: What it is for.
        data: Name of a data set, or path of its ``dataset.yaml``.
        selection: Data set with traces that choose between fits; validation cases never do.
        mapping: Inputs and outputs, such as ``BP+AR -> BC`` or ``STP -> BP+AR``.
        start: How each free run begins.
        rest: Value at rest of the output, by channel name, in its unit.
        seed: Seed of everything random.
        fits: What is fitted, in order.
        tolerance: Share of each output's range: the best fit is first that whose free run stays within it (root mean
            square) over most selection traces, then that of the least error; the error alone where none is given.
        export: What leaves the workbench; ``null`` for nothing.
        report: What the report shows.
        stability: Over which sequences a network's free run has to stay bounded and to settle.
        orders: A search over the orders of ARX models for the report; ``null`` for none.
        annotate: Who says in which state each sample is, for errors by state and weights.
    """

    model_config = STRICT

    kind: Literal["fits"] = "fits"
    name: FolderName
    description: str = ""
    data: str
    selection: str | None = None
    mapping: MappingField
    start: StartField = Start(kind=StartKind.ESTIMATED)
    rest: dict[str, FiniteFloat] = Field(default_factory=dict)
    seed: int = Field(default=0, ge=0)
    fits: Annotated[tuple[FitConfig, ...], BeforeValidator(_as_list)] = Field(min_length=1)
    tolerance: float | None = Field(default=None, gt=0.0, lt=1.0)
    export: ExportConfig | None = ExportConfig()
    report: ReportConfig = ReportConfig()
    stability: StabilityConfig = StabilityConfig()
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
        outputs = self.mapping.outputs
        strangers = sorted(set(self.rest) - set(outputs))
        if strangers:
            raise FieldError(
                f"rest names {', '.join(strangers)}, which is not {'the' if len(outputs) == 1 else 'an'} output",
                expected=", ".join(outputs),
                got=", ".join(strangers),
                remedy=f"write rest: {{{outputs[0]}: 0}}; inputs rest at their first sample",
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
        structures = {fit.name: fit.structure for fit in self.fits}
        for fit in self.fits:
            initial = None if fit.initial is None else structures[fit.initial]
            try:
                structure = fit.structure.for_outputs(len(self.mapping.outputs))
                check_request(structure, self.mapping, initial=initial)
            except ConfigError as error:
                raise as_field_error(error, f"the fit {fit.name!r}") from error
        return self

    @property
    def rest_output(self) -> float | dict[str, float] | None:
        """The output's declared value at rest, ``None`` where none is declared; of several outputs those, by name."""
        return self.rest.get(self.mapping.output) if len(self.mapping.outputs) == 1 else dict(self.rest)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Pipeline:
    """A pipeline and where it was read from.

    Args:
        config: The checked fields.
        text: The YAML as written.
        path: Its file.
    """

    config: PipelineConfig
    text: str
    path: Path


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


def read_pipeline(path: Path) -> Pipeline:
    """Read and check a pipeline.

    Args:
        path: Its YAML file.

    Returns:
        The pipeline.

    Raises:
        ConfigError: Naming the file, the field and what is wrong with it.
    """
    config = check(PipelineConfig, read_yaml(path), where=path)
    return Pipeline(config=config, text=path.read_text(encoding="utf-8-sig"), path=path.resolve())


def parse_pipeline(text: str, *, where: object = "text") -> PipelineConfig:
    """Check a pipeline that is not in a file.

    Args:
        text: The YAML.
        where: Named in errors.

    Returns:
        The checked fields.

    Raises:
        ConfigError: Naming the field and what is wrong with it.

    Example:
        >>> text = '''
        ... name: first
        ... data: tank
        ... mapping: pump -> level
        ... fits: [{name: ARX, structure: {kind: ARX, na: 1, nb: [1], nk: [1]}}]
        ... '''
        >>> parse_pipeline(text).fits[0].structure.label
        'ARX [1; 1; 1]'
    """
    return check(PipelineConfig, parse_yaml(text, where=where), where=where)
