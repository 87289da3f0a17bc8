"""Wrong numbers in the settings of trains, valves, devices and drivers are refused in Python, as they are in YAML."""

import dataclasses
import importlib
import math
import pkgutil
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import sysid.airbrake
import sysid.rail
from sysid.airbrake.command import Command
from sysid.airbrake.consist import BrakeValve, Consist, Cylinder, Pipe
from sysid.airbrake.settings import check_numbers
from sysid.airbrake.simulate import simulate
from sysid.airbrake.variant import LISTING
from sysid.errors import ConfigError, StabilityError


def settings() -> Iterator[tuple[Any, str]]:
    """Every setting that stands for itself, and its fields that are numbers."""
    for package in (sysid.airbrake, sysid.rail):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            for name, kind in vars(importlib.import_module(found.name)).items():
                own = isinstance(kind, type) and dataclasses.is_dataclass(kind) and kind.__module__ == found.name
                if not own or name.startswith("_") or not all(_has_default(f) for f in dataclasses.fields(kind)):
                    continue
                for field in dataclasses.fields(kind):
                    if field.type in {"float", "int"}:
                        yield kind(), field.name


def _has_default(field: dataclasses.Field[Any]) -> bool:
    return field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING


FIELDS = list(settings())


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -1.0])
@pytest.mark.parametrize(("owner", "name"), FIELDS, ids=lambda one: one if isinstance(one, str) else type(one).__name__)
def test_no_setting_takes_a_number_that_it_cannot_be(owner: Any, name: str, wrong: float) -> None:
    with pytest.raises(ConfigError):
        dataclasses.replace(owner, **{name: wrong})


def test_the_settings_are_found() -> None:
    assert len(FIELDS) > 90
    assert {"Pipe", "BrakeValve", "TailSettings", "ControlSettings", "Coupler"} <= {type(o).__name__ for o, _ in FIELDS}


@pytest.mark.parametrize("wrong", ["2", None, True, 1.5])
def test_a_whole_number_is_asked_for_where_one_is_declared(wrong: object) -> None:
    @dataclasses.dataclass(frozen=True)
    class Counted:
        count: "int" = 3

        def __post_init__(self) -> None:
            check_numbers(self, "a count")

    with pytest.raises(ConfigError, match="not a count: count"):
        Counted(count=wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("pairs", [0, -1, 501, 2.0, True, "5"])
def test_a_train_has_wagons_and_an_end(pairs: Any) -> None:
    with pytest.raises(ConfigError, match="a train needs wagons"):
        Consist(pairs=pairs)


def test_a_cylinder_touches_before_its_full_stroke() -> None:
    with pytest.raises(ConfigError, match="behind the full stroke"):
        Cylinder(contact_travel=0.3)


FALL = Command.from_rows([[0, 90], [1, 0], [10, 90]])


def test_pressures_that_are_lost_are_told() -> None:
    """A choke so wide that a step empties more than there is."""
    with pytest.raises(StabilityError, match="lost its pressures"):
        simulate(
            Command.from_rows([[0, 90], [1, 0], [30, 90], [60, 90]]),
            consist=Consist(pairs=5, valve=BrakeValve(emergency_vent=0.1)),
        )


def test_a_step_that_is_too_long_names_one_that_does() -> None:
    short = Consist(pairs=2, pipe=Pipe(length=6.0))
    with pytest.raises(StabilityError, match=r"use time_step 0\.0008 s"):
        simulate(FALL, consist=short)
    assert np.isfinite(simulate(FALL, consist=short, time_step=0.0008).pressures).all()


def test_a_valve_remembers_no_hours() -> None:
    with pytest.raises(ConfigError, match="remember that long"):
        dataclasses.replace(LISTING, rising_delay=1e6)
