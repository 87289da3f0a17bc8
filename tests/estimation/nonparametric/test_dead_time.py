"""Dead times: found wherever they are, and never at the edge of the search in silence."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from sysid.estimation import fit_transfer_function
from sysid.estimation.linear.transfer_function.training import TransferFunctionTraining
from sysid.estimation.nonparametric.dead_time import descend, likely, longest_dead_time
from sysid.estimation.records.experiment import experiments_of
from sysid.models import Mapping, Start, StartKind, TransferFunction
from sysid.traces import Trace
from tests.estimation.linear_systems import trace_of

ESTIMATED = Start(kind=StartKind.ESTIMATED)
ONE, TWO = Mapping.parse("u1 -> y"), Mapping.parse("u1+u2 -> y")
FIRST = TransferFunction(poles=(1,), zeros=(0,))


def record(dead: int, seed: int, decibel: float = 20.0, n: int = 400) -> Trace:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.integers(0, 2, n // 5), 5) * 2.0 - 1.0
    clean = lfilter([*np.zeros(dead), 0.3], [1.0, -0.7], u)
    return trace_of(u[:, None], clean + rng.standard_normal(n) * clean.std() * 10 ** (-decibel / 20))


@pytest.mark.parametrize("dead", [1, 4, 5, 12, 31, 60])
def test_a_dead_time_is_found_within_one_sample(dead: int) -> None:
    """The benchmark ``dead_time`` counts 20 seeds of every dead time from 0 to 60."""
    training = TransferFunctionTraining(scattered_starts=0)
    fit = fit_transfer_function([record(dead, seed=dead)], ONE, FIRST, training, start=ESTIMATED)
    assert abs(fit.model.structure.to_dict()["delays"][0] - dead) <= 1


def test_several_inputs_have_dead_times_of_their_own() -> None:
    rng = np.random.default_rng(2)
    u = np.repeat(rng.normal(size=(120, 2)), 4, axis=0)
    y = lfilter([*np.zeros(9), 0.3], [1.0, -0.7], u[:, 0]) + lfilter([*np.zeros(25), 1.0], [1.0, -0.5], u[:, 1])
    orders = TransferFunction(poles=(1, 1), zeros=(0, 0))
    training = TransferFunctionTraining(scattered_starts=0)
    fit = fit_transfer_function([trace_of(u, y)], TWO, orders, training, start=ESTIMATED)
    assert fit.model.structure.to_dict()["delays"] == [9, 25]


def test_the_end_of_the_search_is_told() -> None:
    training = TransferFunctionTraining(scattered_starts=0, max_delay=6)
    fit = fit_transfer_function([record(12, seed=1, decibel=200.0)], ONE, FIRST, training, start=ESTIMATED)
    assert fit.model.structure.to_dict()["delays"] == [6]
    assert any("longest that was tried" in note for note in fit.notes)
    inside = fit_transfer_function([record(3, seed=1)], ONE, FIRST, training, start=ESTIMATED)
    assert not any("longest that was tried" in note for note in inside.notes)


def test_a_correlation_says_where_to_look() -> None:
    experiments = experiments_of([record(37, seed=3)], ONE, ESTIMATED, 0.0)
    ((first, *_),) = likely(experiments, (1,), longest_dead_time([400]), 1)
    assert abs(first - 37) <= 2


def test_descending_ends_where_no_neighbour_is_better() -> None:
    assert descend((0, 9), 0, 20, lambda k: (k[0] - 7) ** 2 + (k[1] - 3) ** 2) == (7, 3)
    assert descend((5,), 0, 6, lambda k: -float(k[0])) == (6,)
