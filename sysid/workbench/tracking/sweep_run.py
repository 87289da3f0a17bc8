"""What is tracked of a sweep: every trial as a flat run of few calls, and one summary run that has the figures.

Trials have an experiment of their own, so that five hundred of them do not bury the fits; they share the tag ``sweep``.
No tracking tool is imported here: its client and its entities come from :mod:`sysid.workbench.tracking.mlflow_store`.
"""

from __future__ import annotations

import csv
import io
import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.names import csv_cell, distinct, shortened, tracking_key, tracking_text
from sysid.reporting.sweep_record import SWEEP_FILE, SweepRecord, Trial
from sysid.workbench.runner.events import SweepReady
from sysid.workbench.runner.store import digest
from sysid.workbench.tracking.fit_run import Entities
from sysid.workbench.tracking.fit_values import four_digits

SUMMARY = "summary"
"""Value of the tag ``kind`` of the run that has the figures."""

TRIALS_TAG = "sysid.trials"
"""Tag of an experiment that holds trials, so that nobody is led there who comes for fits."""

PAGE = 1000
"""Runs that are asked for at a time."""


def experiment_name(record: SweepRecord) -> str:
    """The experiment of a sweep's trials.

    Args:
        record: The sweep.

    Returns:
        For example ``BP+AR -> BC · sweep closed-loop-sweep``.
    """
    return f"{shortened(record.mapping, 180)} · sweep {record.name}"


def log_sweep(client: Any, ready: SweepReady, *, key_tag: str, experiment: str, entities: Entities) -> int:
    """Track a sweep; trials that are tracked already are not logged again.

    Args:
        client: A client of the tracking store.
        ready: The sweep.
        key_tag: Tag that holds a run's digest.
        experiment: Where its trials go.
        entities: Classes of the tracking tool.

    Returns:
        Trials that were logged now.
    """
    record = ready.record
    client.set_experiment_tag(experiment, TRIALS_TAG, record.name)
    known = _known(client, experiment, key_tag)
    missing = [trial for trial in record.trials if _trial_key(trial) not in known]
    for trial in missing:
        _log_trial(client, experiment, ready, trial, key_tag=key_tag, entities=entities)
    summary = digest({"sweep": record.name, "trials": [_trial_key(trial) for trial in record.trials]})
    if summary not in known:
        _log_summary(client, experiment, ready, {key_tag: summary}, entities)
    return len(missing)


def _known(client: Any, experiment: str, key_tag: str) -> set[str]:
    """Digests of the runs that are whole."""
    found: set[str] = set()
    token = None
    while True:
        page = client.search_runs(
            [experiment], filter_string="attributes.status = 'FINISHED'", max_results=PAGE, page_token=token
        )
        found |= {run.data.tags[key_tag] for run in page if key_tag in run.data.tags}
        token = page.token
        if not token:
            return found


def _trial_key(trial: Trial) -> str:
    """A trial's digest; one that was dropped is another run than the same one trained in full."""
    return f"{trial.key}-{trial.number}-{trial.dropped_at or 'full'}"


def _log_trial(
    client: Any, experiment: str, ready: SweepReady, trial: Trial, *, key_tag: str, entities: Entities
) -> None:
    """One trial in three calls: there are hundreds, and each call is a commit to a disk."""
    tags = {
        key_tag: _trial_key(trial),
        "sweep": ready.record.name,
        "kind": "trial",
        "structure": trial.label,
        "status": trial.status,
        "data": ready.data,
        "dropped": "no" if trial.dropped_at is None else f"at rung {trial.dropped_at}",
    }
    run = client.create_run(experiment, run_name=f"{trial.number} · {trial.label}", tags=tags)
    now, keys = int(time.time() * 1000), distinct(trial.values, tracking_key)
    client.log_batch(
        run.info.run_id,
        metrics=[entities.metric(name, four_digits(value), now, 0) for name, value in metrics(trial).items()],
        params=[entities.param(keys[name], tracking_text(value)) for name, value in trial.values.items()],
    )
    # Whole, however the fit ended: that is what its tag says.
    client.set_terminated(run.info.run_id, status="FINISHED")


