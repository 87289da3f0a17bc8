"""A long ARX model as a yardstick: reached by the system that made the record, missed by one that lacks a state."""

import numpy as np
import pytest
from scipy import signal

from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.state_space.search import search
from sysid.estimation.linear.state_space.training import StateSpaceTraining
from sysid.estimation.linear.subspace.starts import Subspace
from sysid.estimation.linear.subspace.windows import Windows
from sysid.estimation.linear.subspace.yardstick import Yardstick, beyond_chance
from sysid.models import LinearStateSpace


def segment(seed: int, samples: int = 1_500) -> Segment:
    """Two poles in white noise."""
    rng = np.random.default_rng(seed)
    u, e = np.sign(rng.normal(size=samples)), rng.normal(size=samples)
    y = signal.lfilter([0.0, 1.0, 0.5], [1.0, -1.5, 0.7], u) + 0.5 * e
    return Segment(inputs=u[:, None], outputs=y[:, None], root_weights=np.ones(samples))


@pytest.mark.parametrize("seed", range(3))
def test_the_true_order_reaches_it_and_a_state_less_does_not(seed: int) -> None:
    record = segment(seed)
    reached = []
    for states in (1, 2):
        orders = LinearStateSpace(states=states)
        found = search([record], orders, StateSpaceTraining())
        subspace = Subspace.of([record], states=states, horizon=None, feedthrough=False, noise=True)
        reached.append(subspace.yardstick.reached(found.covariance, found.chart.n_parameters))
    assert reached == [False, True]


def test_it_is_the_least_squares_error_of_an_arx_model() -> None:
    record = segment(0)
    windows = Windows.of([record], 4, 1)
    found = Yardstick.of(windows, 3, feedthrough=True)
    u, y = record.inputs[:, 0], record.outputs[:, 0]
    lags = [x[4 - k : len(x) - k] for k in (1, 2, 3) for x in (u, y)]
    table = np.column_stack([*lags, u[4:], np.ones(len(u) - 4)])
    left = y[4:] - table @ np.linalg.lstsq(table, y[4:], rcond=None)[0]
    assert found.size == pytest.approx(np.log(left @ left / len(left)), rel=1e-9)
    assert (found.n_parameters, found.n_rows) == (8, len(left))


def test_a_model_as_long_as_the_arx_model_is_never_called_good_enough() -> None:
    one = Yardstick(size=0.0, n_parameters=5, n_rows=100)
    assert one.reached(np.eye(1), 4)
    assert not one.reached(np.eye(1), 5)
    assert not one.reached(1.1 * np.eye(1), 4)
    assert not Yardstick(size=-np.inf, n_parameters=5, n_rows=100).reached(np.eye(1), 4)


def test_the_test_of_the_likelihood_ratio_has_its_known_bound() -> None:
    """3.84 is the 95 % point of chi-square with one degree of freedom."""
    assert beyond_chance(0.0383, 0.0, n_rows=100, n_parameters=1) < 0.0
    assert beyond_chance(0.0386, 0.0, n_rows=100, n_parameters=1) > 0.0
    assert beyond_chance(1.0384, 0.0, n_rows=100, n_parameters=1) == pytest.approx(1.0, abs=1e-4)
