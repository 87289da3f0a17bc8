"""A fit to a measured frequency response into a tracking store: its run, figures, picture, page and files."""

from __future__ import annotations

import math
import tempfile
import time
from pathlib import Path
from typing import Any

from sysid.export import zip_bundle
from sysid.names import markdown_code, markdown_inline, shortened, slug, tracking_text, visible
from sysid.reporting.responses.results import ResponseFitRecord
from sysid.workbench.runner.events import ResponseReady, RunStarted
from sysid.workbench.tracking.fit_run import PARAM_LIMIT, Entities
from sysid.workbench.tracking.fit_values import COLOUR_TAG, colour, four_digits


def run_name(fit: ResponseFitRecord) -> str:
    """The fit as an engineer recognises it.

    Args:
        fit: The fit.

    Returns:
        For example ``continuous TF [2; 0; 6] · frequency response · u -> y``.
    """
    return f"{fit.label} · frequency response · {shortened(visible(fit.mapping), 180)}"


def new_run(
    client: Any, experiment: str, ready: ResponseReady, run: RunStarted, entities: Entities, *, key_tag: str
) -> str:
    """Log a fit's words, figures and parameters.

    Args:
        client: A client of the tracking store.
        experiment: Where its mapping is tracked.
        ready: The fit.
        run: The pipeline's run that it belongs to.
        entities: Classes of the tracking tool.
        key_tag: Tag that holds a run's digest.

    Returns:
        The identifier of the run that tracks it.
    """
    fit = ready.results.fits[0]
    words = _tags(ready, fit, run) | {key_tag: ready.key, COLOUR_TAG: colour(0)}
    words |= {"mlflow.source.name": run.command, "mlflow.source.type": "LOCAL"}
    run_id = str(client.create_run(experiment, run_name=run_name(fit), tags=words).info.run_id)
    status = "FAILED"
    try:
        now = int(time.time() * 1000)
        metrics = [entities.metric(name, value, now, 0) for name, value in _metrics(fit).items()]
        params = [entities.param(name, value[:PARAM_LIMIT]) for name, value in _parameters(fit).items()]
        client.log_batch(run_id, metrics=metrics, params=params)
        client.set_tag(run_id, "mlflow.note.content", _description(ready, fit, run))
        status = "FINISHED"
    finally:
        client.set_terminated(run_id, status=status)
    return run_id


def log_files(client: Any, run_id: str, ready: ResponseReady) -> bool:
    """Log the page, the results and the exported files with the run of a fit.

    Args:
        client: A client of the tracking store.
        run_id: The fit's run.
        ready: The fit.

    Returns:
        Whether the exported files are new there.
    """
    for file in (ready.page, ready.document):
        client.log_artifact(run_id, str(file), "report")
    exported = client.get_run(run_id).data.tags.get("exported") == "yes"
    if ready.bundle is None or (ready.stored and exported):
        return False
    client.log_artifacts(run_id, str(ready.bundle), "bundle")
    with tempfile.TemporaryDirectory() as scratch:
        # The page downloads files, not folders.
        packed = zip_bundle(ready.bundle, Path(scratch) / f"{slug(run_name(ready.results.fits[0]))}.zip")
        client.log_artifact(run_id, str(packed))
    client.set_tag(run_id, "exported", "yes")
    return True


def _tags(ready: ResponseReady, fit: ResponseFitRecord, run: RunStarted) -> dict[str, str]:
    found = {
        "pipeline": run.pipeline,
        "pipeline_run": run.run_id,
        "fit": run.pipeline,
        "structure": fit.label,
        "status": fit.status,
        "data": ready.results.data.name,
        "data_digest": ready.results.data.digest,
        "output_unit": fit.units[1],
        "folder": str(run.folder),
    }
    return {name: tracking_text(value) for name, value in found.items()}


def _metrics(fit: ResponseFitRecord) -> dict[str, float]:
    found = {
        "response_fit": fit.fit_percent,
        "response_left_out": fit.left_out_percent,
        "gain_furthest_db": fit.furthest_db,
        "phase_furthest_degrees": fit.furthest_degrees,
        "dead_time_s": fit.dead_time,
        "parameters": fit.n_parameters,
        "train_time_s": fit.train_time_s,
    }
    return {name: four_digits(value) for name, value in found.items() if math.isfinite(value)}


def _parameters(fit: ResponseFitRecord) -> dict[str, str]:
    found: dict[str, Any] = {
        "chosen_kind": fit.structure.get("kind"),
        "chosen_parameters": fit.n_parameters,
        "chosen_structure": fit.label,
        "mapping": fit.mapping,
        "weighting": fit.weighting,
        **{f"structure.{name}": value for name, value in fit.structure.items() if name != "kind"},
    }
    return {name: tracking_text(str(value)) for name, value in found.items()}


def _description(ready: ResponseReady, fit: ResponseFitRecord, run: RunStarted) -> str:
    """How the fit ended, what is worth knowing, and the command."""
    told = dict.fromkeys((*fit.warnings, *ready.results.data.notes, *fit.notes))
    lines = [f"A frequency response, fitted by the pipeline {markdown_code(run.pipeline)}.", "", fit.ended, ""]
    lines += [f"* {markdown_inline(note)}" for note in told]
    return "\n".join([*lines, "", f"Made by {markdown_code(run.command)}."])
