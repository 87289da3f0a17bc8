"""The best trials of a sweep as a table on the screen."""

from __future__ import annotations

import math

from rich.table import Table

from sysid.reporting.numbers import pole
from sysid.reporting.sweep_record import SweepRecord, Trial

SHOWN = 5
"""Trials in the table."""


def table_of_trials(record: SweepRecord) -> Table:
    """The best trials by what chooses.

    Args:
        record: All trials.

    Returns:
        The table.
    """
    table = Table(title=f"Best of {len(record.trials)} trials", title_justify="left", header_style="bold")
    ranked: list[Trial] = sorted(record.tried_in_full, key=record.choice)
    linear = any(math.isfinite(trial.pole_radius) for trial in ranked)
    heads = ["trial", "structure", "parameters", record.words(record.choose_by), record.words("run_time")]
    heads += ["BIC", "largest pole"] if linear else []
    for name in heads:
        table.add_column(name, justify="left" if name == "structure" else "right")
    for trial in ranked[:SHOWN]:
        cells = [str(trial.number), trial.label, str(trial.parameters)]
        cells += [f"{record.choice(trial):.4g}", f"{record.figure(trial, 'run_time'):.4g}"]
        if linear:
            cells += [f"{record.figure(trial, 'BIC'):.1f}", pole(trial.pole_radius)]
        table.add_row(*cells)
    return table
