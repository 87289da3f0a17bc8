"""Pictures of a sweep: figures over all trials, maps over two ranges, the Pareto front, parallel coordinates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from sysid.reporting.figures.style import PALETTE, TARGET, new_figure, styled
from sysid.reporting.sweep.tables import PublishedRank
from sysid.reporting.sweep_record import SweepRecord, Trial

COLOURS = "cividis"
"""A map that is even in lightness, and the same to those who see red and green alike."""

MAX_PANELS = 12
"""Maps beside each other; with more, each is too small to read."""

NAME_SIZE = np.array([62.0, 12.0])
"""Width and height of a structure's name on a figure, in pixels."""

MAX_LINES = 600
"""Lines of parallel coordinates: beyond these they are one grey."""
FEW, LAST_COLOUR = 40, 0.75
"""Trials up to which each can be drawn large; and the share of the colour map that can be seen on white."""


def over_trials_figure(
    record: SweepRecord, name: str, *, title: str, published: Sequence[PublishedRank] = ()
) -> Figure:
    """A figure of merit over the number of the trial, as in Lopes 2021, figures 4.13 and 4.14.

    Args:
        record: The sweep.
        name: The figure of merit.
        title: Stands above.
        published: Published rows, each drawn at the trial of the same structure.

    Returns:
        The figure: trials in full, those that were dropped, the best, those chosen by hand, and published ones.
    """
    with styled():
        figure = new_figure(7.6, 3.4)
        axes = figure.subplots()
        axes.set_title(title, pad=24.0)
        full, dropped = record.tried_in_full, [t for t in record.trials if t.usable and t.dropped_at is not None]
        _dots(axes, record, full, name, color=PALETTE[0], marker=".", label="trained in full")
        if dropped:
            _dots(axes, record, dropped, name, color="#AAAAAA", marker=".", label="dropped before its end")
        best = min(full, key=lambda trial: _value(record, trial, name), default=None)
        if best is not None and math.isfinite(_value(record, best, name)):
            label = f"least: {best.label}"
            _dots(axes, record, [best], name, color=PALETTE[1], marker="s", label=label, markersize=6.0)
        hand = [trial for trial in record.beside if trial.number <= record.points]
        if hand:
            _dots(axes, record, hand, name, color=TARGET, marker="x", label="chosen by hand", markersize=6.0)
        theirs = _published_points(record, published, name)
        if theirs:
            label = f"published: best {len(theirs)}, {published[0].source}"
            at, values = list(theirs), list(theirs.values())
            axes.plot(at, values, linestyle="none", color=PALETTE[2], marker="D", markersize=4.5, label=label)
        _log(axes, [_value(record, trial, name) for trial in record.trials])
        axes.set_xlabel("trial")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_ylabel(record.words(name))
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.1)
        return figure


def _published_points(record: SweepRecord, published: Sequence[PublishedRank], name: str) -> dict[int, float]:
    """Published values by the number of the trial that has the same structure."""
    numbers = {trial.label: trial.number for trial in record.trials}
    known = [rank for rank in published if rank.structure in numbers]
    return {numbers[rank.structure]: rank.run_time if name == "run_time" else rank.mse for rank in known}


