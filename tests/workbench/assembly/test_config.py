"""The YAML of an assembly: what cannot be is refused, and what is said becomes the composite and its plan."""

from __future__ import annotations

import pytest

from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.yaml_files import parse_yaml
from tests.workbench.assembly.conftest import PIPELINE

TWO_PLACES = """\
kind: assembly
name: train
data: cases
training: excitation
outputs: [BP, AR]
members:
  - {mapping: STP -> BP, structure: {kind: NARX, input_delays: [0, 1, 3], output_delays: 2, neurons: 3}, rest: 90}
  - {mapping: STP -> BP9, structure: {kind: NARX, input_delays: [0, 1, 3], output_delays: 2, neurons: 3}, rest: 90}
  - mapping: BP+STP -> AR
    structure: {kind: NARX, input_delays: [0, 1, 3], output_delays: 2, neurons: 3}
    rest: 90
    instances: ["", "9"]
    shared: [STP]
rest: {BP: STP, AR: STP}
limits: {AR: {high: BP}}
"""


def config(text: str = TWO_PLACES) -> AssemblyConfig:
    return check(AssemblyConfig, parse_yaml(text, where="text"), where="text")


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        pytest.param("outputs: [upper, lower]", "outputs: [uper]", "which no member writes", id="a stranger scored"),
        pytest.param("members: [lower]", "members: [pump]", "which no member writes", id="a stranger retrained"),
        pytest.param("upper -> lower", "pump -> upper", "two members write one channel", id="a channel twice"),
        pytest.param(
            "{kind: NARX, input_delays: [0], output_delays: 1, neurons: 3}", "{kind: ARX, na: 1, nb: [1], nk: [1]}",
            "an ARX model takes no training", id="a linear kind",
        ),
    ],
)  # fmt: skip
def test_an_assembly_that_cannot_be_is_refused(old, new, match):
    assert old in PIPELINE
    with pytest.raises(ConfigError, match=match):
        config(PIPELINE.replace(old, new))


def test_levels_of_inputs_stand_with_all_others_under_rest():
    with pytest.raises(ConfigError, match="is said for all of it"):
        config(TWO_PLACES + "export: {input_levels: {STP: 90}}\n")


def test_a_round_that_trains_a_stranger_is_refused():
    with pytest.raises(ConfigError, match="together, members names BQ, which no member writes"):
        config(TWO_PLACES + "together: {targets: {AR: 1}, again: [{members: [AR]}, {members: [BQ]}]}\n")
