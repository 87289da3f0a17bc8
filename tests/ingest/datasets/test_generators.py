"""Generators, found by name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

import sysid
from sysid.code_digest import code_digest
from sysid.errors import ConfigError, SysidError
from sysid.ingest import Generator, find_generator
from sysid.traces import Channel, Trace

ORDER: dict[str, Any] = {
    "case": "A",
    "recipe": {"slope": 1.0},
    "options": {},
    "channels": (Channel(name="u", unit="V"),),
    "sample_time": 0.1,
}


def test_a_generator_is_found_and_makes_what_it_is_asked_for(ramp: Any) -> None:
    found = find_generator("ramp", where="dataset.yaml")
    assert found.version.startswith(f"{sysid.__version__}/")
    trace = found.make(**ORDER)
    assert (trace.name, trace.channels, trace.sample_time) == ("A", ORDER["channels"], 0.1)


def test_the_version_holds_the_modules_own(ramp: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    before = find_generator("ramp", where="x").version
    monkeypatch.setattr(sys.modules[type(ramp).__module__], "GENERATOR_VERSION", 7, raising=False)
    assert find_generator("ramp", where="x").version == f"{before.rpartition('/')[0]}/7"


def test_without_one_the_version_is_the_digest_of_the_code() -> None:
    generator = find_generator("abdx", where="here")
    assert generator.version.endswith(f"/{code_digest(generator.generate)[:16]}")


@pytest.mark.parametrize(("name", "remedy"), [("rampe", "did you mean ramp"), ("abdx", "install the package")])
def test_an_unknown_generator_names_the_known_ones(ramp: Any, name: str, remedy: str) -> None:
    with pytest.raises(ConfigError, match=f"(?s)no generator named {name}.*dataset.yaml.*one of ramp.*{remedy}"):
        find_generator(name, where="dataset.yaml")


@pytest.mark.parametrize(
    "change",
    [{"name": "B"}, {"sample_time": 0.2}, {"channels": (Channel(name="v", unit="V"),)}],
    ids=["name", "sample time", "channels"],
)
def test_a_generator_that_makes_something_else_is_found_out(ramp: Any, change: dict[str, Any]) -> None:
    def wrong(**order: Any) -> Trace:
        return replace(ramp(**order), **change)

    with pytest.raises(SysidError, match="another trace than it was asked for"):
        Generator(name="wrong", version="", generate=wrong).make(**ORDER)


def test_the_air_brake_is_registered() -> None:
    assert find_generator("abdx", where="here").name == "abdx"
