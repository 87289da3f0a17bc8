"""A pipeline that extends another one: what is joined and how, which file an error names, what a run keeps."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from sysid.content import content_folders
from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.extending import read_joined
from sysid.workbench.commands.run import run_request
from sysid.workbench.kinds import RunRequest
from sysid.yaml_files import parse_yaml, read_yaml
from tests.workbench.assembly.conftest import PIPELINE, assembly_results

BASE = """\
kind: assembly
name: base
description: The tanks.
data: tanks
training: tanks
outputs: [upper, lower]
limits:
  upper: {low: 0, high: UH}
  lower: {low: 0}
fixed:
  - {mapping: pump -> FULL, gains: {pump: 1}, low: 0, high: 1, rest: 0}
  - {mapping: upper -> UH, gains: {upper: 1}, low: 0, high: 9, rest: 9}
  - {mapping: lower -> LH, gains: {lower: 1}, low: 0, high: 9, rest: 9}
members:
  - mapping: pump+lower -> upper
    structure: &tank {kind: NARX, input_delays: 1, output_delays: 1, neurons: 3}
    rest: 0
  - {mapping: upper -> lower, structure: *tank, rest: 0}
monte_carlo: {data: tanks, output: lower, within: 0.5}
export: {formats: [c]}
"""
HEAD = "kind: assembly\nextends: base.yaml\nname: grown\n"


def joined(folder: Path, text: str, base: str = BASE) -> dict[str, Any]:
    """What is read of an extending pipeline, and of the base beside it."""
    return read_joined(write(folder, text, base)).data


def write(folder: Path, text: str, base: str = BASE) -> Path:
    (folder / "base.yaml").write_text(base, encoding="utf-8")
    (folder / "grown.yaml").write_text(text, encoding="utf-8")
    return folder / "grown.yaml"


def load(file: Path) -> AssemblyConfig:
    read = read_joined(file)
    return check(AssemblyConfig, read.data, where=read.origins)


BASE_DATA = parse_yaml(BASE, where="base")
FULL, UH, LH = BASE_DATA["fixed"]
NEW_UH = {"mapping": "upper+pump -> UH", "gains": {"upper": 2, "pump": 1}, "low": 0, "high": 9, "rest": 9}
NEW = {"mapping": "upper -> NEW", "gains": {"upper": 1}, "low": 0, "high": 1, "rest": 0}
UPPER, LOWER = BASE_DATA["limits"]["upper"], BASE_DATA["limits"]["lower"]


@pytest.mark.parametrize(
    ("text", "key", "value"),
    [
        pytest.param("", "data", "tanks", id="what is not given is the base's"),
        pytest.param("seed: 7", "seed", 7, id="what the base has not is added"),
        pytest.param("outputs: [lower]", "outputs", ["lower"], id="what is given stands instead"),
        pytest.param("monte_carlo: {data: more}", "monte_carlo", {"data": "more"}, id="whole, not key by key"),
        pytest.param("fixed: []", "fixed", [FULL, UH, LH], id="fixed: none of one's own"),
        pytest.param(f"fixed: [{NEW}]", "fixed", [FULL, UH, LH, NEW], id="fixed: another channel comes after"),
        pytest.param(f"fixed: [{NEW_UH}]", "fixed", [FULL, NEW_UH, LH], id="fixed: the same channel in its place"),
        pytest.param(f"fixed: [{NEW}, {NEW_UH}]", "fixed", [FULL, NEW_UH, LH, NEW], id="fixed: in either order"),
        pytest.param("limits: {}", "limits", {"upper": UPPER, "lower": LOWER}, id="limits: none of one's own"),
        pytest.param(
            "limits: {upper: {high: 5}, pump: {low: 0}}",
            "limits",
            {"upper": {"high": 5}, "lower": LOWER, "pump": {"low": 0}},
            id="limits: by output, each whole",
        ),
        pytest.param("limits: {lower: null}", "limits", {"upper": UPPER}, id="limits: null takes one away"),
        pytest.param("export: null", "export", None, id="no export is a word of its own"),
    ],
)
def test_what_is_joined_and_how(tmp_path: Path, text: str, key: str, value: object) -> None:
    assert joined(tmp_path, HEAD + text) == {**BASE_DATA, "name": "grown", key: value}


@pytest.mark.parametrize("key", ["fixed", "limits", "monte_carlo", "description"])
def test_null_takes_the_bases_away(tmp_path: Path, key: str) -> None:
    kept = {name: value for name, value in BASE_DATA.items() if name != key}
    assert joined(tmp_path, f"{HEAD}{key}: null\n") == {**kept, "name": "grown"}


def test_a_channel_that_is_written_by_several_entries_is_replaced_in_all_places(tmp_path: Path) -> None:
    at_ten = {**UH, "instances": ["10"]}
    base = BASE.replace("members:", f"  - {at_ten}\nmembers:")
    assert joined(tmp_path, f"{HEAD}fixed: [{NEW_UH}]", base)["fixed"] == [FULL, NEW_UH, LH]


def test_a_base_may_extend_another(tmp_path: Path) -> None:
    (tmp_path / "middle.yaml").write_text(f"{HEAD}fixed: [{NEW}]\nseed: 7\nmonte_carlo: null\n", encoding="utf-8")
    text = HEAD.replace("base.yaml", "middle.yaml").replace("grown", "last")
    data = joined(tmp_path, f"{text}fixed: [{NEW_UH}]\n")
    assert data == {
        **{key: value for key, value in BASE_DATA.items() if key != "monte_carlo"},
        **{"name": "last", "seed": 7, "fixed": [FULL, NEW_UH, LH, NEW]},
    }


def test_a_base_may_lie_in_another_folder(tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "base.yaml").write_text(BASE, encoding="utf-8")
    file = write(inner, HEAD.replace("base.yaml", "../base.yaml"), base="name: another")
    assert read_joined(file).data == {**BASE_DATA, "name": "grown"}


def test_a_pipeline_that_extends_none_is_as_it_is_written(tmp_path: Path) -> None:
    assert read_joined(write(tmp_path, BASE)).data == BASE_DATA


def test_a_pipeline_that_extends_is_the_one_written_out(tmp_path: Path) -> None:
    """The longest that there is, with a limit, a known member and a few keys of its own, both ways."""
    base = content_folders("pipelines")[0] / "combined-brake-held.yaml"
    text = base.read_text(encoding="utf-8")
    written_out = text.replace("name: combined-brake-held", "name: grown").replace("seed: 0\n", "seed: 4\n")
    written_out = written_out.replace("  BP10: {low: 0, high: BH10}", "  BP10: {low: 1, high: BH10}")
    written_out = written_out.replace("RM = clamp(BP - AR, -2, 2)", "RM = clamp(BP - AR, -3, 3)")
    known = 'fixed: [{equations: "RM = clamp(BP - AR, -3, 3)", unit: psi}]\n'
    extends = HEAD.replace("base.yaml", str(base)) + known + "limits: {BP10: {low: 1, high: BH10}}\nseed: 4\n"
    config = load(write(tmp_path, extends, base=written_out))
    assert config == load(tmp_path / "base.yaml")
    assert config != load(base)


BAD = {**NEW, "low": 2}
"""Its bounds do not hold its rest."""
UNBOUND = {**NEW_UH, "low": "no"}
WRONG_OWN = [
    pytest.param("seed: one", "line 4, field seed", "integer", id="a key"),
    pytest.param("monte_carl: null", "line 4, field monte_carl", "mean monte_carlo?", id="nothing to take away"),
    pytest.param(f"fixed:\n  - {NEW}\n  - {BAD}", "line 6, field fixed[1]", "bounds", id="a known member"),
    pytest.param(f"fixed: [{UNBOUND}]", "line 4, field fixed[0].low", "number", id="one in the place of the base's"),
    pytest.param("fixed: [{}]", "line 4, field fixed[0].mapping", "missing", id="a known member without a mapping"),
    pytest.param("fixed: [all]", "line 4, field fixed[0]", "expected: names with values", id="no known member at all"),
    pytest.param("fixed: all", "line 4, field fixed", "expected: a list", id="no list of them"),
    pytest.param("limits: {upper: {lw: 1}}", "line 4, field limits.upper.lw", "did you mean low?", id="a limit"),
]  # fmt: skip
WRONG_BASE = [
    pytest.param("data: tanks", "data: []", "line 4, field data", "expected: text", id="a key"),
    pytest.param(
        "monte_carlo:", "monte_carl:", "line 19, field monte_carl", "did you mean monte_carlo?", id="a misspelt key"
    ),
    pytest.param("upper: 1}, low: 0", "upper: 1}, low: 10", "line 12, field fixed[1]", "bounds", id="a known member"),
    pytest.param("lower: {low", "lower: {lw", "line 9, field limits.lower.lw", "did you mean low?", id="a limit"),
]
BESIDE = f"fixed: [{{mapping: pump -> FULL, gains: {{pump: 2}}, low: 0, high: 1, rest: 0}}, {NEW}]\nlimits: {{}}\n"
"""Good, and joined with the base's."""


