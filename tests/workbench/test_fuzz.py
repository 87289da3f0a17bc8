"""Whatever stands in a description, a bundle or stored results is taken or refused in words, never with a trace."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sysid.errors import SysidError
from sysid.export import read_bundle
from sysid.export.manifest import manifest_digest
from sysid.field_checks import check
from sysid.ingest import DatasetDescription
from sysid.reporting.results import read_results
from sysid.workbench.fits.config import PipelineConfig
from sysid.yaml_files import parse_yaml, yaml_text

HOSTILE: list[Any] = [
    None, True, -1, 0, 2.5, 1e30, float("inf"), float("nan"), 10**7, 10**30, 2**63, "", "two", "0:1e7", "0:10000000",
    "u -> y", "../x", "a" * 300, "\x1b[2J", [], {}, [[[]]], [None], ["a", "a"], {"a": {}}, {"kind": []}, [1] * 50,
]  # fmt: skip
QUICK = settings(
    max_examples=150,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
PIPELINE = """
name: first
data: tank
mapping: u -> y
start: rest
rest: {y: 0}
fits:
  - {name: A, structure: {kind: ARX, na: 1, nb: [1], nk: [1]}}
  - {name: T, structure: {kind: TransferFunction, poles: [2], zeros: [1], delays: [1]}}
  - {name: N, structure: {kind: NARX, input_delays: 1, output_delays: 1, neurons: 2}, training: {max_iterations: 8}}
  - {name: S, structure: {kind: NSS, states: 1, neurons: 2}}
export: {fit: best, formats: [onnx], tolerance: 1.0e-9}
report: {published: null}
"""
DATASET = """
name: rig
sample_time: 0.05
description: a rig
channels: [{name: a, unit: kPa, reference: gauge}, {name: b, unit: V}]
source: {files: {references: gauge, separator: ",", units: {a: kPa}}}
cases: {r: {role: estimation, file: a.csv, start: 1.0}, s: {role: test, file: b.csv}}
"""


def places(document: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where every value of a document stands."""
    parts = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    return [place for key, part in parts for place in ((*at, key), *places(part, (*at, key)))]


def replaced(document: Any, at: tuple[Any, ...], value: object) -> Any:
    """The document with one value replaced."""
    other = copy.deepcopy(document)
    holder = other
    for key in at[:-1]:
        holder = holder[key]
    holder[at[-1]] = copy.deepcopy(value)
    return other


def is_taken_or_refused_in_words(door: Callable[[], object]) -> None:
    try:
        door()
    except SysidError as error:
        assert error.remedy
        assert len(str(error)) < 5000


@pytest.mark.parametrize(("kind", "text"), [(PipelineConfig, PIPELINE), (DatasetDescription, DATASET)])
def test_a_description(kind: Any, text: str) -> None:
    whole = parse_yaml(text, where="x")
    check(kind, whole, where="x")

    @QUICK
    @given(at=st.sampled_from(places(whole)), value=st.sampled_from(HOSTILE))
    def one(at: tuple[Any, ...], value: object) -> None:
        written = yaml_text(replaced(whole, at, value))
        is_taken_or_refused_in_words(lambda: check(kind, parse_yaml(written, where="x"), where="x"))

    one()


def test_a_bundle(done: Path) -> None:
    file = done / "runs/first/bundle/model.json"
    whole = json.loads(file.read_text(encoding="utf-8"))
    assert read_bundle(file.parent).metadata == whole, "it is taken as it is"

    @QUICK
    @given(
        at=st.sampled_from(places(whole["model"], ("model",)) + [(key,) for key in whole]),
        value=st.sampled_from(HOSTILE),
    )
    def one(at: tuple[Any, ...], value: object) -> None:
        other = replaced(whole, at, value)
        if at != ("digest",):
            other["digest"] = manifest_digest(other)  # as one would that means to be believed
        file.write_text(json.dumps(other), encoding="utf-8")
        is_taken_or_refused_in_words(lambda: read_bundle(file.parent))

    one()


def test_stored_results(done: Path) -> None:
    file = done / "runs/first/results.json"
    whole = json.loads(file.read_text(encoding="utf-8"))
    assert read_results(file.parent).pipeline == "first", "they are taken as they are"

    @QUICK
    @given(at=st.sampled_from(places(whole)), value=st.sampled_from(HOSTILE))
    def one(at: tuple[Any, ...], value: object) -> None:
        file.write_text(json.dumps(replaced(whole, at, value)), encoding="utf-8")
        is_taken_or_refused_in_words(lambda: read_results(file.parent))

    one()


@pytest.mark.parametrize("text", ["[" * 10**6, "[" * 500 + "]" * 500, "9" * 5000, "[],[]," * 3_500_000, "\x00", "{"])
@pytest.mark.parametrize("name", ["bundle/model.json", "results.json"])
def test_a_file_that_is_nothing_of_the_kind(done: Path, name: str, text: str) -> None:
    file = done / "runs/first" / name
    file.write_text(text, encoding="utf-8")
    with pytest.raises(SysidError) as caught:
        read_bundle(file.parent) if "bundle" in name else read_results(file.parent)
    assert caught.value.remedy
