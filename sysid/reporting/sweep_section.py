"""The section of a report that says how its model was found."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from sysid.reporting.parts import Part, Section, picture
from sysid.reporting.published import PublishedTable
from sysid.reporting.sweep_figures import heat_maps, over_trials_figure, parallel_figure, pareto_figure
from sysid.reporting.sweep_record import SweepRecord, has_sweep, read_sweep
from sysid.reporting.sweep_tables import beside_table, best_table, cost_table, published_ranks


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
    mse = "one_step_mse" if "one_step" in record.choose_by else "free_run_mse"
    comparable = published if mse == "one_step_mse" else None
    accuracy, speed = (published_ranks(comparable, record.mapping, figure) for figure in ("accuracy", "speed"))
    parts.append(best_table(record, mse, mse=mse, published=accuracy))
    parts.append(best_table(record, "run_time", mse=mse, published=speed))
    beside = beside_table(record)
    if beside is not None:
        parts.append(beside)
    parts.append(cost_table(record))
    for name, (title, drawing) in sweep_figures(record).items():
        caption = f"{title}. {len(record.tried_in_full)} of {len(record.trials)} trials trained in full."
        parts.append(picture(drawing, title, caption, f"sweep-{name}"))
    return [Section(anchor="sweep", title="How the model was found", parts=tuple(parts))]


def sweep_figures(record: SweepRecord) -> dict[str, tuple[str, Figure]]:
    """The pictures of a sweep, with their titles, by a short name.

    Args:
        record: The sweep.

    Returns:
        In the order in which they are read.
    """
    chosen = record.words(record.choose_by)
    drawings: dict[str, tuple[str, Figure | None]] = {
        "error": (f"{chosen} over the trials", over_trials_figure(record, record.choose_by, title=f"{chosen}")),
        "run-time": ("Run time over the trials", over_trials_figure(record, "run_time", title="Run time")),
        "maps": (f"{chosen} over the ranges", heat_maps(record, record.choose_by)),
        "front": ("What accuracy costs", pareto_figure(record)),
        "parallel": ("Every trial through its ranges and figures", parallel_figure(record)),
    }
    return {name: (title, drawing) for name, (title, drawing) in drawings.items() if drawing is not None}
