"""The picture of loss against number of parameters."""

from __future__ import annotations

import numpy as np

from sysid.estimation.linear.order_search import OrderLosses
from sysid.reporting.figures.order_figure import OrderCurve, order_figure, states_figure


def losses() -> OrderLosses:
    na = np.array([1, 1, 2, 2], dtype=np.int16)
    nb = np.array([[1], [2], [1], [2]], dtype=np.int16)
    mse = np.array([1.0, 0.5, 0.6, 0.495])
    return OrderLosses(na=na, nb=nb, nk=nb, mse=mse, n_samples=100, intercept=True)


def test_the_best_of_each_size_and_the_choices_are_drawn() -> None:
    (axes,) = order_figure(OrderCurve.of(losses()), unit="psi").axes
    best = axes.lines[0].get_xydata()
    np.testing.assert_allclose(best, [[3, 1.0], [4, 0.5], [5, 0.495]])
    assert [line.get_xydata().tolist() for line in axes.lines[1:]] == [[[4, 0.5]]] * 3
    assert "psi²" in axes.get_ylabel()


def test_a_bar_for_every_state_shows_its_correlation() -> None:
    (axes,) = states_figure([0.99, 0.9, 0.2]).axes
    assert [bar.get_height() for bar in axes.patches] == [0.99, 0.9, 0.2]
