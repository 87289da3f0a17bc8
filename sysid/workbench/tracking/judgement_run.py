"""What is tracked of a judgement: its figures and its page, with the fits that were judged."""

from __future__ import annotations

import time
from typing import Any

from sysid.names import slug, tracking_key
from sysid.workbench.runner.events import JudgementReady
from sysid.workbench.tracking.fit_values import batches


def log_judgement(client: Any, ready: JudgementReady, *, key_tag: str, experiment: str, metric: Any) -> None:
    """Log a judgement with the runs that track what was judged; a run of its own stands for what is not tracked.

    What a run has already is not logged again.

    Args:
        client: An ``MlflowClient``.
        ready: The judgement.
        key_tag: Tag that holds the key of a tracked fit.
        experiment: Identifier of the experiment for a run of its own.
        metric: Makes a metric from name, value, time in ms and step.
    """
    tag = f"judged.{slug(ready.pipeline)}.{slug(ready.subject)}"
    runs = list(ready.tracked_as) + _runs_of(client, ready, key_tag)
    for run_id in dict.fromkeys(runs):
        if client.get_run(run_id).data.tags.get(tag) != ready.digest:
            _log(client, run_id, ready, metric)
            client.set_tag(run_id, tag, ready.digest)
    if runs:
        return
    known = client.search_runs([experiment], filter_string=f"tags.`{tag}` = '{ready.digest}'")
    if known:
        return
    words = {"pipeline": ready.pipeline, "fit": ready.subject, "mlflow.source.name": ready.command}
    # The pipeline is the experiment, and the mark stands in front: MLflow cuts long names off at their end, where what
    # tells runs apart is.
    name = f"✓ {ready.subject}" if ready.chosen else ready.subject
    run = client.create_run(experiment, run_name=name, tags=words)
    _log(client, run.info.run_id, ready, metric)
    client.set_tag(run.info.run_id, tag, ready.digest)
    client.set_terminated(run.info.run_id, status="FINISHED")


def _runs_of(client: Any, ready: JudgementReady, key_tag: str) -> list[str]:
    """The newest finished run of each fit that is tracked."""
    experiments = [one.experiment_id for one in client.search_experiments()]
    runs = []
    for fit_key in ready.fit_keys:
        found = client.search_runs(
            experiments, filter_string=f"tags.`{key_tag}` = '{fit_key}' and attributes.status = 'FINISHED'"
        )
        runs += [str(run.info.run_id) for run in found[:1]]
    return runs


def _log(client: Any, run_id: str, ready: JudgementReady, metric: Any) -> None:
    now = int(time.time() * 1000)
    values = [
        metric(f"{slug(ready.pipeline)}/{'/'.join(tracking_key(part) for part in name.split('/'))}", value, now, 0)
        for name, value in ready.metrics.items()
    ]
    for batch in batches(values):
        client.log_batch(run_id, metrics=batch)
    place = f"judgements/{slug(ready.pipeline)}"
    client.log_artifact(run_id, str(ready.page), place)
    client.log_artifact(run_id, str(ready.document), place)
