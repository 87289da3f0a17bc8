"""A model of several outputs of its own runs, predicts and begins as a model of one output does, column by column."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sysid.models import Cascade, History, Start, StartKind, beginning, model_from_dict
from sysid.testing import simulate_cascade
from tests.models.cascades.cascades import block, command, network

U = command(120, 1, 3)
BLOCK = block("BP -> AR+BC", output_delays=[[1, 2], [1, 3]])


def test_the_free_run_is_that_of_the_slow_twin():
    slow = simulate_cascade(Cascade(models=(BLOCK,)), U)
    assert_allclose(BLOCK.simulate(U), np.column_stack([slow["AR"], slow["BC"]]), rtol=1e-12)


def test_a_run_goes_on_from_its_own_past():
    whole = BLOCK.simulate(U)
    history = History(inputs=U[:50], output=whole[:50])
    assert_allclose(BLOCK.simulate(U[50:], history), whole[50:], rtol=1e-12)


@pytest.mark.parametrize("steps", [1, 2, 5, 30])
def test_a_prediction_is_a_free_run_from_measured_samples(steps):
    measured = BLOCK.simulate(U) + np.random.default_rng(1).normal(size=(len(U), 2))
    predicted = BLOCK.predict(U, measured, steps=steps)
    for t in (steps + 10, len(U) - 1):
        before = t - steps + 1
        run = BLOCK.simulate(U[before : t + 1], History(inputs=U[:before], output=measured[:before]))
        assert_allclose(predicted[t], run[-1], rtol=1e-12)
    rest = History.at_rest(inputs=U[0], output=BLOCK.resting)
    assert_allclose(predicted[:steps], BLOCK.simulate(U[:steps], rest), rtol=1e-12)


def test_one_output_is_predicted_as_by_a_network_of_one_output():
    one = network("BP -> AR", neurons=4, inputs=(0, 2), outputs=(1, 2))
    several = block("BP -> AR")
    scaling = one.scaling
    like = one.recursion.columns
    assert like is not None
    same = several.__class__(
        **{name: getattr(several, name) for name in several.__dataclass_fields__}
        | {
            "theta": like.theta,
            "scaling": several.scaling.__class__(
                input_offset=scaling.input_offset, input_scale=scaling.input_scale,
                output_offset=(scaling.output_offset,), output_scale=(scaling.output_scale,),
            ),
            "clamp": one.recursion.high,
            "rest_outputs": (one.rest_output,),
        }
    )  # fmt: skip
    measured = one.simulate(U) + np.random.default_rng(1).normal(size=len(U))
    for steps in (1, 4):
        assert_allclose(
            same.predict(U, measured[:, None], steps=steps)[:, 0], one.predict(U, measured, steps=steps), rtol=1e-10
        )


def test_an_estimated_start_finds_the_state_of_a_run():
    measured = BLOCK.simulate(U, History.at_rest(inputs=U[0], output=np.array([60.0, 20.0])))
    noisy = measured.copy()
    noisy[0] += 0.3
    begun = beginning(BLOCK, U, noisy, Start(kind=StartKind.ESTIMATED))
    run = BLOCK.simulate(U[begun.first :], begun.history)
    plain = BLOCK.simulate(U, History.at_rest(inputs=U[0], output=noisy[0]))[begun.first :]
    errors = [np.abs(one - measured[begun.first :]).max() for one in (run, plain)]
    assert errors[0] <= errors[1]


def test_it_is_stored_like_any_model():
    again = model_from_dict(BLOCK.to_dict())
    assert_array_equal(again.simulate(U), BLOCK.simulate(U))
