"""The front of accuracy against size as a table on the screen."""

from __future__ import annotations

import math

from rich.table import Table

from sysid.reporting.sweep_record import SweepRecord


def table_of_front(record: SweepRecord) -> Table:
    """What nothing beats both in error and in size.

    Args:
        record: All trials.

    Returns:
        The table, the least error first.
    """
    front = record.front()
    title = f"{len(record.trials)} tried; nothing beats these in error and in size"
    table = Table(title=title, title_justify="left", header_style="bold")
    table.add_column("structure")
    for name in (f"free-run rms error [{record.unit}]", "parameters", "multiplications a step", "mean run time [s]"):
        table.add_column(name, justify="right")
    for trial in front:
        cells = [trial.label, f"{math.sqrt(record.choice(trial)):.4g}", str(trial.parameters), str(trial.operations)]
        style = "bold" if trial.number == record.winner else None
        table.add_row(*cells, f"{record.figure(trial, 'run_time'):.3g}", style=style)
    return table
