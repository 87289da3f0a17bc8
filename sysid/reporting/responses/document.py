"""The page of a run that fits a measured frequency response."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation import FitResult
from sysid.reporting.figures.response_figure import measured_figure
from sysid.reporting.frequency import FrequencyUnit
from sysid.reporting.linear.computing import bode_of
from sysid.reporting.numbers import number, quantity, seconds
from sysid.reporting.parts import Document, Part, Section, Tile, Verdict, identifier, picture
from sysid.reporting.records import AGAIN
from sysid.reporting.responses.results import CurveRecord, ResponseFitRecord, ResponseResults
from sysid.reporting.sections.evidence import read_stored_fit, step_and_poles
from sysid.reporting.sections.fit_tables import export_table
from sysid.reporting.sections.runtime_table import run_times_of
from sysid.reporting.tables import Cell, Table, figure_cell, plain_table
from sysid.traces.measured_response import MeasuredResponse

DIGITS = 5
"""Of parameters."""
WEIGHTS = {
    "none": "the error itself, so that resonances and low frequencies count most",
    "relative": "the error over the response's size, as a Bode diagram shows it",
    "root": "the error over the root of the response's size",
    "coherence": "the error over what the measured coherence says of its own",
}
"""What counted of the errors, in words."""


def response_document(folder: Path, results: ResponseResults) -> Document:
    """The parts of the page.

    Args:
        folder: The run's folder, with its fits.
        results: Of the run.

    Returns:
        The parts.

    Raises:
        ConfigError: If a fit is missing or damaged.
    """
    sections: list[Section] = []
    for index, fit in enumerate(results.fits):
        place = folder / "fits" / fit.slug / "fit.json"
        stored = read_stored_fit(place)
        if stored is None:
            raise ConfigError(
                "a fit of the run is missing", where=place, expected="the fit that the results tell of",
                got="no such file", remedy=AGAIN,
            )  # fmt: skip
        sections += _of_fit(fit, stored, results, f"-{index}" if index else "")
    exports = export_table([(fit.mapping, one) for fit in results.fits for one in fit.exports], _unit(results))
    if exports is not None:
        timed = run_times_of([(fit.mapping, one) for fit in results.fits for one in fit.exports])
        sections.append(
            Section(anchor="exports", title="Exported files", parts=(exports,) if timed is None else (exports, timed))
        )
    return Document(results=results, verdict=_verdict(results), sections=(*sections, _data(results)))


def _unit(results: ResponseResults) -> str:
    return next((fit.units[1] for fit in results.fits if fit.exports), "")


def _verdict(results: ResponseResults) -> Verdict:
    fit = results.fits[0]
    left_out = ""
    tiles = [Tile(figure=f"{number(fit.fit_percent, digits=4)} %", words="of the response, by its fit")]
    if math.isfinite(fit.left_out_percent):
        left_out = f", and is {number(fit.left_out_percent)} % off at frequencies left out of the fit"
        tiles.append(Tile(figure=f"{number(fit.left_out_percent)} %", words="error at frequencies left out of the fit"))
    tiles += [
        Tile(figure=quantity(fit.furthest_db, "dB"), words="where the gain is furthest off"),
        Tile(figure=f"{number(fit.furthest_degrees)}°", words="where the phase is furthest off"),
        Tile(figure=str(fit.n_parameters), words="parameters"),
    ]
    headline = f"{fit.label} has {number(fit.fit_percent, digits=4)} % of the measured response{left_out}."
    points = [("How it ended", fit.ended)] + ([] if fit.orders is None else [("Choice", fit.orders.told)])
    points += [("The file", note) for note in results.data.notes]
    return Verdict(headline=headline, tiles=tuple(tiles), points=tuple(points), warnings=tuple(fit.warnings))


def _of_fit(fit: ResponseFitRecord, stored: FitResult, results: ResponseResults, suffix: str) -> list[Section]:
    several = f": {fit.mapping}" if len(results.fits) > 1 else ""
    name = f"{identifier(fit.slug)}{suffix}"
    parts = [_bode(fit, stored, results.data.name, results.frequency, name), _quality(fit, results.frequency)]
    sections = [Section(anchor=f"response{suffix}", title=f"Measured and fitted{several}", parts=tuple(parts))]
    found = [*_parameters(fit), *step_and_poles(fit.mapping, stored, name)]
    sections.append(Section(anchor=f"model{suffix}", title=f"The transfer function{several}", parts=tuple(found)))
    if fit.orders is not None:
        shown: list[Part] = [fit.orders.told, _orders(fit), *fit.orders.failed]
        sections.append(
            Section(anchor=f"orders{suffix}", title=f"Which orders it asks for{several}", parts=tuple(shown))
        )
    told = {*fit.warnings, *([] if fit.orders is None else [fit.orders.told])}
    if left := [note for note in fit.notes if note not in told]:
        rows = tuple((Cell(text=note),) for note in left)
        notes = Table(caption="What was done, and what is worth knowing.", head=(("note", ""),), rows=rows)
        sections.append(Section(anchor=f"notes{suffix}", title=f"Notes of the fit{several}", parts=(notes,)))
    return sections


def _bode(fit: ResponseFitRecord, stored: FitResult, name: str, unit: FrequencyUnit, key: str) -> Part:
    measured = measured_of(fit.curve, name)
    caption = (
        f"{fit.mapping}: gain and phase as measured (points) and of {fit.label} (line), and below how far the model is "
        "off at each frequency, in per cent of the response's size there."
        + (" Grey: 95 % of what the covariance of the parameters allows." if stored.uncertainty else "")
    )
    w = measured.frequency
    model = bode_of([(stored.model, stored.uncertainty)], frequency=w[w > 0.0])
    return picture(
        measured_figure(measured, model, fit.label, unit), f"Bode diagram of {fit.mapping}", caption, f"measured-{key}"
    )


def measured_of(curve: CurveRecord, name: str) -> MeasuredResponse:
    """The response that results hold.

    Args:
        curve: As they hold it.
        name: What it is called.

    Returns:
        The response.
    """

    def numbers(values: list[float]) -> NDArray[np.float64]:
        return np.array(values, dtype=np.float64)

    values = numbers(curve.measured_real) + 1j * numbers(curve.measured_imaginary)
    coherence = None if curve.coherence is None else numbers(curve.coherence)
    return MeasuredResponse(name=name, frequency=numbers(curve.frequency), values=values, coherence=coherence)


def _quality(fit: ResponseFitRecord, unit: FrequencyUnit) -> Table:
    at = f"{number(unit.told(float(fit.furthest_at)))} {unit.value}"
    rows: list[list[float | str | None]] = [
        ["fit of the response", fit.fit_percent, "%"],
        ["error at frequencies left out", fit.left_out_percent, "% of the response, weighted"],
        ["gain, furthest off", fit.furthest_db, f"dB, at {at}"],
        ["phase, furthest off", fit.furthest_degrees, "degrees"],
        ["dead time", fit.dead_time, "s"],
        ["sample time of the files", fit.sample_time, "s"],
        ["time of the fit", seconds(fit.train_time_s), ""],
    ]
    return plain_table(
        "How well the model has the response.", [("figure", ""), ("value", ""), ("unit", "")], rows,
        note="Fit: 100 % is all of the response, 0 % as much as its mean over frequency. Left out is each fifth "
        f"frequency in turn. What counted in the fit was {WEIGHTS.get(fit.weighting, fit.weighting)}.",
    )  # fmt: skip


def _parameters(fit: ResponseFitRecord) -> list[Table]:
    if not fit.parameters:
        return []
    rows = tuple(
        (
            Cell(text=one.name, header=True),
            figure_cell(one.value, digits=DIGITS),
            figure_cell(one.deviation, missing="none"),
            Cell(text=f"{number(one.low, digits=DIGITS)} to {number(one.high, digits=DIGITS)}")
            if math.isfinite(one.deviation)
            else Cell(text="none"),
        )
        for one in fit.parameters
    )
    variable = "1/z" if fit.structure.get("domain") == "discrete" else "s"
    return [
        Table(
            caption=f"Coefficients of the numerator B and the denominator F, by powers of {variable}; of F the one "
            "that is not here is 1.",
            head=(("parameter", ""), ("value", ""), ("deviation", "standard"), ("95 % interval", "")),
            rows=rows,
            note="From the curvature at the minimum, for errors that are alike as they were weighted.",
        )
    ]


def _orders(fit: ResponseFitRecord) -> Table:
    orders = [] if fit.orders is None else fit.orders.rows
    return plain_table(
        "Structures that were compared, the best first.",
        [
            ("poles / zeros", ""), ("dead time", "s"), ("error where left out", "%"), ("fit", "%"),
            ("score", "beyond the best"),
        ],
        [[f"{one.poles} / {one.zeros}", one.dead_time, one.left_out, one.fit, one.score] for one in orders],
        note="Score: the squared errors where left out, in variances of the noise, and BIC's price of a parameter.",
    )  # fmt: skip


def _data(results: ResponseResults) -> Section:
    data, unit = results.data, results.frequency
    low, high = (number(unit.told(float(one))) for one in (data.lowest, data.highest))
    told = f"{data.points} points from {low} to {high} {unit.value}{', with coherence' if data.coherence else ''}."
    table = plain_table(
        "What was measured.", [("response", ""), ("file", ""), ("SHA-256", "")], [[data.name, data.file, data.digest]]
    )
    return Section(anchor="data", title="The response", parts=(told, *data.notes, table))
