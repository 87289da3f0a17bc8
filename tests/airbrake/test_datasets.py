"""The shipped air-brake data sets: what is in them, and that they are made again bit for bit."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.airbrake.command import Command
from sysid.airbrake.sequences import RandomCommand
from sysid.ingest.datasets.dataset import load_dataset
from sysid.ingest.datasets.description import read_description
from sysid.traces import Role, TraceSet

FOLDER = Path(__file__).parents[2] / "datasets"
LENGTHS = {
    "abdx-service": {"EST01": 2000.0, "VAL01": 2000.0, "VAL02": 360.0, "VAL03": 465.0, "VAL04": 205.0},
    "abdx-combined": {
        "EST01": 2309.6,
        "VAL01": 2309.6,
        "VAL02": 360.0,
        "VAL03": 465.0,
        "VAL04": 205.0,
        "VAL05": 309.6,
    },
    "abdx-selection": {f"SEL{k:02d}": 500.0 for k in range(1, 13)},
    "abdx-combined-selection": {f"SEL{k:02d}": 1500.0 for k in range(1, 9)},
    "abdx-combined-selection-literal": {
        "SEL01": 2116.1,
        "SEL02": 2231.7,
        "SEL03": 2158.6,
        "SEL04": 2078.8,
        "SEL05": 2117.1,
        "SEL06": 2069.5,
        "SEL07": 2212.1,
        "SEL08": 2284.5,
    },
    "ab-linear": {"EST01": 2700.0, "VAL01": 2700.0, "VAL02": 420.0, "VAL03": 720.0, "VAL04": 620.0, "VAL05": 720.0},
    "ab-linear-selection": {f"SEL{k:02d}": 1500.0 for k in range(1, 5)},
}


SHORT = {
    "abdx-service": ["VAL04"],
    "abdx-combined": ["VAL05"],
    "abdx-selection": ["SEL02"],
    "abdx-combined-selection": ["SEL03"],
    "abdx-combined-selection-literal": ["SEL06"],
    "ab-linear": ["VAL02"],
    "ab-linear-selection": ["SEL04"],
}
"""Cases that are simulated here; the long ones take 2.5 s each and differ by their commands only."""


@pytest.fixture(scope="module", params=LENGTHS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@cache
def made(name: str) -> TraceSet:
    """The cases of a data set that are simulated here, once for all tests."""
    return load_dataset(FOLDER / name, cases=SHORT[name], cache=False)


@pytest.fixture(scope="module")
def traces(name: str) -> TraceSet:
    return made(name)


def command_of(recipe: dict[str, Any]) -> Command:
    if "random" in recipe:
        limits = dict(recipe["random"])
        return RandomCommand(**{key: value for key, value in limits.items() if key != "seed"}).draw(limits["seed"])
    return Command.from_rows(recipe["command"], time_unit=recipe["time_unit"])


def test_cases_have_the_dissertations_lengths(name: str) -> None:
    cases = read_description(FOLDER / name / "dataset.yaml").cases
    assert {case: command_of(told.recipe or {}).duration for case, told in cases.items()} == pytest.approx(
        LENGTHS[name]
    )


def test_every_command_brakes(name: str) -> None:
    cases = read_description(FOLDER / name / "dataset.yaml").cases
    lowest = {case: min(command_of(told.recipe or {}).pressures) for case, told in cases.items()}
    assert max(lowest.values()) <= 84.2
    assert (min(lowest.values()) == 0.0) == ("combined" in name)


def test_validation_cases_are_never_chosen_on(name: str) -> None:
    roles = {case.role for case in read_description(FOLDER / name / "dataset.yaml").cases.values()}
    assert roles == ({Role.SELECTION} if "selection" in name else {Role.ESTIMATION, Role.VALIDATION})


def test_traces_last_as_long_as_their_commands(name: str, traces: TraceSet) -> None:
    for trace in traces:
        assert trace.duration == pytest.approx(LENGTHS[name][trace.name])


def test_brakes_apply_and_reservoirs_stay_between_atmosphere_and_supply(traces: TraceSet) -> None:
    for trace in traces:
        assert trace["BC"].max() > 9.0
        assert trace["BC"].min() >= -1e-6
        assert trace["AR"].min() > 60.0
        assert max(trace["AR"].max(), trace["BP"].max()) <= 90.0 + 1e-6


@pytest.mark.parametrize(
    ("name", "case"), [("abdx-service", "VAL04"), ("abdx-combined", "VAL05"), ("ab-linear", "VAL02")]
)
def test_a_case_is_made_again_bit_for_bit(name: str, case: str) -> None:
    one, again = made(name)[case], load_dataset(FOLDER / name, cases=[case], cache=False)[case]
    np.testing.assert_array_equal(again.values, one.values)
    assert again.digest == one.digest


@pytest.mark.parametrize(("name", "case"), [("abdx-service", "VAL04"), ("abdx-selection", "SEL02")])
def test_two_valves_are_those_of_the_same_run(name: str, case: str) -> None:
    one = made(name)[case]
    two = load_dataset(FOLDER / f"{name}-two-valves", cases=[case], cache=False)[case]
    for channel in ("STP", "BP", "AR"):
        np.testing.assert_array_equal(two[channel], one[channel])
    assert two["BP10"].min() > two["BP"].min()  # farther from the handle it falls later, and less deep
    cases = read_description(FOLDER / f"{name}-two-valves" / "dataset.yaml").cases
    for shared, told in read_description(FOLDER / name / "dataset.yaml").cases.items():
        assert (cases[shared].recipe, cases[shared].role) == (told.recipe, told.role)
