"""Ranges on the fields of a structure, and in a pipeline's words."""

from __future__ import annotations

import pytest

from sysid.errors import ConfigError
from sysid.models import ARX, NARX, TransferFunction
from sysid.models.orders.ranges import Among, FloatRange, IntRange, declared_ranges, parse_range

WRITTEN = {
    "ends": ({"from": 1, "to": 5}, (1, 2, 3, 4, 5)),
    "ends and a step": ({"from": 2, "to": 9, "step": 3}, (2, 5, 8)),
    "lag sets": ({"among": ["0:3", [1, 2, 4, 8], 4]}, ("0:3", [1, 2, 4, 8], 4)),
    "equal ratios": ({"from": 1e-4, "to": 1.0, "points": 5, "log": True}, (1e-4, 1e-3, 1e-2, 1e-1, 1.0)),
    "equal steps": ({"from": 0, "to": 1, "points": 5}, (0.0, 0.25, 0.5, 0.75, 1.0)),
    "the field's own": ("range", (1, 2)),
}


@pytest.mark.parametrize(("written", "values"), WRITTEN.values(), ids=WRITTEN)
def test_a_range_is_written_as(written: object, values: tuple[object, ...]) -> None:
    found = parse_range(written, IntRange(low=1, high=2), where="neurons")
    assert found is not None
    assert found.values == values


@pytest.mark.parametrize("plain", [4, "0:3", [1, 2], {"kind": "NARX"}, None, True])
def test_a_plain_value_is_no_range(plain: object) -> None:
    assert parse_range(plain, IntRange(low=1, high=2), where="neurons") is None


WRONG = {
    "ends turned round": {"from": 5, "to": 1},
    "no end": {"from": 5},
    "a step of nothing": {"from": 1, "to": 5, "step": 0},
    "a misspelt step": {"from": 1, "to": 5, "stepp": 1},
    "among and ends": {"among": [1], "from": 1},
    "among nothing": {"among": []},
    "one choice twice": {"among": [4, 4]},
    "ratios from zero": {"from": 0.0, "to": 1.0, "points": 3, "log": True},
    "reals without a number of points": {"from": 0.5, "to": 1.0},
}


@pytest.mark.parametrize("written", WRONG.values(), ids=WRONG)
def test_what_is_meant_as_a_range_and_is_none_is_refused(written: object) -> None:
    with pytest.raises(ConfigError):
        parse_range(written, None, where="neurons")


def test_a_field_without_a_range_of_its_own_cannot_be_asked_for_it() -> None:
    with pytest.raises(ConfigError, match="feedthrough declares no range"):
        parse_range("range", None, where="feedthrough")


@pytest.mark.parametrize(
    ("structure", "fields"),
    [
        (NARX, {"activation", "input_delays", "output_delays", "neurons"}),
        (ARX, {"na", "nb", "nk"}),
        (TransferFunction, {"poles", "zeros"}),
    ],
)
def test_structures_declare_what_is_usual_for_them(structure: type, fields: set[str]) -> None:
    assert set(declared_ranges(structure)) == fields


def test_only_a_list_of_choices_has_no_order() -> None:
    assert IntRange(low=1, high=3).numeric
    assert FloatRange(low=0.0, high=1.0, points=2).numeric
    assert not Among(choices=(1, 2)).numeric
