"""A first look at a record: every channel over time, with what is missing marked.

Written as SVG by itself: to import the library of the other figures and to draw with it takes as long as all else that
``sysid ingest`` does, and these are lines in boxes.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sysid.names import visible
from sysid.reporting.figures.palette import PALETTE
from sysid.reporting.figures.svg import described, relative_path
from sysid.reporting.figures.thinning import thin

MOST_CHANNELS = 12
"""Rows of a picture that is still read; a file with more shows its first."""

_COLUMNS = 900
_WIDTH, _BOX, _PITCH = 518.4, 62.0, 84.0
"""Points: of the picture, the height of a box, and from box to box."""
_HEAD, _FOOT, _RIGHT = 40.0, 34.0, 14.0
_LETTER = 5.8
"""Points; a digit of the font in which ticks are written, with room to spare."""
_SMALLEST, _LARGEST = 1e-300, float(np.finfo(float).max)
_LONGEST = 80
"""Letters of a label."""
_SMALL: Final = "font-size:9px;fill:#000000"


@dataclass(frozen=True, kw_only=True)
class Axis:
    """From values to places on the picture.

    Args:
        low: The smallest value.
        high: The largest value, above ``low``.
        begin: Place of ``low``, in points.
        end: Place of ``high``.
    """

    low: float
    high: float
    begin: float
    end: float

    @classmethod
    def over(cls, values: NDArray[np.float64], begin: float, end: float) -> Axis:
        """The axis for some values, those that are not finite aside, shape ``(n_samples,)``."""
        finite = values[np.isfinite(values)]
        low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
        if not high / 2 - low / 2 > max(abs(low) * 1e-12, _SMALLEST):  # nothing that ticks could tell apart
            room = max(abs(low) * 0.05, 10.0 * _SMALLEST) if low else 1.0
            low, high = max(low - room, -_LARGEST), min(high + room, _LARGEST)
        return cls(low=low, high=high, begin=begin, end=end)

    def place(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where values stand, in points; halves, as the largest less the smallest may be beyond floating point."""
        return self.begin + (values / 2 - self.low / 2) / (self.high / 2 - self.low / 2) * (self.end - self.begin)

    def ticks(self, most: int) -> list[tuple[float, str]]:
        """Round values and how they are written: 1, 2 or 5 of a power of ten apart, as many as there is room for."""
        step = self.high / most - self.low / most
        power = 10.0 ** np.floor(np.log10(step))
        step = next((times * power for times in (1.0, 2.0, 5.0) if times * power >= step), 10.0 * power)
        first, last = np.ceil(self.low / step), np.floor(self.high / step)
        places = np.clip(np.arange(first, last + 1.0) * step, self.low, self.high)
        values = [float(value) + 0.0 for value in places]
        plain = step > 1e-5 and max(abs(self.low), abs(self.high)) < 1e6
        for digits in range(18):
            texts = [f"{value:.{digits}{'f' if plain else 'g'}}" for value in values]
            if all(abs(float(text) - value) <= 0.01 * step for text, value in zip(texts, values, strict=True)):
                break
        return list(zip(values, texts, strict=True))