def metrics(trial: Trial) -> dict[str, float]:
    """The figures of a trial; a slash groups a figure's cases.

    Args:
        trial: The trial.

    Returns:
        Finite numbers by name.
    """
    found = {
        "free_run_mse": trial.mean("free_run_mse"),
        "one_step_mse": trial.mean("one_step_mse"),
        "selection_free_run_mse": trial.selection_free_run_mse,
        "selection_one_step_mse": trial.selection_one_step_mse,
        "run_time_s": trial.mean("run_time_s"),
        "parameters": trial.parameters,
        "operations": trial.operations,
        "log_evidence": trial.log_evidence,
        "iterations": trial.iterations,
        "train_time_s": trial.seconds,
        "cpu_s": trial.cpu_s,
        "trial": trial.number,
    }
    keys = distinct(trial.cases, tracking_key)
    found |= {f"free_run_mse/{keys[name]}": case.free_run_mse for name, case in trial.cases.items()}
    return {name: float(value) for name, value in found.items() if math.isfinite(value)}


def _log_summary(client: Any, experiment: str, ready: SweepReady, tags: dict[str, str], entities: Entities) -> None:
    """The run that is looked at: the winner's figures, what the sweep took, and the pictures of the report."""
    record = ready.record
    winner = record.winning
    words = tags | {
        "sweep": record.name,
        "kind": SUMMARY,
        "data": ready.data,
        "folder": str(ready.folder),
        "mlflow.note.content": f"{record.chosen_by}\n\nMade by `{ready.command}`.",
        "mlflow.source.name": ready.command,
        "mlflow.source.type": "LOCAL",
    }
    run = client.create_run(experiment, run_name=f"sweep {record.name}", tags=words)
    run_id, now, status = run.info.run_id, int(time.time() * 1000), "FAILED"
    try:
        figures = {"trials": float(len(record.trials)), "points": float(record.points), "wall_s": record.wall_s}
        figures |= {f"winner/{name}": value for name, value in (metrics(winner) if winner else {}).items()}
        chosen = {"method": record.method, "choose": f"{record.choose_by} on {record.choose_on}", "seed": ready.seed}
        chosen |= {"winner": winner.label if winner else "", "warm_start": record.warm_start}
        client.log_batch(
            run_id,
            metrics=[
                entities.metric(name.replace("winner/", "winner_", 1), four_digits(v), now, 0)
                for name, v in figures.items()
            ],
            params=[entities.param(name, str(value)) for name, value in chosen.items()],
        )
        for name, picture in _pictures(record):
            client.log_image(run_id, picture, key=name, step=0)
        with tempfile.TemporaryDirectory() as folder:
            table = Path(folder) / "trials.csv"
            table.write_text(_csv(record), encoding="utf-8")
            client.log_artifact(run_id, str(table))
        client.log_artifact(run_id, str(ready.folder / SWEEP_FILE))
        status = "FINISHED"
    finally:
        client.set_terminated(run_id, status=status)


def _pictures(record: SweepRecord) -> list[tuple[str, NDArray[np.uint8]]]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from sysid.reporting.figures.style import styled
    from sysid.reporting.sweep.section import sweep_figures

    pictures = []
    for name, (_, figure) in sweep_figures(record).items():
        with styled():
            # matplotlib's backends carry no annotations.
            canvas: Any = FigureCanvasAgg(figure)
            canvas.draw()
        pictures.append((f"sweep {name}", np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[:, :, :3])))
    return pictures


def _csv(record: SweepRecord) -> str:
    """All trials, one a line."""
    names = list(dict.fromkeys(name for trial in record.trials for name in trial.values))
    columns = sorted({name for trial in record.trials for name in metrics(trial)})
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(map(csv_cell, ["label", "status", "dropped_at", *names, *columns]))
    for trial in record.trials:
        values = metrics(trial)
        cells = [trial.label, trial.status, trial.dropped_at or "", *(trial.values.get(name, "") for name in names)]
        cells += [values.get(name, "") for name in columns]
        writer.writerow(csv_cell(cell) if isinstance(cell, str) else cell for cell in cells)
    return text.getvalue()
