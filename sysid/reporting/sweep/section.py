"""The section of a report that says how its model was found."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from sysid.reporting.numbers import quantity, seconds, times
from sysid.reporting.parts import Part, Section, picture
from sysid.reporting.published.tables import PublishedTable
from sysid.reporting.sweep.figures import heat_maps, over_trials_figure, parallel_figure, pareto_figure
from sysid.reporting.sweep.tables import (
    PublishedRank,
    beside_table,
    best_table,
    cost_table,
    mean_not_fitted,
    published_ranks,
)
from sysid.reporting.sweep_record import FIGURES, TRACES, SweepRecord, has_sweep, read_sweep
from sysid.units import squared


def sweep_sections(folder: Path, published: PublishedTable | None) -> list[Section]:
    """What a sweep tried and how its winner was chosen.

    Args:
        folder: The run's folder.
        published: Published figures, among them perhaps a published sweep's best.

    Returns:
        One section; none for a run without a sweep.

    Raises:
        ConfigError: If the record of the sweep is damaged.
    """
    if not has_sweep(folder):
        return []
    record = read_sweep(folder)
    parts: list[Part] = [record.chosen_by]
    if record.choose_on == "cases":
        parts.append(
            "Cases for validation took part in this choice, as in the sweep that is repeated: on them the winner's "
            "figures are those of a model that was chosen for them."
        )
    mse, theirs = _shown_mse(record), _published(record, published)
    parts.append(best_table(record, mse, mse=mse, published=theirs["error"]))
    parts.append(best_table(record, "run_time", mse=mse, published=theirs["run-time"]))
    beside = beside_table(record)
    if beside is not None:
        parts.append(beside)
    parts.append(cost_table(record))
    for name, (title, drawing) in sweep_figures(record, theirs).items():
        caption = f"{title}: {_shown(record)}.{' White: none of them.' if name == 'maps' else ''}"
        parts.append(picture(drawing, title, caption, f"sweep-{name}"))
    return [Section(anchor="sweep", title="How the model was found", parts=tuple(parts))]


def sweep_points(folder: Path, published: PublishedTable | None) -> list[tuple[str, str]]:
    """What the verdict of a report says of the sweep that found its model.

    Args:
        folder: The run's folder.
        published: Published figures, among them perhaps a published sweep's best.

    Returns:
        A keyword and a sentence; none for a run without a sweep, or one that found nothing.

    Raises:
        ConfigError: If the record of the sweep is damaged.
    """
    record = read_sweep(folder) if has_sweep(folder) else None
    winner = None if record is None else record.winning
    if record is None or winner is None:
        return []
    unit = FIGURES[record.choose_by].unit.format(unit=record.unit, squared=squared(record.unit))
    least = record.choice(winner)
    # A search may have held parts of records out, where nothing is declared to choose; its choice says which.
    chose = "what chose" if record.method == "auto" else TRACES[record.choose_on]
    trials = "1 trial" if len(record.trials) == 1 else f"{len(record.trials)} trials"
    below = min(record.tried_in_full, key=record.choice, default=winner)
    first = record.choice(below) >= least
    # A search may take a smaller model, one that is stable, or one that is nearer the others beyond the records.
    beside = "" if first else f"; {below.label} has the least, {quantity(record.choice(below), unit)}"
    text = (
        f"{winner.label} has {'the least' if first else 'a'} {FIGURES[record.choose_by].words} on {chose}"
        f"{', ' if first else ' of '}{quantity(least, unit)}, of {trials} ({_shown(record)}){beside}. They took "
        f"{seconds(record.wall_s)} on {record.workers} worker{'s' if record.workers != 1 else ''}."
    )
    best = next(iter(_published(record, published)["error"]), None)
    if best is not None:
        theirs = quantity(best.mse, squared(record.unit))
        ratio = times(least / best.mse)
        text += f" The published sweep's best has {theirs} ({best.structure}, {best.source}): ours is {ratio} that."
    for hand in record.beside:
        ours, other = (quantity(mean_not_fitted(trial), squared(record.unit)) for trial in (winner, hand))
        text += f" In free run on the cases not fitted to, {winner.label} has {ours} on average, {hand.label} {other}."
    return [("Sweep", text)]


def _shown(record: SweepRecord) -> str:
    """How many of the trials the tables and pictures are about, and what became of the others."""
    dropped = sum(trial.dropped_at is not None for trial in record.trials)
    others = Counter(trial.status.lower() for trial in record.trials if not trial.usable and trial.dropped_at is None)
    left_out = [f"{dropped} dropped before their end"] if dropped else []
    words = {"unstable": "unstable in free run"}
    left_out += [f"{n} {words.get(status, status.replace('_', ' '))}" for status, n in sorted(others.items())]
    return ", ".join([f"{len(record.tried_in_full)} trained in full and usable", *left_out])


def _shown_mse(record: SweepRecord) -> str:
    return "one_step_mse" if "one_step" in record.choose_by else "free_run_mse"


def _published(record: SweepRecord, published: PublishedTable | None) -> dict[str, list[PublishedRank]]:
    """Published rows by the name of the picture that they belong to; those of one-step errors only beside such."""
    comparable = published if _shown_mse(record) == "one_step_mse" else None
    ranks = {"error": "accuracy", "run-time": "speed"}
    return {name: published_ranks(comparable, record.mapping, figure) for name, figure in ranks.items()}


def sweep_figures(
    record: SweepRecord, published: Mapping[str, Sequence[PublishedRank]] | None = None
) -> dict[str, tuple[str, Figure]]:
    """The pictures of a sweep, with their titles, by a short name.

    Args:
        record: The sweep.
        published: Published rows that are drawn too, by the name of the picture.

    Returns:
        In the order in which they are read.
    """
    chosen, ranks = record.words(record.choose_by), published or {}
    drawings: dict[str, tuple[str, Figure | None]] = {
        "error": (
            f"{chosen} over the trials",
            over_trials_figure(record, record.choose_by, title=chosen, published=ranks.get("error", ())),
        ),
        "run-time": (
            "Run time over the trials",
            over_trials_figure(record, "run_time", title="Run time", published=ranks.get("run-time", ())),
        ),
        "maps": (f"{chosen} over the ranges", heat_maps(record, record.choose_by)),
        "front": ("What accuracy costs", pareto_figure(record)),
        "parallel": ("Every trial through its ranges and figures", parallel_figure(record)),
    }
    return {name: (title, drawing) for name, (title, drawing) in drawings.items() if drawing is not None}
