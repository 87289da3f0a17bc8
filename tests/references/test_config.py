"""What a reference is, as it stands in YAML: its ports, and what their pressures are measured from."""

from __future__ import annotations

import pytest

from sysid.references.config import InputPort, ReferenceConfig
from sysid.references.runs import channels_of


def test_a_pressure_says_what_it_is_measured_from() -> None:
    psi = {"unit": "psi", "reference": "gauge"}
    config = ReferenceConfig.model_validate(
        {
            **{"python": "a:b", "sample_time": 0.1, "inputs": {"handle": {**psi, "range": [60, 90]}}},
            "outputs": {"pipe": psi, "cylinder": {"unit": "psi"}},
        }
    )
    assert [one.label for one in channels_of(config)] == ["handle [psi gauge]", "pipe [psi gauge]", "cylinder [psi]"]


def test_what_is_no_pressure_is_measured_from_nothing() -> None:
    with pytest.raises(ValueError, match="only pressures are measured from something"):
        InputPort.model_validate({"unit": "V", "reference": "gauge", "range": [0, 1]})


def test_levels_say_how_far_a_port_goes() -> None:
    assert InputPort.model_validate({"levels": [2, 0, 1]}).range == (0.0, 2.0)
    assert InputPort.model_validate({"levels": [2, 0, 1], "range": [-1, 5]}).range == (-1.0, 5.0)
    for port in ({}, {"levels": []}, {"levels": [1]}, {"levels": "012"}):
        with pytest.raises(ValueError, match=r"range|levels"):
            InputPort.model_validate(port)


@pytest.mark.parametrize("name", ["time", "usable"])
def test_a_port_that_records_cannot_name_is_refused_before_anything_is_run(name: str) -> None:
    content = {"python": "a:b", "sample_time": 0.1, "inputs": {"u": {"unit": "V", "range": [0, 1]}}}
    with pytest.raises(ValueError, match=f"{name} is what records call their own"):
        ReferenceConfig.model_validate({**content, "outputs": {name: {"unit": "V"}}})
