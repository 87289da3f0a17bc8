"""How networks came about and how far they may be trusted: starts, evidence, stability, coverage of intervals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sysid.estimation.estimators import ESTIMATORS
from sysid.reporting.figures.style import MARKERS, PALETTE, logarithmic, new_figure, styled
from sysid.reporting.fit_records import AttemptRecord, CaseRecord, FitRecord
from sysid.reporting.numbers import number
from sysid.reporting.parts import Part, Section, identifier, picture
from sysid.reporting.results import Results
from sysid.reporting.sections.fit_tables import case_columns
from sysid.reporting.tables import Cell, Table, figure_cell, plain_cell
from sysid.units import in_unit, squared

RELATIVE = "relative"
"""Unit of errors that several outputs have in common."""

ROWS = 30
"""Starts that a table names; the figure shows all."""


def trust_sections(results: Results) -> list[Section]:
    """Intervals and stability.

    Args:
        results: The run.

    Returns:
        A section for each of them that some fit has.
    """
    sections = []
    coverage = coverage_table(results)
    if coverage is not None:
        sections.append(Section(anchor="intervals", title="How sure the free runs are", parts=(coverage,)))
    stability = stability_table(results)
    if stability is not None:
        sections.append(Section(anchor="stability", title="Whether their free run stays stable", parts=(stability,)))
    return sections


def trained_models(results: Results) -> list[FitRecord]:
    """One record a model: those of a model of several outputs tell of the same training, which is told once.

    Args:
        results: The run.

    Returns:
        The records, one of a shared model under the name of the whole.
    """
    found: dict[str, FitRecord] = {}
    for fit in results.fits:
        shared = fit.system is not None and fit.model_slug not in {"", fit.slug}
        named = fit.model_copy(update={"name": fit.system}) if shared else fit
        found.setdefault(fit.model_slug or fit.slug, named)
    return list(found.values())


def error_unit(fit: FitRecord) -> str:
    """The unit of a fit's training errors: errors of a model of several outputs are relative, each output to its own.

    Args:
        fit: The fit.

    Returns:
        The output's unit squared, or ``relative``.
    """
    row = ESTIMATORS.get(fit.structure.get("kind", ""))
    return RELATIVE if row is not None and row.structure.several_outputs else squared(fit.unit)


def training_parts(results: Results) -> list[Part]:
    """Starts and evidence of every fit that has them.

    Args:
        results: The run.

    Returns:
        Tables and pictures.
    """
    parts: list[Part] = []
    sizes = evidence_figure(results)
    if sizes is not None:
        caption = (
            "Log evidence against the number of parameters: higher is better, between fits of one kind of training."
        )
        parts.append(picture(sizes, "Evidence against size", caption, "evidence-size"))
    for fit in trained_models(results):
        if len({attempt.start for attempt in fit.attempts}) > 1:
            caption = (
                f"{fit.name}: every start at every checkpoint. Left: how much of the error on unseen traces the error "
                "on the estimation traces tells. Right: how much of it the evidence tells."
            )
            name = f"attempts-{identifier(fit.slug)}"
            parts += [picture(attempts_figure(fit), f"Starts of {fit.name}", caption, name), attempts_table(fit)]
        if fit.evidence is not None and fit.evidence.effective_parameters:
            parts.append(groups_table(fit))
    return parts


def coverage_table(results: Results) -> Table | None:
    """How often the fits' intervals hold what was measured, by case; ``None`` where no fit has intervals."""
    fits = [fit for fit in results.fits if any(case.coverage for case in fit.cases.values())]
    columns = case_columns(fits)
    rows = []
    for fit in fits:
        for kind, words in (("free_run", "free run"), ("one_step", "one step ahead")):
            cells = [Cell(text=fit.name, header=True, below=words)]
            cells += [_coverage_cell(fit.cases.get(name), kind, fit.unit) for name in columns]
            rows.append(tuple(cells))
    if not rows:
        return None
    without = [fit.name for fit in results.fits if fit not in fits]
    return Table(
        caption="How often the 95 % interval of the output holds the measured output, by case [%].",
        head=(("fit", ""), *((name, role.value) for name, role in columns.items())),
        rows=tuple(rows),
        note="A right interval holds 95 %. One that holds more is wider than it need be; one that holds less promises "
        "too much. Small figures: the mean half width, and what the interval from the estimation records alone holds, "
        "before it was widened to the errors on the traces that choose."
        + (f" No interval: {', '.join(without)}; why stands among their notes." if without else ""),
    )


