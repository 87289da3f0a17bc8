"""Commands: zero-order hold, deciseconds, and rows that are refused."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.airbrake.command import Command
from sysid.errors import ConfigError

VAL04 = [[0, 90], [100, 84.2], [600, 90], [2050, 90]]


def dissertation_step(rows: list[list[float]]) -> np.ndarray:
    """The loop of the dissertation's 5.2.2, one value per decisecond."""
    output = np.empty(int(rows[-1][0]))
    for (start, pressure), (end, _) in pairwise(rows):
        for index in range(int(start) + 1, int(end) + 1):
            output[index - 1] = pressure
    return output


def test_a_printed_vector_is_held_as_its_own_algorithm_does() -> None:
    command = Command.from_rows(VAL04, time_unit="ds")
    np.testing.assert_array_equal(command.sampled(sample_time=0.1), dissertation_step(VAL04))


@given(st.lists(st.tuples(st.integers(1, 500), st.integers(0, 900)), min_size=2, max_size=8))
def test_any_vector_is_held_as_the_printed_algorithm_does(steps: list[tuple[int, int]]) -> None:
    times = np.concatenate([[0], np.cumsum([wait for wait, _ in steps])[:-1]])
    rows = [[float(t), p / 10] for t, (_, p) in zip(times, steps, strict=True)]
    command = Command.from_rows(rows, time_unit="ds")
    np.testing.assert_array_equal(command.sampled(sample_time=0.1), dissertation_step(rows))


def test_seconds_and_deciseconds_are_the_same_command() -> None:
    seconds = [[t / 10, p] for t, p in VAL04]
    assert Command.from_rows(seconds) == Command.from_rows(VAL04, time_unit="ds")


def test_a_duration_holds_the_last_row() -> None:
    command = Command.from_rows([[0, 90], [1, 70]], duration=3.0)
    assert command.sampled(sample_time=0.5).tolist() == [90.0, 90.0, 70.0, 70.0, 70.0, 70.0]


@pytest.mark.parametrize(
    ("rows", "options", "said"),
    [
        ([[0, 90], [10, 84], [5, 90]], {}, "do not increase"),
        ([[1, 90], [10, 84]], {}, "do not increase"),
        ([[0, 90], [10, -3], [20, 90]], {}, "below the atmosphere"),
        ([[0, 90]], {}, "not a list of rows"),
        ([[0, 90, 1], [3, 2, 1]], {}, "not a list of rows"),
        ([[0, "x"], [3, 2]], {}, "not a list of rows"),
        ([[0, 90], [10, float("nan")], [20, 90]], {}, "not finite"),
        ([[0, 90], [10, 84]], {"time_unit": "min"}, "unknown time unit"),
        ([[0, 90], [10, 84]], {"duration": 5.0}, "does not fit its rows"),
        ([[0, 90], [100_000, 84]], {}, "does not fit its rows"),
    ],
    ids=["backwards", "late start", "negative", "one row", "three columns", "text", "nan", "unit", "short", "a day"],
)
def test_what_is_no_command_is_refused(rows: list, options: dict, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        Command.from_rows(rows, **options)
