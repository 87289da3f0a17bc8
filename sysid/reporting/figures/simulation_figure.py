"""A picture of a simulation: inputs above, outputs below, channels of one unit on one axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sysid.reporting.figures.style import new_figure, series_style, styled
from sysid.reporting.figures.thinning import thin
from sysid.traces import Trace

COLUMNS = 600
"""How finely lines are drawn: up to four points in each of so many columns."""


def simulation_figure(trace: Trace, inputs: Sequence[str], *, outside: NDArray[np.bool_], title: str = "") -> Figure:
    """Draw every channel of a simulation.

    Args:
        trace: Inputs and outputs.
        inputs: Which of the channels are inputs.
        outside: Samples whose inputs are outside the declared range, shape ``(n_samples,)``; shaded.
        title: Stands above.

    Returns:
        The figure, not known to pyplot.
    """
    groups: dict[tuple[bool, str], list[str]] = {}
    for channel in trace.channels:
        groups.setdefault((channel.name not in inputs, channel.unit), []).append(channel.name)
    ordered = sorted(groups.items(), key=lambda entry: entry[0][0])
    with styled():
        figure = new_figure(7.6, 1.2 + 2.2 * len(ordered))
        axes = figure.subplots(len(ordered), 1, sharex=True, squeeze=False)[:, 0]
        number = 0
        for axis, ((_, unit), names) in zip(axes, ordered, strict=True):
            for name in names:
                style = {key: value for key, value in series_style(number).items() if key != "marker"}
                axis.plot(*thin(trace.time, trace[name], COLUMNS), label=name, **style)
                number += 1
            edges = np.flatnonzero(np.diff(np.concatenate([[False], outside, [False]]).astype(np.int8)))
            for begin, end in edges.reshape(-1, 2):
                left, right = trace.time[begin], trace.time[min(end, len(trace) - 1)]
                axis.axvspan(left, right, color="0.88", linewidth=0.0, zorder=0)
            axis.set_ylabel(f"{', '.join(names)} [{unit}]")
            if len(names) > 1:
                axis.legend(loc="best")
        axes[0].set_title(title)
        axes[-1].set_xlabel("time [s]" + ("; shaded: outside the declared range" if outside.any() else ""))
        axes[-1].set_xlim(float(trace.time[0]), float(trace.time[-1]) if len(trace) > 1 else float(trace.time[0]) + 1.0)
        return figure
