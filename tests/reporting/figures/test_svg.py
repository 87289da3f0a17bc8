"""Figures made small: what is drawn stays where it was."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from sysid.reporting.figures.style import Drawing, new_figure, styled
from sysid.reporting.figures.svg import FAR, relative_path, svg

POINT = st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4))


def walk(path: str) -> list[tuple[float, float]]:
    """The points that a relative path of lines passes through, read by the letter of the SVG specification."""
    points: list[tuple[float, float]] = []
    x = y = 0.0
    for command, rest in re.findall(r"([MLlhvz])([^MLlhvz]*)", path):
        numbers = [float(text) for text in re.findall(r"-?\d*\.?\d+", rest)]
        if command == "M":
            x, y = numbers
        elif command == "l":
            x, y = x + numbers[0], y + numbers[1]
        elif command == "h":
            x += numbers[0]
        elif command == "v":
            y += numbers[0]
        points.append((x, y))
    return points


def busy() -> Figure:
    """A figure with what is placed late: ticks of a log axis, a legend, names in a foreign script, a second panel."""
    with styled():
        figure = new_figure(5.0, 3.0)
        left, right = figure.subplots(1, 2)
        left.semilogy(np.arange(9.0), np.exp(np.arange(9.0)), label="$a$ \u4e2d")
        left.legend()
        right.bar(["one", "two $x$", "three"], [1.0, 2e5, 3.0])
        right.set(title="a title", xlabel="x", ylabel="y in V")
    return figure


def test_a_figure_that_is_drawn_once_is_what_matplotlib_makes_in_two_drawings(monkeypatch: pytest.MonkeyPatch) -> None:
    words = {"title": "t", "description": "d", "name": "n"}
    once = svg(busy(), **words)
    monkeypatch.setattr(Drawing, "savefig", Figure.savefig)
    assert once == svg(busy(), **words)


@given(st.lists(POINT, min_size=1, max_size=30))
def test_no_point_of_a_line_moves_by_more_than_half_a_hundredth(points: list[tuple[float, float]]) -> None:
    absolute = " \n".join(f"{'L' if i else 'M'} {x:f} {y:f}" for i, (x, y) in enumerate(points))
    assert np.allclose(walk(relative_path(absolute)), points, rtol=0.0, atol=0.00501)


@pytest.mark.parametrize(
    ("absolute", "relative"),
    [
        pytest.param("M 1 2 C 2 3 4 5 6 7 z", "M1 2c1 1 3 3 5 5z", id="curve"),
        pytest.param("M 0 0 L 1e400 0", f"M0 0h{FAR:.0f}", id="beyond-any-number"),
        pytest.param("M 5 5 L 6 6 z M 1 1 L 2 1", "M5 5l1 1zM1 1h1", id="two-outlines"),
        pytest.param("M 0 0 Q 1 1 2 0", "M0 0q1 1 2 0", id="parabola"),
    ],
)
def test_every_command_is_written_from_point_to_point(absolute: str, relative: str) -> None:
    assert relative_path(absolute) == relative


def test_markers_say_once_how_they_look() -> None:
    figure = Figure()
    figure.subplots().plot(np.arange(50.0), np.sin(np.arange(50.0)), "o")
    text = svg(figure, title="t", description="d", name="one")
    used = re.findall(r"<use[^>]*>", text)
    assert len(used) >= 50
    assert sum("style" in mark for mark in used) < 25
