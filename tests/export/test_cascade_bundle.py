"""A whole cascade in a bundle: several outputs, limits and levels, in every format, and read back."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from sysid.errors import ChannelError, ConfigError
from sysid.export import EXPORTERS, export_bundle, read_bundle, simulate_bundle, zip_bundle
from sysid.export.manifest import schema_text
from sysid.models import Cascade
from tests.export.test_surrogate import linear


@pytest.fixture
def bundle(cascade_bundle):
    return cascade_bundle


@pytest.fixture
def card(bundle):
    return (bundle.folder / "MODEL_CARD.md").read_text(encoding="utf-8")


def test_every_file_is_within_its_tolerance_over_every_case(bundle):
    assert {file.format for file in bundle.files} == {name for name, one in EXPORTERS.items() if not one.lacks()} - {
        "torchscript",
        "torch-export",
    }
    for file in bundle.files:
        assert 0.0 <= file.largest_difference <= file.tolerance


def test_what_is_read_back_is_the_cascade(bundle, limited, command):
    for again in (read_bundle(bundle.folder), read_bundle(zip_bundle(bundle.folder))):
        assert isinstance(again.model, Cascade)
        assert again.model.to_dict() == limited.to_dict()
        assert [channel["name"] for channel in again.outputs] == list(limited.outputs)
        u = command["VAL01"].columns(limited.inputs)
        np.testing.assert_array_equal(again.model.simulate(u).values, limited.simulate(u).values)


def test_manifest_keeps_to_the_schema_and_tells_limits_levels_and_models(bundle, limited):
    manifest = json.loads((bundle.folder / "model.json").read_text(encoding="utf-8"))
    jsonschema.validate(manifest, json.loads(schema_text()))
    assert {o["name"]: o["limits"] for o in manifest["outputs"]}["BP"] == {"low": 0.0, "high": "STP"}
    levels = manifest["initialisation"]["levels"]
    assert (levels["STP"], levels["FLOW"], levels["BP"], levels["ER"]) == ("STP", 10.0, "STP", 60.0)
    assert [stage["mapping"] for stage in manifest["stages"]] == [str(model.mapping) for model in limited.models]
    assert manifest["fit"] is None


def test_figures_are_told_by_case_and_output(bundle, card):
    figures = bundle.metadata["metrics"]
    assert list(figures) == ["EST01", "VAL01"]
    assert figures["VAL01"]["outputs"]["BC"]["free_run"]["mse"] == pytest.approx(0.0, abs=1e-18)
    assert "| VAL01 | test | BC |" in card or "| VAL01 | validation | BC |" in card


@pytest.mark.parametrize(
    "text",
    [
        "Outputs: BP [psi], AR [psi], ER [psi], V [psi], W [psi], BC [psi gauge], X [psi].",
        "- BP is held at or above 0.0 and at or below STP: a limit that was declared for it or found in the records.",
        "8 (an output is held at one of its limits, declared or found in the records)",
        "5 models, run one after the other within a sample",
        "In float32 files the state has",
    ],
)
def test_card_says(card, text):
    assert text in card.replace("\n", " ")


def test_receivers_find_every_record_as_recorded(bundle, tmp_path):
    python = [sys.executable, "-I", bundle.folder / "verify" / "verify.py"]
    done = subprocess.run(python, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr, done.stdout.count(": as recorded")) == (0, "", 3)
    (source,) = [file.name for file in bundle.files if file.format == "c"]
    for flags in ([], [f"-D{source.removesuffix('.c').upper()}_FLOAT"]):
        command = ["gcc", "-std=c99", "-O2", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", *flags]
        subprocess.run(
            [*command, "-I.", "verify/verify.c", source, "-lm", "-o", tmp_path / "v"], cwd=bundle.folder, check=True
        )
        records = sorted((bundle.folder / "verify").glob("record*.csv"))
        done = subprocess.run([tmp_path / "v", *records], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout


def test_a_bundle_of_some_outputs_tells_of_these_alone(limited, command, tmp_path):
    bundle = export_bundle(limited, command, tmp_path / "b", outputs=["BC", "AR"], formats=["onnx", "c"])
    manifest = json.loads((bundle.folder / "model.json").read_text(encoding="utf-8"))
    jsonschema.validate(manifest, json.loads(schema_text()))
    assert (manifest["mapping"], len(manifest["stages"])) == ("STP+FLOW -> BC, AR", len(limited.models))
    assert "Outputs: BC [psi gauge], AR [psi]." in (bundle.folder / "MODEL_CARD.md").read_text(encoding="utf-8")
    run = simulate_bundle(read_bundle(bundle.folder), command["VAL01"])
    assert run.trace.channel_names == ("STP", "FLOW", "BC", "AR")
    expected = limited.simulate(command["VAL01"].columns(limited.inputs))
    for name in run.outputs:
        np.testing.assert_array_equal(run.trace[name], expected[name])
    python = [sys.executable, "-I", bundle.folder / "verify" / "verify.py"]
    done = subprocess.run(python, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr, done.stdout.count(": as recorded")) == (0, "", 3)


def test_many_models_are_counted_not_listed(command, tmp_path):
    models = tuple(linear(text) for text in ("STP -> X1", *(f"X{i} -> X{i + 1}" for i in range(1, 12))))
    folder = export_bundle(Cascade(models=models), command, tmp_path / "b", outputs=["X12"], formats=[]).folder
    card = (folder / "MODEL_CARD.md").read_text(encoding="utf-8")
    assert card.startswith("# STP -> X12: 12 models with ")
    assert "12 models, run one after the other within a sample: see `stages` in `model.json`" in card


def test_the_same_cascade_gives_the_same_bytes(limited, command, tmp_path):
    first, second = (
        export_bundle(limited, command, tmp_path / name, formats=["onnx", "c"]).folder for name in ("a", "b")
    )
    names = sorted(path.relative_to(first) for path in first.rglob("*") if path.is_file())
    assert [(first / name).read_bytes() for name in names] == [(second / name).read_bytes() for name in names]


def test_cases_without_an_input_are_refused(cascade, command, tmp_path):
    with pytest.raises(ChannelError, match="STP"):
        records = tuple(replace(t, channels=t.channels[1:], values=t.values[:, 1:]) for t in command)
        export_bundle(cascade.source, replace(command, traces=records), tmp_path / "b")


def test_a_member_with_parameters_that_are_not_finite_is_refused(cascade, command, tmp_path):
    first = cascade.source.models[0]
    theta = first.theta.copy()
    theta[3] = np.nan
    broken = cascade.source.with_member(replace(first, theta=theta))
    with pytest.raises(ConfigError, match="not finite"):
        export_bundle(broken, command, tmp_path / "b", formats=["onnx"])
