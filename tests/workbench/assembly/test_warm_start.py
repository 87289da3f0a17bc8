"""A whole that goes on from a trained one: its networks as they stand, under what is declared now."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from numpy.testing import assert_array_equal

from sysid.composite import Composite, started_from
from sysid.errors import BundleError, ConfigError
from sysid.export import export_bundle
from sysid.ingest import load_dataset
from sysid.reporting import publish_run
from sysid.workbench.assembly.runner import read_assembly
from sysid.workbench.assembly.warm_start import read_whole
from sysid.workbench.commands.run import run_request
from sysid.workbench.fits.record import read_fit
from sysid.workbench.kinds import RunRequest
from tests.composite.composites import member, trace
from tests.models.test_interpolation import line
from tests.workbench.assembly.conftest import PIPELINE, assembly_results, fill

QUICK = PIPELINE.replace("candidates: 2", "candidates: 1").replace(
    "retrain: {members: [lower], max_iterations: 5}\n", ""
)
FIRST = QUICK.replace("export: null", "export: {formats: [c]}")
KNOWN = "fixed: [{mapping: upper -> LH, gains: {upper: 0.9}, low: 0, high: 100, rest: 0}]\n"
SECOND = QUICK.replace("name: tanks\n", "name: further\nwarm_start: ../runs/tanks/bundle\n", 1)


def run(workspace: Path, name: str, text: str) -> Path:
    file = workspace / "pipelines" / f"{name}.yaml"
    file.write_text(text, encoding="utf-8")
    assert run_request(RunRequest(path=file, typed=name, tracking=False)) == 0
    return workspace / "runs" / name


@pytest.fixture(scope="module")
def first_whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace in which the first whole was trained, once for all tests that go on from it."""
    folder = tmp_path_factory.mktemp("first")
    fill(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        run(folder, "tanks", FIRST)
    return folder


@pytest.fixture
def trained(workspace: Path, first_whole: Path) -> Path:
    """The run folder of the first whole."""
    shutil.copytree(first_whole, workspace, dirs_exist_ok=True)
    return workspace / "runs" / "tanks"


def test_its_networks_stand_where_members_would_be_fitted(workspace: Path, trained: Path) -> None:
    folder = run(workspace, "further", SECOND)
    results, before = assembly_results(folder), assembly_results(trained)
    assert [stage.name for stage in results.stages] == ["as it was begun from", "trained end to end"]
    assert not list(folder.rglob("fit.json"))
    assert (results.stages[0].mse, results.stages[0].selection) == (before.chosen.mse, before.chosen.selection)
    assert results.notes[0].startswith("Begun from the networks of bundle (sysid run tanks; digest ")


def test_its_rounds_are_found_again_until_it_begins_from_another_whole(workspace: Path, trained: Path) -> None:
    file = run(workspace, "further", SECOND) / "together.json"
    stamp = file.stat().st_mtime_ns
    run(workspace, "further", SECOND)
    assert file.stat().st_mtime_ns == stamp
    run(workspace, "tanks", FIRST.replace("max_iterations: 4", "max_iterations: 2"))
    run(workspace, "further", SECOND)
    assert file.stat().st_mtime_ns != stamp


def test_a_line_is_begun_from_as_well(tmp_path: Path) -> None:
    """What runs along it, and once what stands at every position, whose weights each instance begins with."""
    (tmp_path / "line.json").write_text(json.dumps(line().to_dict()), encoding="utf-8")
    given, said = read_whole(tmp_path)
    assert said.startswith(f"Begun from the line {tmp_path.name} (")
    assert set(given.outputs) == {"BP", "BP10", "BP25", "BP50", "AR", "BC"}
    places = Composite(
        members=(member("BP -> AR", instances=("", "10")), member("STP -> BP", instances=("", "10"), shared=("STP",)))
    )
    whole = started_from(places, given, trace())
    for name in ("BP", "BP10"):
        assert whole.member(name).theta is given.member(name).theta
    assert str(whole.member("AR10").mapping) == "BP10 -> AR10"
    assert_array_equal(whole.member("AR10").theta, given.member("AR").theta)


def test_the_mean_of_lines_is_nothing_to_begin_from(tmp_path: Path) -> None:
    mean = replace(line(), beside=(line(),))
    (tmp_path / "line.json").write_text(json.dumps(mean.to_dict()), encoding="utf-8")
    with pytest.raises(ConfigError, match="mean of several wholes is none to begin from"):
        read_whole(tmp_path)


def test_what_is_declared_is_the_new_pipelines(workspace: Path, trained: Path) -> None:
    held = SECOND.replace("  lower: {low: 0}", "  lower: {low: 0, high: LH}")
    folder = run(workspace, "further", held.replace("together:", f"{KNOWN}together:"))
    whole = read_assembly(folder)
    assert "LH" in whole.outputs
    assert whole.limits["lower"].high == "LH"
    assert read_assembly(trained).limits["lower"].high is None


def test_a_round_may_have_closed_a_circle_before(workspace: Path) -> None:
    chain = FIRST.replace("mapping: pump+lower -> upper", "mapping: pump -> upper").replace(
        "input_delays: [[0, 1], [1]]", "input_delays: [0, 1]"
    )
    closed = chain.replace(
        "stride: 2, checkpoints: 2}\n", "stride: 2, checkpoints: 2}\n  again: [{reads: {upper: {lower: 1}}}]\n"
    )
    given = read_assembly(run(workspace, "tanks", closed))
    folder = run(
        workspace, "further", chain.replace("name: tanks\n", "name: further\nwarm_start: ../runs/tanks/bundle\n", 1)
    )
    assert str(read_assembly(folder).member("upper").mapping) == str(given.member("upper").mapping)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("neurons: 3}\n    rest: 0\ntogether", "neurons: 4}\n    rest: 0\ntogether", "has no such"),
        ("neurons: 3}", "neurons: 3, gated: true}", "has no such upper"),
        ("together:", "retrain: {members: [lower]}\ntogether:", "begun from another one has retrain"),
    ],
)
def test_what_it_lacks_is_said(workspace: Path, trained: Path, old: str, new: str, complaint: str) -> None:
    text = SECOND.replace("    training: *short\ntogether", "together")
    assert old in text
    with pytest.raises(ConfigError, match=complaint):
        run(workspace, "further", text.replace(old, new))


