"""The look that all figures share."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.reporting.figures.style import logarithmic, new_figure, styled


@pytest.mark.parametrize("across", [False, True])
def test_what_hardly_changes_has_ticks_that_can_be_told_apart(across: bool) -> None:
    """A learning curve that fell by a millionth had eight ticks of 0.370618."""
    with styled():
        axes = new_figure(6.0, 3.0).subplots()
        values, other = 0.370618 + 1e-9 * np.arange(9.0), np.arange(9.0)
        axes.plot(*((values, other) if across else (other, values)))
        logarithmic(axes, across=across)
        axes.figure.canvas.draw()
        axis = axes.xaxis if across else axes.yaxis
        low, high = axes.get_xlim() if across else axes.get_ylim()
        labels = [one.get_text() for one in (*axis.get_ticklabels(), *axis.get_ticklabels(minor=True))]
    assert low < values.min() and values.max() < high
    assert high / low == pytest.approx(1.1)
    shown = [label for label in labels if label]
    assert len(shown) == len(set(shown))


def test_nothing_that_has_a_logarithm_leaves_the_axis_as_it_is() -> None:
    axes = new_figure(6.0, 3.0).subplots()
    axes.plot([0.0, 1.0], [0.0, np.nan])
    logarithmic(axes)
    assert axes.get_yscale() == "linear"
