"""What is tracked of a fit, in plain words: names, parameters, figures, pictures. No tracking tool is known here."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.names import distinct, markdown_code, markdown_inline, shortened, tracking_key, tracking_text, visible
from sysid.traces import Role
from sysid.units import squared
from sysid.validation.metrics import MERITS, mean_fit
from sysid.workbench.runner.events import DataLoaded, FitReady, RunStarted

if TYPE_CHECKING:
    from sysid.validation import CaseResult


MAX_METRICS = 1000
"""Metrics that MLflow takes in one batch (``mlflow.utils.validation.MAX_METRICS_PER_BATCH``)."""
COLUMNS = 75
"""Of a line over the samples of a case: its peaks stay, and a case has some three hundred points."""
OUTPUT, TARGET = "output", "target"
"""What the free run and the record are called in charts, before a slash and the case."""
COLOUR_TAG = "mlflow.runColor"
"""Tag of a run with its colour in charts; without it MLflow may give two fits the same."""


def colour(number: int) -> str:
    """The colour of a fit, as reports have it.

    Args:
        number: Of the fit in its run.

    Returns:
        A colour as in ``#0072B2``.
    """
    from sysid.reporting.figures.style import PALETTE

    return PALETTE[number % len(PALETTE)]


def run_name(ready: FitReady) -> str:
    """The fit as an engineer recognises it; where a page cuts it, the mapping goes, which all fits beside it share.

    Args:
        ready: The fit.

    Returns:
        For example ``NARX 4/4/20 · closed · BP+AR -> BC``.
    """
    model = ready.fit.model
    mapping = shortened(visible(ready.pipeline.mapping), 180)
    return f"{model.label} · {ready.fit.loop.value} · {mapping}"


def tags(ready: FitReady, run: RunStarted, data: DataLoaded) -> dict[str, str]:
    """Words to filter and group by.

    Args:
        ready: The fit.
        run: The run that it belongs to.
        data: The traces.

    Returns:
        Texts by name.
    """
    found = (
        {
            "pipeline": run.pipeline,
            "pipeline_run": run.run_id,
            "fit": ready.config.name,
            "structure": ready.fit.model.label,
            "loop": ready.fit.loop.value,
            "status": ready.fit.status.name,
            "data": data.traces.name,
            "data_digest": data.traces.digest,
            "output_unit": ready.unit,
            "folder": str(ready.folder),
        }
        | ({"fit_of_several_outputs": ready.system} if ready.system else {})
        | ({"initial_fit": ready.config.initial} if ready.config.initial else {})
    )
    return {name: tracking_text(value) for name, value in found.items()}


def description(ready: FitReady, run: RunStarted, links: Mapping[str, str]) -> str:
    """What stands above the fit: how it ended, what is worth knowing, what belongs to it, and the command.

    Args:
        ready: The fit.
        run: The run that it belongs to.
        links: Addresses by what lies there.

    Returns:
        Markdown.
    """
    # MLflow shows the first few lines and hides the rest behind a click: what leads elsewhere stands first.
    leads = [f"[{markdown_inline(words)}]({address})" for words, address in links.items()]
    name, pipeline = markdown_inline(ready.config.name.strip()), markdown_code(run.pipeline)
    lines = [" · ".join([f"**{name}** of the pipeline {pipeline}", *leads]), ""]
    told = dict.fromkeys((*ready.fit.warnings, *ready.fit.notes))  # a warning is a note, too, and stands first
    lines += [ready.fit.status.value, "", *(f"* {markdown_inline(note)}" for note in told)]
    return "\n".join([*lines, "", f"Made by {markdown_code(run.command)}."])


def parameters(ready: FitReady) -> dict[str, str]:
    """What was chosen before the fit.

    Args:
        ready: The fit.

    Returns:
        Texts by name.
    """
    structure = ready.fit.model.structure.to_dict()
    # MLflow's page of a comparison draws the first three names of the alphabet that differ. These stand for every fit,
    # and before those that some have, so that none of them is "unknown" between two structures.
    model = ready.fit.model
    chosen: dict[str, Any] = {
        "chosen_kind": model.structure.kind,
        "chosen_loop": ready.fit.loop.value,
        "chosen_parameters": model.n_parameters,
        "chosen_structure": model.label,
        "error_unit": squared(ready.unit),
        "mapping": ready.pipeline.mapping,
        "start": ready.pipeline.start.kind.value,
        **{f"structure.{name}": value for name, value in structure.items() if name != "kind"},
    }
    training = ready.config.training_options(ready.pipeline.seed)
    if training is not None:
        chosen |= {f"training.{name}": getattr(value, "value", value) for name, value in vars(training).items()}
    return {name: tracking_text(value) for name, value in chosen.items()}


TITLES = {"r": "correlation"}
"""Merits whose own name nobody would search for."""


def metrics(ready: FitReady) -> dict[str, float]:
    """The figures; a slash groups a figure's cases in one section.

    Args:
        ready: The fit.

    Returns:
        Finite numbers by name.
    """
    fit, cases = ready.fit, ready.evaluation.cases
    unseen = [role for role in (Role.VALIDATION, Role.TEST) if any(case.role is role for case in cases.values())]
    fits = [case.free_run.nrmse_fit for case in cases.values()]
    scored = [case.free_run.nrmse_fit for case in cases.values() if case.role in unseen]
    found: dict[str, float] = {
        "mean_free_run_mse": ready.evaluation.mean_mse(*unseen),
        "worst_free_run_mse": max(case.free_run.mse for case in cases.values()),
        "mean_nrmse_fit": mean_fit(scored or fits),
        "least_nrmse_fit": min((fit for fit in fits if not math.isnan(fit)), default=math.nan),
        "selection_mse": ready.selection_mse,
        "parameters": fit.model.n_parameters,
        "train_time_s": fit.train_time_s,
        "mean_run_time_s": float(np.mean([case.run_time_s for case in cases.values()])),
    }
    if fit.evidence is not None:
        found["log_evidence"] = fit.evidence.log_evidence
        found["effective_parameters"] = fit.evidence.total_effective_parameters
    if fit.stability is not None:
        found["unstable_sequences"] = sum(fit.stability.get(one, 0) for one in ("unbounded", "unsettled", "apart"))
    keys = distinct(cases, tracking_key)
    for name, case in cases.items():
        case_name = keys[name]
        found[f"free_run_mse/{case_name}"] = case.free_run.mse
        found[f"one_step_mse/{case_name}"] = case.one_step.mse
        found |= {f"{TITLES.get(one.key, one.key)}/{case_name}": getattr(case.free_run, one.key) for one in MERITS[1:]}
        found[f"run_time_s/{case_name}"] = case.run_time_s
        if case.intervals is not None:
            found[f"free_run_coverage/{case_name}"] = case.intervals.free_run.share
            found[f"one_step_coverage/{case_name}"] = case.intervals.one_step.share
    return {name: four_digits(value) for name, value in found.items() if math.isfinite(value)}


def four_digits(value: float) -> float:
    """Four digits, whole numbers whole: MLflow's tables print all that there are; results.json keeps them.

    Example:
        >>> four_digits(0.05525342215), four_digits(123456.0)
        (0.05525, 123456.0)
    """
    return float(value) if float(value).is_integer() else float(f"{value:.4g}")


def learning_curve(ready: FitReady) -> list[tuple[int, float]]:
    """Iteration and mean squared error, where the latter is finite."""
    history = ready.fit.history
    pairs = zip(history["iteration"], history["mse"], strict=True)
    return [(int(iteration), float(mse)) for iteration, mse in pairs if math.isfinite(mse)]


def drawn(ready: FitReady) -> list[str]:
    """The cases whose lines and pictures are tracked: those that a verdict rests on first, then the others.

    Which they are depends on no fit, so that fits stand side by side; figures are tracked of every case.

    Args:
        ready: The fit.

    Returns:
        Their names, in the order of the file; as many as the report draws.
    """
    from sysid.reporting.sections.fit_tables import DRAWN, SCORED

    cases = ready.evaluation.cases
    first = sorted(cases, key=lambda name: cases[name].role not in SCORED)[: ready.pipeline.report.drawn or DRAWN]
    return [name for name in cases if name in first]


def lines(ready: FitReady) -> Iterator[tuple[str, int, float]]:
    """Target and free run of the drawn cases as lines over their samples: a chart has those of several fits in one.

    Args:
        ready: The fit.

    Yields:
        Name, sample and value; those samples at which either line has a peak, and no value that is not finite.
    """
    from sysid.reporting.figures.thinning import thin

    keys = distinct(ready.evaluation.cases, tracking_key)
    for name in drawn(ready):
        case = ready.evaluation.cases[name]
        both, samples = {TARGET: case.target, OUTPUT: case.simulated}, np.arange(len(case.target), dtype=np.float64)
        kept = np.unique(np.concatenate([thin(samples, values, COLUMNS)[0] for values in both.values()])).astype(int)
        for line, values in both.items():
            finite = kept[np.isfinite(values[kept])]
            yield from ((f"{line}/{keys[name]}", int(k), float(f"{values[k]:.6g}")) for k in finite)


def pictures(ready: FitReady) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    """Target and output of the cases of :func:`drawn`: of 90 cases pictures took longer than the search and its report.

    The key is the case, and the same for every fit, so that fits stand side by side.

    Args:
        ready: The fit.

    Yields:
        Key and picture, shape ``(height, width, 3)``.
    """
    keys = distinct(ready.evaluation.cases, tracking_key)
    for name in drawn(ready):
        yield f"target and output/{keys[name]}", _picture(ready, ready.evaluation.cases[name])


def _picture(ready: FitReady, case: CaseResult) -> NDArray[np.uint8]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from sysid.reporting.figures.fit_figures import case_figure

    model = ready.fit.model
    figure = case_figure(
        case.time,
        case.target,
        case.simulated,
        title=f"{case.case}, {case.role.value}: {model.label}, {ready.fit.loop.value} loop",
        label=ready.output,
        unit=ready.unit,
    )
    # matplotlib's backends carry no annotations.
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    return np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[:, :, :3])


def batches(values: Sequence[Any]) -> Iterator[Sequence[Any]]:
    """Metrics in as many calls as the store needs.

    Args:
        values: The metrics.

    Yields:
        At most as many as it takes in one batch.
    """
    for first in range(0, len(values), MAX_METRICS):
        yield values[first : first + MAX_METRICS]
