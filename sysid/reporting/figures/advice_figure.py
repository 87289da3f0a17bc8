"""The first look: impulse and frequency response of every input with bands, and the coherence."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sysid.models import Mapping
from sysid.reporting.advice.record import AdviceRecord, ImpulseRecord, ResponseRecord
from sysid.reporting.figures.style import PALETTE, TARGET, new_figure, styled
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.units import per

MOST_INPUTS = 4
"""Columns of a picture that is still read; further inputs are in the data."""
BAND_COLOUR = "#DDDDDD"


def advice_figure(advice: AdviceRecord, unit: FrequencyUnit = HERTZ) -> Figure | None:
    """Draw what was found by estimates without a structure.

    Args:
        advice: The findings.
        unit: Of frequencies.

    Returns:
        One column an input, the coherence below them; ``None`` where there is nothing to draw.
    """
    impulse, response = advice.impulse, advice.response
    shown = impulse or response
    if shown is None or not shown.inputs:
        return None
    inputs = shown.inputs[:MOST_INPUTS]
    with styled():
        heights = [2.0] * (impulse is not None) + [2.0, 1.4] * (response is not None)
        figure = new_figure(max(7.6, 2.4 * len(inputs)), sum(heights) + 0.4)
        grid = figure.add_gridspec(len(heights), len(inputs), height_ratios=heights)
        output = advice.units.get(Mapping.parse(advice.mapping).output, "1")
        for j, name in enumerate(inputs):
            gain = per(output, advice.units.get(name, "1"))
            if impulse is not None:
                _impulse(figure.add_subplot(grid[0, j]), impulse, (j, name), gain)
            if response is not None:
                _gain(figure.add_subplot(grid[len(heights) - 2, j]), response, (j, name, gain), unit)
        if response is not None:
            _coherence(figure.add_subplot(grid[-1, :]), response, unit)
        return figure


def _array(values: list[float]) -> NDArray[np.float64]:
    return np.asarray(values, dtype=np.float64)


def _impulse(axes: Axes, impulse: ImpulseRecord, which: tuple[int, str], unit: str) -> None:
    j, name = which
    time, values, spread = _array(impulse.time), _array(impulse.values[j]), 1.96 * _array(impulse.deviation[j])
    axes.fill_between(time, values - spread, values + spread, color=BAND_COLOUR, label="95 %")
    axes.axhline(0.0, color=TARGET, linewidth=0.6)
    axes.plot(time, values, color=PALETTE[0], marker=".", markersize=3, label=name)
    axes.set_xlabel("time after a pulse [s]")
    axes.set_ylabel(f"response [{unit}]")
    axes.legend()


def _gain(axes: Axes, response: ResponseRecord, which: tuple[int, str, str], unit: FrequencyUnit) -> None:
    j, name, of = which
    frequency, gain = unit.told(_array(response.frequency)), _array(response.gain[j])
    low, high = _array(response.low[j]), _array(response.high[j])
    seen = np.isfinite(gain) & (gain > 0.0)
    if not seen.any():
        axes.text(0.5, 0.5, "not in the input", ha="center", transform=axes.transAxes)
        return
    banded = seen & np.isfinite(high)
    floor = 0.1 * float(gain[seen].min())
    axes.fill_between(frequency[banded], np.maximum(low[banded], floor), high[banded], color=BAND_COLOUR, label="95 %")
    axes.loglog(frequency[seen], gain[seen], color=PALETTE[0], label=name)
    axes.set_xlabel(unit.label)
    axes.set_ylabel(f"gain [{of}]")
    axes.legend(loc="lower left")


def _coherence(axes: Axes, response: ResponseRecord, unit: FrequencyUnit) -> None:
    frequency, coherence = unit.told(_array(response.frequency)), _array(response.coherence)
    known = np.isfinite(coherence)
    axes.semilogx(frequency[known], coherence[known], color=PALETTE[2])
    axes.set_ylim(0.0, 1.02)
    axes.set_xlabel(unit.label)
    axes.set_ylabel("coherence")
