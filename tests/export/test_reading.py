"""A damaged, incomplete or newer bundle is refused with what is wrong, and nothing in it is executed."""

from __future__ import annotations

import json
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import BundleError
from sysid.export import export_bundle, read_bundle, zip_bundle
from sysid.export.manifest import SCHEMA_VERSION, seal

FILES = [
    "sequence.onnx",
    "step.torchscript.pt",
    "bp_ar_to_bc.c",
    "bp_ar_to_bc.h",
    "bp_ar_to_bc.fmi3.fmu",
    "verify/record2.csv",
    "verify/verify.py",
    "model.schema.json",
    "MODEL_CARD.md",
]


@pytest.fixture(scope="module")
def original(fit, traces, start, tmp_path_factory):
    formats = ["onnx", "onnx-float32", "torchscript", "c", "c-float32", "fmi2", "fmi3"]
    return export_bundle(fit, traces, tmp_path_factory.mktemp("original") / "b", start=start, formats=formats)


@pytest.fixture
def folder(original, tmp_path):
    shutil.copytree(original.folder, tmp_path / "b")
    return tmp_path / "b"


def rewrite(folder, change, *, sealed):
    """Change the manifest; ``sealed`` by somebody who knows how to compute the digest."""
    manifest = json.loads((folder / "model.json").read_text(encoding="utf-8"))
    change(manifest)
    text = seal(manifest) if sealed else json.dumps(manifest)
    (folder / "model.json").write_text(text, encoding="utf-8")


@pytest.mark.parametrize("name", FILES)
def test_missing_file(folder, name):
    (folder / name).unlink()
    with pytest.raises(BundleError, match=f"the file {name} is missing"):
        read_bundle(folder)


@pytest.mark.parametrize("name", FILES)
def test_changed_file(folder, name):
    (folder / name).write_bytes((folder / name).read_bytes() + b" ")
    with pytest.raises(BundleError, match=f"the file {name} was changed"):
        read_bundle(folder)


def test_missing_manifest(folder):
    (folder / "model.json").unlink()
    with pytest.raises(BundleError, match=r"there is no model\.json"):
        read_bundle(folder)


def test_missing_folder(tmp_path):
    with pytest.raises(BundleError, match=r"there is no model\.json"):
        read_bundle(tmp_path / "nowhere")


@pytest.mark.parametrize(
    ("text", "match"),
    [
        pytest.param(b"", "cannot be read", id="empty"),
        pytest.param(b'{"schema_version": 1', "cannot be read", id="cut off"),
        pytest.param(b"\xff\xfe", "cannot be read", id="not UTF-8"),
        pytest.param(b"[" * 100_000, "cannot be read", id="nested without end"),
        pytest.param(b"[1]", "does not describe a bundle", id="not an object"),
        pytest.param(b"{}", "does not describe a bundle", id="no version"),
        pytest.param(b'{"schema_version": "1"}', "does not describe a bundle", id="version as text"),
        pytest.param(b'{"schema_version": 0}', "does not describe a bundle", id="version 0"),
        pytest.param(b'{"schema_version": true}', "does not describe a bundle", id="version true"),
    ],
)
def test_manifest_that_is_none(folder, text, match):
    (folder / "model.json").write_bytes(text)
    with pytest.raises(BundleError, match=match):
        read_bundle(folder)


def test_newer_schema(folder):
    rewrite(folder, lambda manifest: manifest.update(schema_version=SCHEMA_VERSION + 1), sealed=True)
    numbers = rf"up to {SCHEMA_VERSION}.*got:\s+{SCHEMA_VERSION + 1}"
    with pytest.raises(BundleError, match=rf"(?s)newer version.*{numbers}.*pip install --upgrade"):
        read_bundle(folder)


def test_changed_parameter(folder):
    def change(manifest):
        manifest["model"]["theta"][0] += 1e-12

    rewrite(folder, change, sealed=False)
    with pytest.raises(BundleError, match=r"model\.json was changed"):
        read_bundle(folder)


def test_other_layout_of_the_same_json_is_accepted(folder, original):
    rewrite(folder, lambda manifest: manifest, sealed=False)
    assert read_bundle(folder).metadata == original.metadata


@pytest.mark.parametrize("field", ["files", "card", "attachments"])
def test_field_that_every_bundle_has(folder, field):
    rewrite(folder, lambda manifest: manifest.pop(field), sealed=True)
    with pytest.raises(BundleError, match=f"(?s)lacks something.*{field}"):
        read_bundle(folder)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        pytest.param(lambda m: m["model"]["theta"].pop(), "cannot be built", id="parameter missing"),
        pytest.param(lambda m: m["model"].pop("theta"), "cannot be built", id="parameters missing"),
        pytest.param(lambda m: m["model"]["structure"].update(kind="Oracle"), "cannot be built", id="unknown kind"),
        pytest.param(lambda m: m["model"]["structure"].update(neurons="x"), "cannot be built", id="neurons no number"),
        pytest.param(lambda m: m["model"]["theta"].__setitem__(0, "x"), "cannot be built", id="parameter no number"),
        pytest.param(lambda m: m.pop("model"), "cannot be built", id="model missing"),
        pytest.param(lambda m: m.update(model=None), "cannot be built", id="no model"),
        pytest.param(lambda m: m.update(files=7), "lacks something", id="files no list"),
    ],
)
def test_model_that_cannot_be_built(folder, change, match):
    rewrite(folder, change, sealed=True)
    with pytest.raises(BundleError, match=match):
        read_bundle(folder)


