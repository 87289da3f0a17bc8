"""The pipeline's YAML: what is accepted, and what each mistake is told."""

from __future__ import annotations

import dataclasses
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import pytest

from sysid.content import content_folders
from sysid.errors import ConfigError
from sysid.estimation import Loop, Training
from sysid.field_checks import check
from sysid.models import NARX, StartKind
from sysid.workbench.assembly.extending import read_joined
from sysid.workbench.fits.config import PipelineConfig, find_pipeline
from sysid.workbench.kinds import kind_of, kinds
from tests.workbench.pipelines import parse_pipeline

GOOD = """\
name: first
data: rig
selection: rig-selection
mapping: a+b -> y
start: {measured: 5}
rest: {y: 1.5}
seed: 7
fits:
  - {name: ARX, structure: {kind: ARX, na: 1, nb: [2, 2], nk: [1, 1]}}
  - name: open
    structure: {kind: NARX, input_delays: "0:3", output_delays: [1, 2, 4], neurons: 6}
    training: {loop: open, max_iterations: 12}
  - name: closed
    structure: {kind: NARX, input_delays: "0:3", output_delays: [1, 2, 4], neurons: 6}
    training: {starts: 3, max_time_s: 1e2, seed: 11}
    initial: open
export: {fit: closed, formats: [onnx], tolerance: 1e-10}
report: {published: lopes-2021}
"""


def test_every_field_arrives() -> None:
    config = parse_pipeline(GOOD)
    assert str(config.mapping) == "a+b -> y"
    assert (config.start.kind, config.start.n_measured) == (StartKind.MEASURED, 5)
    assert config.rest_output == 1.5
    network = config.fits[1].structure
    assert isinstance(network, NARX)
    assert (network.input_delays, network.output_delays, network.neurons) == (((0, 1, 2, 3),), (1, 2, 4), 6)
    assert config.fits[1].training_options(config.seed) == Training(loop=Loop.OPEN, max_iterations=12, seed=7)
    assert config.fits[2].training_options(config.seed) == Training(starts=3, max_time_s=100.0, seed=11)
    assert config.export is not None
    assert (config.export.formats, config.export.tolerance) == (("onnx",), 1e-10)


def test_what_is_left_out_has_a_default() -> None:
    config = parse_pipeline(
        "name: a\ndata: d\nmapping: u -> y\nfits: [{name: f, structure: {kind: ARX, na: 1, nb: [1], nk: [0]}}]"
    )
    assert config.start.kind is StartKind.ESTIMATED
    assert config.rest_output is None
    assert config.selection is None
    assert config.export is not None
    assert config.export.fit == "best"


NETWORK = '"0:3", output_delays: [1, 2, 4], neurons: 6}'  # of the fit "open"; its twin "closed" stays as it is

MISTAKES = [
    pytest.param(
        NETWORK,
        NETWORK.replace("neurons", "neuronz"),
        ["neuronz", "did you mean neurons?", "fits[1].structure"],
        id="misspelt field of a structure",
    ),
    pytest.param(
        "max_iterations",
        "max_iteration",
        ["max_iteration", "did you mean max_iterations?", "fits[1].training"],
        id="misspelt field of a training",
    ),
    pytest.param("selection:", "selektion:", ["selektion", "did you mean selection?"], id="misspelt field at the top"),
    pytest.param("kind: ARX", "kind: ARXX", ["unknown kind", "did you mean ARX?"], id="unknown kind"),
    pytest.param("kind: ARX, ", "", ["not a structure", "kind: one of ARX, VectorARX, NARX"], id="no kind"),
    pytest.param("na: 1, ", "", ["lacks na", "add na: 2"], id="missing field of a structure"),
    pytest.param("nb: [2, 2]", "nb: two", ["orders of an ARX model", "two", "fits[0].structure"], id="text for orders"),
    pytest.param(
        "nb: [2, 2], nk: [1, 1]",
        "nb: [2, 2, 2], nk: 1",
        ["do not match the inputs", "2 values"],
        id="orders for three inputs of two",
    ),
    pytest.param(NETWORK, NETWORK.replace("6", "many"), ["number of neurons", "'many'"], id="text for neurons"),
    pytest.param(NETWORK, NETWORK.replace("[1, 2, 4]", "[0, 1]"), ["not a set of lags"], id="output delay 0"),
    pytest.param("loop: open", "loop: ajar", ["fits[1].training.loop", "'open' or 'closed'"], id="unknown loop"),
    pytest.param(
        "max_iterations: 12",
        "max_iterations: lots",
        ["fits[1].training.max_iterations", "integer"],
        id="text for a number",
    ),
    pytest.param("max_iterations: 12", "max_iterations: 0", ["max_iterations is too small"], id="no iterations"),
    pytest.param(
        "starts: 3", "choose_by: dice", ["unknown value of choose_by", "selection or evidence"], id="unknown choice"
    ),
    pytest.param("mapping: a+b -> y", "mapping: a+b = y", ["not a mapping", "->"], id="no arrow"),
    pytest.param("mapping: a+b -> y", "mapping: a+y -> y", ["not a mapping"], id="output among the inputs"),
    pytest.param("{measured: 5}", "tomorrow", ["start a free run", "first-sample"], id="unknown start"),
    pytest.param("{measured: 5}", "{measured: 0}", ["measured samples"], id="no measured samples"),
    pytest.param("rest: {y: 1.5}", "rest: {y: .nan}", ["field rest.y", "a finite number"], id="rest at no number"),
    pytest.param("rest: {y: 1.5}", "rest: {z: 1.5}", ["rest names z"], id="rest of a stranger"),
    pytest.param(
        "initial: open", "initial: opne", ["not an earlier fit", "did you mean open?"], id="misspelt initial fit"
    ),
    pytest.param(NETWORK, NETWORK.replace("6", "7"), ["'closed'", "not contained"], id="initial fit that is larger"),
    pytest.param("name: closed", "name: Open", ["cannot be told from another"], id="two names for one folder"),
    pytest.param("fit: closed", "fit: close", ["export names the fit", "did you mean closed?"], id="export of no fit"),
    pytest.param("[onnx]", "[onxx]", ["export.formats", "did you mean onnx?"], id="unknown format"),
    pytest.param(
        "tolerance: 1e-10", "input_levels: {y: 0}", ["names y, which is no input", "a, b"], id="level of an output"
    ),
    pytest.param("tolerance: 1e-10", "tolerance: -1", ["export.tolerance"], id="negative tolerance"),
    pytest.param("name: first", "name: a/b", ["field name"], id="name that is no folder"),
    pytest.param("seed: 7", "seed: -1", ["field seed"], id="negative seed"),
    pytest.param(
        "nk: [1, 1]}}",
        "nk: [1, 1]}, training: {starts: 2}}",
        ["an ARX model takes no training"],
        id="training of an ARX",
    ),
    pytest.param("fits:", "fits: []\nfitz:", ["fitz"], id="no fits"),
]


