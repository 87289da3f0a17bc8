"""Which word was meant, at whatever door it is written."""

from __future__ import annotations

import pytest

from sysid.errors import ChannelError, ConfigError, did_you_mean, near_words
from sysid.export import EXPORTERS
from sysid.export.exporters import ELSEWHERE, exporter
from sysid.traces import Role
from tests.workbench.pipelines import parse_pipeline

WORDS = ["BP", "AR", "outlet flow", "outlet temperature"]
PIPELINE = "name: rig\ndata: rig\nmapping: u -> y\nfits: [{name: a, structure: {kind: ARX, na: 1, nb: [1], nk: [1]}}]\n"


@pytest.mark.parametrize(
    ("given", "near"),
    [
        ("bp", ("BP",)),
        ("Outlet_Flow", ("outlet flow",)),
        ("outletflw", ("outlet flow",)),
        ("outlet", ("outlet flow",)),
        ("temperature", ("outlet temperature",)),
        ("pump", ()),
        ("x", ()),
        (3, ()),
        (None, ()),
    ],
)
def test_the_nearest_are_found(given: object, near: tuple[str, ...]) -> None:
    assert near_words(given, WORDS) == near
    assert did_you_mean(given, WORDS, "add it") == (f"did you mean {near[0]}?" if near else "add it")


def test_several_that_are_as_near_are_all_told() -> None:
    assert did_you_mean("case-0", ["case-1", "case-2", "other"], "") == "did you mean case-1 or case-2?"
    assert near_words("case", [f"case-long-name-{k}" for k in range(9)]) == ()


@pytest.mark.parametrize("given", ["fmu", "FMU", "fmi", "FMI-3", "pytorch", "onxx", "c++", "ONNX"])
def test_a_format_is_told_by_yaml_as_by_python(given: str) -> None:
    with pytest.raises(ConfigError, match="did you mean") as by_yaml:
        parse_pipeline(PIPELINE + f"export: {{fit: a, formats: [{given}]}}\n", where="rig.yaml")
    with pytest.raises(ConfigError, match="did you mean") as by_python:
        exporter(given)
    assert by_yaml.value.remedy == by_python.value.remedy


def test_what_formats_are_called_elsewhere_are_formats_here() -> None:
    assert {one for ones in ELSEWHERE.values() for one in ones} <= set(EXPORTERS)
    assert exporter("fmi3").name in near_words("fmu", EXPORTERS, ELSEWHERE)
    assert not set(ELSEWHERE) & set(EXPORTERS)


def test_channels_and_choices_are_told_whatever_their_capitals() -> None:
    assert ChannelError(["bp"], ["BP", "AR"]).remedy == "did you mean BP?"
    assert near_words("Validate", [role.value for role in Role]) == ("validation",)