@pytest.mark.parametrize(("text", "where", "says"), WRONG_OWN)
def test_what_is_wrong_in_the_extending_file_is_named_there(tmp_path: Path, text: str, where: str, says: str) -> None:
    file = write(tmp_path, HEAD + text)
    with pytest.raises(ConfigError, match=re.escape(says)) as caught:
        load(file)
    assert caught.value.where == f"{file}, {where}"


@pytest.mark.parametrize(("old", "new", "where", "says"), WRONG_BASE)
def test_what_is_wrong_in_the_base_is_named_there(tmp_path: Path, old: str, new: str, where: str, says: str) -> None:
    assert old in BASE
    file = write(tmp_path, HEAD + BESIDE, base=BASE.replace(old, new, 1))
    with pytest.raises(ConfigError, match=re.escape(says)) as caught:
        load(file)
    assert caught.value.where == f"{tmp_path / 'base.yaml'}, {where}"


def test_what_is_wrong_in_the_bases_base_is_named_there(tmp_path: Path) -> None:
    (tmp_path / "middle.yaml").write_text(HEAD + BESIDE, encoding="utf-8")
    file = write(
        tmp_path,
        HEAD.replace("base.yaml", "middle.yaml") + BESIDE,
        BASE.replace("low: 0, high: 9", "low: no, high: 9", 1),
    )
    with pytest.raises(ConfigError, match="number") as caught:
        load(file)
    assert caught.value.where == f"{tmp_path / 'base.yaml'}, line 12, field fixed[1].low"


