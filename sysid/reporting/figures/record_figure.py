"""A first look at a record: every channel over time, with what is missing marked."""

from __future__ import annotations

from collections.abc import Mapping as Dict

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sysid.reporting.figures.style import DASHES, PALETTE, new_figure, styled
from sysid.reporting.figures.thinning import thin

MOST_CHANNELS = 12
"""Rows of a picture that is still read; a file with more shows its first."""

_COLUMNS = 900


def record_figure(time: NDArray[np.float64], channels: Dict[str, NDArray[np.float64]], *, title: str) -> Figure:
    """Draw a record as it stands in its file.

    Args:
        time: Seconds, shape ``(n_samples,)``.
        channels: By label, shape ``(n_samples,)`` each; missing values are gaps, and marked on the time axis.
        title: Stands above.

    Returns:
        The figure, one row a channel.
    """
    shown = dict(list(channels.items())[:MOST_CHANNELS])
    with styled():
        figure = new_figure(7.2, 0.6 + 1.15 * len(shown))
        rows = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
        order = np.argsort(time, kind="stable")
        for number, (axes, (label, values)) in enumerate(zip(rows, shown.items(), strict=True)):
            axes.plot(
                *thin(time[order], values[order], _COLUMNS), color=PALETTE[number % len(PALETTE)], linestyle=DASHES[0]
            )
            missing = time[order][~np.isfinite(values[order])]
            if len(missing):
                axes.plot(
                    missing, np.full(len(missing), 0.02), "|", color="black", transform=axes.get_xaxis_transform()
                )
            axes.set_ylabel(label)
        rows[0].set_title(title)
        rows[-1].set_xlabel("time in s")
    return figure