def heat_maps(record: SweepRecord, name: str) -> Figure | None:
    """A figure of merit over two ranges, one map for each value of the third and fourth.

    The two longest ranges are the axes; of trials that share a place the best one is shown.

    Args:
        record: The sweep.
        name: The figure of merit.

    Returns:
        The figure; ``None`` with fewer than two ranges, or with too many maps to read.
    """
    axes_names = _ranges(record)
    if len(axes_names) < 2:
        return None
    lengths = {axis: len(_values(record, axis)) for axis in axes_names}
    x = max(axes_names, key=lambda axis: lengths[axis])
    y = max((axis for axis in axes_names if axis != x), key=lambda axis: lengths[axis])
    others = [axis for axis in axes_names if axis not in {x, y}]
    places = sorted({tuple(repr(t.values.get(axis)) for axis in others) for t in record.trials})
    if len(places) > MAX_PANELS:
        return None
    panels = [_grid(record, name, (x, y), dict(zip(others, place, strict=True))) for place in places]
    every = np.concatenate([panel[np.isfinite(panel)] for panel in panels])
    if not len(every):
        return None
    with styled():
        columns = min(3, len(places))
        rows = -(-len(places) // columns)
        figure = new_figure(7.6, 0.7 + 1.9 * rows)
        norm = LogNorm(every.min(), every.max()) if every.min() > 0.0 else Normalize(every.min(), every.max())
        drawn = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
        image: Any = None
        for axes, place, panel in zip(drawn.ravel(), places, panels, strict=False):
            image = axes.imshow(panel, origin="lower", aspect="auto", cmap=COLOURS, norm=norm, interpolation="nearest")
            axes.set_title(", ".join(f"{a} {v}" for a, v in zip(_words(others), place, strict=True)), fontsize=8.5)
            axes.grid(visible=False)
            _ticks(axes, record, x, y)
        for axes in drawn.ravel()[len(places) :]:
            axes.set_visible(False)
        figure.supxlabel(_words([x])[0], fontsize=9)
        figure.supylabel(_words([y])[0], fontsize=9)
        figure.colorbar(image, ax=drawn, label=record.words(name), shrink=0.9)
        return figure


def pareto_figure(record: SweepRecord) -> Figure:
    """The first two objectives against each other, with the trials that no other beats in both.

    Args:
        record: The sweep.

    Returns:
        The figure.
    """
    first, second = [*record.objectives, "operations"][:2]
    with styled():
        figure = new_figure(7.6, 3.8)
        axes = figure.subplots()
        full = record.tried_in_full
        _pairs(axes, record, full, (second, first), color="#AAAAAA", marker=".", label="trained in full")
        front = sorted(record.front([first, second]), key=lambda trial: _value(record, trial, second))
        _pairs(axes, record, front, (second, first), color=PALETTE[0], marker="o", linestyle="-", label="Pareto front")
        winner = record.winning
        if winner is not None:
            style = {"color": PALETTE[1], "marker": "s", "markersize": 7.0}
            _pairs(axes, record, [winner], (second, first), label=f"winner: {winner.label}", **style)
        if record.beside:
            style = {"color": TARGET, "marker": "x", "markersize": 7.0}
            _pairs(axes, record, record.beside, (second, first), label="chosen by hand", **style)
        _log(axes, [_value(record, trial, first) for trial in full])
        if all(_value(record, trial, second) > 0.0 for trial in full):
            axes.set_xscale("log")
        named = [(_value(record, trial, second), _value(record, trial, first), trial.label) for trial in front]
        for x, y, label in _apart(axes, named):
            axes.annotate(label, (x, y), textcoords="offset points", xytext=(4, 4), fontsize=7)
        axes.set_xlabel(record.words(second))
        axes.set_ylabel(record.words(first))
        axes.legend(loc="upper right")
        return figure


def parallel_figure(record: SweepRecord) -> Figure | None:
    """Every trial as a line through its value in each range and its figures, coloured by the one that chooses.

    Args:
        record: The sweep.

    Returns:
        The figure; ``None`` without a range.
    """
    ranges = _ranges(record)
    trials = sorted(record.tried_in_full, key=record.choice, reverse=True)[-MAX_LINES:]
    trials = [trial for trial in trials if math.isfinite(record.choice(trial))]
    if not ranges or len(trials) < 2:
        return None
    figures = list(dict.fromkeys([record.choose_by, *record.objectives]))
    columns: list[tuple[str, NDArray[np.float64], list[str], list[float]]] = []
    for axis in ranges:
        values = _values(record, axis)
        at = np.array([values.index(repr(t.values[axis])) if axis in t.values else np.nan for t in trials])
        n = max(1, len(values) - 1)
        shown = sorted({0, n // 2, len(values) - 1})
        columns.append((_words([axis])[0], at / n, [values[i].strip("'") for i in shown], [i / n for i in shown]))
    for name in figures:
        raw = np.array([_value(record, trial, name) for trial in trials])
        columns.append((record.words(name), *_unit(raw)))
    with styled():
        figure = new_figure(7.6, 3.8)
        axes = figure.subplots()
        paint = _colours(np.array([record.choice(trial) for trial in trials]))
        lines = np.stack([column[1] for column in columns])
        thin = 1.4 if len(trials) <= FEW else 0.6
        for i in range(len(trials)):
            last = i == len(trials) - 1
            axes.plot(lines[:, i], color=PALETTE[1] if last else paint[i], linewidth=2.2 if last else thin)
        for number, (_, _, texts, places) in enumerate(columns):
            axes.axvline(number, color=TARGET, linewidth=0.8)
            for text, place in zip(texts, places, strict=True):
                box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 0.8}
                axes.text(number + 0.03, place, text, fontsize=7, va="center", bbox=box)
        axes.set_xticks(range(len(columns)), [column[0] for column in columns], fontsize=7.5)
        axes.set_yticks([])
        axes.set_xlim(-0.1, len(columns) - 0.6)
        axes.grid(visible=False)
        axes.set_title(f"{len(trials)} trials in full; the best by {record.words(record.choose_by)} is drawn bold")
        return figure


def _value(record: SweepRecord, trial: Trial, name: str) -> float:
    return record.figure(trial, name)


def _dots(axes: Axes, record: SweepRecord, trials: Sequence[Trial], name: str, **style: Any) -> None:
    values = [_value(record, trial, name) for trial in trials]
    look = {"linestyle": "none", "markersize": 7.0 if len(record.trials) <= FEW else 3.0, **style}
    axes.plot([trial.number for trial in trials], values, **look)


def _pairs(axes: Axes, record: SweepRecord, trials: Sequence[Trial], names: tuple[str, str], **style: Any) -> None:
    x, y = ([_value(record, trial, name) for trial in trials] for name in names)
    size = 7.0 if len(record.trials) <= FEW else 4.0
    axes.plot(x, y, **{"linestyle": "none", "markersize": size, "linewidth": 1.0, **style})


def _log(axes: Axes, values: Sequence[float]) -> None:
    known = [value for value in values if math.isfinite(value)]
    if known and min(known) > 0.0:
        axes.set_yscale("log")


def _ranges(record: SweepRecord) -> list[str]:
    """Fields in which the trials differ, in the order of the grid."""
    names = list(dict.fromkeys(name for trial in record.trials for name in trial.values))
    return [name for name in names if len(_values(record, name)) > 1]


def _values(record: SweepRecord, name: str) -> list[str]:
    """The values of a range as text: numbers in their order, words as they come."""
    found = {repr(trial.values[name]): trial.values[name] for trial in record.trials if name in trial.values}
    numbers = all(isinstance(value, int | float) for value in found.values())
    return sorted(found, key=lambda text: found[text]) if numbers else list(found)


def _words(names: Sequence[str]) -> list[str]:
    return [name.removeprefix("training.").replace("_", " ") for name in names]


def _grid(record: SweepRecord, name: str, axes: tuple[str, str], at: dict[str, str]) -> NDArray[np.float64]:
    x, y = (_values(record, axis) for axis in axes)
    grid = np.full((len(y), len(x)), np.nan)
    for trial in record.tried_in_full:
        if any(repr(trial.values.get(axis)) != value for axis, value in at.items()) or set(axes) - set(trial.values):
            continue
        i, j = y.index(repr(trial.values[axes[1]])), x.index(repr(trial.values[axes[0]]))
        grid[i, j] = np.fmin(grid[i, j], _value(record, trial, name))
    return grid


def _ticks(axes: Axes, record: SweepRecord, x: str, y: str) -> None:
    for values, ticks in ((_values(record, x), axes.set_xticks), (_values(record, y), axes.set_yticks)):
        step = max(1, len(values) // 5)
        shown = range(step - 1 if step > 1 else 0, len(values), step)
        ticks(list(shown), [values[i].strip("'") for i in shown], fontsize=7)


def _apart(axes: Axes, named: Sequence[tuple[float, float, str]]) -> list[tuple[float, float, str]]:
    """Those of the named points whose names can be read: the ends first, then whatever does not meet a name before."""
    axes.get_xlim(), axes.get_ylim()  # settles the scales, which matplotlib leaves until it draws
    order = [*named[:1], *named[-1:], *named[1:-1]]
    kept: list[tuple[float, float, str]] = []
    places: list[NDArray[np.float64]] = []
    for point in order:
        place = axes.transData.transform(point[:2])
        if all((np.abs(place - other) > NAME_SIZE).any() for other in places):
            kept.append(point)
            places.append(place)
    return kept


def _unit(raw: NDArray[np.float64]) -> tuple[NDArray[np.float64], list[str], list[float]]:
    """Values between 0 and 1, logarithmic where they are positive, with the ends as texts."""
    scaled = np.log(raw) if np.nanmin(raw) > 0.0 else raw
    low, high = np.nanmin(scaled), np.nanmax(scaled)
    span = high - low if high > low else 1.0
    return (scaled - low) / span, [f"{np.nanmin(raw):.3g}", f"{np.nanmax(raw):.3g}"], [0.0, 1.0]


def _colours(values: NDArray[np.float64]) -> list[tuple[float, float, float, float]]:
    import matplotlib as mpl

    order = np.argsort(np.argsort(values)) / max(1, len(values) - 1)
    # The far end of the map is a yellow that nobody sees on white.
    return [tuple(colour) for colour in mpl.colormaps[COLOURS](LAST_COLOUR * order, alpha=0.6)]
