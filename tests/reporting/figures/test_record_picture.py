"""A first look at a record: what is drawn stands where it is measured."""

from __future__ import annotations

import re
import subprocess
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from sysid.reporting.figures.palette import PALETTE
from sysid.reporting.figures.record_picture import MOST_CHANNELS, Axis, record_picture
from sysid.reporting.figures.svg import as_file


def read(drawing: str | bytes) -> ET.Element:
    return ET.fromstring(drawing)  # noqa: S314 - our own


def drawn(time: NDArray[np.float64], channels: dict[str, NDArray[np.float64]]) -> ET.Element:
    return read(record_picture(time, channels, title="a <record>", description="two & more"))


def texts(root: ET.Element) -> list[str]:
    return [element.text or "" for element in root.iter("text")]


def paths(root: ET.Element, colour: str) -> list[list[list[tuple[float, float]]]]:
    """The lines of a colour, each by its parts without gaps, as points."""
    found = []
    for element in root.iter("path"):
        if f"stroke:{colour};" in element.get("style", ""):
            lines, x, y = [], 0.0, 0.0
            for command, rest in re.findall(r"([Mlhv])([^Mlhv]*)", element.get("d", "")):
                numbers = [float(text) for text in re.findall(r"-?\d*\.?\d+", rest)]
                if command == "M":
                    lines.append([])
                    x, y = numbers
                else:
                    x += numbers[0] if command in "lh" else 0.0
                    y += numbers[-1] if command in "lv" else 0.0
                lines[-1].append((x, y))
            found.append(lines)
    return found


def test_every_channel_has_a_row_with_all_its_extremes() -> None:
    time = np.arange(10_000.0)
    spike = np.zeros(10_000)
    spike[5_017] = 9.0
    root = drawn(time, {"a [V]": np.sin(time), "b [kPa]": spike})
    labels = texts(root)
    assert {"a <record>", "a [V]", "b [kPa]", "time in s", "0", "5", "4000"} <= set(labels)
    assert root.findtext("desc") == "two & more"
    ((line,),) = paths(root, PALETTE[1])
    x, y = min(line, key=lambda point: point[1])
    first, last = line[0][0], line[-1][0]
    assert x == pytest.approx(first + 5_017 / 9_999 * (last - first), abs=0.5)
    zero, five = _ticks(root, y)
    assert line[0][1] - y == pytest.approx(9 / 5 * (zero - five), abs=0.1)


def _ticks(root: ET.Element, above: float) -> tuple[float, float]:
    """Where 0 and 5 stand beside the row that begins at a height."""
    beside = {
        element.text: float(element.get("y", ""))
        for element in root.iter("text")
        if element.get("text-anchor") == "end" and float(element.get("y", "")) > above - 1.0
    }
    return beside["0"], beside["5"]


def test_missing_samples_are_gaps_and_marked_and_disorder_is_drawn_in_order() -> None:
    time = np.array([0.0, 2.0, 1.0, 3.0, 4.0, 5.0])
    root = drawn(time, {"a": np.array([0.0, 2.0, np.nan, 3.0, np.inf, 1.0])})
    (line,) = paths(root, PALETTE[0])
    begin, end = line[0][0][0], line[-1][0][0]
    places = [[round(5 * (x - begin) / (end - begin), 1) for x, _ in part] for part in line]
    assert places == [[0.0, 0.0], [2.0, 3.0], [5.0, 5.0]]
    marks = next(one for one in paths(root, "#000000") if len(one) == 2)
    assert [round(5 * (mark[0][0] - begin) / (end - begin), 1) for mark in marks] == [1.0, 4.0]


def test_a_file_with_many_columns_shows_its_first() -> None:
    root = drawn(np.arange(3.0), {f"column {n}": np.ones(3) for n in range(40)})
    assert sum(text.startswith("column") for text in texts(root)) == MOST_CHANNELS


@settings(max_examples=200)
@given(st.lists(st.floats(), min_size=1, max_size=3))
def test_any_values_can_be_drawn(values: list[float]) -> None:
    """Constant, all missing, the smallest and the largest that there are: all within the box, ticks as written."""
    given_ = np.array(values)
    axis = Axis.over(given_, 10.0, 110.0)
    finite = given_[np.isfinite(given_)]
    assert ((axis.place(finite) >= 10.0 - 1e-6) & (axis.place(finite) <= 110.0 + 1e-6)).all()
    ticks = axis.ticks(8)
    assert len(ticks) <= 9
    assert len({text for _, text in ticks}) == len(ticks)
    for value, text in ticks:
        assert axis.low <= value <= axis.high
        assert axis.place(np.array(float(text))) == pytest.approx(axis.place(np.array(value)), abs=0.3)
    assert texts(read(record_picture(np.arange(float(len(values))), {"a": given_}, title="", description="")))


@pytest.mark.parametrize(
    ("low", "high", "written"),
    [
        (0.0, 1.0, ["0.0", "0.5", "1.0"]),
        (-3.0, 4.0, ["-2", "0", "2", "4"]),
        (1e6, 4e6, ["1e+06", "2e+06", "3e+06", "4e+06"]),
        (101.31, 101.39, ["101.32", "101.34", "101.36", "101.38"]),
        (0.0, 40_000.0, ["0", "10000", "20000", "30000", "40000"]),
    ],
)
def test_ticks_are_round_numbers(low: float, high: float, written: list[str]) -> None:
    assert [text for _, text in Axis(low=low, high=high, begin=0.0, end=1.0).ticks(4)] == written


def test_a_file_of_its_own_says_what_it_is() -> None:
    drawing = record_picture(np.arange(3.0), {"a": np.ones(3)}, title="a", description="a")
    assert read(as_file(drawing)).tag == "{http://www.w3.org/2000/svg}svg"


def test_nothing_slow_is_imported_for_it() -> None:
    script = "import sys, sysid.reporting.figures.record_picture as _; print({'matplotlib', 'scipy'} & {*sys.modules})"
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert done.stdout == "set()\n"