def record_picture(
    time: NDArray[np.float64], channels: Dict[str, NDArray[np.float64]], *, title: str, description: str
) -> str:
    """Draw a record as it stands in its file.

    Args:
        time: Seconds, shape ``(n_samples,)``.
        channels: By label, shape ``(n_samples,)`` each; missing values are gaps, and marked on the time axis.
        title: Stands above.
        description: Read aloud as what is shown.

    Returns:
        An SVG element, a row a channel.
    """
    shown = dict(list(channels.items())[:MOST_CHANNELS])
    order = np.argsort(time, kind="stable")
    time = time[order]
    tops = [_HEAD + _PITCH * number for number in range(len(shown))]
    heights = [Axis.over(values, top + _BOX - 3.0, top + 3.0) for values, top in zip(shown.values(), tops, strict=True)]
    longest = max(len(text) for height in heights for _, text in height.ticks(4))
    across = Axis.over(time, 12.0 + _LETTER * longest, _WIDTH - _RIGHT)
    bottom = tops[-1] + _BOX
    root = described(f"0 0 {_WIDTH:g} {bottom + _FOOT:g}", title=title, description=description, name="record")
    ET.SubElement(root, "path", {"d": f"M0 0h{_WIDTH:g}v{bottom + _FOOT:g}h-{_WIDTH:g}z", "style": "fill:#ffffff"})
    _write(root, title, across.begin, 16.0, "font-size:10px;fill:#000000")
    for number, ((label, values), top, height) in enumerate(zip(shown.items(), tops, heights, strict=True)):
        _box(root, across, height, top)
        _write(root, label, across.begin, top - 5.0)
        line = thin(time, values[order], _COLUMNS)
        colour = PALETTE[number % len(PALETTE)]
        _draw(root, _line(across.place(line[0]), height.place(line[1])), f"stroke:{colour};stroke-width:1.3")
        missing = np.unique(np.round(across.place(time[~np.isfinite(values[order])]), 1))
        marks = [f"M {x:.2f} {top + _BOX:.2f} L {x:.2f} {top + _BOX - 6.0:.2f}" for x in missing[np.isfinite(missing)]]
        _draw(root, " ".join(marks), "stroke:#000000;stroke-width:1")
    for value, text in across.ticks(8):
        _write(root, text, float(across.place(np.array(value))), bottom + 13.0, anchor="middle")
    _write(root, "time in s", (across.begin + across.end) / 2, bottom + 27.0, anchor="middle")
    return ET.tostring(root, encoding="unicode")


def _box(root: ET.Element, across: Axis, height: Axis, top: float) -> None:
    """A grid with its ticks, and the two lines on which they stand."""
    bottom = top + _BOX
    grid = []
    for value, text in height.ticks(4):
        y = float(height.place(np.array(value)))
        grid.append(f"M {across.begin:.2f} {y:.2f} L {across.end:.2f} {y:.2f}")
        _write(root, text, across.begin - 5.0, y + 3.0, anchor="end")
    for value, _ in across.ticks(8):
        x = float(across.place(np.array(value)))
        grid.append(f"M {x:.2f} {top:.2f} L {x:.2f} {bottom:.2f}")
    _draw(root, " ".join(grid), "stroke:#dddddd;stroke-width:0.6")
    sides = f"M {across.begin} {top} L {across.begin} {bottom} L {across.end} {bottom}"
    _draw(root, sides, "stroke:#000000;stroke-width:0.8")


def _line(x: NDArray[np.float64], y: NDArray[np.float64]) -> str:
    """From point to point, with a gap where one of them is not finite; a value alone between gaps is a dot."""
    there = np.isfinite(x) & np.isfinite(y)
    parts = []
    for n in np.flatnonzero(there):
        goes_on = n > 0 and there[n - 1]
        parts.append(f"{'L' if goes_on else 'M'} {x[n]:.2f} {y[n]:.2f}")
        if not goes_on and not (n + 1 < len(x) and there[n + 1]):
            parts.append(f"L {x[n] + 0.5:.2f} {y[n]:.2f}")
    return " ".join(parts)


def _draw(root: ET.Element, path: str, style: str) -> None:
    if path:
        ET.SubElement(root, "path", {"d": relative_path(path), "style": f"fill:none;{style}"})


def _write(root: ET.Element, text: str, x: float, y: float, style: str = _SMALL, *, anchor: str = "") -> None:
    placed = {"x": f"{x:.2f}", "y": f"{y:.2f}", "style": style}
    element = ET.SubElement(root, "text", {**placed, **({"text-anchor": anchor} if anchor else {})})
    words = visible(text)
    element.text = words if len(words) <= _LONGEST else f"{words[: _LONGEST - 1]}…"