def _coverage_cell(case: CaseRecord | None, kind: str, unit: str) -> Cell:
    found = None if case is None or case.coverage is None else case.coverage.get(kind)
    if found is None or np.isnan(found.share):
        return Cell(text="none")
    below = f"± {in_unit(number(found.mean_half_width), unit)}; {100.0 * found.share_before_spread:.1f} % alone"
    return Cell(text=f"{100.0 * found.share:.1f}", value=found.share, below=below, mark="number")


def stability_table(results: Results) -> Table | None:
    """What the check over random sequences found; ``None`` where no fit was checked."""
    rows = []
    for fit in results.fits:
        found = fit.stability
        if found is None:
            continue
        error = 100.0 * found.largest_plateau_error
        rows.append(
            (
                Cell(text=fit.name, header=True, below="stable" if found.stable else "UNSTABLE"),
                Cell(text=str(found.sequences), value=found.sequences, mark="number"),
                Cell(text=str(found.unbounded), value=found.unbounded, mark="number"),
                Cell(text=str(found.unsettled), value=found.unsettled, below=f"of {found.judged}", mark="number"),
                figure_cell(error, missing="none judged", below=f"{100.0 * found.tolerance:g} allowed"),
                Cell(text=found.worst),
                Cell(text=found.source),
            )
        )
    if not rows:
        return None
    return Table(
        caption="The free run over random input sequences within the range of the estimation traces.",
        head=(
            ("fit", ""),
            ("sequences", ""),
            ("left the bounds", ""),
            ("settled elsewhere", ""),
            ("furthest from its plateau", "% of the range"),
            ("worst", ""),
            ("sequences made of", ""),
        ),
        rows=tuple(rows),
    )


def attempts_table(fit: FitRecord) -> Table:
    """The starts of a fit as each stood when it was last looked at, best first on the traces that choose.

    Args:
        fit: A fit with attempts.

    Returns:
        The table.
    """
    by_iterations = sorted(fit.attempts, key=lambda a: a.iterations)
    last = {(a.start, a.cautious): a for a in by_iterations}.values()
    shown = {(a.start, a.cautious, a.iterations): a for a in [*last, *(a for a in fit.attempts if a.chosen)]}.values()
    compared = any(np.isfinite(a.away) for a in shown)
    ranked = sorted(
        shown,
        key=lambda a: (_or_last(a.selection_mse), not a.members, _or_last(a.away), _or_last(-a.log_evidence)),
    )
    rows = tuple(_attempt_row(attempt, compared) for attempt in ranked[:ROWS])
    return Table(
        caption=f"{fit.name}: every start where its training ended, and the one that was chosen.",
        head=(
            ("start", ""),
            ("iterations", "s"),
            ("estimation mse", error_unit(fit)),
            ("selection mse", f"{error_unit(fit)}, geometric mean"),
            ("log evidence", ""),
            ("effective parameters", ""),
            *((("from the middle", "of half the range, backwards"),) if compared else ()),
            ("free run", ""),
        ),
        rows=rows,
        note="" if len(ranked) <= ROWS else f"The best {ROWS} of {len(ranked)}.",
    )


def _or_last(value: float) -> float:
    """A figure to sort by; what has none comes last."""
    return math.inf if math.isnan(value) else value


def _attempt_row(attempt: AttemptRecord, compared: bool) -> tuple[Cell, ...]:
    name, origin = f"{attempt.start}", "from the initial fit" if attempt.seed is None else f"seed {attempt.seed}"
    if attempt.without:
        origin += f", without {' and '.join(attempt.without)}"
    if attempt.cautious:
        origin += ", cautious"
    if attempt.members:
        name, origin = "ensemble", f"of starts {', '.join(map(str, attempt.members))}"
    words = {None: "not checked", True: "stable", False: "refused"}[attempt.stable]
    return (
        Cell(text=name, header=True, below=f"{origin}, chosen" if attempt.chosen else origin, mark=_mark(attempt)),
        Cell(text=str(attempt.iterations), value=attempt.iterations, below=f"{attempt.elapsed_s:.1f} s", mark="number"),
        figure_cell(attempt.estimation_mse, missing="diverged"),
        figure_cell(attempt.selection_mse, missing="none"),
        figure_cell(attempt.log_evidence, missing="none", digits=6),
        figure_cell(attempt.effective_parameters, missing="none"),
        *((figure_cell(attempt.away, missing="none"),) if compared else ()),
        Cell(text=words),
    )


def _mark(attempt: AttemptRecord) -> str:
    return "best" if attempt.chosen else ""


