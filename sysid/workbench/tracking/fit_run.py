"""A fit into a tracking store: its run is found again, described, and given its figures and pictures.

No tracking tool is imported here: its client and its entities come from :mod:`sysid.workbench.tracking.mlflow_store`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from sysid.workbench.runner.events import FitReady, RunStarted
from sysid.workbench.tracking import fit_values as tracked

PARAM_LIMIT = 6000
"""Characters that MLflow takes in a parameter (``mlflow.utils.validation.MAX_PARAM_VAL_LENGTH``)."""

_HALF_LOGGED = {"RUNNING", "KILLED", "FAILED"}


@dataclass(frozen=True, kw_only=True)
class Entities:
    """Classes of the tracking tool.

    Args:
        metric: Of a name, a value, a time and a step.
        param: Of a name and a text.
    """

    metric: Callable[..., Any]
    param: Callable[..., Any]


def known_run(client: Any, experiment: str, key: str, *, key_tag: str) -> str | None:
    """The run that tracks this very fit already; what a killed process left half logged is removed.

    A fit has one run. What is removed lies in the trash of MLflow until it is emptied there.

    Args:
        client: A client of the tracking store.
        experiment: Where the fit's mapping is tracked.
        key: Digest of the fit.
        key_tag: Tag that holds a run's digest.

    Returns:
        The run's identifier; ``None`` if there is none that is whole.
    """
    found = client.search_runs([experiment], filter_string=f"tags.`{key_tag}` = '{key}'")
    for run in found:
        if run.info.status in _HALF_LOGGED:
            client.delete_run(run.info.run_id)
    return next((str(run.info.run_id) for run in found if run.info.status == "FINISHED"), None)


def describe(
    client: Any,
    experiment: str,
    run_id: str,
    ready: FitReady,
    run: RunStarted,
    *,
    initial_run: str | None = None,
    exported: bool = False,
) -> None:
    """Say what a fit is, in words, with links to what belongs to it.

    Args:
        client: A client of the tracking store.
        experiment: Where it is tracked.
        run_id: Its run.
        ready: The fit.
        run: The pipeline's run that it belongs to.
        initial_run: The run of the fit that it started from.
        exported: Whether its bundle and report are there too.
    """
    here = f"#/experiments/{experiment}/runs"
    links = {}
    if initial_run is not None:
        links[f"started from {ready.config.initial}"] = f"{here}/{initial_run}"
        client.set_tag(run_id, "initial_run", initial_run)
    if exported:
        links |= {words: f"{here}/{run_id}/artifacts/{words}" for words in ("bundle", "report")}
    client.set_tag(run_id, "mlflow.note.content", tracked.description(ready, run, links))


def log_values(client: Any, run_id: str, ready: FitReady, entities: Entities) -> None:
    """Log a fit's figures, learning curve, free runs and parameters.

    Args:
        client: A client of the tracking store.
        run_id: Its run.
        ready: The fit.
        entities: Classes of the tracking tool.
    """
    now = int(time.time() * 1000)
    values = [entities.metric(name, value, now, 0) for name, value in tracked.metrics(ready).items()]
    values += [entities.metric("learning_curve_mse", mse, now, step) for step, mse in tracked.learning_curve(ready)]
    # MLflow's page of a metric has time for its axis at first: a sample's time is the record's, in seconds.
    step_ms = 1000.0 * ready.fit.model.sample_time
    values += [
        entities.metric(name, value, now + round(step_ms * sample), sample)
        for name, sample, value in tracked.lines(ready)
    ]
    params = [entities.param(name, value[:PARAM_LIMIT]) for name, value in tracked.parameters(ready).items()]
    for number, batch in enumerate(tracked.batches(values)):
        client.log_batch(run_id, metrics=batch, params=() if number else params)


def log_pictures(client: Any, run_id: str, ready: FitReady) -> None:
    """Log target and output of each case.

    Args:
        client: A client of the tracking store.
        run_id: The fit's run.
        ready: The fit.
    """
    for name, picture in tracked.pictures(ready):
        # Twice: the charts show pictures by key, and the page that compares runs those files that all of them have in
        # their topmost folder.
        client.log_image(run_id, picture, key=name, step=0)
        client.log_image(run_id, picture, artifact_file=f"{name.replace('/', ' - ')}.png")
