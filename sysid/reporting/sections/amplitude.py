"""Error by amplitude: where in the range of the output the free run is good, and where it is not."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from sysid.names import output_side
from sysid.reporting.figures.style import PALETTE, logarithmic, new_figure, styled
from sysid.reporting.fit_records import FitRecord
from sysid.reporting.numbers import number
from sysid.reporting.parts import Part, Section, picture
from sysid.reporting.signals import CaseSignals
from sysid.reporting.tables import DIVERGED, Cell, Table, figure_cell

BANDS = 8
"""Bands of equal width from the lowest to the highest target."""


@dataclass(frozen=True, kw_only=True)
class Band:
    """What the free run does while the target is in a band.

    Args:
        low: Lower end, in the output's unit.
        high: Upper end; it belongs to the last band only.
        samples: How many there are.
        rms: Root mean square error; NaN where the free run is not finite, or there is no sample.
        largest: Largest absolute error; NaN likewise.
        mean: Mean error, free run minus target; NaN likewise.
    """

    low: float
    high: float
    samples: int
    rms: float
    largest: float
    mean: float


def bands(signals: Dict[str, CaseSignals]) -> list[Band]:
    """Errors of the free run by band of the target, over all samples of all cases.

    Args:
        signals: By case.

    Returns:
        From the lowest band up; none for a target that does not vary.
    """
    if not signals:
        return []
    target = np.concatenate([signal.target[signal.counted] for signal in signals.values()])
    error = np.concatenate([signal.error[signal.counted] for signal in signals.values()])
    low, high = float(target.min()), float(target.max())
    if not high > low:
        return []
    edges = np.linspace(low, high, BANDS + 1)
    place = np.minimum(np.searchsorted(edges, target, side="right") - 1, BANDS - 1)
    return [_band(float(edges[k]), float(edges[k + 1]), error[place == k]) for k in range(BANDS)]


def _band(low: float, high: float, error: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Band:
    if not len(error):
        return Band(low=low, high=high, samples=0, rms=np.nan, largest=np.nan, mean=np.nan)
    return Band(
        low=low,
        high=high,
        samples=len(error),
        rms=float(np.sqrt(np.mean(error**2))),
        largest=float(np.max(np.abs(error))),
        mean=float(np.mean(error)),
    )


def amplitude_section(fit: FitRecord, signals: Dict[str, CaseSignals], *, suffix: str = "") -> Section | None:
    """Table and picture of the errors by amplitude.

    Args:
        fit: The fit.
        signals: By case, those that the verdict rests on.
        suffix: Tells its anchor from others in the page.

    Returns:
        The section; ``None`` for a target that does not vary.
    """
    found = bands(signals)
    if not found:
        return None
    cases = ", ".join(signals)
    caption = f"{fit.name}: free run by level of the target, {cases}."
    rows = tuple(
        (
            Cell(text=f"{number(band.low)} to {number(band.high)}", header=True),
            Cell(text=str(band.samples), value=band.samples, mark="number"),
            figure_cell(band.rms, missing=_missing(band)),
            figure_cell(band.mean, missing=_missing(band)),
            figure_cell(band.largest, missing=_missing(band)),
        )
        for band in found
    )
    unit, output = fit.unit, output_side(fit.mapping)
    table = Table(
        caption=caption,
        head=(("target", unit), ("samples", ""), ("rms error", unit), ("mean error", unit), ("largest error", unit)),
        rows=rows,
        note="Bands of equal width. A mean error far from zero says that the model reads too high or too low there.",
    )
    title = f"{fit.name}: error by level of {output}"
    words = "Errors of the free run by level of the target, logarithmic."
    drawing = picture(amplitude_figure(found, label=output, unit=unit), title, words, f"error-by-level{suffix}")
    parts: tuple[Part, ...] = (table, drawing)
    return Section(anchor=f"amplitude{suffix}", title=f"Error by amplitude{_of(fit)}", parts=parts)


def _of(fit: FitRecord) -> str:
    """Which output, where there are several."""
    return "" if fit.system is None else f": {output_side(fit.mapping)}"


def _missing(band: Band) -> str:
    return DIVERGED if band.samples else "no sample"


def amplitude_figure(found: list[Band], *, label: str, unit: str) -> Figure:
    """Root mean square and largest error of every band.

    Args:
        found: The bands.
        label: What the output is, for the axis.
        unit: Its unit.

    Returns:
        The figure.
    """
    with styled():
        figure = new_figure(7.6, 2.9)
        axes = figure.subplots()
        middle = np.array([0.5 * (band.low + band.high) for band in found])
        for values, mark, color, name in (
            ([band.largest for band in found], "D", PALETTE[1], "largest error"),
            ([band.rms for band in found], "s", PALETTE[0], "rms error"),
        ):
            axes.plot(middle, values, mark, color=color, markersize=6, label=name)
        logarithmic(axes)
        axes.set_xlabel(f"target {label} [{unit}]")
        axes.set_ylabel(f"error [{unit}]")
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
        return figure
