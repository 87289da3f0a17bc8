"""A first look at a record."""

from __future__ import annotations

import numpy as np

from sysid.reporting.figures.record_figure import MOST_CHANNELS, record_figure


def test_every_channel_has_a_row_with_all_its_extremes() -> None:
    time = np.arange(10_000.0)
    spike = np.zeros(10_000)
    spike[5_017] = 9.0
    figure = record_figure(time, {"a [V]": np.sin(time), "b [kPa]": spike}, title="both")
    assert [axes.get_ylabel() for axes in figure.axes] == ["a [V]", "b [kPa]"]
    assert figure.axes[1].lines[0].get_ydata().max() == 9.0


def test_missing_samples_are_marked_and_disorder_is_drawn_in_order() -> None:
    time = np.array([0.0, 2.0, 1.0, 3.0])
    figure = record_figure(time, {"a": np.array([0.0, 2.0, np.nan, 3.0])}, title="holes")
    line, marks = figure.axes[0].lines
    np.testing.assert_array_equal(line.get_xdata(), [0.0, 1.0, 2.0, 3.0])
    np.testing.assert_array_equal(marks.get_xdata(), [1.0])


def test_a_file_with_many_columns_shows_its_first() -> None:
    figure = record_figure(np.arange(3.0), {str(n): np.ones(3) for n in range(40)}, title="many")
    assert len(figure.axes) == MOST_CHANNELS