def attempts_figure(fit: FitRecord) -> Figure:
    """Estimation error and evidence of every start at every checkpoint against its error on the traces that choose.

    Args:
        fit: A fit with attempts; without selection traces the evidence stands against the estimation error alone.

    Returns:
        The figure.
    """
    with styled():
        figure = new_figure(7.6, 3.2)
        chosen_by = [attempt.selection_mse for attempt in fit.attempts]
        both = bool(np.isfinite(chosen_by).any())
        panels = figure.subplots(1, 2 if both else 1, squeeze=False)[0]
        if both:
            _scatter(panels[0], fit, [a.estimation_mse for a in fit.attempts], chosen_by)
            logarithmic(panels[0], across=True)
            panels[0].set_xlabel(f"mse on the estimation records [{error_unit(fit)}]")
            panels[0].set_ylabel(f"mse on the selection traces [{error_unit(fit)}]")
        errors = chosen_by if both else [attempt.estimation_mse for attempt in fit.attempts]
        _scatter(panels[-1], fit, [a.log_evidence for a in fit.attempts], errors)
        panels[-1].set_xlabel("log evidence")
        panels[-1].set_ylabel("" if both else f"mse on the estimation records [{error_unit(fit)}]")
        figure.legend(*panels[-1].get_legend_handles_labels(), loc="outside upper left", ncols=2)
        return figure


def _scatter(axes: Axes, fit: FitRecord, across: list[float], up: list[float]) -> None:
    x, y = np.array(across, dtype=np.float64), np.array(up, dtype=np.float64)
    shown = np.isfinite(x) & np.isfinite(y)
    chosen = np.array([attempt.chosen for attempt in fit.attempts])
    kinds = (
        (~chosen, MARKERS[0], PALETTE[0], 4.0, "a start at a checkpoint"),
        (chosen, MARKERS[3], PALETTE[1], 8.0, "chosen"),
    )
    for mask, marker, colour, size, label in kinds:
        points = shown & mask
        axes.plot(
            x[points], y[points], linestyle="none", marker=marker, color=colour, markersize=size, alpha=0.8, label=label
        )
    logarithmic(axes)


def groups_table(fit: FitRecord) -> Table:
    """What the evidence made of each group of a network's weights.

    Args:
        fit: A fit with evidence.

    Returns:
        The table.
    """
    evidence = fit.evidence
    groups = {} if evidence is None else evidence.effective_parameters
    rows = []
    for name, effective in groups.items():
        count = evidence.parameters.get(name, float("nan")) if evidence is not None else float("nan")
        precision = evidence.alphas.get(name, float("nan")) if evidence is not None else float("nan")
        rows.append(
            (
                Cell(text=name, header=True),
                plain_cell(count if np.isnan(count) else int(count)),
                figure_cell(effective),
                figure_cell(100.0 * effective / count if count else float("nan"), missing="none"),
                figure_cell(precision, missing="unknown"),
            )
        )
    note = "" if evidence is None else f"Log evidence {number(evidence.log_evidence, digits=6)}."
    return Table(
        caption=f"{fit.name}: how many of its parameters the data determine, by group of weights.",
        head=(("group", ""), ("parameters", ""), ("determined", ""), ("share", "%"), ("precision of the prior", "")),
        rows=tuple(rows),
        note=f"{note} Hidden weights have a group for each regressor, as they are trained.",
    )


def evidence_figure(results: Results) -> Figure | None:
    """Log evidence against the number of parameters, where several fits of one mapping and loop have it.

    Args:
        results: The run.

    Returns:
        The figure; ``None`` where there is nothing to compare.
    """
    groups: dict[tuple[str, str], list[tuple[int, float]]] = {}
    for fit in results.fits:
        if fit.evidence is not None and fit.n_parameters is not None and np.isfinite(fit.evidence.log_evidence):
            pair = (fit.n_parameters, fit.evidence.log_evidence)
            groups.setdefault((fit.mapping, fit.loop.value), []).append(pair)
    series = {words: sorted(pairs) for words, pairs in groups.items() if len(pairs) > 1}
    if not series:
        return None
    with styled():
        figure = new_figure(7.6, 3.0)
        axes = figure.subplots()
        for index, ((mapping, loop), pairs) in enumerate(series.items()):
            style: dict[str, Any] = {"marker": MARKERS[index % len(MARKERS)], "color": PALETTE[index % len(PALETTE)]}
            axes.plot([n for n, _ in pairs], [value for _, value in pairs], label=f"{mapping}, {loop} loop", **style)
        axes.set_xlabel("parameters")
        axes.set_ylabel("log evidence")
        axes.legend(loc="lower right")
        return figure
