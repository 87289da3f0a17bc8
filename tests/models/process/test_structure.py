"""What a process model is asked for by, and what is refused."""

from __future__ import annotations

from typing import Any

import pytest

from sysid.errors import ConfigError
from sysid.models import Mapping, ProcessModel, structure_from_dict
from sysid.models.process.process_type import ProcessType


@pytest.mark.parametrize(
    ("written", "names"),
    [
        ("P1", ("K", "Tp1")),
        ("p1d", ("K", "Tp1", "Td")),
        ("P2ZUD", ("K", "Tw", "zeta", "Tz", "Td")),
        ("P3U", ("K", "Tw", "zeta", "Tp3")),
        ("P0DI", ("K", "Td")),
    ],
)
def test_a_type_says_its_parameters(written: str, names: tuple[str, ...]) -> None:
    assert ProcessType.parse(written).names == names


@pytest.mark.parametrize("written", ["P4", "P1X", "P1DD", "P1U", "P0", "P0D", "", "1D", 3, None, True])
def test_what_is_no_type_is_refused(written: Any) -> None:
    with pytest.raises(ConfigError):
        ProcessModel(type=written)


def test_a_structure_survives_its_file() -> None:
    asked = ProcessModel(
        type=("P1D", "P2DU"), parameters={"Td": 2, "K(b)": {"start": 1, "low": 0, "fixed": True}}, intercept=False
    )
    assert structure_from_dict(asked.to_dict()) == asked


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"Tp2": 3}, "Tp2 is no parameter of P1D"),
        ({"Kp": 3}, "did you mean K"),
        ({"Tp1": {"start": 3, "per": "case"}}, "one value of each parameter"),
        ({"Tp1": {"start": 3, "prior": 1}}, "no prior"),
        ({"Tp1": -3}, "Tp1 is above 0"),
        ({"Td": -1}, "Td is not negative"),
        ({"Td": {"low": 0}}, "Td has no start"),
    ],
)
def test_a_parameter_that_cannot_be_is_refused(parameters: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        ProcessModel(type="P1D", parameters=parameters)


def test_a_parameter_of_no_input_is_refused_once_the_inputs_are_known() -> None:
    asked = ProcessModel(type=("P1D", "P1"), parameters={"Td(b)": 2})
    with pytest.raises(ConfigError, match="Td is no parameter of P1"):
        asked.check_mapping(Mapping.parse("a+b -> y"))
    with pytest.raises(ConfigError, match="b is no input"):
        asked.check_mapping(Mapping.parse("a+c -> y"))
    with pytest.raises(ConfigError, match="name an input"):
        ProcessModel(type="P1D").check_mapping(Mapping.parse("-> y"))


def test_what_is_said_of_an_input_goes_before_what_is_said_of_all() -> None:
    asked = ProcessModel(type=("P1D", "P1D"), parameters={"Td": 2, "Td(b)": 3})
    found = [asked.known("Td", of) for of in ("a", "b")]
    assert [one.start for one in found if one is not None] == [2.0, 3.0]
