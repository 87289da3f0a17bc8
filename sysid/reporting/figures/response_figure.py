"""Pictures of estimates without a structure: impulse responses, and frequency responses with models over them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sysid.estimation import FitResult
from sysid.estimation.nonparametric.impulse_response import ImpulseResponse
from sysid.estimation.nonparametric.response import FrequencyResponse
from sysid.reporting.figures.style import DASHES, PALETTE, TARGET, new_figure, styled
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.reporting.linear_views import linear_views
from sysid.traces.measured_response import MeasuredResponse
from sysid.units import per

if TYPE_CHECKING:
    from sysid.reporting.linear.responses import Bode

Array = NDArray[np.float64]
BAND_COLOUR = "#DDDDDD"
POINTS: dict[str, Any] = {"color": TARGET, "linestyle": "none", "marker": ".", "markersize": 4}
"""How what was measured is drawn."""


def impulse_figure(found: ImpulseResponse) -> Figure:
    """The impulse response of every input with its 95 % band.

    Args:
        found: The response.

    Returns:
        One panel an input.
    """
    with styled():
        figure = new_figure(max(7.6, 2.4 * len(found.values)), 2.8)
        row = figure.subplots(1, len(found.values), squeeze=False)[0]
        for axes, name, unit, values, spread in zip(
            row, found.mapping.inputs, found.input_units, found.values, 1.96 * found.deviation, strict=True
        ):
            axes.fill_between(found.time, values - spread, values + spread, color=BAND_COLOUR, label="95 %")
            axes.axhline(0.0, color=TARGET, linewidth=0.6)
            axes.plot(found.time, values, color=PALETTE[0], marker=".", markersize=3, label=f"pulse of {name}")
            axes.set_xlabel("time [s]")
            axes.set_ylabel(f"{found.mapping.output} [{per(found.output_unit, unit)}]")
            axes.legend()
        return figure


def response_figure(found: FrequencyResponse, fits: Sequence[FitResult] = (), unit: FrequencyUnit = HERTZ) -> Figure:
    """Gain, phase and coherence with their 95 % bands, models over them.

    Args:
        found: The response.
        fits: Linear models; what has no frequency response, or another output, is left out.
        unit: Of frequencies.

    Returns:
        One column an input, the coherence below.
    """
    m = len(found.mapping.inputs)
    with styled():
        figure = new_figure(max(7.6, 2.6 * m), 5.6)
        grid = figure.add_gridspec(3, m, height_ratios=[2.0, 1.6, 1.0])
        for j, name in enumerate(found.mapping.inputs):
            above = figure.add_subplot(grid[0, j])
            below = figure.add_subplot(grid[1, j], sharex=above)
            _measured(above, below, found, j, unit)
            for number, fit in enumerate(fits):
                _model(above, below, found, fit, (j, number, unit))
            above.set_ylabel(f"gain [{per(found.output_unit, found.input_units[j])}]")
            below.set_ylabel("phase [degrees]")
            above.set_title(name)
            above.legend(loc="lower left")
        place = figure.add_subplot(grid[2, :])
        place.semilogx(unit.told(found.frequency), found.coherence, color=PALETTE[2])
        place.set_ylim(0.0, 1.02)
        place.set_ylabel("coherence")
        place.set_xlabel(unit.label)
        return figure


def measured_figure(found: MeasuredResponse, model: Bode, label: str, unit: FrequencyUnit = HERTZ) -> Figure:
    """A measured response point by point, a model over it with its 95 % band, and how far they are apart.

    Args:
        found: The response.
        model: A model of one input, at the measured frequencies above 0.
        label: What it is called.
        unit: Of frequencies.

    Returns:
        Gain, phase and error, one below the other; and the coherence, where it was measured.
    """
    seen = found.frequency > 0.0
    w, values = found.frequency[seen], found.values[seen]
    panels = 3 if found.coherence is None else 4
    with styled():
        figure = new_figure(7.6, 2.2 * panels)
        ratios = [2.0, 1.6, 1.2, 1.0][:panels]
        above, below, error, *last = figure.subplots(panels, 1, sharex=True, height_ratios=ratios)
        at = unit.told(w)
        _over_points(above, below, (at, values), model, label)
        with np.errstate(divide="ignore", invalid="ignore"):
            off = 100.0 * np.abs(model.values[:, 0] / values - 1.0)
        error.loglog(at, np.where(off > 0.0, off, np.nan), **POINTS)
        error.set_ylabel("error [%]")
        if found.coherence is not None:
            (place,) = last
            place.semilogx(at, found.coherence[seen], color=PALETTE[2])
            place.set_ylim(0.0, 1.02)
            place.set_ylabel("coherence")
        (*_, lowest) = figure.axes
        lowest.set_xlabel(unit.label)
        return figure


def _over_points(
    above: Axes, below: Axes, measured: tuple[Array, NDArray[np.complex128]], model: Bode, label: str
) -> None:
    """Gain and phase as measured, and a model's with its band over them."""
    at, values = measured
    phase = np.degrees(np.unwrap(np.angle(values)))
    turns = 360.0 * np.round(np.median(phase - model.phase[:, 0]) / 360.0)
    bands = (above, model.gain_low, model.gain_high, 0.0), (below, model.phase_low, model.phase_high, turns)
    for axes, low, high, shift in bands:
        if np.isfinite(low).any():
            named = "95 % of the model" if axes is above else None
            axes.fill_between(at, low[:, 0] + shift, high[:, 0] + shift, color=BAND_COLOUR, label=named)
    above.loglog(at, np.abs(values), label="measured", **POINTS)
    above.loglog(at, model.gain[:, 0], color=PALETTE[0], label=label)
    below.semilogx(at, phase, **POINTS)
    below.semilogx(at, model.phase[:, 0] + turns, color=PALETTE[0])
    above.set_ylabel(f"gain [{per(*model.units[0])}]")
    below.set_ylabel("phase [degrees]")
    above.legend(loc="lower left")


