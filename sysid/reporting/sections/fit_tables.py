"""Tables of fits: errors by case, all figures of one, the ranking, run times, exported files, the data."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence

from sysid.reporting.fit_records import CaseRecord, ExportRecord, FiguresRecord, FitRecord, PublishedRecord
from sysid.reporting.numbers import number, seconds, times
from sysid.reporting.results import Results
from sysid.reporting.tables import DIVERGED, Cell, Column, Table, figure_cell
from sysid.traces import Role
from sysid.units import squared
from sysid.validation.metrics import MERITS

SCORED = (Role.VALIDATION, Role.TEST)
"""Roles of the cases that a verdict rests on: nothing was fitted to them or chosen on them."""


DRAWN, OF_SCORED = 12, 2 / 3
"""Cases that are drawn one by one, and the share of them at least that a verdict rests on, where there are so many:
drawing all takes longer than a fit, and nobody looks through them."""


def drawn_cases(fit: FitRecord, most: int) -> list[str]:
    """The cases of a fit that are drawn: all where they are few, else the worst of those that a verdict rests on.

    Where these leave room, the worst of the others stand beside them.

    Args:
        fit: The fit.
        most: How many at most.

    Returns:
        Their names, in the order of the file.
    """
    if len(fit.cases) <= most:
        return list(fit.cases)

    def worst(names: Collection[str]) -> list[str]:
        return sorted(names, key=lambda name: -_size(fit.cases[name].free_run.mse))

    scored = worst(scored_cases(fit))
    rest = worst([name for name in fit.cases if name not in scored])
    first = scored[: max(math.ceil(OF_SCORED * most), most - len(rest))]
    kept = {*first, *rest[: most - len(first)]}
    return [name for name in fit.cases if name in kept]


def worst_case(fit: FitRecord) -> str:
    """The case in which a fit is weakest, of those that a verdict rests on where there are some."""
    return max(scored_cases(fit) or fit.cases, key=lambda name: _size(fit.cases[name].free_run.mse))


def told_of_drawn(drawn: int, of: int) -> list[str]:
    """That not all cases are drawn, where that is so."""
    if drawn == of:
        return []
    return [
        f"Drawn are {drawn} of {of} cases: the worst of those that were not fitted, and of those that were. The "
        "tables have all."
    ]


def _size(mse: float) -> float:
    return math.inf if math.isnan(mse) else mse


def case_columns(fits: Sequence[FitRecord]) -> dict[str, Role]:
    """The cases of some fits with their roles, in the order of the file."""
    return {name: case.role for fit in fits for name, case in fit.cases.items()}


def scored_cases(fit: FitRecord) -> dict[str, CaseRecord]:
    """The cases of a fit that a verdict may rest on."""
    return {name: case for name, case in fit.cases.items() if case.role in SCORED}


def mean_mse(fit: FitRecord, kind: str) -> float:
    """Mean over the scored cases of ``free_run`` or ``one_step`` mse; NaN without such cases."""
    values = [getattr(case, kind).mse for case in scored_cases(fit).values()]
    return sum(values) / len(values) if values else float("nan")


def accuracy_table(fits: Sequence[FitRecord], kind: str, best: Collection[str]) -> Table:
    """Mean squared errors of the fits of one mapping by case, of one kind only, with the published figures below.

    Args:
        fits: The fits.
        kind: ``free_run`` or ``one_step``.
        best: Names of what was chosen.

    Returns:
        The table.
    """
    columns = case_columns(fits)
    means = {fit.name: figure_cell(mean_mse(fit, kind), missing=_missing_mean(fit, kind)) for fit in fits}
    rows = [(*cells, means[fit.name]) for fit, cells in _by_case(fits, best, lambda case: _mse_cell(case, kind))]
    published = _published_row(fits, kind, list(columns), lambda figure: figure_cell(figure.value, mark="published"))
    rows.extend(published)
    words = {"free_run": "Free run", "one_step": "One step ahead"}[kind]
    note = {
        "free_run": "The model runs on its own past output: the figure that counts.",
        "one_step": "Every prediction begins at the measured output, one sample before. That is easy, and says little "
        "about a free run. A model that adds its noise to the output (a transfer function, a neural state space) "
        "predicts nothing else than its free run, and shows a dash.",
    }[kind]
    return Table(
        caption=f"{words}: mean squared error [{squared(fits[0].unit)}] by case. {fits[0].mapping}.",
        head=(
            ("fit", ""),
            *((name, role.value) for name, role in columns.items()),
            ("mean", "unseen cases"),
        ),
        rows=tuple(rows),
        note=note + (" Small figures: ours divided by the published one; below 1 is better." if published else ""),
    )


def systems_table(results: Results) -> Table:
    """Fits of several outputs as wholes: mean over the outputs of the free run's fit, by case.

    Args:
        results: The results, with systems.

    Returns:
        The table.
    """
    cases = {name: case.role for one in results.systems for name, case in one.cases.items()}
    best = {fit.system for fit in results.best_fits}
    rows = []
    for one in results.systems:
        chosen = one.name in best
        count = f"{one.models} model{'' if one.models == 1 else 's'}, {one.n_parameters} parameters"
        below = f"{one.label}, {count}{'; chosen' if chosen else ''}"
        unseen = [case.mean_fit for case in one.cases.values() if case.role in SCORED]
        rows.append(
            (
                Cell(text=one.name, below=below, header=True, mark="best" if chosen else ""),
                *(figure_cell(one.cases[name].mean_fit, digits=4, missing=DIVERGED) for name in cases),
                figure_cell(sum(unseen) / len(unseen) if unseen else math.nan, digits=4, missing="no such case"),
                Cell(text=seconds(one.train_time_s), value=one.train_time_s, mark="number"),
            )
        )
    return Table(
        caption=f"The whole: mean over the outputs of the free run's fit [%]. {results.systems[0].mapping}.",
        head=(
            ("fit", ""),
            *((name, role.value) for name, role in cases.items()),
            ("mean", "unseen cases"),
            ("training", ""),
        ),
        rows=tuple(rows),
        note="100 is exact. Each output has its own tables below.",
    )


def run_time_table(fits: Sequence[FitRecord], best: Collection[str]) -> Table:
    """Run time of the free run by case, with how many times faster than real time it is.

    Args:
        fits: The fits of one mapping.
        best: Names of what was chosen.

    Returns:
        The table.
    """
    columns = case_columns(fits)
    rows = [cells for _, cells in _by_case(fits, best, _run_time_cell)]
    rows += _published_row(
        fits, "run_time", list(columns), lambda figure: figure_cell(1e3 * figure.value, mark="published")
    )
    return Table(
        caption=f"Run time of the free run [ms] by case. {fits[0].mapping}.",
        head=(("fit", ""), *((name, f"{number(_simulated(fits, name))} s simulated") for name in columns)),
        rows=tuple(rows),
        note="Small figures: how many times faster than real time.",
    )


def _by_case(
    fits: Sequence[FitRecord], best: Collection[str], cell: Callable[[CaseRecord], Cell]
) -> list[tuple[FitRecord, tuple[Cell, ...]]]:
    """Each fit with its name and a cell of every case that one of them has."""
    columns = case_columns(fits)
    return [
        (
            fit,
            (
                _name_cell(fit, best),
                *(cell(fit.cases[name]) if name in fit.cases else Cell(text="not run") for name in columns),
            ),
        )
        for fit in fits
    ]


def _run_time_cell(case: CaseRecord) -> Cell:
    return figure_cell(1e3 * case.run_time_s, missing="not measured", below=times(real_time_factor(case)))


def real_time_factor(case: CaseRecord) -> float:
    """Simulated seconds for each second of run time."""
    return case.simulated_s / case.run_time_s if case.run_time_s > 0.0 else float("nan")


def quality_table(fit: FitRecord, kind: str) -> Table:
    """All figures of merit of one fit by case.

    Args:
        fit: The fit.
        kind: ``free_run`` or ``one_step``.

    Returns:
        The table.
    """
    words = {"free_run": "free run", "one_step": "one step ahead"}[kind]
    columns = [Column.of(merit, fit.unit) for merit in MERITS]
    return Table(
        caption=f"{fit.name}, {words}: all figures by case.",
        head=(("case", ""), ("role", ""), *((column.heading, column.below) for column in columns)),
        rows=tuple(
            (
                Cell(text=name, header=True),
                Cell(text=case.role.value),
                *(
                    column.cell(getattr(figures, column.key), missing=_word(figures, _missing(case, kind)))
                    for column in columns
                ),
            )
            for name, case in fit.cases.items()
            for figures in (getattr(case, kind),)
        ),
    )


def _word(figures: FiguresRecord, missing: str) -> str:
    """Why a figure is not a number: a free run that diverged, or a target that does not vary."""
    return "-" if math.isfinite(figures.mse) else missing


def ranking_table(results: Results) -> Table:
    """What was tried, best first on the traces that chose."""
    order = list(results.mappings())
    ranked = sorted(
        results.fits, key=lambda fit: (order.index(fit.mapping), math.isnan(fit.selection_mse), fit.selection_mse)
    )
    best = {fit.name for fit in results.best_fits}
    chosen_by = any(math.isfinite(fit.selection_mse) for fit in ranked)
    rows = []
    for fit in ranked:
        effective = None if fit.evidence is None else sum(fit.evidence.effective_parameters.values())
        count = Cell(text="unknown") if fit.n_parameters is None else _count_cell(fit.n_parameters, effective)
        rows.append(
            (
                Cell(text=fit.name, header=True, below="chosen" if fit.name in best else "", mark=_mark(fit, best)),
                Cell(text=fit.label, below=fit.mapping.replace("->", "→")),
                Cell(text=fit.loop.value),
                count,
                Cell(text=seconds(fit.train_time_s), value=fit.train_time_s, mark="number"),
                figure_cell(fit.selection_mse, missing="none"),
                Cell(text=fit.status_sentence),
            )
        )
    return Table(
        caption="Every fit of this run, "
        + ("best first on the traces that choose between fits." if chosen_by else "in the order of the pipeline."),
        head=(
            ("fit", ""),
            ("structure", ""),
            ("trained", "loop"),
            ("parameters", ""),
            ("training", ""),
            ("selection mse", _selection_words(results)),
            ("how it ended", ""),
        ),
        rows=tuple(rows),
    )


def export_table(exports: Sequence[tuple[str, ExportRecord]], unit: str) -> Table | None:
    """Exported files and how they compare with their models.

    Args:
        exports: Each with the name of its model.
        unit: Of the differences.

    Returns:
        The table; ``None`` without any.
    """
    if not exports:
        return None
    return Table(
        caption="Exported files, each run against its model on every case.",
        head=(
            ("format", ""),
            ("model", ""),
            ("file", ""),
            ("largest difference", unit),
            ("tolerance", unit),
            ("verdict", ""),
        ),
        rows=tuple(
            (
                Cell(text=export.format, header=True),
                Cell(text=name),
                Cell(text=export.file),
                figure_cell(export.largest_difference, missing="not finite"),
                figure_cell(export.tolerance),
                Cell(text="within tolerance" if export.largest_difference <= export.tolerance else "OVER TOLERANCE"),
            )
            for name, export in exports
        ),
    )


def data_table(results: Results) -> Table:
    """The traces: what each was used for, how long it is, and where it comes from."""
    return Table(
        caption=f"Data set {results.data.name}, sample time {number(results.data.sample_time)} s.",
        head=(("case", ""), ("role", ""), ("samples", ""), ("length", "s"), ("provenance", "")),
        rows=tuple(
            (
                Cell(text=name, header=True),
                Cell(text=case.role.value),
                Cell(text=str(case.samples), value=case.samples, mark="number"),
                Cell(text=f"{case.duration_s:g}", value=case.duration_s, mark="number"),
                Cell(text=" ".join(_sentence(text) for text in case.provenance) or "not recorded"),
            )
            for name, case in results.data.cases.items()
        ),
        note=" ".join(_sentence(text) for text in results.data.source.splitlines()),
    )


def _sentence(text: str) -> str:
    text = text.strip()
    text = text[:1].upper() + text[1:]
    return text if text.endswith((".", "!", "?")) else text + "."


def _name_cell(fit: FitRecord, best: Collection[str]) -> Cell:
    chosen = fit.name in best
    below = f"{fit.label}, trained in {fit.loop.value} loop" + ("; chosen" if chosen else "")
    return Cell(text=fit.name, below=below, header=True, mark=_mark(fit, best))


def _selection_words(results: Results) -> str:
    units = {fit.unit for fit in results.fits}
    return f"{squared(units.pop())}, free run" if len(units) == 1 else "free run"


def _mark(fit: FitRecord, best: Collection[str]) -> str:
    return "best" if fit.name in best else ""


def _mse_cell(case: CaseRecord, kind: str) -> Cell:
    published = (case.published or {}).get(kind)
    below = times(published.ratio) if published is not None and math.isfinite(published.ratio) else ""
    return figure_cell(getattr(case, kind).mse, missing=_missing(case, kind), below=below)


def _missing(case: CaseRecord, kind: str) -> str:
    """Why there is no figure: a run that is lost, or a model that predicts nothing from measured output."""
    return "-" if kind == "one_step" and not case.predicts else DIVERGED


def _missing_mean(fit: FitRecord, kind: str) -> str:
    cases = scored_cases(fit)
    return _missing(next(iter(cases.values())), kind) if cases else "no such case"


def _count_cell(parameters: int, effective: float | None) -> Cell:
    below = "" if effective is None or math.isnan(effective) else f"{number(effective)} effective"
    return Cell(text=str(parameters), value=parameters, below=below, mark="number")


def _published_row(
    fits: Sequence[FitRecord], kind: str, columns: list[str], cell: Callable[[PublishedRecord], Cell]
) -> list[tuple[Cell, ...]]:
    """The yardsticks as a row of their own; no row where nothing was published."""
    by_case: dict[str, PublishedRecord] = {}
    for fit in fits:
        for name, case in fit.cases.items():
            if case.published and kind in case.published:
                by_case.setdefault(name, case.published[kind])
    if not by_case:
        return []
    sources = ", ".join(dict.fromkeys(figure.source for figure in by_case.values()))
    labels = ", ".join(dict.fromkeys(figure.label for figure in by_case.values()))
    title = Cell(text="published", below=f"{sources}: {labels}", header=True, mark="published")
    cells = [cell(by_case[case]) if case in by_case else Cell(text="none", mark="published") for case in columns]
    mean = [] if kind == "run_time" else [Cell(text="", mark="published")]
    return [(title, *cells, *mean)]


def _simulated(fits: Sequence[FitRecord], name: str) -> float:
    return next(fit.cases[name].simulated_s for fit in fits if name in fit.cases)