@pytest.mark.parametrize("name", ["", "name: null\n"])
def test_a_name_is_ones_own(tmp_path: Path, name: str) -> None:
    file = write(tmp_path, HEAD.replace("name: grown\n", name))
    with pytest.raises(ConfigError, match="field 'name' is missing") as caught:
        load(file)
    assert str(caught.value.where).startswith(str(file))


@pytest.mark.parametrize(
    ("extends", "says"),
    [
        ("bas.yaml", ["the pipeline to extend is not there", "a YAML file, seen from", "did you mean base.yaml?"]),
        ("base", ["is not there", "did you mean base.yaml?"]),
        ("../bse.yml", ["is not there", "../bse.yml", "remedy"]),
        ("[base.yaml]", ["is not there", "['base.yaml']"]),
        ("grown.yaml", ["extend each other in a circle", "grown.yaml -> grown.yaml", "leave out extends"]),
        ("round.yaml", ["in a circle", "grown.yaml -> round.yaml -> grown.yaml", "round.yaml, line 2, field extends"]),
        ("fits.yaml", ["one of another kind", "a pipeline of kind assembly", "fits.yaml, of kind fits", "remedy"]),
        ("sweep.yaml", ["one of another kind", "sweep.yaml, of kind sweep"]),
        ("broken.yaml", ["broken.yaml, line 2", "not valid YAML"]),
    ],
)
def test_what_cannot_be_extended_is_told(tmp_path: Path, extends: str, says: list[str]) -> None:
    others = {
        "round": HEAD.replace("base", "grown"),
        "fits": "name: fits",
        "sweep": "kind: sweep",
        "broken": "kind: assembly\nname: a: b",
    }
    for name, text in others.items():
        (tmp_path / f"{name}.yaml").write_text(f"{text}\n", encoding="utf-8")
    file = write(tmp_path, HEAD.replace("base.yaml", extends))
    with pytest.raises(ConfigError) as caught:
        read_joined(file)
    where = "" if extends in {"round.yaml", "broken.yaml"} else f"{file}, line 2, field extends"
    assert [word for word in [*says, where] if word not in str(caught.value)] == []


QUICK = PIPELINE.replace("candidates: 2", "candidates: 1").replace(
    "retrain: {members: [lower], max_iterations: 5}\n", ""
)
KNOWN = "fixed: [{mapping: upper -> LH, gains: {upper: 0.9}, low: 0, high: 100, rest: 0}]\n"
GROWN = f"{HEAD.replace('base', 'tanks')}limits: {{lower: {{high: LH}}}}\n{KNOWN}monte_carlo: null\n"


def run(workspace: Path, name: str, text: str, *, out: Path | None = None) -> Path:
    file = workspace / "pipelines" / f"{name}.yaml"
    file.write_text(text, encoding="utf-8")
    assert run_request(RunRequest(path=file, typed=name, out=out, tracking=False)) == 0
    return out or workspace / "runs" / name


def test_a_pipeline_that_extends_runs_as_the_one_written_out(workspace: Path) -> None:
    run(workspace, "tanks", QUICK)
    folder = run(workspace, "grown", GROWN)
    assert assembly_results(folder).pipeline == "grown"
    # A run folder says by itself what was run.
    assert (folder / "pipeline.yaml").read_text(encoding="utf-8") == GROWN
    whole = folder / "pipeline-joined.yaml"
    assert whole.read_text(encoding="utf-8").startswith("# grown.yaml joined with what it extends: tanks.yaml\n")
    config = load(workspace / "pipelines" / "grown.yaml")
    assert check(AssemblyConfig, read_yaml(whole), where=whole) == config
    # What is stored is found by what is declared, wherever that is written.
    files = [*folder.rglob("fit.json"), folder / "together.json"]
    stamps = [file.stat().st_mtime_ns for file in files]
    assert len(stamps) == 3
    run(workspace, "written-out", whole.read_text(encoding="utf-8"), out=folder)
    assert [file.stat().st_mtime_ns for file in files] == stamps
    assert not whole.exists(), "what is run now extends nothing"
    (workspace / "pipelines" / "tanks.yaml").write_text(QUICK.replace("max_iterations: 4", "max_iterations: 2"))
    run(workspace, "grown", GROWN)
    changed = [file.stat().st_mtime_ns != stamp for file, stamp in zip(files, stamps, strict=True)]
    assert changed == [False, False, True]
