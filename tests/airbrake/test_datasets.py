"""The shipped air-brake data sets: what is in them, and that they are made again bit for bit."""

from pathlib import Path

import numpy as np
import pytest

from sysid.ingest.dataset import load_dataset
from sysid.traces import Role

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
    "abdx-selection": {f"SEL{k:02d}": 800.0 for k in range(1, 7)},
    "abdx-combined-selection": {f"SEL{k:02d}": 900.0 for k in range(1, 7)},
}


@pytest.fixture(scope="module", params=LENGTHS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def traces(name: str):
    return load_dataset(FOLDER / name, cache=False)


def test_cases_have_the_dissertations_lengths(name: str, traces) -> None:
    assert {trace.name: trace.duration for trace in traces} == pytest.approx(LENGTHS[name])


def test_validation_cases_are_never_chosen_on(name: str, traces) -> None:
    roles = {traces.roles[trace.name] for trace in traces}
    expected = {Role.SELECTION} if "selection" in name else {Role.ESTIMATION, Role.VALIDATION}
    assert roles == expected


def test_brakes_apply_and_reservoirs_stay_between_atmosphere_and_supply(traces) -> None:
    for trace in traces:
        assert trace["BC"].max() > 5.0
        assert trace["BC"].min() >= -1e-6
        assert trace["AR"].min() > 60.0
        assert max(trace["AR"].max(), trace["BP"].max()) <= 90.0 + 1e-6


def test_the_shortest_case_is_made_again_bit_for_bit(name: str, traces) -> None:
    shortest = min(traces, key=lambda trace: (trace.duration, trace.name)).name
    again = load_dataset(FOLDER / name, cases=[shortest], cache=False)[shortest]
    np.testing.assert_array_equal(again.values, traces[shortest].values)
    assert again.digest == traces[shortest].digest
