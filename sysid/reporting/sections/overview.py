"""The picture that people look for first: all models over the measured output, case by case."""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from typing import Final

from sysid.reporting.figures.comparison_figure import Overlay, comparison_figure
from sysid.reporting.figures.style import PALETTE
from sysid.reporting.fit_records import FitRecord
from sysid.reporting.parts import Gallery, Part, Section, picture
from sysid.reporting.results import Results
from sysid.reporting.sections.fit_tables import SCORED, case_columns, drawn_cases, told_of_drawn, worst_case
from sysid.reporting.signals import CaseSignals

MOST: Final = len(PALETTE)
"""Models in one picture: as many as have a colour of their own."""

POINTS: Final = 12_000
"""Columns of all lines together, so that a page with many cases stays small."""


def overview_section(results: Results, signals: Dict[str, Dict[str, CaseSignals]]) -> Section:
    """Every model over what was measured.

    Args:
        results: Of the run.
        signals: By slug of the fit, and by case.

    Returns:
        A gallery for each mapping; a reader chooses the case, and the models that are drawn.
    """
    parts: list[Part] = []
    for index, (mapping, fits) in enumerate(results.mappings().items()):
        shown = _shown(fits)
        if len(shown) < len(fits):
            parts.append(f"{mapping}: the {MOST} best of {len(fits)} models on the traces that choose.")
        cases = overview_cases(fits, results.drawn)
        parts += told_of_drawn(len(cases), len(case_columns(fits)))
        parts.append(_gallery(mapping, shown, cases, signals, f"overview-{index}"))
    return Section(anchor="overview", title="All models over the measured output", parts=tuple(parts))


def _gallery(
    mapping: str,
    fits: list[FitRecord],
    cases: list[str],
    signals: Dict[str, Dict[str, CaseSignals]],
    name: str,
) -> Gallery:
    output, unit = mapping.rpartition("->")[2].strip(), fits[0].unit
    roles = case_columns(fits)
    columns = max(40, min(300, POINTS // ((len(fits) + 1) * len(cases))))
    pictures = []
    for number, case in enumerate(cases):
        own = [fit for fit in fits if case in fit.cases]
        first = max((signals[fit.slug][case] for fit in own), key=lambda one: len(one.time))
        panel = Overlay(
            case=case,
            output=output,
            unit=unit,
            time=first.time,
            target=first.target,
            runs={fit.name: signals[fit.slug][case].simulated for fit in own},
            fits={fit.name: fit.cases[case].free_run.nrmse_fit for fit in own},
        )
        caption = f"{case} ({roles[case].value}): {output} as measured, and the free run of each model with its fit."
        drawing = comparison_figure([panel], columns=columns, numbers=[fits.index(fit) for fit in own])
        pictures.append(picture(drawing, f"All models on {case}", caption, f"{name}-{number}"))
    return Gallery(
        name=name,
        title=mapping,
        models=tuple(fit.name for fit in fits),
        cases=tuple(cases),
        pictures=tuple(pictures),
    )


def overview_cases(fits: list[FitRecord], most: int) -> list[str]:
    """The cases of a mapping in the order of its pictures: what nothing was fitted to comes first.

    Args:
        fits: Of one mapping.
        most: How many of the best are drawn at most.

    Returns:
        Names of the cases that are drawn.
    """
    roles, shown = case_columns(fits), _shown(fits)
    # Those of the best, and the worst of each other.
    drawn = {*drawn_cases(shown[0], most), *(worst_case(fit) for fit in shown)}
    return sorted((case for case in roles if case in drawn), key=lambda case: roles[case] not in SCORED)


def _shown(fits: list[FitRecord]) -> list[FitRecord]:
    return sorted(fits, key=_rank)[:MOST]


def _rank(fit: FitRecord) -> tuple[bool, float]:
    return math.isnan(fit.selection_mse), fit.selection_mse
