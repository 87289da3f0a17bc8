"""``fixed`` as equations in YAML: the same pipeline as by weights, and printed as what is read."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from sysid.content import content_folders
from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.extending import read_joined
from sysid.workbench.assembly.fixed_words import equations_text
from sysid.workbench.commands.equations import equations_command
from sysid.yaml_files import read_yaml
from tests.workbench.assembly.conftest import PIPELINE

WEIGHTS = """\
fixed:
  - {mapping: upper -> near, gains: {upper: {0: 2, 1: -1}}, constant: -0.5, low: 0, high: 9, rest: 0, unit: cm}
  - {mapping: upper+lower -> open, gains: {upper: 20, lower: -20, open: 49.7}, constant: -29, low: 0, high: 1, rest: 1}
"""
EQUATIONS = """\
fixed:
  - unit: cm
    rest: {open: 1}
    equations: |
      # what upper will be, and whether the valve is open
      near = clamp(2*upper - upper[k-1] - 0.5, 0, 9)
      open = relay(upper - lower, on=1.45, off=-0.985, slope=20)
"""


def config(folder: Path, text: str) -> AssemblyConfig:
    file = folder / "tanks.yaml"
    file.write_text(text, encoding="utf-8")
    joined = read_joined(file)
    return check(AssemblyConfig, joined.data, where=joined.origins)


def test_equations_are_the_weights_that_they_stand_for(tmp_path):
    assert config(tmp_path, PIPELINE + EQUATIONS) == config(tmp_path, PIPELINE + WEIGHTS)


def test_who_extends_replaces_one_of_them(tmp_path):
    (tmp_path / "base.yaml").write_text(PIPELINE + EQUATIONS, encoding="utf-8")
    own = "kind: assembly\nname: own\nextends: base.yaml\n"
    own += 'fixed: [{equations: "near = clamp(3*upper, 0, 1); far = 2*lower"}]\n'
    (tmp_path / "own.yaml").write_text(own, encoding="utf-8")
    fixed = check(AssemblyConfig, read_joined(tmp_path / "own.yaml").data, where="own").composite.fixed
    assert [(one.output, one.high) for one in fixed] == [("near", 1.0), ("open", 1.0), ("far", float("inf"))]


@pytest.mark.parametrize(
    ("edit", "line", "field", "says"),
    [
        (
            ("*upper - upper", "*upper*net(lower, neurons=2) - upper"),
            4,
            "equations: equations, line 2, column 22",
            "net within",
        ),
        (("0, 9)", "0, -9)"), 4, "equations: low, high", "bounds of near"),
        (("rest: {open: 1}", "rest: {shut: 1}"), 4, "equations: rest", "rest names shut"),
        (("unit: cm", "units: cm"), 2, "units", "did you mean unit"),
        (("rest: {open: 1}", "rest: shut"), 3, "rest", "number"),
    ],
)
def test_what_is_wrong_names_its_line(tmp_path, edit, line, field, says):
    with pytest.raises(ConfigError, match=says) as caught:
        config(tmp_path, PIPELINE + EQUATIONS.replace(*edit))
    place = f"tanks.yaml, line {PIPELINE.count(chr(10)) + line}, field fixed[0].{field}"
    assert str(caught.value.where).endswith(place)


def test_the_command_prints_what_is_read_as_the_same(tmp_path, capsys):
    given = config(tmp_path, PIPELINE + WEIGHTS)
    equations_command(str(tmp_path / "tanks.yaml"))
    printed = capsys.readouterr().out
    assert printed == EQUATIONS.replace(EQUATIONS.splitlines(keepends=True)[4], "").replace(
        "relay(upper - lower, on=1.45, off=-0.985, slope=20)", "switch(20*upper - 20*lower + 49.7*open[k-1] - 29)"
    )
    assert config(tmp_path, PIPELINE + printed) == given
    config(tmp_path, PIPELINE)
    with pytest.raises(ConfigError, match="nothing is fixed"):
        equations_command(str(tmp_path / "tanks.yaml"))
    (tmp_path / "fits.yaml").write_text("name: fits\ndata: tanks\nmapping: u -> y\nfits: []\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="nothing is fixed") as refused:
        equations_command(str(tmp_path / "fits.yaml"))
    assert refused.value.got == "kind: fits"


@pytest.fixture(scope="module")
def schema() -> Draft202012Validator:
    found = AssemblyConfig.model_json_schema()
    Draft202012Validator.check_schema(found)
    return Draft202012Validator(found)


def test_parameters_are_those_of_equations_and_limits_and_printed_as_the_same(tmp_path, capsys, schema):
    known = """\
fixed:
  - unit: cm
    parameters: {k: {start: 0.1, low: 0.0}, on: 1.45}
    equations: |
      flow = k * sqrt(upper)
      open = relay(upper - lower, on=on, off=-0.985, slope=20)
"""
    limits = "limits:\n  lower: {low: 0, high: edge + k*upper, parameters: {edge: {start: 9, unit: cm}}}\n"
    text = PIPELINE.replace("limits:\n  lower: {low: 0}\n", limits)
    given = config(tmp_path, text + known)
    assert given.composite.free == ("k", "on", "edge")
    assert [one.output for one in given.composite.fixed if one.free] == ["flow", "open", "lower high"]
    schema.validate(read_yaml(tmp_path / "tanks.yaml"))
    equations_command(str(tmp_path / "tanks.yaml"))
    assert config(tmp_path, text + capsys.readouterr().out) == given
    named = text.replace("together:", "together:\n  members: [lower, flow, lower high]")
    assert config(tmp_path, named + known).plan.rounds[0].members == ("lower", "flow", "lower high")
    with pytest.raises(ConfigError, match="members names open"):
        config(tmp_path, PIPELINE.replace("together:", "together:\n  members: [lower, open]") + EQUATIONS)
    with pytest.raises(ConfigError, match="k is declared in two ways"):
        config(tmp_path, text.replace("{edge:", "{k: 3, edge:") + known)


BUILT_IN = [
    one
    for one in sorted(content_folders("pipelines")[0].glob("*.yaml"))
    if re.search("^fixed:", one.read_text("utf-8"), re.M)
]


@pytest.mark.parametrize("pipeline", BUILT_IN, ids=lambda one: one.stem)
def test_what_is_built_in_is_written_by_equations_and_printed_as_the_same(tmp_path, pipeline, schema):
    assert all("equations" in one for one in read_yaml(pipeline)["fixed"])
    schema.validate(read_yaml(pipeline))
    data = read_joined(pipeline).data
    (tmp_path / "printed.yaml").write_text(equations_text(check(AssemblyConfig, data, where=pipeline).composite.fixed))
    assert check(AssemblyConfig, {**data, **read_joined(tmp_path / "printed.yaml").data}, where=pipeline) == check(
        AssemblyConfig, data, where=pipeline
    )
