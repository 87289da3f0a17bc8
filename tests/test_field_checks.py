"""Data that do not fit their fields: which one, where it stands, and what was meant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field

from sysid.errors import ConfigError
from sysid.field_checks import FolderName, Origins, check


class Inner(BaseModel):
    model_config = ConfigDict(extra="forbid")
    neurons: int = 1
    delays: int = 2


class Outer(BaseModel):
    model_config = ConfigDict(extra="forbid")
    name: str
    steps: tuple[Inner, ...] = ()
    models: dict[str, Inner | None] = {}
    folder: FolderName = "a"
    form: Literal["round", "square"] | dict[str, Literal["round", "square"]] = "round"


class Few(BaseModel):
    steps: Annotated[tuple[int, ...], Field(min_length=1, max_length=2)]


@pytest.mark.parametrize(
    ("data", "where", "remedy"),
    [
        ({"name": "a", "stepps": []}, "field stepps", "did you mean steps?"),
        ({"name": "a", "steps": [{}, {"neuronz": 3}]}, "field steps[1].neuronz", "did you mean neurons?"),
        ({"name": "a", "models": {"m": {"delay": 3}}}, "field models.m.delay", "did you mean delays?"),
        ({"name": "a", "models": {"m": {"xyz": 3}}}, "field models.m.xyz", "remove it"),
        ({"name": None}, "field name", "give name a value"),
        ({"name": ["a"]}, "field name", "write one text, without brackets"),
        ({"name": 5}, "field name", "write it in quotes"),
        ({"name": "a", "folder": "../Tank 1"}, "field folder", "write for example tank-1"),
        ({"name": "a", "folder": "x" * 101}, "field folder", "correct the value"),
        ({"name": "a", "form": "squar"}, "field form", "did you mean square?"),
        ({"name": "a", "form": {"u": "squar"}}, "field form.u", "did you mean square?"),
        ({"nam": "a"}, "field nam", "did you mean name? (also at fault: name)"),
        ({}, "field name", "add name: ..."),
    ],
)
def test_a_field_at_fault_is_named_with_its_path(data: dict[str, object], where: str, remedy: str) -> None:
    with pytest.raises(ConfigError) as caught:
        check(Outer, data, where="x.yaml")
    assert caught.value.where == f"x.yaml, {where}"
    assert str(caught.value.remedy).startswith(remedy)


class Mended(BaseModel):
    model_config = ConfigDict(extra="forbid")
    drift: str = ""
    jitter: str = ""


@pytest.mark.parametrize(
    ("field", "remedy"),
    [
        ("detrend", "did you mean drift?"),
        ("filter", "no record is filtered"),
        ("focus", "no record is filtered"),
        ("split", "parts of one file are cases of a data set"),
    ],
)
def test_a_word_of_another_tool_leads_to_what_there_is(field: str, remedy: str) -> None:
    """``filter`` was answered with jitter."""
    with pytest.raises(ConfigError) as caught:
        check(Mended, {field: 1}, where="x.yaml")
    assert str(caught.value.remedy).startswith(remedy)


class Truths(BaseModel):
    on: bool = False
    count: int | None = None
    share: float = 0.5
    either: bool | float = 1.0
    inner: Inner = Inner()
    listed: tuple[float, ...] = ()
    named: dict[str, int] = {}


@pytest.mark.parametrize(
    ("data", "field", "expected"),
    [
        ({"count": True}, "count", "a number"),
        ({"share": False}, "share", "a number"),
        ({"on": 1}, "on", "true or false"),
        ({"on": 0.0}, "on", "true or false"),
        ({"inner": {"neurons": True}}, "inner.neurons", "a number"),
        ({"listed": [0.5, True]}, "listed[1]", "a number"),
        ({"named": {"a": 1, "b": True}}, "named.b", "a number"),
    ],
)
def test_a_truth_is_no_number_and_a_number_no_truth(data: dict[str, object], field: str, expected: str) -> None:
    with pytest.raises(ConfigError) as caught:
        check(Truths, data, where="x.yaml")
    assert caught.value.where == f"x.yaml, field {field}"
    assert caught.value.expected == expected


def test_a_field_that_may_be_either_takes_both() -> None:
    assert check(Truths, {"either": True, "on": True, "count": 3, "share": 1}, where="x.yaml").either is True
    assert check(Truths, {"either": 1.0}, where="x.yaml").either == 1.0


def test_a_list_of_too_few_is_told_in_words_of_lists() -> None:
    """They had been the words of the library that checks: a tuple, after validation."""

    for given, words in (([], "at least 1 entry"), ([1, 2, 3], "at most 2 entries")):
        with pytest.raises(ConfigError, match=words):
            check(Few, {"steps": given}, where="x.yaml")


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


def test_what_is_of_a_whole_file_is_of_no_field(origins: Origins) -> None:
    assert origins.place(()) == str(origins.file)


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
