"""Charts show all that they name."""

import pytest

from sysid.reporting.charts import Chart, Line, chart_figure


@pytest.mark.parametrize("letters", [5, 20, 30, 48, 70])
def test_names_above_a_chart_are_not_cut_off(letters: int) -> None:
    lines = tuple(Line(name=f"{i}" + "n" * (letters - 1), x=(0.0, 1.0), y=(0.0, float(i))) for i in range(5))
    figure = chart_figure(Chart(title="All", caption="", x="x", y="y", lines=lines))
    figure.canvas.draw()
    legend = figure.axes[0].get_legend().get_window_extent()
    assert legend.x1 <= figure.bbox.x1
