"""A damaged, incomplete or newer bundle is refused with what is wrong, and nothing in it is executed."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest

from sysid.errors import BundleError
from sysid.export import export_bundle, read_bundle
from sysid.export.manifest import seal


@pytest.fixture(scope="module")
def original(fit, traces, start, tmp_path_factory):
    return export_bundle(fit, traces, tmp_path_factory.mktemp("original") / "b", start=start)


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


@pytest.mark.parametrize("name", ["sequence.onnx", "step.onnx", "step.torchscript.pt", "MODEL_CARD.md"])
def test_missing_file(folder, name):
    (folder / name).unlink()
    with pytest.raises(BundleError, match=f"the file {name} is missing"):
        read_bundle(folder)


@pytest.mark.parametrize("name", ["sequence.onnx", "step.onnx", "step.torchscript.pt", "MODEL_CARD.md"])
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
    rewrite(folder, lambda manifest: manifest.update(schema_version=2), sealed=True)
    with pytest.raises(BundleError, match=r"(?s)newer version.*up to 1.*got:\s+2.*pip install --upgrade"):
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


@pytest.mark.parametrize("field", ["files", "card"])
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


@pytest.mark.parametrize("name", ["../b/step.onnx", "/etc/hostname", "sub/step.onnx", "..", ""])
def test_path_that_leaves_the_bundle(folder, name):
    rewrite(folder, lambda manifest: manifest["files"][0].update(name=name), sealed=True)
    with pytest.raises(BundleError, match=r"points outside|is missing"):
        read_bundle(folder)


def test_any_one_byte_changed_is_refused_or_without_effect(folder, original):
    rng = np.random.default_rng(0)
    paths = sorted(folder.iterdir())
    refused = 0
    for _ in range(200):
        path = paths[rng.integers(len(paths))]
        before = path.read_bytes()
        at = int(rng.integers(len(before)))
        path.write_bytes(before[:at] + bytes([before[at] ^ int(rng.integers(1, 256))]) + before[at + 1 :])
        try:
            assert read_bundle(folder).metadata == original.metadata
        except BundleError:
            refused += 1
        path.write_bytes(before)
    assert refused > 150
