"""``sysid sweep``: a sweep with everybody who listens to it."""

from __future__ import annotations

import shlex
from pathlib import Path

from rich.markup import escape
from rich.table import Table

from sysid.errors import ConfigError
from sysid.reporting.sweep.record import SweepRecord, Trial
from sysid.workbench.fits.config import find_pipeline
from sysid.workbench.kinds import KINDS, RunRequest, kind_of
from sysid.workbench.runner.listeners import Audience, typed_command
from sysid.workbench.runner.screen import table_of_fits
from sysid.workbench.sweep.run import Sweep, read_sweep_file, run_sweep
from sysid.workbench.sweep.store import TrialStore

SHOWN = 5
"""Trials in the table on the screen."""


def sweep_command(
    pipeline: str, *, workers: int | None, resume: bool, fresh: bool, out: Path | None, tracking: bool
) -> int:
    """Run a sweep and show how it came out.

    Args:
        pipeline: Its name or file.
        workers: Processes that train; what the YAML says by default.
        resume: Only go on with a sweep that was begun.
        fresh: Do everything again.
        out: The run folder.
        tracking: Whether trials are tracked in MLflow.

    Returns:
        Exit code: 0, or 1 if everything is done and stored but something could not be tracked.

    Raises:
        UserError: If the pipeline is no sweep, cannot be used, or there is nothing to go on with.
    """
    path = find_pipeline(pipeline)
    kind = kind_of(path)
    if kind != "sweep":
        raise ConfigError(
            f"{pipeline} is not a sweep",
            where=path,
            expected="a pipeline with kind: sweep",
            got=f"kind: {kind}",
            remedy=f"run it with: sysid run {shlex.quote(pipeline)}" if kind in KINDS else "correct the kind",
        )
    sweep = read_sweep_file(path)
    if workers is not None:
        sweep = Sweep(config=sweep.config.model_copy(update={"workers": workers}), text=sweep.text, path=sweep.path)
    folder = out or Path("runs") / sweep.config.name
    if resume and TrialStore(path=folder / "trials").count() == 0:
        raise ConfigError(
            "there is no sweep to go on with",
            where=folder,
            expected="a run folder with finished trials",
            remedy="leave --resume out to begin one, or name its folder with --out",
        )
    return _run(sweep, folder, typed_command("sweep", pipeline, out), fresh=fresh, tracking=tracking)


def run_sweep_request(request: RunRequest) -> int:
    """``sysid run`` of a sweep.

    Args:
        request: What was asked.

    Returns:
        Exit code, as :func:`sweep_command`.
    """
    sweep = read_sweep_file(request.path)
    folder = request.out or Path("runs") / sweep.config.name
    command = typed_command("sweep", request.typed, request.out)
    return _run(sweep, folder, command, fresh=request.fresh, tracking=request.tracking)


def _run(sweep: Sweep, folder: Path, command: str, *, fresh: bool, tracking: bool) -> int:
    audience = Audience.of(tracking=tracking)
    try:
        swept = run_sweep(sweep, folder, command=command, fresh=fresh, watchers=audience.watchers)
    finally:
        audience.screen.close()
    audience.target.print()
    audience.target.print(_table_of_trials(swept.record))
    audience.target.print(table_of_fits(swept.results))
    audience.target.print(f"Best: {swept.results.fits[0].label}. {swept.record.chosen_by}", soft_wrap=True)
    return audience.end(
        {
            "Report": folder / "report" / "index.html",
            "Bundle": folder / "bundle",
            "Trials": folder / "sweep.json",
            "Results": folder / "results.json",
        }
    )


def _table_of_trials(record: SweepRecord) -> Table:
    """The best trials by what chooses."""
    table = Table(title=f"Best of {len(record.trials)} trials", title_justify="left", header_style="bold")
    for name in ("trial", "structure", "parameters", record.words(record.choose_by), record.words("run_time")):
        table.add_column(escape(name), justify="left" if name == "structure" else "right")
    ranked: list[Trial] = sorted(record.tried_in_full, key=record.choice)
    for trial in ranked[:SHOWN]:
        cells = [str(trial.number), escape(trial.label), str(trial.parameters)]
        table.add_row(*cells, f"{record.choice(trial):.4g}", f"{record.figure(trial, 'run_time'):.4g}")
    return table
