"""ONNX in JavaScript: the example of the documentation, run where Node and onnxruntime-web are."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from sysid.export import export_bundle

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "receivers" / "node.cjs"


@pytest.fixture(scope="module", autouse=True)
def _needs_node():
    if shutil.which("node") is None:
        pytest.skip("there is no node")
    probe = subprocess.run(["node", "-e", "require('onnxruntime-web')"], capture_output=True, check=False)
    if probe.returncode:
        pytest.skip("node finds no onnxruntime-web: npm install onnxruntime-web, and NODE_PATH=<there>/node_modules")


def test_records_of_a_cascade_are_found_as_recorded(limited, command, tmp_path):
    bundle = export_bundle(limited, command, tmp_path / "b", formats=["onnx"])
    done = subprocess.run(["node", EXAMPLE, bundle.folder], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr, done.stdout.count(": as recorded")) == (0, "", 3)


def test_records_are_found_as_recorded(fit, traces, start, tmp_path):
    bundle = export_bundle(fit, traces, tmp_path / "b", start=start, formats=["onnx"])
    done = subprocess.run(["node", EXAMPLE, bundle.folder], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count(": as recorded") == 3
    record = bundle.folder / "verify" / "record2.csv"
    record.write_text(record.read_text().replace("\n1.0,", "\n1.0,9", 1))
    assert subprocess.run(["node", EXAMPLE, bundle.folder], capture_output=True, check=False).returncode == 1
