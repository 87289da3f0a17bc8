"""results.json: read strictly, refused clearly, written so that anybody can read it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ConfigError
from sysid.reporting import Results, parse_results, read_results, write_results
from sysid.reporting.records import SCHEMA_VERSION

Edit = Callable[[dict[str, Any]], None]


def _stored(folder: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((folder / "results.json").read_text())
    return document


def test_every_field_is_read(run_folder: Path) -> None:
    results, stored = read_results(run_folder), _stored(run_folder)
    assert results.pipeline == "tank-level"
    assert [fit.name for fit in results.fits] == [fit["name"] for fit in stored["fits"]]
    assert results.best_fit is results.fits[2]
    case = results.fits[2].cases["VAL01"]
    assert case.free_run.mse == stored["fits"][2]["cases"]["VAL01"]["free_run"]["mse"]
    assert case.role.value == "validation"
    assert results.fits[0].status_sentence == "Linear least squares: the minimum was computed directly."


def test_null_is_read_as_nan_and_written_as_null_again(run_folder: Path, tmp_path: Path) -> None:
    results = read_results(run_folder)
    assert math.isnan(results.fits[1].cases["VAL03"].free_run.mse)
    text = write_results(tmp_path, results).read_text()
    assert "NaN" not in text
    assert json.loads(text)["fits"][1]["cases"]["VAL03"]["free_run"]["mse"] is None


def test_what_is_read_and_written_again_says_the_same(run_folder: Path, tmp_path: Path) -> None:
    before = _stored(run_folder)
    write_results(tmp_path, read_results(run_folder))
    after = _stored(tmp_path)
    _assert_kept(before, after)


def _assert_kept(before: Any, after: Any) -> None:
    if isinstance(before, dict):
        for key, value in before.items():
            _assert_kept(value, after[key])
    elif isinstance(before, list):
        assert len(before) == len(after)
        for left, right in zip(before, after, strict=True):
            _assert_kept(left, right)
    else:
        assert before == after


def test_keys_of_a_later_release_are_skipped_and_kept(run_folder: Path, tmp_path: Path) -> None:
    document = _stored(run_folder)
    document["colour"] = "blue"
    document["fits"][0]["cases"]["VAL01"]["free_run"]["median"] = 0.5
    write_results(tmp_path, parse_results(document, where="test"))
    after = _stored(tmp_path)
    assert after["colour"] == "blue"
    assert after["fits"][0]["cases"]["VAL01"]["free_run"]["median"] == 0.5


def test_a_missing_version_is_the_first(run_folder: Path) -> None:
    document = _stored(run_folder)
    del document["schema_version"]
    assert parse_results(document, where="test").schema_version == 1


def _newer(document: dict[str, Any]) -> None:
    document["schema_version"] = SCHEMA_VERSION + 1


def _no_fits(document: dict[str, Any]) -> None:
    document["fits"] = []


def _no_pipeline(document: dict[str, Any]) -> None:
    del document["pipeline"]


def _text_for_mse(document: dict[str, Any]) -> None:
    document["fits"][0]["cases"]["VAL01"]["free_run"]["mse"] = "small"


def _unknown_role(document: dict[str, Any]) -> None:
    document["fits"][0]["cases"]["VAL01"]["role"] = "training"


def _unknown_loop(document: dict[str, Any]) -> None:
    document["fits"][0]["loop"] = "ajar"


def _same_name(document: dict[str, Any]) -> None:
    document["fits"][1]["name"] = document["fits"][0]["name"]


def _unknown_best(document: dict[str, Any]) -> None:
    document["best"]["name"] = "another"


def _slug_that_leaves_the_folder(document: dict[str, Any]) -> None:
    document["fits"][0]["slug"] = "../../etc"


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        pytest.param(_newer, "newer release", id="newer-schema"),
        pytest.param(_no_fits, "fits", id="no-fits"),
        pytest.param(_no_pipeline, "pipeline", id="missing-key"),
        pytest.param(_text_for_mse, r"fits\.0\.cases\.VAL01\.free_run\.mse", id="text-for-a-number"),
        pytest.param(_unknown_role, r"role.*'validation'", id="unknown-role"),
        pytest.param(_unknown_loop, "loop", id="unknown-loop"),
        pytest.param(_same_name, "a name and a slug of its own", id="two-fits-of-one-name"),
        pytest.param(_unknown_best, "best.name: one of ARX", id="best-is-no-fit"),
        pytest.param(_slug_that_leaves_the_folder, "slug", id="slug-leaves-the-folder"),
    ],
)
def test_damage_is_refused_with_the_field_and_the_remedy(run_folder: Path, edit: Edit, words: str) -> None:
    document = _stored(run_folder)
    edit(document)
    with pytest.raises(ConfigError, match=words) as refusal:
        parse_results(document, where="some file")
    assert refusal.value.where == "some file"
    assert refusal.value.remedy


@pytest.mark.parametrize(
    ("content", "words"),
    [
        pytest.param(None, "the folder holds no results", id="no-file"),
        pytest.param(b"", "JSON in UTF-8", id="empty"),
        pytest.param(b'{"pipeline": "a', "JSON in UTF-8", id="cut-off"),
        pytest.param(b"\xff\xfe\x00", "JSON in UTF-8", id="not-utf-8"),
        pytest.param(b"[1, 2]", "a JSON object", id="a-list"),
        pytest.param(b"[" * 100_000, "JSON in UTF-8", id="nested-without-end"),
    ],
)
def test_a_file_that_is_no_results_file_is_refused(tmp_path: Path, content: bytes | None, words: str) -> None:
    if content is not None:
        (tmp_path / "results.json").write_bytes(content)
    with pytest.raises(ConfigError, match=words):
        read_results(tmp_path)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@given(key=st.sampled_from(sorted(Results.model_fields)), value=json_values)
def test_any_value_under_any_key_is_read_or_refused(run_folder: Path, key: str, value: Any) -> None:
    document = _stored(run_folder) | {key: value}
    try:
        parse_results(document, where="test")
    except ConfigError as refusal:
        assert refusal.remedy
