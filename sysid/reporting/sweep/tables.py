"""Tables of a sweep: the best by a figure beside published ones, the winner beside what was chosen by hand."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from sysid.reporting.numbers import seconds
from sysid.reporting.published.tables import PublishedTable
from sysid.reporting.sweep_record import SweepRecord, Trial
from sysid.reporting.tables import Cell, Table, figure_cell
from sysid.units import squared

SHOWN = 5
"""Rows of a table of the best."""


@dataclass(frozen=True, kw_only=True)
class PublishedRank:
    """One row of a published table of the best.

    Args:
        rank: Its place, from 1 on.
        structure: Label of the structure.
        source: Where it is printed.
        mse: Mean squared error, in the output's unit squared.
        run_time: Seconds.
    """

    rank: int
    structure: str
    source: str
    mse: float
    run_time: float


def published_ranks(published: PublishedTable | None, mapping: str, figure: str) -> list[PublishedRank]:
    """The published rows that rank a mapping's structures by a figure.

    Args:
        published: The table of published figures.
        mapping: The mapping.
        figure: ``accuracy`` or ``speed``, as the rows' variants say: "accuracy rank 1".

    Returns:
        Best first; empty where nothing is published.
    """
    if published is None:
        return []
    bare = "".join(mapping.split())
    found: dict[int, dict[str, tuple[str, str, float]]] = {}
    for row in published.figures:
        rank = re.search(rf"{figure} rank (\d+)", row.variant)
        if rank and "".join(row.mapping.split()) == bare and row.quantity in {"mse", "run_time"}:
            found.setdefault(int(rank.group(1)), {})[row.quantity] = (row.structure, row.source, row.value)
    return [
        PublishedRank(
            rank=rank,
            structure=entry["mse"][0],
            source=entry["mse"][1],
            mse=entry["mse"][2],
            run_time=entry.get("run_time", ("", "", float("nan")))[2],
        )
        for rank, entry in sorted(found.items())
        if "mse" in entry
    ]


def best_table(record: SweepRecord, name: str, *, mse: str, published: Sequence[PublishedRank] = ()) -> Table:
    """The best five by a figure of merit, with published rows beside them.

    Args:
        record: The sweep.
        name: The figure that ranks.
        mse: Which error is shown: ``free_run_mse`` or ``one_step_mse``.
        published: Published rows, best first.

    Returns:
        The table.
    """
    ranked = sorted(record.tried_in_full, key=lambda trial: (_rank(record, trial, name), trial.number))[:SHOWN]
    rows = []
    for place in range(max(len(ranked), min(SHOWN, len(published)))):
        trial = ranked[place] if place < len(ranked) else None
        theirs = published[place] if place < len(published) else None
        rows.append((Cell(text=str(place + 1), header=True), *_ours(record, trial, mse), *_theirs(theirs, published)))
    head: list[tuple[str, str]] = [
        ("", ""),
        ("structure", ""),
        ("trial", ""),
        (record.words(mse), ""),
        (record.words("run_time"), "free run"),
        ("parameters", ""),
    ]
    if published:
        head += [
            (published[0].source, "structure"),
            ("published mse", squared(record.unit)),
            ("published run time", "s"),
        ]
    return Table(
        caption=f"The best by {record.words(name)} of {len(record.tried_in_full)} trials in full.",
        head=tuple(head),
        rows=tuple(rows),
        note="Published run times are of another machine and another program." if published else "",
    )


def _rank(record: SweepRecord, trial: Trial, name: str) -> float:
    value = record.figure(trial, name)
    return value if math.isfinite(value) else math.inf


def _ours(record: SweepRecord, trial: Trial | None, mse: str) -> tuple[Cell, ...]:
    if trial is None:
        return (Cell(text=""),) * 5
    return (
        Cell(text=_unbroken(trial.label)),
        Cell(text=str(trial.number), value=trial.number, mark="number"),
        figure_cell(record.figure(trial, mse), digits=4),
        figure_cell(record.figure(trial, "run_time")),
        Cell(text=str(trial.parameters), value=trial.parameters, mark="number"),
    )


def _theirs(row: PublishedRank | None, published: Sequence[PublishedRank]) -> tuple[Cell, ...]:
    if not published:
        return ()
    if row is None:
        return (Cell(text=""),) * 3
    return (
        Cell(text=_unbroken(row.structure)),
        figure_cell(row.mse, digits=4, mark="published"),
        figure_cell(row.run_time, mark="published"),
    )


def _unbroken(label: str) -> str:
    """A label that is not parted at the end of a line."""
    return label.replace(" ", "\u00a0")


def mean_not_fitted(trial: Trial) -> float:
    """Mean free-run mse of a trial over the cases that it was not fitted to.

    Args:
        trial: The trial.

    Returns:
        The mean; NaN without such cases.
    """
    errors = [case.free_run_mse for case in trial.cases.values() if case.role in {"validation", "test"}]
    return sum(errors) / len(errors) if errors else math.nan


def beside_table(record: SweepRecord) -> Table | None:
    """The winner and those chosen by hand, on the cases that they were not fitted to.

    Args:
        record: The sweep.

    Returns:
        The table; ``None`` with nothing chosen by hand.
    """
    winner = record.winning
    if winner is None or not record.beside:
        return None
    unseen = [name for name, case in winner.cases.items() if case.role in {"validation", "test"}]
    trials = [("sweep winner", winner), *(("chosen by hand", trial) for trial in record.beside)]
    rows = []
    for words, trial in trials:
        errors = [trial.cases[name].free_run_mse for name in unseen if name in trial.cases]
        rows.append(
            (
                Cell(text=trial.label, header=True, below=words),
                *(figure_cell(error) for error in errors),
                figure_cell(mean_not_fitted(trial)),
                figure_cell(trial.selection_free_run_mse, missing="none"),
            )
        )
    chose = record.choose_on == "cases"
    kind = "chose the winner" if chose else "unseen"
    seen = " These cases did choose the winner here, by another figure." if chose else ""
    return Table(
        caption=f"Free run of the winner and of what was chosen by hand, mean squared error [{squared(record.unit)}].",
        head=(("structure", ""), *((name, kind) for name in unseen), ("mean", kind), ("selection", "")),
        rows=tuple(rows),
        note="One trial each: another seed gives other figures, for either." + seen,
    )


def cost_table(record: SweepRecord) -> Table:
    """What the sweep cost: trials, those dropped at each checkpoint, wall and processor time.

    Args:
        record: The sweep.

    Returns:
        The table.
    """
    trials = record.trials
    rows = [("trials", str(len(trials))), ("points in the ranges", str(record.points))]
    for number, rung in enumerate(record.rungs, start=1):
        dropped = sum(trial.dropped_at == number for trial in trials)
        share = f" on {rung['record']:.0%} of the record" if rung["record"] < 1.0 else ""
        rows.append((f"dropped after {rung['iterations']} iterations{share}", str(dropped)))
    unusable = sum(not trial.usable and trial.dropped_at is None for trial in trials)
    ended = [trial.cpu_s for trial in trials if trial.cpu_s > 0.0]  # of what was stopped no time is known
    rows += [
        ("failed, stopped, or not usable", str(unusable)),
        ("wall time", seconds(record.wall_s)),
        (
            f"processor time of {'all trials' if len(ended) == len(trials) else 'trials that ended'}",
            seconds(sum(ended)),
        ),
        ("workers", str(record.workers)),
        ("method", record.method),
        (
            "networks begin",
            {"none": "at random", "linear": "at their linear fit"}.get(record.warm_start, "from smaller"),
        ),
    ]
    return Table(
        caption="What the sweep took.",
        head=(("", ""), ("", "")),
        rows=tuple((Cell(text=name, header=True), Cell(text=value)) for name, value in rows),
    )
