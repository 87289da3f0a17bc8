"""A grey box as people write it, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

import sysid
from sysid.errors import ConfigError
from sysid.models import GreyBox, History, Mapping, structure_from_dict

TANKS = {
    "kind": "GreyBox",
    "equations": "dx1/dt = -k1*sqrt(x1) + k2*u\ndx2/dt = valve(x1) - k1*sqrt(x2)\ny = x2",
    "parameters": {"k1": {"start": 0.1, "low": 0.0, "prior": 0.05, "unit": "V^0.5/s"}, "k2": 0.2},
    "initial": {"x1": {"start": 3.0, "low": 0.0}},
    "tables": {"valve": [[0.0, 0.0], [5.0, 0.2], [10.0, 0.3]]},
    "substeps": 4,
    "solver": "rosenbrock",
}


def test_it_is_what_it_writes() -> None:
    structure = structure_from_dict(TANKS)
    assert isinstance(structure, GreyBox)
    assert structure.to_dict() == TANKS
    assert structure_from_dict(structure.to_dict()) == structure
    assert hash(structure) == hash(structure_from_dict(TANKS))


def test_its_label_has_states_parameters_and_weights() -> None:
    assert structure_from_dict(TANKS).label == "GreyBox 2/2"
    assert GreyBox(equations="y = net(u; neurons=2)").label == "GreyBox 0/0+8"


def test_equations_may_be_a_list_and_a_parameter_a_number() -> None:
    listed = GreyBox(equations=["dx/dt = -k*x + u", "y = x"], parameters={"k": 2})  # type: ignore[arg-type]
    assert listed == GreyBox(equations="dx/dt = -k*x + u\ny = x", parameters={"k": {"start": 2.0}})
    assert GreyBox(equations="y = k*u", parameters={"k": {"start": 2, "fixed": True}}).free == ()


EQUATION = "dx/dt = -k*x + u\ny = x"


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"equations": 3}, "the equations are no text"),
        ({"equations": "y = k**u", "parameters": {"k": "2"}}, "start is no number"),
        ({"parameters": {"k": {"start": 2, "low": 3}}}, "k starts outside its bounds"),
        ({"parameters": {"k": {"start": 2, "low": 2, "high": 2}}}, "k starts outside its bounds"),
        ({"parameters": {"k": {"start": 2, "prior": 0}}}, "a prior is a standard deviation"),
        ({"parameters": {"k": {"low": 2}}}, "k has no start"),
        ({"parameters": {"k": {"start": 1, "lower": 2}}}, "unknown field 'lower'"),
        ({"parameters": {"k": float("nan")}}, "start is no number"),
        ({"parameters": {"k": True}}, "start is no number"),
        ({"parameters": {"k": float("inf")}}, "start is no number"),
        ({"parameters": [1, 2]}, "parameters are no entries by name"),
        ({"parameters": {"k": 1, 2: 3}}, "not a name"),
        ({"initial": {"z": 1}}, "z is no state"),
        ({"initial": {"x": {"start": -1, "low": 0}}}, "x begins outside its bounds"),
        ({"tables": {"f": [[0, 1]]}}, "f is no table"),
        ({"tables": {"f": [[0, 1], [0, 2]]}}, "f is no table"),
        ({"tables": [1]}, "not tables"),
        ({"tables": 2}, "not tables"),
        ({"tables": {"f": "no"}}, "f is no table"),
        ({"substeps": 0}, "not a number of steps"),
        ({"substeps": 2.5}, "not a number of steps"),
        ({"solver": "rosenbrok"}, "no such solver"),
        (
            {"equations": "\n".join(f"dx{i}/dt = -x{i}" for i in range(31)), "parameters": {}, "solver": "rosenbrock"},
            "too many states for implicit steps",
        ),
    ],
)
def test_fields_that_cannot_be_are_refused(fields: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        GreyBox(**{"equations": EQUATION, "parameters": {"k": 1.0}, **fields})  # type: ignore[arg-type]
    assert caught.value.remedy


def test_what_is_read_later_begins_where_it_is_said_to_have_stood() -> None:
    """Past samples of an output are states, and had no name to say so by."""
    delayed = "y = a*y[k-1] + b*y[k-2] + u[k-1]"
    grey = GreyBox(equations=delayed, parameters={"a": 0.5, "b": 0.2}, initial={"y": 3.0})
    u = np.r_[np.zeros(5), np.ones(45)]
    y = np.full(52, 3.0)
    for k in range(2, 52):
        y[k] = 0.5 * y[k - 1] + 0.2 * y[k - 2] + (u[k - 3] if k > 2 else 0.0)
    model = sysid.fit(sysid.data((u, y[2:]), sample_time=1.0), "u -> y", grey).model
    run = model.simulate(u, History.at_rest(inputs=u[:1], output=0.0))
    np.testing.assert_allclose(run, y[2:], atol=1e-6)
    with pytest.raises(ConfigError, match="expected: one of y"):
        GreyBox(equations=delayed, parameters={"a": 0.5, "b": 0.2}, initial={"u": 3.0})


def test_a_mapping_of_other_channels_is_refused() -> None:
    grey = GreyBox(equations=EQUATION, parameters={"k": 1.0})
    grey.check_mapping(Mapping.parse("u+spare -> y"))
    with pytest.raises(ConfigError, match="nothing says what u is"):
        grey.check_mapping(Mapping.parse("v -> y"))
    with pytest.raises(ConfigError, match="no equation computes the output z"):
        grey.check_mapping(Mapping.parse("u -> z"))
