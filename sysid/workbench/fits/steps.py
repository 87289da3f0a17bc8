"""The steps of a pipeline: functions of (config, inputs) that give a result and touch no folder.

Each step has a ``*_key`` beside it: the digest of everything that its result depends on. The pipeline
stores results under their keys; a step does not know that.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sysid.advice import advise, looked_at
from sysid.code_digest import code_digest
from sysid.errors import ConfigError
from sysid.estimation import FitProgress, FitResult, fitting
from sysid.estimation.estimators import estimator_of
from sysid.estimation.grey_box.by_case import for_case
from sysid.estimation.results.tolerance import spans_of
from sysid.estimation.stability import StabilityOptions
from sysid.export.exporters import wanted_formats
from sysid.models import AbstractStructure, Cascade
from sysid.traces import Role
from sysid.validation import CascadeEvaluation, Evaluation, case_results, evaluate_outputs
from sysid.workbench.annotation import by_state, find_annotator
from sysid.workbench.fits.config import FitConfig, PipelineConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.runner.store import digest

if TYPE_CHECKING:
    from sysid.export import Bundle
    from sysid.export.run_times import RunTime

STORED_BY = "sysid.workbench.fits.record:write_fit"
CONFIGURATION = ("sysid.workbench.fits.config", "sysid.workbench.fits.data", "sysid.workbench.fields")
"""How a YAML is read is no code that a result depends on: what was read is among the terms of its key."""


def advice_key(config: PipelineConfig, data: Data, *, suggest: bool = True) -> str:
    """Digest of everything that the first look at the traces depends on.

    Args:
        config: The pipeline.
        data: The traces.
        suggest: As for :func:`look`.

    Returns:
        64 hexadecimal digits.
    """
    code = code_digest("sysid.advice:advise")
    terms = {"mapping": str(config.mapping), "traces": data.traces.digest, "code": code}
    return digest(terms if suggest else {**terms, "suggest": False})


def look(config: PipelineConfig, data: Data, *, suggest: bool = True) -> list[dict[str, Any]]:
    """The first look at the traces, output by output: what is in them, before anything is fitted.

    Args:
        config: The pipeline.
        data: The traces.
        suggest: Whether structures are suggested. A search of several outputs does not, and looks at no more of them
            than it did before its trials.

    Returns:
        JSON values, one object an output.
    """
    outputs = config.mapping.each if suggest else looked_at(config.mapping)
    return [advise(data.traces, one, suggest=suggest).to_dict() for one in outputs]


def fit_code(structure: AbstractStructure) -> str:
    """Digest of the code that a fit runs, and that stores it.

    Args:
        structure: What is fitted.

    Returns:
        64 hexadecimal digits.
    """
    return code_digest(*estimator_of(structure).runs, STORED_BY)


def fit_key(fit: FitConfig, config: PipelineConfig, data: Data, initial: str | None) -> str:
    """Digest of everything that a fit depends on.

    Args:
        fit: The fit.
        config: Its pipeline.
        data: The traces.
        initial: Key of the fit that it starts from.

    Returns:
        64 hexadecimal digits.
    """
    row, training = estimator_of(fit.structure), fit.training_options(config.seed)
    terms = {
        "structure": fit.structure.to_dict(),
        "training": None if training is None else dataclasses.asdict(training),
        "initial": initial,
        "traces": [trace.digest for trace in data.estimation],
        # Where nothing is chosen on them, other selection traces do not concern a fit.
        "selection": [trace.digest for trace in data.selection] if row.selects else None,
        "stability": None if row.stability.by_poles else config.stability.options(data.sequences).terms,
        "code": fit_code(fit.structure),
    }
    if fit.structure.names_records:  # of which digests know nothing
        terms["records"] = [trace.name for trace in (*data.estimation, *data.selection)]
    return digest(_plain(terms | _common(config)))


def _common(config: PipelineConfig) -> dict[str, Any]:
    start = {"kind": config.start.kind.value, "n_measured": config.start.n_measured}
    return {"mapping": str(config.mapping), "start": start, "rest_output": config.rest_output}


def _plain(value: Any) -> Any:
    """JSON values, with enums by their value."""
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return getattr(value, "value", value)


def fit_traces(
    fit: FitConfig,
    config: PipelineConfig,
    data: Data,
    initial: FitResult | None,
    on_progress: Callable[[FitProgress], None],
    *,
    stability: StabilityOptions | None = None,
) -> FitResult:
    """Fit one structure.

    Args:
        fit: The fit.
        config: Its pipeline.
        data: The traces.
        initial: The fit that it starts from.
        on_progress: Called after every iteration, from the threads that train.
        stability: How its free run is checked; as the pipeline says by default.

    Returns:
        The fit.

    Raises:
        ConfigError: If what is asked does not go together.
    """
    fit.structure.check_records([trace.name for trace in data.estimation], data.traces.names, config.start)
    return fitting.fit(
        data.estimation,
        config.mapping,
        fit.structure,
        fit.training_options(config.seed),
        start=config.start,
        rest_output=config.rest_output,
        selection=data.selection,
        initial=initial,
        stability=stability or config.stability.options(data.sequences),
        on_progress=on_progress,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Scores:
    """A fit's figures.

    Args:
        evaluation: On every case.
        selection_mse: Mean free-run mse on the selection traces; NaN without any.
        selection_rms_shares: Root mean square of each of them, as a share of the output's range over all records.
        selection_errors: Squared errors by part of each of them, in the output's unit squared.
        estimation_errors: The same of the estimation traces.
    """

    evaluation: Evaluation
    selection_mse: float
    selection_rms_shares: tuple[float, ...] = ()
    selection_errors: tuple[float, ...] = ()
    estimation_errors: tuple[float, ...] = ()


def scores_key(fit: str, structure: AbstractStructure, data: Data, config: PipelineConfig) -> str:
    """Digest of everything that a fit's figures depend on.

    Args:
        fit: Key of the fit.
        structure: What was fitted.
        data: The traces.
        config: The pipeline.

    Returns:
        64 hexadecimal digits.
    """
    here = ("steps:score", "evidence:residuals", "evidence:curves", "record:write_scores")
    # What fits a structure names the class of its models, whose methods are run.
    made_by = [f"sysid.workbench.fits.{one}" for one in here]
    code = code_digest(*made_by, *estimator_of(structure).runs, without=CONFIGURATION)
    terms = {
        "fit": fit,
        "traces": data.traces.digest,
        "selection": [trace.digest for trace in data.selection],
        # Scores of a release that kept less are made again.
        "kept": ["figures", "signals", "residuals", "intervals", "curves", "shares", "errors"],
        "code": code,
    }
    return digest(terms | _common(config))


def score(fit: FitResult, data: Data, config: PipelineConfig) -> Scores:
    """Run a fitted model over every case, in free run and one step ahead, and judge one output.

    Args:
        fit: The fit.
        data: The traces.
        config: The pipeline, as of that output.

    Returns:
        The figures.
    """
    output = config.mapping.output
    chosen = [case_results(fit.model, trace, Role.SELECTION, config.start, 1)[output] for trace in data.selection]
    errors = [case.free_run.mse for case in chosen]
    (span,) = spans_of([*data.traces, *data.selection], [output])
    evaluation = evaluate_outputs(fit.model, data.traces, config.start, posterior=fit.posterior)[output]
    if config.annotate is not None:
        annotator = find_annotator(config.annotate.by, where="annotate, by")
        evaluation = by_state(evaluation, data.traces, annotator)
    return Scores(
        evaluation=evaluation,
        selection_mse=float(np.mean(errors)) if errors else math.nan,
        selection_rms_shares=tuple(float(np.sqrt(error) / span) for error in errors),
        selection_errors=tuple(error for case in chosen for error in case.errors),
        estimation_errors=tuple(
            error for case in evaluation.cases.values() if case.role is Role.ESTIMATION for error in case.errors
        ),
    )


def output_sizes(data: Data, outputs: Sequence[str]) -> tuple[float, ...]:
    """For each output the squared error that counts as one where fits are compared.

    Args:
        data: The traces.
        outputs: The outputs.

    Returns:
        One for a single output, else the variance over the traces that choose, or that are fitted where none does.
    """
    if len(outputs) == 1:
        return (1.0,)
    traces = data.selection or data.estimation
    found = [np.concatenate([trace[name][trace.usable_of([name])] for trace in traces]).var() for name in outputs]
    return tuple(float(size) if size > 0.0 else 1.0 for size in found)


def export_key(scores: str, config: PipelineConfig) -> str:
    """Digest of everything that a bundle depends on.

    Args:
        scores: Key of the exported fit's figures.
        config: The pipeline.

    Returns:
        64 hexadecimal digits.
    """
    export = None if config.export is None else config.export.model_dump(mode="json", exclude={"fit"})
    if export is not None and config.export is not None:
        export["formats"] = list(wanted_formats(config.export.formats).names)
    files = ("sysid/export/templates", "sysid/export/fmi_headers", "sysid/export/schemas")
    code = code_digest("sysid.export:export_bundle", "sysid.models:model_from_dict", files=files)
    return digest({"scores": scores, "export": export, "code": code})


def export(
    fits: Sequence[FitResult],
    scores: Mapping[str, Scores],
    data: Data,
    config: PipelineConfig,
    *,
    folder: Path,
    provenance: dict[str, Any],
) -> Bundle:
    """Write a fit's files and check each against the model on every case.

    Args:
        fits: Its models: one, or one an output, which are run as one.
        scores: By output its figures, for the model card.
        data: The traces that the files are run on.
        config: The pipeline, with an ``export``.
        folder: Where the bundle goes.
        provenance: What the bundle says about where it comes from.

    Returns:
        The bundle.

    Raises:
        ConfigError: If the pipeline exports nothing.
        ParityError: If a file differs from the model by more than the tolerance.
    """
    from sysid.export import export_bundle

    if config.export is None:
        raise ConfigError("the pipeline exports nothing", where=config.name, remedy="add export: {fit: best}")
    figures = {output: one.evaluation for output, one in scores.items()}
    several, case = len(fits) > 1 or bool(config.export.input_levels), config.export.case
    if case is not None:
        fits = [for_case(fit, case) for fit in fits]
    return export_bundle(
        Cascade(models=tuple(fit.model for fit in fits), rest=dict(config.export.input_levels)) if several else fits[0],
        data.traces,
        folder,
        start=config.start,
        outputs=config.mapping.outputs if several else None,
        formats=wanted_formats(config.export.formats).names,
        tolerance=config.export.tolerance,
        metrics=CascadeEvaluation(outputs=figures, activity={})
        if several or len(figures) > 1
        else figures.popitem()[1],
        fits={str(fit.model.mapping): fit for fit in fits} if several else None,
        provenance=provenance,
    )


def export_run_times(bundle: Bundle) -> tuple[RunTime, ...]:
    """Time every file of a bundle beside the model's own free run.

    Args:
        bundle: The bundle.

    Returns:
        The model's own run, then file by file.
    """
    from sysid.export.run_times import bundle_run_times

    return bundle_run_times(bundle)
