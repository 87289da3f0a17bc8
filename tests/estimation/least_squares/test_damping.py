"""The contract of damping strategies, row by row of their table."""

from __future__ import annotations

import json

import numpy as np
import pytest

from sysid import NARX, Training, fit, load
from sysid.errors import ConfigError
from sysid.estimation import JointTraining
from sysid.estimation.least_squares.checkpoint import Checkpoint
from sysid.estimation.least_squares.damping import DAMPINGS, damping_of
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.termination import MAX_DAMPING, Termination
from sysid.field_checks import check
from sysid.testing import first_order_record
from sysid.workbench.fields import TrainingConfig
from tests.estimation.least_squares.test_levenberg_marquardt import ROSENBROCK, flat_prior

EVERY = pytest.mark.parametrize("kind", DAMPINGS)
START = np.array([-1.2, 1.0])


def engine(kind: str, iterations: int) -> LevenbergMarquardt:
    limits = Termination(max_iterations=iterations, patience=iterations)
    return LevenbergMarquardt(termination=limits, damping=DAMPINGS[kind](), evidence_after=None)


@EVERY
def test_it_reaches_the_minimum(kind: str) -> None:
    solution = engine(kind, 200).minimise(ROSENBROCK, START, flat_prior(2))
    np.testing.assert_allclose(solution.theta, [1.0, 1.0], atol=1e-6)


@EVERY
def test_rejections_end_the_search_for_a_step(kind: str) -> None:
    damping = DAMPINGS[kind]().scaled_by(np.ones(2))
    for _ in range(100):
        damping = damping.rejected()
    assert damping.factor > MAX_DAMPING


@EVERY
def test_a_fit_that_was_put_aside_goes_on_to_the_last_bit(kind: str) -> None:
    whole = engine(kind, 20).minimise(ROSENBROCK, START, flat_prior(2))
    half = engine(kind, 7).minimise(ROSENBROCK, START, flat_prior(2))
    kept = json.loads(json.dumps(Checkpoint.of(half.state).fields))
    again = engine(kind, 20).resume(ROSENBROCK, Checkpoint(fields=kept).state(ROSENBROCK, flat_prior(2)))
    np.testing.assert_array_equal(again.theta, whole.theta)
    assert again.state.damping.to_dict() == whole.state.damping.to_dict()


def test_what_was_put_aside_before_there_was_a_choice_is_read() -> None:
    damping = damping_of({"factor": 0.5, "growth": 4.0, "scale": [1.0, 2.0]})
    assert (damping.kind, damping.factor, damping.rejected().factor) == ("marquardt", 0.5, 2.0)


@EVERY
def test_training_takes_it_by_name(kind: str) -> None:
    assert check(TrainingConfig, {"damping": kind}, where="x").damping == kind
    assert JointTraining(damping=kind).damping == kind


@pytest.mark.parametrize("options", [Training, JointTraining])
def test_a_name_that_is_none_is_refused(options: type) -> None:
    with pytest.raises(ConfigError, match="marquardt or levenberg"):
        options(damping="marquard")


def test_another_damping_takes_other_steps() -> None:
    network, traces = NARX(input_delays=1, output_delays=1, neurons=2), load(first_order_record())
    curves = [
        fit(traces, "u -> y", network, Training(max_iterations=3, damping=kind)).history["mse"] for kind in DAMPINGS
    ]
    assert len({curve[0] for curve in curves}) == 1, "from the same start"
    assert len({curve[-1] for curve in curves}) == len(curves)
