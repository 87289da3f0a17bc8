"""Pictures of linear models: Bode and step responses and poles and zeros, with what is uncertain about them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sysid.reporting.figures.style import PALETTE, TARGET, new_figure, styled
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.reporting.linear_views import LinearView
from sysid.units import in_unit, per

if TYPE_CHECKING:
    from sysid.reporting.linear.responses import Bode, StepResponse

BAND_COLOUR = "#DDDDDD"
CLOUD = 600
"""Poles shown of a cloud: more cannot be told apart, and each costs a hundred characters of the page."""
REACH = 1.5
"""How far from the origin the z plane is shown."""
SHOWN = 400
"""Samples shown of a step response."""


def _layout(panels: int) -> tuple[int, int]:
    """Rows and columns of panels that are wide enough for their names."""
    columns = panels if panels <= 3 else 2 if panels == 4 else 3
    return -(-panels // columns), columns


def _named(place: Axes, name: str, *, alone: bool) -> str:
    """The label of a line: its name where it is alone; beside others that is above the panel, where it has room."""
    if not alone:
        place.set_title(name, fontsize=8.5)
    return name if alone else "_" + name


def bode_figure(found: Bode, unit: FrequencyUnit = HERTZ) -> Figure:
    """Magnitude and phase of every pair, with their bands.

    Args:
        found: The responses.
        unit: Of frequencies.

    Returns:
        Two panels a pair, one above the other.
    """
    w, gain, phase = unit.told(found.frequency), found.gain, found.phase
    rows, columns = _layout(len(found.names))
    with styled():
        figure = new_figure(7.6, 4.2 * rows)
        axes = figure.subplots(2 * rows, columns, sharex=True, squeeze=False)
        for one in axes[-2:, len(found.names) - columns * (rows - 1) :].ravel():
            one.set_visible(False)
        for j, (name, (y, u)) in enumerate(zip(found.names, found.units, strict=True)):
            above, below = axes[2 * (j // columns), j % columns], axes[2 * (j // columns) + 1, j % columns]
            if not gain[:, j].any():  # no logarithm has it
                above.text(0.5, 0.5, f"{name}: no effect in the model", ha="center", transform=above.transAxes)
                continue
            if np.isfinite(found.gain_low[:, j]).any():
                above.fill_between(w, found.gain_low[:, j], found.gain_high[:, j], color=BAND_COLOUR, label="95 %")
                below.fill_between(w, found.phase_low[:, j], found.phase_high[:, j], color=BAND_COLOUR)
            above.loglog(w, gain[:, j], color=PALETTE[0], label=_named(above, name, alone=len(found.names) == 1))
            below.semilogx(w, phase[:, j], color=PALETTE[0])
            above.set_ylabel(f"gain [{per(y, u)}]")
            below.set_ylabel("phase [degrees]")
            below.set_xlabel(unit.label)
            if above.get_legend_handles_labels()[1]:
                above.legend(loc="lower left")
        return figure


def step_figure(found: StepResponse) -> Figure:
    """The response of every pair, with its band.

    Args:
        found: The responses.

    Returns:
        One panel a pair.
    """
    every = -(-len(found.time) // SHOWN)
    time, shape = found.time[::every], "steps-post" if every == 1 else "default"
    rows, columns = _layout(len(found.names))
    with styled():
        figure = new_figure(7.6, 2.8 * rows)
        axes = figure.subplots(rows, columns, squeeze=False).ravel()
        for one in axes[len(found.names) :]:
            one.set_visible(False)
        for j, (place, name, (y_unit, u_unit)) in enumerate(zip(axes, found.names, found.units, strict=False)):
            y = found.values[:, j]
            if np.isfinite(found.low[:, j]).any():
                # A draw that is not stable must not take the picture with it.
                room = max(float(np.ptp(y)), 1e-12)
                ends = (np.clip(one[::every, j], y.min() - room, y.max() + room) for one in (found.low, found.high))
                held = "post" if every == 1 else None
                place.fill_between(time, *ends, step=held, color=BAND_COLOUR, linewidth=0.0, label="95 %")
            label = _named(place, f"{name}, {in_unit('1', u_unit)}", alone=len(found.names) == 1)
            place.plot(time, y[::every], drawstyle=shape, color=PALETTE[0], label=label)
            place.set_xlabel("time [s]")
            place.set_ylabel(f"{found.outputs[j]} [{y_unit}]")
            if place.get_legend_handles_labels()[1]:
                place.legend()
        return figure


def pole_zero_figure(views: Sequence[LinearView]) -> Figure:
    """Poles and zeros of every input, with the cloud of poles that the uncertainty allows.

    Args:
        views: From each input to each output, one or more; without draws there is no cloud.

    Returns:
        One panel a view.
    """
    with styled():
        (rows, columns), named = _layout(len(views)), set[tuple[str, ...]]()
        figure = new_figure(7.6, rows * min(3.8, 7.6 / columns + 0.7))
        grid = figure.subplots(rows, columns, squeeze=False)
        for one in grid[:, 0]:
            one.set_ylabel("imaginary part" if views[0].discrete else "imaginary part [1/s]")
        for one in grid.ravel()[len(views) :]:
            one.set_visible(False)
        for place, view in zip(grid.ravel(), views, strict=False):
            poles, zeros = view.roots(view.F[0]), view.roots(view.B[0])
            draws = view.F[1 : 1 + CLOUD // max(len(poles), 1)]
            if len(draws):
                cloud = np.concatenate([view.roots(f) for f in draws])
                place.plot(cloud.real, cloud.imag, ".", color="#BBBBBB", markersize=2, label=f"{len(draws)} draws")
            for roots, marker, kind in ((poles, "x", "poles"), (zeros, "o", "zeros")):
                far = int(np.count_nonzero(np.abs(roots) > REACH)) if view.discrete else 0
                label = f"{kind} ({far} outside)" if far else kind
                place.plot(roots.real, roots.imag, marker, color=PALETTE[0], fillstyle="none", label=label)
            if view.discrete:
                angle = np.linspace(0.0, 2.0 * np.pi, 200)
                place.plot(np.cos(angle), np.sin(angle), color=TARGET, linewidth=0.6)
                place.set_aspect("equal")
                # A zero of fast sampling may lie a hundred units off, and would shrink the circle to a dot.
                place.set_xlim(-REACH, REACH)
                place.set_ylim(-REACH, REACH)
            else:
                place.axvline(0.0, color=TARGET, linewidth=0.6)
            place.set_title(view.name)
            place.set_xlabel("real part" if view.discrete else "real part [1/s]")
            # In a narrow panel a legend hides part of the circle: one that says nothing new is left out.
            if (labels := tuple(place.get_legend_handles_labels()[1])) not in named:
                place.legend(loc="lower left")
            named.add(labels)
        return figure
