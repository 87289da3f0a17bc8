"""A stored bundle is written again from its own model: the same where nothing changed, and in other formats."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from sysid.errors import BundleError, ConfigError
from sysid.export import export_bundle, read_bundle, renew_bundle, zip_bundle
from sysid.workbench.commands.export import export_command

OLD = Path(__file__).parent / "data"


@pytest.fixture(scope="module")
def bundle(fit, traces, start, tmp_path_factory):
    provenance = {"pipeline": "synthetic"}
    folder = tmp_path_factory.mktemp("stored") / "bundle"
    return export_bundle(fit, traces, folder, start=start, formats=["c"], provenance=provenance)


def content(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_with_its_cases_nothing_changes_but_where_it_comes_from(bundle, traces, tmp_path):
    again = renew_bundle(bundle.folder, tmp_path / "again", traces=traces)
    before, after = content(bundle.folder), content(tmp_path / "again")
    assert before.keys() == after.keys()
    assert {name for name in before if before[name] != after[name]} == {"model.json"}
    told = again.metadata["provenance"].pop("exported_again")
    assert told["from"] == bundle.metadata["digest"]
    unlike = {name for name in bundle.metadata if bundle.metadata[name] != again.metadata[name]}
    assert unlike == {"digest"}


def test_alone_it_is_run_on_its_record_and_says_so(bundle, tmp_path):
    again = renew_bundle(bundle.folder, tmp_path / "again")
    assert read_bundle(tmp_path / "again").metadata == again.metadata
    assert "the beginning of EST01, from rest," in (tmp_path / "again" / "MODEL_CARD.md").read_text(encoding="utf-8")
    assert all(file.largest_difference <= file.tolerance for file in again.files)
    renew_bundle(tmp_path / "again", tmp_path / "twice")
    assert content(tmp_path / "again") == content(tmp_path / "twice")


def test_a_zip_becomes_other_formats_in_place_of_none(bundle, tmp_path, capsys):
    packed = zip_bundle(bundle.folder, tmp_path / "given.zip")
    export_command(str(packed), fit=None, out=None, run_folder=None, formats="cpp, c", pack=False)
    assert [file.format for file in read_bundle(tmp_path / "given").files] == ["cpp", "c"]
    assert "Bundle:" in capsys.readouterr().out


@pytest.mark.parametrize("version", [3, 4])
def test_bundles_of_earlier_versions_are_written_again(version, tmp_path):
    again = renew_bundle(OLD / f"bundle-{version}.zip", tmp_path / "again", formats=["c"])
    assert again.metadata["schema_version"] == 5
    assert read_bundle(tmp_path / "again").metadata == again.metadata


@pytest.mark.parametrize("version", [1, 2])
def test_the_first_versions_are_refused(version, tmp_path):
    with pytest.raises(BundleError, match="too old"):
        renew_bundle(OLD / f"bundle-{version}.zip", tmp_path / "again")


def test_other_traces_are_refused(bundle, traces, tmp_path):
    others = replace(traces, traces=traces.traces[:2], roles={name: traces.roles[name] for name in traces.names[:2]})
    with pytest.raises(ConfigError, match="not those"):
        renew_bundle(bundle.folder, tmp_path / "again", traces=others)
    assert not (tmp_path / "again").exists()


@pytest.mark.parametrize(("fit", "formats"), [(None, None), ("linear", "c")])
def test_a_fit_of_a_run_needs_its_name_and_has_the_formats_of_its_pipeline(fit, formats):
    with pytest.raises(ConfigError, match="by its name"):
        export_command("service-brake", fit=fit, out=None, run_folder=None, formats=formats, pack=False)


def test_what_was_allowed_in_units_is_allowed_again(fit, traces, start, tmp_path):
    export_bundle(fit, traces, tmp_path / "bundle", start=start, formats=["c"], tolerance=1e-3)
    again = renew_bundle(tmp_path / "bundle", tmp_path / "again")
    manifest = json.loads((tmp_path / "again" / "model.json").read_text(encoding="utf-8"))
    assert [file.tolerance for file in again.files] == [1e-3]
    assert manifest["files"][0]["parity"]["share"] is None