@pytest.mark.parametrize(
    "name", ["../b/step.onnx", "/etc/hostname", "verify/../step.onnx", "verify/./x", "a\\b", "C:x", "sub/x", "..", ""]
)
def test_path_that_leaves_the_bundle(folder, name):
    rewrite(folder, lambda manifest: manifest["files"][0].update(name=name), sealed=True)
    with pytest.raises(BundleError, match=r"points outside|is missing"):
        read_bundle(folder)


@pytest.fixture
def packed(original, tmp_path):
    return zip_bundle(original.folder, tmp_path / "b.zip")


def test_a_zip_is_read_as_the_folder_is(packed, original):
    again = read_bundle(packed)
    assert again.metadata == original.metadata
    assert again.model.to_dict() == original.model.to_dict()


def test_the_same_bundle_gives_the_same_zip(packed, original, tmp_path):
    assert zip_bundle(original.folder, tmp_path / "again.zip").read_bytes() == packed.read_bytes()


def test_a_zip_lies_beside_its_folder_unless_told_otherwise(folder):
    assert zip_bundle(folder) == folder.with_name("b.zip")
    assert read_bundle(folder.with_name("b.zip")).folder == folder.with_name("b.zip")


@pytest.mark.parametrize("name", ["model.json", "sequence.onnx", "verify/record1.csv"])
def test_a_zip_without_a_file(packed, tmp_path, name):
    with zipfile.ZipFile(packed) as whole, zipfile.ZipFile(tmp_path / "less.zip", "w") as less:
        for entry in whole.namelist():
            if entry != name:
                less.writestr(entry, whole.read(entry))
    with pytest.raises(BundleError, match=r"there is no model|is missing"):
        read_bundle(tmp_path / "less.zip")


def test_a_zip_that_unpacks_to_too_much_is_not_unpacked(packed, monkeypatch):
    monkeypatch.setattr("sysid.export.reading.LARGEST", 1000)
    with pytest.raises(BundleError, match="unpacks to more than 1000 bytes"):
        read_bundle(packed)


@pytest.mark.parametrize("data", [b"", b"PK", b"no zip at all" * 100])
def test_a_file_that_is_no_zip(tmp_path, data):
    (tmp_path / "b.zip").write_bytes(data)
    with pytest.raises(BundleError, match="not a readable zip"):
        read_bundle(tmp_path / "b.zip")


@pytest.mark.parametrize("version", range(1, SCHEMA_VERSION))
def test_a_bundle_of_an_earlier_version_is_read_for_ever(tmp_path, version):
    with zipfile.ZipFile(Path(__file__).parent / "data" / f"bundle-{version}.zip") as archive:
        archive.extractall(tmp_path)
    bundle = read_bundle(tmp_path)
    assert bundle.metadata["schema_version"] == version
    assert [channel["name"] for channel in bundle.outputs] == ["BC"]
    assert [(file.name, file.format) for file in bundle.files] == [("step.onnx", "onnx"), ("sequence.onnx", "onnx")]
    assert bundle.model.structure.label == "NARX 2/2/3"
    output = bundle.model.simulate(np.array([[80.0, 70.0], [70.0, 60.0], [60.0, 65.0], [60.0, 65.0]]))
    assert np.isfinite(output).all()


def changed(data, rng):
    at = int(rng.integers(len(data)))
    return data[:at] + bytes([data[at] ^ int(rng.integers(1, 256))]) + data[at + 1 :]


def test_any_one_byte_changed_is_refused_or_without_effect(folder, original):
    rng = np.random.default_rng(0)
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    refused = 0
    for i in range(200):
        path = paths[i % len(paths)]
        before = path.read_bytes()
        path.write_bytes(changed(before, rng))
        try:
            assert read_bundle(folder).metadata == original.metadata
        except BundleError:
            refused += 1
        path.write_bytes(before)
    assert refused == 200 or refused > 200 - 200 // len(paths)  # only model.json has bytes without effect


def test_any_one_byte_changed_in_a_zip_is_refused_or_without_effect(packed, original):
    rng, before = np.random.default_rng(1), packed.read_bytes()
    refused = 0
    for _ in range(200):
        packed.write_bytes(changed(before, rng))
        try:
            again = read_bundle(packed)
            assert again.metadata == original.metadata
            assert again.model.to_dict() == original.model.to_dict()
        except BundleError:
            refused += 1
    assert refused > 150
