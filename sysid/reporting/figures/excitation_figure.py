"""Signals of an experiment: over time, and which frequencies they hold."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from sysid.excitation import Excitation
from sysid.reporting.figures.style import PALETTE, new_figure, styled
from sysid.reporting.figures.thinning import thin
from sysid.reporting.frequency import HERTZ

_COLUMNS = 900
MOST_CHANNELS = 8


def excitation_figure(found: Excitation) -> Figure:
    """Draw an excitation.

    Args:
        found: The signals.

    Returns:
        One row a channel: the signal, and its spectrum.
    """
    shown = list(zip(found.names, found.units, found.values.T, strict=True))[:MOST_CHANNELS]
    base = 1.0 / (len(found) * found.plan.sample_time)
    frequency = base * np.arange(1, len(found) // 2 + 1, dtype=np.float64)
    with styled():
        figure = new_figure(7.6, 0.8 + 1.5 * len(shown))
        rows = figure.subplots(len(shown), 2, squeeze=False, sharex="col")
        for number, ((left, right), (name, unit, x)) in enumerate(zip(rows, shown, strict=True)):
            colour = PALETTE[number % len(PALETTE)]
            left.plot(*thin(found.time, x, _COLUMNS), color=colour, drawstyle="steps-post")
            left.set_ylabel(f"{name} [{unit}]")
            size = np.abs(np.fft.rfft(x - x.mean()))[1:] / len(x)
            every = -(-len(size) // _COLUMNS)
            # Of many lines the highest of each few: a spectrum of lines is no curve.
            whole = len(size) // every * every
            top = size[:whole].reshape(-1, every)
            place = np.arange(0, whole, every) + top.argmax(axis=1)
            right.plot(frequency[place], size[place], ".", color=colour, markersize=2.5)
            right.set_ylim(0.0, 1.1 * max(float(size.max(initial=0.0)), 1e-300))
            right.set_ylabel("amplitude")
        rows[-1, 0].set_xlabel("time [s]")
        rows[-1, 1].set_xlabel(HERTZ.label)
        return figure
