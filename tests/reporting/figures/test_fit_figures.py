"""Figures: the same bytes every time, readable, and untouched by what runs away."""

from __future__ import annotations

import re
import sys
import xml.etree.ElementTree as ET

import matplotlib as mpl
import numpy as np
import pytest

from sysid.reporting.figures.fit_figures import (
    Series,
    case_figure,
    cases_caption,
    cases_figure,
    instants_figure,
    learning_figure,
)
from sysid.reporting.figures.style import DASHES, MARKERS, PALETTE, series_style
from sysid.reporting.figures.svg import svg
from sysid.reporting.fit_records import LearningCurve
from sysid.reporting.signals import CaseSignals
from sysid.reporting.worst_instants import Instant

TIME = 0.1 * np.arange(20_000)
TARGET = 30.0 + 20.0 * np.sin(TIME / 60.0)
NOISE = 0.01 * np.random.default_rng(1).standard_normal(len(TIME))


def _svg(simulated: np.ndarray, **options: object) -> str:
    figure = case_figure(TIME, TARGET, simulated, title="VAL01", label="BC", unit="psi", **options)  # type: ignore[arg-type]
    return svg(figure, title="a <title>", description="what & why", name="one")


def test_a_figure_is_the_same_to_the_byte() -> None:
    assert _svg(TARGET + NOISE) == _svg(TARGET + NOISE)


def test_a_figure_is_well_formed_named_described_and_in_words_that_can_be_searched() -> None:
    root = ET.fromstring(_svg(TARGET + NOISE, predicted=TARGET))  # noqa: S314 - our own drawing
    assert root.get("role") == "img"
    assert root.findtext("title") == "a <title>"
    assert root.findtext("desc") == "what & why"
    texts = {element.text for element in root.iter("text")}
    assert {"BC [psi]", "error [psi]", "time [s]", "target", "free run", "one step ahead", "VAL01"} <= texts


def test_ids_carry_the_name_of_the_figure_and_every_reference_is_met() -> None:
    text = _svg(TARGET)
    ids = set(re.findall(r'\bid="([^"]*)"', text))
    assert all(name.startswith("one-") for name in ids)
    assert set(re.findall(r'(?:href="#|url\(#)([^")]*)', text)) <= ids
    assert "http" not in text


def test_20000_noisy_samples_are_a_small_file() -> None:
    assert len(_svg(TARGET + NOISE)) < 50_000


def test_no_global_state_is_touched() -> None:
    before, open_before = dict(mpl.rcParams), _open_figures()
    _svg(TARGET)
    assert dict(mpl.rcParams) == before
    assert _open_figures() == open_before


def _open_figures() -> list[int]:
    """Those that pyplot keeps; another test of the process may have left some."""
    return sys.modules["matplotlib.pyplot"].get_fignums() if "matplotlib.pyplot" in sys.modules else []


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        pytest.param(1e6, "the free run leaves these axes", id="runs-away"),
        pytest.param(np.inf, "the free run diverges", id="infinite"),
        pytest.param(np.nan, "the free run diverges", id="nan"),
    ],
)
def test_a_free_run_that_leaves_does_not_squeeze_the_target(bad: float, words: str) -> None:
    simulated = TARGET.copy()
    simulated[10_000:] = bad
    figure = case_figure(TIME, TARGET, simulated, title="VAL01", label="BC", unit="psi")
    low, high = figure.axes[0].get_ylim()
    assert high - low < 3.0 * np.ptp(TARGET)
    assert words in svg(figure, title="t", description="d", name="one")


@pytest.mark.parametrize("samples", [1, 2, 5])
def test_a_constant_target_and_a_handful_of_samples_can_be_drawn(samples: int) -> None:
    constant = np.full(samples, 90.0)
    figure = case_figure(TIME[:samples], constant, constant, title="A", label="BP", unit="psi")
    assert "<path" in svg(figure, title="t", description="d", name="one")


def test_series_differ_in_line_and_marker_as_well_as_colour() -> None:
    assert len({*PALETTE}) == len({*map(str, DASHES)}) == len(PALETTE) == len({*MARKERS}) - 1
    assert len({str(series_style(index)) for index in range(40)}) == 40


def test_what_cannot_stand_on_a_logarithmic_axis_is_left_out() -> None:
    series = [
        Series(name="a", values={"A": 1e-3, "B": float("nan")}),
        Series(name="published", values={"B": 0.0}, published=True),
    ]
    axes = cases_figure(series, ["A", "B"], quantity="mse [psi²]").axes[0]
    drawn = [np.isfinite(np.asarray(line.get_ydata(), dtype=float)).sum() for line in axes.lines]
    assert drawn == [1, 0]
    curve = LearningCurve(iteration=[0.0, 1.0, 2.0], mse=[1.0, float("nan"), 0.0])
    assert learning_figure({"a": curve}, unit="psi²").axes[0].get_yscale() == "log"


def test_what_has_no_error_has_no_logarithm_and_the_caption_says_so() -> None:
    """Of an output that never changes every fit is exact; matplotlib warned on the screen."""
    exact = [Series(name="a", values={"A": 0.0, "B": 0.0})]
    axes = cases_figure(exact, ["A", "B"], quantity="mse").axes[0]
    assert axes.get_yscale() == "linear"
    assert cases_caption(exact, "Free-run mse", "fit").endswith("A fit without a mark diverges, or has an error of 0.")
    some = [*exact, Series(name="b", values={"A": 1.0, "B": 2.0})]
    assert cases_figure(some, ["A", "B"], quantity="mse").axes[0].get_yscale() == "log"
    assert cases_caption(some[1:], "Free-run mse", "fit").endswith("A fit without a mark diverges.")


@pytest.mark.parametrize(
    ("mse", "shown", "never"), [((0.0065, 0.0082), "0.008", "×10"), ((1e-9, 1e-3), "10⁻⁶", "0.000001")]
)
def test_numbers_of_a_logarithmic_axis_are_plain_where_tables_have_plain_ones(
    mse: tuple[float, float], shown: str, never: str
) -> None:
    curve = LearningCurve(iteration=[0, 1], mse=list(mse), effective_parameters=[1.0, 1.0], elapsed_s=[0.0, 0.1])
    text = svg(learning_figure({"a": curve}, unit="V²"), title="t", description="d", name="n")
    assert f">{shown}<" in text
    assert never not in text


def test_the_title_of_an_instant_is_not_cut_where_its_case_has_a_long_name() -> None:
    signals = CaseSignals(time=TIME, target=TARGET, simulated=TARGET + 2540.0, predicted=None)
    there = {"case": "validation", "sample": 7, "time": 4779.88, "target": 30.0, "simulated": 2570.0}
    instants = [Instant(**there, first=0, last=99) for _ in range(3)]
    figure = instants_figure(instants, {"validation": signals}, title="t", label="speed", unit="1")
    text = svg(figure, title="t", description="d", name="n")
    assert "4779.88 s: +2540" in text
    assert "e+03" not in text
    assert "…" not in text
