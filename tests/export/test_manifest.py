"""``model.json`` keeps to the schema that is published with it."""

from __future__ import annotations

import copy
import json
import math
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

import sysid
from sysid.export import Surrogate, export_bundle, read_bundle
from sysid.export.card import model_card
from sysid.export.expected_runs import random_cases
from sysid.export.manifest import SCHEMA, SCHEMA_VERSION, amplification, schema_text
from sysid.models import NARX


@pytest.fixture(scope="module")
def bundle(fit, traces, start, tmp_path_factory):
    return export_bundle(fit, traces, tmp_path_factory.mktemp("schema") / "b", start=start, formats=["onnx", "c"])


@pytest.fixture(scope="module")
def schema():
    return json.loads(schema_text())


def test_schema_is_one(schema):
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["properties"]["schema_version"] == {"const": SCHEMA_VERSION}


def test_every_manifest_keeps_to_it(bundle, schema):
    jsonschema.validate(json.loads((bundle.folder / "model.json").read_text(encoding="utf-8")), schema)


def test_it_travels_in_the_bundle(bundle):
    assert (bundle.folder / SCHEMA).read_text(encoding="utf-8") == schema_text()
    assert SCHEMA in [entry["name"] for entry in read_bundle(bundle.folder).metadata["attachments"]]


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda m: m.update(schema_version=1), id="another version"),
        pytest.param(lambda m: m.pop("files"), id="a field missing"),
        pytest.param(lambda m: m.update(extra=1), id="a field too many"),
        pytest.param(lambda m: m["files"][0].update(sha256="0"), id="a hash that is none"),
        pytest.param(lambda m: m["inputs"][0].update(range=[1.0]), id="half a range"),
        pytest.param(lambda m: m.update(sample_time_s=0), id="no sample time"),
        pytest.param(lambda m: m["provenance"].update(training={"fitted": []}), id="half a training"),
        pytest.param(lambda m: m["files"][0]["parity"].pop("random_difference"), id="no random parity"),
    ],
)
def test_schema_refuses(bundle, schema, change):
    manifest = copy.deepcopy(bundle.metadata)
    change(manifest)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(manifest, schema)


def test_every_file_in_the_bundle_is_hashed(bundle):
    listed = [entry["name"] for key in ("files", "attachments") for entry in bundle.metadata[key]]
    there = {path.relative_to(bundle.folder).as_posix() for path in bundle.folder.rglob("*") if path.is_file()}
    assert there == {*listed, bundle.metadata["card"]["name"], "model.json"}


@pytest.mark.parametrize(
    ("structure", "value"),
    [
        pytest.param(sysid.ARX(na=1, nb=1, nk=1), 1.0, id="a level of its own"),
        pytest.param(sysid.TransferFunction(poles=1, zeros=0, delays=1), 8.0, id="held by its inputs"),
        pytest.param(sysid.GreyBox(equations="y[k+1] = a*y + b*u + c", parameters={"a": 0.9, "b": 0.1, "c": 0.5},
                                   initial={"y": 7.0}), 7.0, id="declared"),
    ],
)  # fmt: skip
def test_the_values_at_rest_are_those_of_the_state_beside_them(structure, value, tmp_path):
    """The declared output at rest had stood there for states that heed none, and are at rest elsewhere."""
    u, y = 3.0 + np.repeat(np.random.default_rng(0).normal(size=40), 10), np.full(400, 7.0)
    u[0] = 3.0
    for k in range(1, 400):
        y[k] = 0.9 * y[k - 1] + 0.1 * u[k - 1] + 0.5
    fit = sysid.fit(sysid.data((u, y), sample_time=1.0), "u -> y", structure, rest_output=1.0)
    about = fit.save(tmp_path / "b", formats=("c",)).metadata["initialisation"]
    assert about["values"]["y"] == pytest.approx(value, abs=1e-3)


def test_amplification_is_told(bundle):
    told = bundle.metadata["amplification"]
    assert 0.0 < told["largest"] < 10.0
    assert told["meaning"]
    assert not told["amplifies"]
    assert "amplifies rounding" not in model_card(bundle.metadata)


def test_a_surrogate_that_amplifies_rounding_says_how_fast(bundle, narx):
    surrogate = Surrogate.of(narx(NARX(input_delays=1, output_delays=1, neurons=1)))
    (case,) = random_cases(surrogate, sequences=1)
    told = amplification((replace(case, amplification=math.exp(8.0), reached=399),), (case,), 0.1)
    assert (told["after_s"], told["rate_per_s"], told["amplifies"]) == (40.0, pytest.approx(0.2), True)
    card = model_card(bundle.metadata | {"amplification": told})
    assert "after 40 s" in card
    assert "it grew by 20 % a second" in card
    assert "**This surrogate amplifies rounding.**" in card
