"""YAML as an engineer means it."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ConfigDict

from sysid.errors import ConfigError
from sysid.yaml_files import Origins, check, parse_yaml, read_yaml, yaml_text


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


class Inner(BaseModel):
    model_config = ConfigDict(extra="forbid")
    neurons: int = 1
    delays: int = 2


class Outer(BaseModel):
    model_config = ConfigDict(extra="forbid")
    name: str
    steps: tuple[Inner, ...] = ()
    models: dict[str, Inner | None] = {}


@pytest.mark.parametrize(
    ("data", "where", "remedy"),
    [
        ({"name": "a", "stepps": []}, "field stepps", "did you mean steps?"),
        ({"name": "a", "steps": [{}, {"neuronz": 3}]}, "field steps[1].neuronz", "did you mean neurons?"),
        ({"name": "a", "models": {"m": {"delay": 3}}}, "field models.m.delay", "did you mean delays?"),
        ({"name": "a", "models": {"m": {"xyz": 3}}}, "field models.m.xyz", "remove it"),
        ({"nam": "a"}, "field nam", "did you mean name? (also at fault: name)"),
        ({}, "field name", "add name: ..."),
    ],
)
def test_a_field_at_fault_is_named_with_its_path(data: dict[str, object], where: str, remedy: str) -> None:
    with pytest.raises(ConfigError) as caught:
        check(Outer, data, where="x.yaml")
    assert caught.value.where == f"x.yaml, {where}"
    assert str(caught.value.remedy).startswith(remedy)


def test_good_data_becomes_the_model() -> None:
    assert check(Outer, {"name": "a", "steps": [{"neurons": 4}]}, where="x").steps[0].neurons == 4


@pytest.fixture
def origins(tmp_path: Path) -> Origins:
    """Of a whole whose steps stand in two files, one of them the second of the first file's."""
    base, own = tmp_path / "base.yaml", tmp_path / "own.yaml"
    base.write_text("name: base\nsteps:\n  - {neurons: 1}\n  - neurons: 2\n    delays: two\n", encoding="utf-8")
    own.write_text("name: own\n\nsteps:\n  - {neurons: three}\n", encoding="utf-8")
    return Origins(
        file=own,
        parts={("steps", 0): (Origins(file=base), ("steps", 1))} | {("steps", 1): (Origins(file=own), ("steps", 0))},
    )


def test_a_part_stands_in_its_file(origins: Origins, tmp_path: Path) -> None:
    assert origins.of(("name",)) == (tmp_path / "own.yaml", ("name",))
    assert origins.place(("steps", 0, "delays")) == f"{tmp_path / 'base.yaml'}, line 5, field steps[1].delays"
    assert origins.place(("steps", 1, "neurons")) == f"{tmp_path / 'own.yaml'}, line 4, field steps[0].neurons"


def test_what_was_joined_twice_stands_where_it_was_written(origins: Origins, tmp_path: Path) -> None:
    further = Origins(file=tmp_path / "further.yaml", parts={("steps",): (origins, ("steps",))})
    assert further.of(("steps", 0, "delays")) == (tmp_path / "base.yaml", ("steps", 1, "delays"))
    assert further.of(("steps", 7)) == (tmp_path / "own.yaml", ("steps", 7))
    assert further.of(("name",)) == (tmp_path / "further.yaml", ("name",))


def test_an_error_names_the_file_of_each_part_at_fault(origins: Origins, tmp_path: Path) -> None:
    data = {"name": "own", "steps": [{"neurons": 2, "delays": "two"}, {"neurons": "three"}]}
    with pytest.raises(ConfigError) as caught:
        check(Outer, data, where=origins)
    assert caught.value.what == "steps[1].delays cannot be used as it is"
    assert caught.value.where == f"{tmp_path / 'base.yaml'}, line 5, field steps[1].delays"
    assert str(caught.value.remedy).endswith(f"(also at fault: steps[0].neurons in {tmp_path / 'own.yaml'})")


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


class _Inner(BaseModel):
    model_config = ConfigDict(extra="forbid")
    reader: str
    grid: int = 1


class _Outer(BaseModel):
    model_config = ConfigDict(extra="forbid")
    source: _Inner | None
    rows: tuple[_Inner, ...]


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ({"source": "csv", "rows": []}, "names with values, of reader, grid"),
        ({"source": [1], "rows": []}, "names with values, of reader, grid"),
        ({"rows": []}, "names with values, of reader, grid"),
        ({"source": None}, "a value for rows"),
        ({"source": None, "rows": 3}, "a list"),
    ],
    ids=["a word", "a list", "missing", "a missing list", "a number for a list"],
)
def test_what_stands_in_place_of_names_is_told_the_names(data: dict[str, object], expected: str) -> None:
    with pytest.raises(ConfigError) as refused:
        check(_Outer, data, where="x")
    assert refused.value.expected == expected