@pytest.mark.parametrize(("old", "new", "words"), MISTAKES)
def test_a_mistake_is_named(old: str, new: str, words: list[str]) -> None:
    assert old in GOOD
    with pytest.raises(ConfigError) as caught:
        parse_pipeline(GOOD.replace(old, new, 1), where="first.yaml")
    text = str(caught.value)
    assert [word for word in [*words, "first.yaml"] if word not in text] == [], text


def test_delays_for_three_inputs_of_two_are_named() -> None:
    with pytest.raises(ConfigError, match="one per input"):
        parse_pipeline(GOOD.replace('"0:3"', "[[0], [1], [2]]"))


def test_options_of_the_yaml_are_those_of_the_code() -> None:
    properties = PipelineConfig.model_json_schema()["$defs"]["TrainingConfig"]["properties"]
    assert list(properties) == [field.name for field in dataclasses.fields(Training)]


def test_schema_knows_the_structures() -> None:
    fit = PipelineConfig.model_json_schema()["$defs"]["FitConfig"]["properties"]["structure"]
    kinds = {choice["title"]: choice for choice in fit["oneOf"]}
    assert kinds["NARX"]["required"] == ["kind", "input_delays", "output_delays", "neurons"]
    assert set(kinds["ARX"]["properties"]) == {"kind", "na", "nb", "nk", "intercept"}


@pytest.mark.parametrize("file", sorted(content_folders("pipelines")[0].glob("*.yaml")), ids=lambda file: file.stem)
def test_built_in_pipelines_can_be_read(file: Path) -> None:
    kind = kind_of(file)
    read = read_joined(file)
    config: Any = check(kinds()[kind].load_config(), read.data, where=read.origins)
    assert config.name == file.stem
    assert find_pipeline(file.stem).resolve() == file
    # What an installed package brings checks its own options.
    for group in ("sysid.judges", "sysid.makers"):
        for entry in entry_points(group=group, name=kind):
            check(entry.load().options, config.options, where=file)


def test_a_workspace_comes_before_what_is_built_in(workspace: Path) -> None:
    own = workspace / "pipelines" / "service-brake.yaml"
    own.write_text("name: service-brake\n", encoding="utf-8")
    assert find_pipeline("service-brake").resolve() == own


@pytest.mark.parametrize(
    ("asked", "remedy"),
    [("frist", "did you mean first?"), ("no/such.yaml", "check the path"), ("quite-another", "sysid init")],
)
def test_an_unknown_pipeline_is_named(workspace: Path, asked: str, remedy: str) -> None:
    with pytest.raises(ConfigError, match="there is no") as caught:
        find_pipeline(asked)
    assert remedy in str(caught.value)


def test_ones_own_pipelines_are_named_first(workspace: Path) -> None:
    (workspace / "pipelines" / "zz-mine.yaml").write_text("name: zz-mine\n", encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        find_pipeline("quite-another")
    names = str(caught.value.expected).removeprefix("one of ").split(", ")
    assert names[:2] == ["first", "zz-mine"]
    assert "service-brake" in names[2:]


def test_the_file_that_was_meant_is_named(workspace: Path) -> None:
    with pytest.raises(ConfigError, match=r"did you mean pipelines/first.yaml"):
        find_pipeline("pipelines/frist.yaml")


def test_a_pipeline_in_a_folder_is_found_by_both_names() -> None:
    found = find_pipeline("benchmarks/silverbox")
    assert (found.parent.name, found.name) == ("benchmarks", "silverbox.yaml")


def test_a_data_set_is_no_pipeline(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    place = tmp_path / "datasets" / "mine" / "dataset.yaml"
    place.parent.mkdir(parents=True)
    place.write_text("name: mine\nchannels: []\ncases: {}\n")
    for ask in (lambda: find_pipeline("mine"), lambda: kind_of(place)):
        with pytest.raises(ConfigError, match='sysid auto mine --mapping "u -> y"'):
            ask()


def test_the_folder_of_a_run_names_its_pipeline(tmp_path: Path) -> None:
    folder = tmp_path / "runs" / "mine"
    folder.mkdir(parents=True)
    (folder / "results.json").write_text("{}")
    with pytest.raises(ConfigError, match="name the pipeline that was run, mine"):
        find_pipeline(str(folder))