def _measured(above: Axes, below: Axes, found: FrequencyResponse, j: int, unit: FrequencyUnit) -> None:
    gain, (low, high) = found.gain[:, j], found.gain_band
    seen = np.isfinite(gain) & (gain > 0.0)
    every = unit.told(found.frequency)
    w = every[seen]
    if not len(w):
        above.text(0.5, 0.5, "not in the input", ha="center", transform=above.transAxes)
        return
    floor = 0.1 * float(gain[seen].min())
    banded = seen & np.isfinite(high[:, j])
    above.fill_between(
        every[banded], np.maximum(low[banded, j], floor), high[banded, j], color=BAND_COLOUR, label="95 %"
    )
    above.loglog(w, gain[seen], color=TARGET, label=found.method.value)
    phase, half = np.degrees(found.phase[:, j]), np.degrees(found.phase_band[:, j])
    below.fill_between(every[banded], (phase - half)[banded], (phase + half)[banded], color=BAND_COLOUR)
    below.semilogx(w, phase[seen], color=TARGET)


def _model(
    above: Axes, below: Axes, found: FrequencyResponse, fit: FitResult, which: tuple[int, int, FrequencyUnit]
) -> None:
    j, number, unit = which
    ends, pair = fit.model.ends, (found.mapping.inputs[j], found.mapping.output)
    views = [
        one for one in linear_views(fit.model, None) if (ends.inputs[one.source], ends.outputs[one.target]) == pair
    ]
    w = found.frequency[found.frequency > 0.0]
    look = {"color": PALETTE[number % len(PALETTE)], "linestyle": DASHES[number % len(DASHES)]}
    for view in views:
        response = view.responses(w)[0]
        if not response.any():  # an input that does nothing in the model
            continue
        above.loglog(unit.told(w), np.abs(response), label=fit.model.label, **look)
        phase = np.degrees(view.phase(w))
        measured = np.degrees(found.phase[found.frequency > 0.0, j])
        seen = np.flatnonzero(np.isfinite(measured))[:1]
        turns = 360.0 * float(np.round((measured[seen] - phase[seen]) / 360.0).sum())
        below.semilogx(unit.told(w), phase + turns, **look)
