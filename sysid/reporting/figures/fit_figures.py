"""Figures: plain functions of stored numbers, drawn without pyplot and its global state."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sysid.reporting.figures.style import (
    DASHES,
    PALETTE,
    PUBLISHED,
    TARGET,
    logarithmic,
    new_figure,
    series_style,
    styled,
)
from sysid.reporting.figures.thinning import distinct_points, thin
from sysid.reporting.fit_records import CaseRecord, FitRecord, LearningCurve
from sysid.reporting.numbers import number
from sysid.reporting.results import Results
from sysid.reporting.signals import CaseSignals
from sysid.reporting.worst_instants import Instant
from sysid.units import in_unit, squared

_COLUMNS = 450
LETTERS = 80
"""Of all names below an axis together, beyond which they stand upright: side by side they would cover each other."""
_FREE_RUN: dict[str, Any] = {"color": PALETTE[0], "linestyle": DASHES[1], "linewidth": 1.5}
_OTHER_RUN: dict[str, Any] = {"color": PALETTE[1], "linestyle": DASHES[2], "linewidth": 1.5}
_ONE_STEP: dict[str, Any] = {"color": PALETTE[1], "linestyle": DASHES[2], "linewidth": 1.5}


@dataclass(frozen=True, kw_only=True)
class Series:
    """One row of a chart: a value for each case.

    Args:
        name: Shown in the legend.
        values: By case; a case that is missing or not finite gets no mark.
        published: Whether these are published figures, drawn in grey.
    """

    name: str
    values: Dict[str, float]
    published: bool = False


def case_figure(
    time: NDArray[np.float64],
    target: NDArray[np.float64],
    simulated: NDArray[np.float64],
    *,
    title: str,
    label: str,
    unit: str,
    predicted: NDArray[np.float64] | None = None,
    interval: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
    other: NDArray[np.float64] | None = None,
    names: tuple[str, str] = ("free run", "other free run"),
    columns: int = 450,
) -> Figure:
    """One model on one case: target and free run over time, and the error below.

    Args:
        time: Seconds, shape ``(n_samples,)``.
        target: Measured output, shape ``(n_samples,)``.
        simulated: Free run, shape ``(n_samples,)``; values that are not finite are gaps.
        title: Stands above.
        label: What the output is, for the axis.
        unit: Its unit.
        predicted: One step ahead, shape ``(n_samples,)``; left out if not given.
        interval: Lower and upper end of the free run's 95 % interval, drawn around the error's zero; left out if not
            given.
        other: Free run of another model, shape ``(n_samples,)``; left out if not given.
        names: What the free run, and the other one, are called.
        columns: How finely lines are drawn: up to four points in each of so many columns.

    Returns:
        The figure; nothing outside it was touched.
    """
    with styled():
        # Fixed margins: cases stand one above the other on the same axes, and drawing takes half the time.
        figure = new_figure(7.6, 3.9, fixed=True)
        figure.subplots_adjust(left=0.1, right=0.985, top=0.935, bottom=0.115, hspace=0.12)
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[2.4, 1.0])
        above.set_title(title)
        _line(above, time, target, columns, color=TARGET, linewidth=1.1, label="target")
        if predicted is not None:
            _line(above, time, predicted, columns, **_ONE_STEP, label="one step ahead")
            _line(below, time, predicted - target, columns, **_ONE_STEP)
        if other is not None:
            _line(above, time, other, columns, **_OTHER_RUN, label=names[1])
            _line(below, time, other - target, columns, **{**_OTHER_RUN, "linewidth": 1.0})
        _line(above, time, simulated, columns, **_FREE_RUN, label=names[0])
        if interval is not None:
            _band(below, time, simulated - interval[1], simulated - interval[0], columns)
        _line(below, time, simulated - target, columns, color=PALETTE[0], linewidth=1.0)
        below.axhline(0.0, color=TARGET, linewidth=0.6)
        _limit(above, below, target, simulated)
        above.set_ylabel(f"{label} [{unit}]")
        below.set_ylabel(f"error [{unit}]")
        below.set_xlabel("time [s]")
        below.set_xlim(float(time[0]), float(time[-1]) if len(time) > 1 else float(time[0]) + 1.0)
        figure.align_ylabels()
        above.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.1)
        return figure


def _line(axes: Axes, x: NDArray[np.float64], y: NDArray[np.float64], columns: int, **style: Any) -> None:
    axes.plot(*thin(x, np.where(np.isfinite(y), y, np.nan), columns), **style)


def _band(
    axes: Axes, x: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64], columns: int
) -> None:
    """A shaded band, in each of so many stretches as wide as at its widest place there."""
    edges = np.unique(np.linspace(0, len(x), min(columns // 2, len(x)), endpoint=False).astype(int))
    bottom, top = np.minimum.reduceat(low, edges), np.maximum.reduceat(high, edges)
    if np.isfinite(bottom).all() and np.isfinite(top).all():
        axes.fill_between(x[edges], bottom, top, color=PALETTE[0], alpha=0.18, linewidth=0.0, step="post")


def _limit(above: Axes, below: Axes, target: NDArray[np.float64], simulated: NDArray[np.float64]) -> None:
    """Keep a free run that runs away from squeezing the target into a line, and say so."""
    low, high = float(target.min()), float(target.max())
    span = max(high - low, 1e-6 * max(abs(low), abs(high)), 1e-12)
    if np.isfinite(simulated).all() and low - span <= simulated.min() and simulated.max() <= high + span:
        return
    above.set_ylim(low - 0.5 * span, high + 0.5 * span)
    below.set_ylim(-span, span)
    text = "the free run leaves these axes" if np.isfinite(simulated).all() else "the free run diverges"
    above.text(0.01, 0.95, text, transform=above.transAxes, color=PALETTE[0], va="top", weight="bold")


ONE_LINE = 30
"""Letters of a title that fit beside two other panels."""


def instants_figure(
    instants: Sequence[Instant], signals: Dict[str, CaseSignals], *, title: str, label: str, unit: str
) -> Figure:
    """Zooms at the worst instants of a free run.

    Args:
        instants: At least one, worst first.
        signals: By case.
        title: Stands above.
        label: What the output is, for the axes.
        unit: Its unit.

    Returns:
        The figure: one panel an instant.
    """
    with styled():
        columns = min(3, len(instants))
        rows = -(-len(instants) // columns)
        figure = new_figure(7.6, 0.5 + 2.2 * rows)
        figure.suptitle(title, x=0.01, ha="left", fontsize=10)
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for rank, (axes, instant) in enumerate(zip(panels, instants, strict=False), 1):
            case = signals[instant.case]
            window = slice(instant.first, instant.last + 1)
            _line(axes, case.time[window], case.target[window], _COLUMNS, color=TARGET, linewidth=1.1, label="target")
            _line(axes, case.time[window], case.simulated[window], _COLUMNS, **_FREE_RUN, label="free run")
            axes.axvline(instant.time, color=PALETTE[1], linewidth=0.9, linestyle=DASHES[2])
            error = "diverged"
            if np.isfinite(instant.error):
                error = in_unit(f"{'+' * (instant.error > 0.0)}{number(instant.error)}", unit)
            place, what = f"{rank}. {instant.case},", f"{instant.time:g} s: {error}"
            # What a panel's title is cut to would leave half of the figure.
            apart = "\n" if len(place) + len(what) > ONE_LINE else " "
            axes.set_title(f"{place}{apart}{what}", fontsize=8.5)
            axes.set_xlabel("time [s]")
            axes.set_ylabel(f"{label} [{unit}]" if rank % columns == 1 % columns else "")
            axes.locator_params(nbins=4)
        for axes in panels[len(instants) :]:
            axes.set_visible(False)
        panels[0].legend(loc="best")
        return figure


def regression_figure(signals: Dict[str, CaseSignals], r: Dict[str, float], *, label: str, unit: str) -> Figure:
    """Free run against target, one panel a case.

    Args:
        signals: By case, at least one.
        r: Correlation coefficient by case.
        label: What the output is, for the axes.
        unit: Its unit.

    Returns:
        The figure.
    """
    with styled():
        columns = min(3, len(signals))
        rows = -(-len(signals) // columns)
        figure = new_figure(7.6 if columns == 3 else 2.7 * columns, 2.7 * rows)
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for rank, (axes, (case, signal)) in enumerate(zip(panels, signals.items(), strict=False), 1):
            low, high = float(signal.target.min()), float(signal.target.max())
            axes.plot([low, high], [low, high], color=TARGET, linewidth=0.8, label="free run = target")
            axes.plot(
                *distinct_points(signal.target[signal.counted], signal.simulated[signal.counted], 120),
                linestyle="none", marker=".", markersize=2.5, color=PALETTE[0], label="samples",
            )  # fmt: skip
            axes.set_title(f"{case}: R = {r[case]:.6f}" if np.isfinite(r[case]) else f"{case}: R is not defined")
            axes.set_xlabel(f"target {label} [{unit}]")
            axes.set_ylabel(f"free run [{unit}]" if rank % columns == 1 % columns else "")
            axes.locator_params(nbins=5)
        for axes in panels[len(signals) :]:
            axes.set_visible(False)
        panels[0].legend(loc="upper left", markerscale=3)
        return figure


def learning_figure(curves: Dict[str, LearningCurve | None], *, unit: str) -> Figure:
    """Learning curves of all fits.

    Args:
        curves: By name of the fit; a fit without one is left out, and the others keep the colours that they
            have in charts of all fits.
        unit: Of the squared errors.

    Returns:
        The figure, with a logarithmic axis.
    """
    with styled():
        figure = new_figure(7.6, 3.3)
        axes = figure.subplots()
        for index, (name, curve) in enumerate(curves.items()):
            if curve is None or len(curve.mse) < 2:
                continue
            style = series_style(index)
            mse = np.array(curve.mse, dtype=np.float64)
            x, y = thin(np.array(curve.iteration, dtype=np.float64), np.where(mse > 0.0, mse, np.nan), _COLUMNS)
            axes.plot(x, y, **style, markevery=max(1, len(x) // 8), markersize=4, label=name)
        logarithmic(axes)
        axes.set_xlabel("iteration")
        axes.set_ylabel(f"mse on the estimation records [{unit}]")
        axes.legend(loc="upper right")
        return figure


def cases_figure(series: Sequence[Series], cases: Sequence[str], *, quantity: str) -> Figure:
    """A figure of merit of all fits by case, on a logarithmic axis.

    Args:
        series: One a fit, published figures among them.
        cases: Names of the cases, in order.
        quantity: What it is, with its unit, for the axis.

    Returns:
        The figure.
    """
    with styled():
        figure = new_figure(7.6, 3.4)
        axes = figure.subplots()
        place = np.arange(len(cases), dtype=np.float64)
        for index, row in enumerate(series):
            values = np.array([row.values.get(case, np.nan) for case in cases], dtype=np.float64)
            values[~(np.isfinite(values) & (values > 0.0))] = np.nan
            x = place + 0.5 * ((index + 0.5) / len(series) - 0.5)
            style = series_style(index)
            if row.published:
                style = {"color": PUBLISHED, "marker": "_", "markersize": 13, "markeredgewidth": 2.4}
            axes.plot(x, values, **{"markersize": 6, **style, "linestyle": "none"}, label=row.name)
        logarithmic(axes)
        axes.set_xticks(place, list(cases), rotation=90 if sum(map(len, cases)) > LETTERS else 0)
        axes.set_xlim(-0.5, len(cases) - 0.5)
        axes.grid(visible=False, axis="x")
        axes.set_ylabel(quantity)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
        return figure


def cases_caption(series: Sequence[Series], drawn: str, what: str) -> str:
    """What stands below :func:`cases_figure`.

    Args:
        series: Its rows.
        drawn: What it shows.
        what: What a row is: ``"fit"`` or ``"run"``.

    Returns:
        The caption.
    """
    exact = any(value == 0.0 for row in series for value in row.values.values())
    without = "diverges, or has an error of 0" if exact else "diverges"
    return f"{drawn}; logarithmic, lower is better. A {what} without a mark {without}."


def run_time_figure(seconds: Dict[str, float], *, quantity: str) -> Figure:
    """Run time of each fit as a bar.

    Args:
        seconds: By name of the fit, in the unit that ``quantity`` names.
        quantity: What it is, with its unit, for the axis.

    Returns:
        The figure.
    """
    with styled():
        figure = new_figure(7.6, 0.8 + 0.36 * len(seconds))
        axes = figure.subplots()
        names, values = list(seconds), [value if np.isfinite(value) else 0.0 for value in seconds.values()]
        bars = axes.barh(names, values, height=0.6, color=PALETTE[0])
        axes.bar_label(bars, labels=[number(value, missing="not measured") for value in seconds.values()], padding=3)
        axes.margins(x=0.12)
        axes.invert_yaxis()
        axes.grid(visible=False, axis="y")
        axes.set_xlabel(quantity)
        return figure


def size_figure(results: Results, fits: Sequence[FitRecord]) -> Figure:
    """Fits by their parameters and their free-run error on the traces that choose, or that score where none choose.

    Args:
        results: The results.
        fits: Those of one output, whose errors are of one unit.

    Returns:
        The figure, with a logarithmic axis for the error.
    """
    with styled():
        figure = new_figure(7.6, 3.4)
        axes = figure.subplots()
        for index, fit in enumerate(fits):
            error = fit.selection_mse if np.isfinite(fit.selection_mse) else _mean_mse(fit.cases)
            if fit.n_parameters is None or not (np.isfinite(error) and error > 0.0):
                continue
            style = {**series_style(index), "linestyle": "none"}
            axes.plot([fit.n_parameters], [error], **style, markersize=6, label=f"{fit.name}, {fit.label}")
            if results.chosen(fit):
                axes.plot([fit.n_parameters], [error], "o", fillstyle="none", color=TARGET, markersize=13)
            effective = 0.0 if fit.evidence is None else sum(fit.evidence.effective_parameters.values())
            if 0.0 < effective < fit.n_parameters:
                axes.plot([effective, fit.n_parameters], [error, error], color=style["color"], linewidth=1.0)
        logarithmic(axes)
        axes.set_xlabel("parameters (the line reaches to the effective ones)")
        axes.set_ylabel(f"free-run mse [{squared(fits[0].unit)}]")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        return figure


def _mean_mse(cases: Dict[str, CaseRecord]) -> float:
    return float(np.mean([case.free_run.mse for case in cases.values()]))