def test_a_damaged_bundle_is_refused(workspace: Path, trained: Path) -> None:
    file = trained / "bundle" / "model.json"
    file.write_text(file.read_text(encoding="utf-8").replace("0.1", "0.2"), encoding="utf-8")
    with pytest.raises(BundleError):
        run(workspace, "further", SECOND)


def test_a_bundle_of_one_model_is_no_whole(workspace: Path, trained: Path) -> None:
    fit = read_fit(trained / "fits" / "upper-lower-0")
    shutil.rmtree(trained / "bundle")
    export_bundle(fit, load_dataset("tanks"), trained / "bundle", formats=["c"], tolerance=1e-6)
    with pytest.raises(ConfigError, match="no whole to begin from"):
        run(workspace, "further", SECOND)


def test_a_published_bundle_is_begun_from_as_well(workspace: Path, trained: Path) -> None:
    page = publish_run(trained, workspace / "reports", bundle=True)
    assert "[bundle](bundle)" in page.read_text(encoding="utf-8")
    shutil.rmtree(trained)
    published = SECOND.replace("../runs/tanks/bundle", "../reports/tanks/bundle")
    assert assembly_results(run(workspace, "further", published)).whole.stage


def test_a_line_is_published_beside_the_page_as_it_is(workspace: Path) -> None:
    """Whatever the line is of: it is copied, and the page says where it lies."""
    folder = run(workspace, "tanks", QUICK)
    shutil.rmtree(folder / "bundle", ignore_errors=True)
    (folder / "line.json").write_text('{"a": "interpolation"}', encoding="utf-8")
    page = publish_run(folder, workspace / "reports", bundle=True)
    assert "[line.json](line.json)" in page.read_text(encoding="utf-8")
    assert not (page.parent / "bundle").exists()
    assert (page.parent / "line.json").read_bytes() == (folder / "line.json").read_bytes()


def test_a_bundle_that_is_not_there_is_not_published(workspace: Path) -> None:
    folder = run(workspace, "tanks", QUICK)
    with pytest.raises(ConfigError, match="no bundle to publish"):
        publish_run(folder, workspace / "reports", bundle=True)
    assert not (workspace / "reports").exists()
