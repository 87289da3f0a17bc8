"""Limits of an output: how they are written, and what holds a free run."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.errors import ConfigError
from sysid.kernels.cascade_layout import FREE, HIGH, LOST, LOW
from sysid.models import (
    NARX,
    Cascade,
    History,
    Limit,
    Mapping,
    NARXModel,
    Scaling,
    model_from_dict,
    structure_from_dict,
)
from sysid.models.orders.output_limits import parse_limits
from sysid.testing import simulate, simulate_cascade


def held(low: float | None, high: float | None) -> NARXModel:
    """A sum of its input, and a neuron."""
    return NARXModel(
        network=NARX(input_delays=[0], output_delays=2, neurons=1, limits=[low, high]),
        theta=np.array([0.3, 0.1, -0.2, 0.1, 0.05, 0.01, 0.1, 1.2, -0.2]),
        scaling=Scaling(input_offset=(0.5,), input_scale=(1.5,), output_offset=10.0, output_scale=7.0),
        mapping=Mapping.parse("u -> y"),
        sample_time=1.0,
        input_units=("V",),
        output_unit="m",
        rest_output=10.0,
        between=(low, high),
    )


U = np.repeat(np.random.default_rng(0).uniform(-1.0, 2.0, (30, 1)), 10, axis=0)


@pytest.mark.parametrize("written", [None, "found", [0, 3], [None, 3.5], {"low": -1}, {"low": 0, "high": 2}])
def test_what_may_be_written_is_stored_as_it_is_read(written):
    structure = NARX(input_delays=1, output_delays=1, neurons=2, limits=written)
    assert structure_from_dict(structure.to_dict()) == structure
    assert ("limits" in structure.to_dict()) is (written is not None)


@pytest.mark.parametrize(
    "written", ["at the ends", [3, 0], [0], [None, None], {"least": 0}, {}, [0, True], [0, float("inf")], 4]
)
def test_what_is_none_is_refused(written):
    with pytest.raises(ConfigError, match="not limits of an output"):
        parse_limits(written)


@pytest.mark.parametrize("between", [(20.0, 25.0), (-5.0, 0.0), (9.0, 30.0), (-9.0, 11.0)])
def test_limits_beyond_the_bounds_win_as_in_the_slow_twin(between):
    model = replace(held(*between).recursion, low=-1.0, high=1.0)  # in units 3 and 17
    start = History.at_rest(inputs=[0.5], output=10.0)
    assert_allclose(model.simulate(U, start), simulate(model, U, start), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("between", [(3.3, 16.1), (3.3, None), (None, 16.1)])
def test_a_run_is_held_inside_the_recursion_as_by_a_cascade(between):
    model = held(*between)
    output = model.simulate(U)
    cascade = Cascade(models=(model,))
    assert cascade.limits == model.limits == {"y": Limit(low=between[0], high=between[1])}
    run = cascade.simulate(U)
    np.testing.assert_allclose(output, run["y"], rtol=1e-12)
    np.testing.assert_allclose(output, simulate_cascade(cascade, U)["y"], rtol=1e-12)
    np.testing.assert_allclose(output, simulate(model.recursion, U, History.at_rest(inputs=U[0], output=10.0)))
    at = np.array([[output == side] for side in between if side is not None])
    assert at.any(axis=2).all()  # to the last bit, and each of them
    codes = {code for code, side in zip((LOW, HIGH), between, strict=True) if side is not None}
    assert codes <= {*np.unique(run.held)} <= {FREE, *codes, *[LOST] * (None in between)}  # held there, and not lost
    free = replace(model, between=(None, None))
    assert not np.allclose(free.simulate(U), output)
    assert not free.limits


def test_what_is_declared_of_the_whole_takes_the_place_of_a_members_own_limits():
    model = held(3.3, 16.1)
    whole = Cascade(models=(model,), limits={"y": Limit(low=5.0)})
    assert whole.simulate(U)["y"].min() == 5.0
    assert Cascade(models=(model,)).with_member(replace(model, between=(None, 12.0))).limits == {"y": Limit(high=12.0)}
    assert whole.with_member(replace(model, between=(None, 12.0))).limits == {"y": Limit(low=5.0)}


def test_a_stored_model_is_held_alike():
    model = held(3.3, None)
    again = model_from_dict(model.to_dict())
    assert again.limits == model.limits
    np.testing.assert_array_equal(again.simulate(U), model.simulate(U))
