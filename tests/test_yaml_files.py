"""YAML as an engineer means it."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ConfigError
from sysid.yaml_files import parse_yaml, read_yaml, yaml_text


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("no", "no"),
        ("on", "on"),
        ("Y", "Y"),
        ("true", True),
        ("1e-3", 0.001),
        ("1.5", 1.5),
        (".5", 0.5),
        ("-.inf", float("-inf")),
        ("17", 17),
        ("-3", -3),
        ("0x1F", 31),
        ("0o17", 15),
        ("010", 10),
        ("1:30", "1:30"),
        ("2024-05-01", "2024-05-01"),
        ("1_000", "1_000"),
        ("", None),
        ("~", None),
        ("'1'", "1"),
    ],
)
def test_a_scalar_is_what_it_looks_like(text: str, value: object) -> None:
    parsed = parse_yaml(f"key: {text}", where="x")["key"]
    assert parsed == value
    assert type(parsed) is type(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\na: 2", r"key 'a' stands twice"),
        ("a: {b: 1, b: 2}", r"key 'b' stands twice"),
        ("a: [1", r"line \d+"),
        ("a: !!python/object/apply:os.system ['echo no']", r"could not determine a constructor"),
        ("? [1, 2]\n: 3", r"plain text"),
        ("- 1", r"a list"),
        ("a: *nothing", r"undefined alias"),
    ],
    ids=["key twice", "key twice inside", "broken", "python object", "list as key", "a list", "unknown alias"],
)
def test_what_is_not_plain_data_is_refused(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        parse_yaml(text, where="x.yaml")


@given(st.text(max_size=80))
def test_any_text_is_parsed_or_refused(text: str) -> None:
    try:
        assert isinstance(parse_yaml(text, where="x"), dict)
    except ConfigError as error:
        assert error.remedy


LEAVES = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=12)
ENTRIES = st.lists(LEAVES, max_size=3) | st.dictionaries(st.text(max_size=5), LEAVES, max_size=3)


@given(st.dictionaries(st.text(max_size=5), LEAVES | ENTRIES, max_size=4))
def test_plain_data_are_written_as_they_are_read(data: dict[str, object]) -> None:
    assert parse_yaml(yaml_text(data), where="x") == data


@pytest.mark.parametrize("text", ["1e-3", "0o17", "010", "no", "true", "null", "1_000", "12:30", ""])
def test_text_that_looks_like_something_else_stays_text(text: str) -> None:
    assert parse_yaml(yaml_text({"key": text}), where="x") == {"key": text}


def test_an_unreadable_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read"):
        read_yaml(tmp_path / "none.yaml")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param("a: " + "9" * 5000, "line 1.*whole number of 5,000 digits", id="an integer of 5,000 digits"),
        pytest.param("a: 0x" + "f" * 5000, "whole number of 5,002 digits", id="the same in hexadecimal"),
        pytest.param("a: " + "[" * 100 + "]" * 100, "64 deep", id="lists in lists"),
        pytest.param("a:\n" + "\n".join(" " * n + "a:" for n in range(1, 100)), "64 deep", id="mappings in mappings"),
        pytest.param("[" * 100_000, "not valid YAML", id="brackets"),
        pytest.param("a: &a [*a]", "contains itself", id="a list that contains itself"),
        pytest.param(
            "a0: &a0 [1, 1]\n" + "\n".join(f"a{n + 1}: &a{n + 1} [*a{n}, *a{n}]" for n in range(30)),
            "1,000,000 values",
            id="aliases of aliases",
        ),
    ],
)
def test_bounds_come_before_memory(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=f"(?s){message}") as caught:
        parse_yaml(text, where="x.yaml")
    assert caught.value.remedy


def test_a_file_that_is_too_large_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "large.yaml"
    with path.open("wb") as file:
        file.truncate(2**30)
    with pytest.raises(ConfigError, match="larger than 4 MB"):
        read_yaml(path)


def test_a_mapping_is_merged_into_another_which_goes_first() -> None:
    text = "base: &b {gain: 1, k: {start: 2}}\nmore: {gain: 3, <<: *b}\nagain: {<<: [*b], c: 4}\nword: '<<'"
    assert parse_yaml(text, where="x") == {
        "base": {"gain": 1, "k": {"start": 2}},
        "more": {"gain": 3, "k": {"start": 2}},
        "again": {"gain": 1, "k": {"start": 2}, "c": 4},
        "word": "<<",
    }
    with pytest.raises(ConfigError, match="twice"):
        parse_yaml("base: &b {gain: 1}\nmore: {<<: *b, gain: 3, gain: 4}", where="x")
    with pytest.raises(ConfigError, match="merg"):
        parse_yaml("more: {<<: 3}", where="x")
