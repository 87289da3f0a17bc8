"""The continuous form of a discrete state space: the same at the samples, or refused in words."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.models import (
    LinearStateSpace,
    LinearStateSpaceModel,
    Mapping,
    Scaling,
    VectorScaling,
    VectorStateSpace,
    VectorStateSpaceModel,
)
from sysid.models.converting.to_control import state_space
from sysid.models.linear.innovations import Innovations

T = 0.1
SYSTEM = Innovations(
    A=np.array([[0.9, 0.2], [-0.2, 0.8]]), B=np.array([[0.5, 0.1], [0.2, 0.6]]), C=np.array([[1.0, 0.3]]),
    D=np.zeros((1, 2)), K=np.array([[0.3], [0.1]]), constant=np.array([0.2]),
)  # fmt: skip
TERMS = {
    "mapping": Mapping.parse("u+w -> y"), "sample_time": T, "input_units": ("V", "V"), "output_unit": "bar",
    "rest_output": 0.0,
}  # fmt: skip
SCALING = Scaling(input_offset=(1.0, 2.0), input_scale=(3.0, 0.5), output_offset=1.0, output_scale=4.0)
MODEL = LinearStateSpaceModel(orders=LinearStateSpace(states=2), system=SYSTEM, scaling=SCALING, **TERMS)


def test_its_samples_are_the_model_s() -> None:
    sampled = control.sample_system(MODEL.to_control(continuous=True), T, method="zoh")
    for one, other in zip((sampled.A, sampled.B, sampled.C, sampled.D), MODEL.matrices, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    np.testing.assert_allclose(np.exp(T * MODEL.continuous().poles), np.linalg.eigvals(SYSTEM.A), atol=1e-12)
    assert sampled.input_labels == ["u", "w"]


def test_dead_times_stand_beside_it_in_seconds_and_as_pade_for_python_control() -> None:
    late = replace(MODEL, orders=LinearStateSpace(states=2, nk=(4, 1)))
    found = late.continuous()
    assert found.delays == pytest.approx((0.3, 0.0))
    np.testing.assert_array_equal(found.A, MODEL.continuous().A)
    w = 0.5
    exact = found.C @ np.linalg.solve(1j * w * np.eye(2) - found.A, found.B) * np.exp(-1j * w * np.array(found.delays))
    np.testing.assert_allclose(late.to_control(continuous=True)(1j * w), exact, rtol=1e-9)


def test_of_several_outputs() -> None:
    scaling = VectorScaling(
        input_offset=(1.0, 2.0), input_scale=(3.0, 0.5), output_offset=(0.0, 1.0), output_scale=(4.0, 0.1)
    )
    model = VectorStateSpaceModel(
        orders=VectorStateSpace(states=2), scaling=scaling, sample_time=T, input_units=("V", "V"),
        system=replace(SYSTEM, C=np.eye(2), D=np.zeros((2, 2)), K=np.zeros((2, 2)), constant=np.zeros(2)),
        mapping=Mapping.parse("u+w -> y+z"), output_units=("bar", "K"), rest_outputs=(0.0, 0.0),
    )  # fmt: skip
    sampled = control.sample_system(model.to_control(continuous=True), T, method="zoh")
    np.testing.assert_allclose(control.dcgain(sampled), control.dcgain(state_space(model)), rtol=1e-12)


@pytest.mark.parametrize("pole", [-0.4, 0.0])
def test_a_pole_that_no_continuous_system_has_is_refused(pole: float) -> None:
    other = replace(MODEL, system=replace(SYSTEM, A=np.diag([0.9, pole])))
    with pytest.raises(ConfigError, match="no continuous system of this order") as refused:
        other.to_control(continuous=True)
    assert "fewer states" in str(refused.value)
