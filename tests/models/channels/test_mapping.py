"""Mappings as text."""

import pytest

from sysid.errors import ConfigError
from sysid.models import Mapping


def test_text_and_mapping_are_one():
    mapping = Mapping.parse(" BP+ AR ->BC ")
    assert mapping == Mapping(inputs=("BP", "AR"), output="BC")
    assert Mapping.parse(str(mapping)) == mapping


@pytest.mark.parametrize(
    "text",
    ["BP BC", "BP -> ", "BP+BP -> BC", "BP -> BP", "BP++AR -> BC"],
    ids=["no arrow", "no output", "an input twice", "output among inputs", "empty name"],
)
def test_what_is_no_mapping_is_refused(text):
    with pytest.raises(ConfigError, match="not a mapping"):
        Mapping.parse(text)


def test_several_outputs_are_as_many_mappings():
    mapping = Mapping.of({"inputs": ["STP"], "outputs": ["BP", "V->C"]})
    assert mapping == Mapping.parse(str(mapping)) == Mapping(inputs=("STP",), outputs=("BP", "V->C"))
    assert [one.output for one in mapping.each] == ["BP", "V->C"]
    with pytest.raises(ConfigError, match="a mapping here has one output"):
        _ = mapping.output
