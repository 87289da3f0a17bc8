"""The schemas that editors complete by accept what the workbench accepts, and are the ones that it writes."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest

from sysid.workbench.cli import run_cli
from sysid.workbench.fields import with_short_kind
from sysid.workbench.fits.config import FitConfig
from sysid.workbench.schemas import DATASET_FILE, PIPELINE_FILE, dataset_schema, pipeline_schema, schema_line
from sysid.workbench.workspace import TEMPLATE
from sysid.yaml_files import parse_yaml, read_yaml

ROOT = Path(__file__).resolve().parents[2]
PIPELINES = sorted([*ROOT.glob("pipelines/**/*.yaml"), *TEMPLATE.glob("pipelines/*.yaml")])
DATASETS = sorted([*ROOT.glob("datasets/*/dataset.yaml"), *TEMPLATE.glob("datasets/*/dataset.yaml")])

BAD_PIPELINES = {
    "a misspelt field": ("mapping:", "maping:"),
    "a word for the seed": ("seed: 1", "seed: one"),
    "an unknown structure": ("kind: ARX", "kind: ARMAX"),
    "a missing order": ("na: 2, ", ""),
    "a misspelt option": ("max_iterations", "max_iteration"),
    "an unknown kind": ("name: tank", "kind: dance\nname: tank"),
    "an unknown format": ("{fit: best}", "{formats: [exe]}"),
}


EXTENDING = "kind: assembly\nextends: base.yaml\nname: grown\n"
GOOD_EXTENDING = {
    "nothing but a name": EXTENDING,
    "what is taken away": f"{EXTENDING}monte_carlo: null\nfixed: null\nlimits: {{BP: null, AR: {{low: 0}}}}",
    "another start": f"{EXTENDING}warm_start: ../runs/base/bundle\ntogether: {{targets: {{BP: 0.1}}}}",
}
BAD_EXTENDING = {
    "a misspelt field": f"{EXTENDING}sed: 1",
    "a word for the seed": f"{EXTENDING}seed: one",
    "a misspelt limit": f"{EXTENDING}limits: {{BP: {{lw: 0}}}}",
    "a known member in part": f"{EXTENDING}fixed: [{{mapping: BP -> X, low: 0}}]",
    "no name": EXTENDING.replace("name: grown\n", ""),
    "a name taken away": EXTENDING.replace("grown", "null"),
    "nothing that it extends": EXTENDING.replace("extends: base.yaml\n", ""),
}


@pytest.fixture(scope="module")
def pipelines() -> jsonschema.Draft202012Validator:
    jsonschema.Draft202012Validator.check_schema(pipeline_schema())
    return jsonschema.Draft202012Validator(pipeline_schema())


@pytest.mark.parametrize("file", PIPELINES, ids=lambda file: file.stem)
def test_pipelines_that_run_are_accepted(file: Path, pipelines: jsonschema.Draft202012Validator) -> None:
    pipelines.validate(read_yaml(file))


@pytest.mark.parametrize(("old", "new"), BAD_PIPELINES.values(), ids=BAD_PIPELINES)
def test_mistakes_are_marked_while_one_types(old: str, new: str, pipelines: jsonschema.Draft202012Validator) -> None:
    text = (TEMPLATE / "pipelines" / "tank.yaml").read_text(encoding="utf-8")
    assert old in text
    assert not pipelines.is_valid(parse_yaml(text.replace(old, new), where="test"))


@pytest.mark.parametrize("text", GOOD_EXTENDING.values(), ids=GOOD_EXTENDING)
def test_a_pipeline_that_extends_another_leaves_out_what_it_has(
    text: str, pipelines: jsonschema.Draft202012Validator
) -> None:
    pipelines.validate(parse_yaml(text, where="test"))


@pytest.mark.parametrize("text", BAD_EXTENDING.values(), ids=BAD_EXTENDING)
def test_mistakes_are_marked_in_it_as_well(text: str, pipelines: jsonschema.Draft202012Validator) -> None:
    assert not pipelines.is_valid(parse_yaml(text, where="test"))


@pytest.mark.parametrize("key", ["data", "limits", "known"])
def test_a_pipeline_that_extends_none_takes_nothing_away(key: str, pipelines: jsonschema.Draft202012Validator) -> None:
    file = ROOT / "pipelines" / "combined-brake-held.yaml"
    assert not pipelines.is_valid({**read_yaml(file), key: None})


@pytest.mark.parametrize("file", DATASETS, ids=lambda file: file.parent.name)
def test_data_sets_that_load_are_accepted(file: Path) -> None:
    jsonschema.Draft202012Validator(dataset_schema()).validate(read_yaml(file))


def test_a_misspelt_role_is_marked_while_one_types() -> None:
    description = read_yaml(TEMPLATE / "datasets" / "tank" / "dataset.yaml")
    description["cases"]["EST"]["role"] = "estimaton"
    assert not jsonschema.Draft202012Validator(dataset_schema()).is_valid(description)


def test_a_workspace_has_the_schemas_its_files_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run_cli(["init", str(tmp_path / "mine")]) == 0
    monkeypatch.chdir(tmp_path / "mine")
    for name, schema in {PIPELINE_FILE: pipeline_schema(), DATASET_FILE: dataset_schema()}.items():
        assert json.loads(name.read_text(encoding="utf-8")) == schema
    for file in (Path("pipelines/tank.yaml"), Path("datasets/tank/dataset.yaml")):
        first = file.read_text(encoding="utf-8").splitlines()[0]
        named = first.removeprefix("# yaml-language-server: $schema=")
        assert (file.parent / named).resolve() in {PIPELINE_FILE.resolve(), DATASET_FILE.resolve()}
    proposal = Path("datasets/own/dataset.yaml")
    assert run_cli(["ingest", "datasets/tank/est.csv", "--propose", str(proposal)]) == 0
    assert proposal.read_text(encoding="utf-8").startswith(schema_line(proposal))
    assert schema_line(proposal) != ""
    PIPELINE_FILE.write_text("{}")
    assert run_cli(["schema"]) == 0
    assert json.loads(PIPELINE_FILE.read_text(encoding="utf-8")) == pipeline_schema()


@pytest.mark.parametrize("kind", ["NeuralStateSpace", "NSS"])
def test_a_structure_is_read_by_the_name_of_its_class_too(kind: str) -> None:
    from sysid.models import NeuralStateSpace
    from sysid.workbench.sweep.search_space import parse_space

    fit = FitConfig.model_validate({"name": "a", "structure": {"kind": kind, "states": 2, "neurons": 3}})
    assert isinstance(fit.structure, NeuralStateSpace)
    asked = with_short_kind({"kind": kind, "states": 2, "neurons": {"from": 3, "to": 4}})
    assert isinstance(asked, dict)
    assert [point.structure.kind for point in parse_space([asked], {}, 1).points()] == ["NSS", "NSS"]
