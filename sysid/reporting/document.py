"""The parts of a report in the order they are read: stored results turned into tables and pictures."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import replace
from pathlib import Path

import numpy as np

from sysid.names import output_side
from sysid.reporting.figures import fit_figures as figures
from sysid.reporting.fit_records import FitRecord, LearningCurve
from sysid.reporting.growth import growth_section
from sysid.reporting.judging.document import judgement_points, judgement_sections
from sysid.reporting.numbers import quantity
from sysid.reporting.parts import Document, Part, Picture, Section, identifier, picture
from sysid.reporting.published.tables import PublishedTable
from sysid.reporting.results import Results
from sysid.reporting.sections.advice import advice_section
from sysid.reporting.sections.amplitude import amplitude_section
from sysid.reporting.sections.beginnings import beginnings_section
from sysid.reporting.sections.evidence import evidence_sections
from sysid.reporting.sections.fit_tables import (
    accuracy_table,
    case_columns,
    data_table,
    drawn_cases,
    export_table,
    quality_table,
    ranking_table,
    run_time_table,
    scored_cases,
    systems_table,
    told_of_drawn,
)
from sysid.reporting.sections.orders import orders_section
from sysid.reporting.sections.overview import overview_section
from sysid.reporting.sections.runtime_table import exported_run_times
from sysid.reporting.sections.state_table import state_section
from sysid.reporting.sections.training import RELATIVE, error_unit, trained_models, training_parts, trust_sections
from sysid.reporting.sections.verdict import verdict
from sysid.reporting.sections.warnings_of_fits import warning_points, warnings_section
from sysid.reporting.signals import CaseSignals, read_signals
from sysid.reporting.sweep.section import sweep_points, sweep_sections
from sysid.reporting.tables import DIVERGED, Cell, Table, figure_cell
from sysid.reporting.worst_instants import Instant, worst_instants
from sysid.units import squared


def build_document(folder: Path, results: Results, published: PublishedTable | None) -> Document:
    """Turn a run into the parts of a report.

    Args:
        folder: The run's folder, with the signals of its fits.
        results: Its results, with published figures where there are some.
        published: Where those figures come from.

    Returns:
        The parts.

    Raises:
        ConfigError: If the signals of a fit are missing or damaged.
    """
    signals = {fit.slug: read_signals(folder / "fits" / fit.slug, list(fit.cases)) for fit in results.fits}
    instants: dict[str, list[Instant]] = {}
    for best in results.best_fits:
        judged = scored_cases(best) or best.cases
        instants[best.name] = worst_instants({name: signals[best.slug][name] for name in judged}, 5)
    sections = [overview_section(results, signals), _accuracy(results, published)]
    sections += [one for one in (warnings_section(results), beginnings_section(results)) if one is not None]
    sections += [*sweep_sections(folder, published)]
    columns, most = _columns(results), results.drawn
    for index, best in enumerate(results.best_fits):
        suffix = f"-{index + 1}" if index else ""
        shown = _best(best, signals[best.slug], instants[best.name], suffix, columns=columns, most=most)
        sections.append(shown)
        seen = {name: signals[best.slug][name] for name in scored_cases(best) or best.cases}
        by_level = amplitude_section(best, seen, suffix=suffix)
        sections += [] if by_level is None else [by_level]
    orders = orders_section(results)
    sections += [] if orders is None else [orders]
    sections += [*trust_sections(results), *evidence_sections(folder, results)]
    states = state_section(results)
    sections += ([] if states is None else [states]) + growth_section(folder) + judgement_sections(folder)
    sections += [_run_times(results, published), _tried(results)]
    exports = export_table(
        [(fit.name, export) for fit in results.fits for export in fit.exports],
        next((fit.unit for fit in results.fits if fit.exports), ""),
    )
    if exports is not None:
        timed = exported_run_times(results)
        parts = (exports,) if timed is None else (exports, timed)
        sections.append(Section(anchor="exports", title="Exported files", parts=parts))
    sections += [advice_section(results.advice, results.frequency)] if results.advice else []
    sections += [_data(results), *_others(results, signals, columns)]
    comparability = "" if published is None else published.comparability
    found = verdict(results, instants, comparability)
    points = (*judgement_points(folder), *sweep_points(folder, published), *warning_points(results), *found.points)
    found = replace(found, points=points)
    return Document(results=results, verdict=found, sections=tuple(sections))


def _accuracy(results: Results, published: PublishedTable | None) -> Section:
    best = {fit.name for fit in results.best_fits}
    parts: list[Part] = [] if not results.systems else [systems_table(results)]
    for index, (mapping, fits) in enumerate(results.mappings().items()):
        parts.append(accuracy_table(fits, "free_run", best))
        if len(case_columns(fits)) > 1:  # of one case the table says it all
            parts.append(_mse_picture(mapping, fits, f"mse-{index}"))
        parts += [accuracy_table(fits, "one_step", best)] if any(fit.predicts for fit in fits) else []
    if published is not None:
        parts.append(f"Published figures: {published.reference}; {published.part}. {published.comparability}")
    return Section(anchor="accuracy", title="Accuracy by case", parts=tuple(parts))


def _mse_picture(mapping: str, fits: list[FitRecord], name: str) -> Picture:
    cases = list(case_columns(fits))
    series = [
        figures.Series(name=fit.name, values={case: record.free_run.mse for case, record in fit.cases.items()})
        for fit in fits
    ]
    published = {
        case: record.published["free_run"].value
        for fit in fits
        for case, record in fit.cases.items()
        if record.published and "free_run" in record.published
    }
    if published:
        series.append(figures.Series(name="published", values=published, published=True))
    figure = figures.cases_figure(series, cases, quantity=f"free-run mse [{squared(fits[0].unit)}]")
    caption = figures.cases_caption(series, f"Free-run mse by case and fit, {mapping}", "fit")
    return picture(figure, f"Free-run mse by case, {mapping}", caption, name)


def _best(
    fit: FitRecord, signals: Dict[str, CaseSignals], instants: list[Instant], suffix: str, *, columns: int, most: int
) -> Section:
    parts: list[Part] = [*_quality(fit)]
    parts += _case_pictures(fit, signals, columns, most)
    output = output_side(fit.mapping)
    if instants:
        title = f"{fit.name}: the {len(instants)} worst instants"
        drawing = figures.instants_figure(instants, signals, title=title, label=output, unit=fit.unit)
        words = "Zooms at the largest errors of the free run, worst first."
        parts.append(picture(drawing, title, words, f"instants{suffix}"))
        parts.append(_instants_table(fit, instants))
    r = {case: record.free_run.r for case, record in fit.cases.items()}
    drawn = {name: signals[name] for name in drawn_cases(fit, most)}
    drawing = figures.regression_figure(drawn, r, label=output, unit=fit.unit)
    caption = "Free run against target: a perfect model lies on the line."
    parts.append(picture(drawing, f"{fit.name}: target-output regression", caption, f"regression{suffix}"))
    return Section(anchor=f"best{suffix}", title=f"The chosen model: {fit.name}", parts=tuple(parts))


def _quality(fit: FitRecord) -> list[Table]:
    """All figures; one step ahead only of a model that has such a run."""
    ahead = [quality_table(fit, "one_step")] if fit.predicts else []
    return [quality_table(fit, "free_run"), *ahead]


def _columns(results: Results) -> int:
    """How finely time plots are drawn, so that a page with many of them stays under three megabytes."""
    pictures = sum(len(drawn_cases(fit, results.drawn)) for fit in results.fits)
    return max(60, min(450, 450 * 30 // pictures))


def _case_pictures(fit: FitRecord, signals: Dict[str, CaseSignals], columns: int, most: int) -> list[Part]:
    output, drawn = output_side(fit.mapping), drawn_cases(fit, most)
    parts: list[Part] = [*told_of_drawn(len(drawn), len(fit.cases))]
    for index, (name, case) in enumerate(fit.cases.items()):
        if name not in drawn:
            continue
        signal = signals[name]
        figure = figures.case_figure(
            signal.time,
            signal.target,
            signal.simulated,
            title=name,
            label=output,
            unit=fit.unit,
            columns=columns,
            interval=None if signal.low is None or signal.high is None else (signal.low, signal.high),
        )
        caption = (
            f"{fit.name} on {name} ({case.role.value}): target and free run above, error below. "
            f"mse {quantity(case.free_run.mse, squared(fit.unit), missing='diverged')}, largest error "
            f"{quantity(case.free_run.max_abs_error, fit.unit, missing='diverged')}."
            f"{'' if signal.low is None else ' Shaded: the 95 % interval of the free run.'}"
        )
        parts.append(picture(figure, f"{fit.name} on {name}", caption, f"case-{identifier(fit.slug)}-{index}"))
    return parts


def _instants_table(fit: FitRecord, instants: list[Instant]) -> Table:
    return Table(
        caption="The worst instants of the free run, on the cases that the verdict rests on.",
        head=(("", ""), ("case", ""), ("time", "s"), ("target", fit.unit), ("free run", fit.unit), ("error", fit.unit)),
        rows=tuple(
            (
                Cell(text=str(place), header=True),
                Cell(text=instant.case),
                Cell(text=f"{instant.time:g}", value=instant.time, mark="number"),
                figure_cell(instant.target, digits=5),
                figure_cell(instant.simulated, digits=5, missing=DIVERGED),
                figure_cell(instant.error, missing=DIVERGED),
            )
            for place, instant in enumerate(instants, start=1)
        ),
    )


def _run_times(results: Results, published: PublishedTable | None) -> Section:
    best = {fit.name for fit in results.best_fits}
    parts: list[Part] = [run_time_table(fits, best) for fits in results.mappings().values()]
    per_thousand = {
        fit.name: float(np.median([1e6 * case.run_time_s / case.simulated_s for case in fit.cases.values()]))
        for fit in results.fits
    }
    figure = figures.run_time_figure(per_thousand, quantity="run time for 1000 simulated seconds [ms]")
    caption = "Free run, median over the cases."
    parts.append(picture(figure, "Run time of each fit", caption, "run-time"))
    machine = results.environment.get("cpu") or "the machine named below"
    protocol = (
        f"Protocol: the free run of each whole case, median of repeats after one that warms up, measured on {machine}."
    )
    if published is not None:
        protocol += f" Published run times were measured on: {published.computer}."
    parts.append(protocol)
    return Section(anchor="run-times", title="Run times", parts=tuple(parts))


def _learning(results: Results) -> list[tuple[str, str, dict[str, LearningCurve | None]]]:
    """Caption, unit of the errors and learning curves: of each mapping, and of the models of several outputs."""
    found = []
    for mapping, fits in results.mappings().items():
        # A fit whose curve stands elsewhere keeps its colour.
        curves = {fit.name: None if error_unit(fit) == RELATIVE else fit.learning_curve for fit in fits}
        caption = f"Learning curves on the estimation records, {mapping}; open loop learns the error of one step."
        found.append((caption, squared(fits[0].unit), curves))
    shared = {fit.name: fit.learning_curve for fit in trained_models(results) if error_unit(fit) == RELATIVE}
    caption = "Learning curves on the estimation records of models of several outputs, each output over its own errors."
    return [*found, (caption, RELATIVE, shared)]


def _tried(results: Results) -> Section:
    parts: list[Part] = []
    if results.best is not None:
        parts.append(f"Choice: {results.best.chosen_by}")
    if results.selection is not None and not (results.best is not None and results.best.cases_chose):
        parts.append(f"Traces that choose: {results.selection.name} ({', '.join(results.selection.cases)}).")
    parts.append(ranking_table(results))
    for index, (caption, unit, curves) in enumerate(_learning(results)):
        if any(curve is not None and len(curve.mse) > 1 for curve in curves.values()):
            picture_of = figures.learning_figure(curves, unit=unit)
            parts.append(picture(picture_of, "Learning curves", caption, f"learning-{index}"))
    parts += training_parts(results)
    mappings = results.mappings()
    for index, (mapping, fits) in enumerate(mappings.items()):
        if len([fit for fit in fits if fit.n_parameters is not None]) > 2:
            where = f"the traces that choose, {mapping}" if len(mappings) > 1 else "the traces that choose"
            caption = f"Size against accuracy on {where}; lower left is better. Ringed: the chosen fit."
            drawn = figures.size_figure(results, fits)
            parts.append(picture(drawn, "Size against accuracy", caption, f"size-{index}" if index else "size"))
    notes = [(fit.name, " ".join(fit.notes)) for fit in results.fits if fit.notes]
    if notes:
        rows = tuple((Cell(text=name, header=True), Cell(text=text)) for name, text in notes)
        parts.append(Table(caption="Notes of the fits.", head=(("fit", ""), ("notes", "")), rows=rows))
    return Section(anchor="tried", title="What was tried, and what chose", parts=tuple(parts))


def _data(results: Results) -> Section:
    return Section(
        anchor="data",
        title="Traces",
        parts=(data_table(results), f"Digest of the data set (SHA-256): {results.data.digest}"),
    )


def _others(results: Results, signals: Dict[str, Dict[str, CaseSignals]], columns: int) -> list[Section]:
    return [
        Section(
            anchor=f"fit-{identifier(fit.slug)}",
            title=f"Every case: {fit.name}",
            parts=(
                *_quality(fit),
                *_case_pictures(fit, signals[fit.slug], columns, results.drawn),
            ),
        )
        for fit in results.fits
        if not results.chosen(fit)
    ]
