"""Inputs and outputs where nobody names them: by the words of their names, or by how two channels move."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

import sysid
from sysid.advice import guessed
from sysid.errors import ConfigError
from sysid.ingest.inspecting.undescribed import GuessedWarning
from sysid.models import Mapping
from sysid.traces import TraceSet

N = 1200


def record(**channels: NDArray[np.float64]) -> TraceSet:
    return sysid.data(channels, sample_time=1.0)


def named(*names: str) -> TraceSet:
    rng = np.random.default_rng(0)
    return record(**{name: rng.normal(size=60) for name in names})


@pytest.mark.parametrize(
    ("names", "mapping"),
    [
        (("u", "y"), "u -> y"),
        (("y", "u"), "u -> y"),
        (("y1", "u1"), "u1 -> y1"),
        (("yEst", "uEst"), "uEst -> yEst"),
        (("output", "input"), "input -> output"),
        (("speed", "pwm_duty"), "pwm_duty -> speed"),
        (("measured_level", "pump"), "pump -> measured_level"),
        (("u1", "u2", "y"), "u1+u2 -> y"),
        (("y2", "u1", "y1", "u2"), "u1+u2 -> y2+y1"),
    ],
)
def test_names_tell(names: tuple[str, ...], mapping: str) -> None:
    found = guessed(named(*names))
    assert found is not None
    assert found.mapping == Mapping.of(mapping)


def test_three_channels_of_which_one_says_nothing_are_not_guessed() -> None:
    assert guessed(named("u", "y", "temperature")) is None
    with pytest.raises(ConfigError, match=r'mapping="u\+y -> temperature"'):
        sysid.advise(named("u", "y", "temperature"))


def lag(inputs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of a plant with one pole, and 1 % noise."""
    output = lfilter([0.0, 0.05], [1.0, -0.95], inputs)
    return np.asarray(output + 0.01 * np.std(output) * np.random.default_rng(9).normal(size=len(inputs)))


HELD = np.repeat(np.random.default_rng(1).uniform(-1.0, 1.0, N // 20), 20)
BINARY = np.repeat(np.random.default_rng(2).choice([0.0, 5.0], N // 6), 6)
WHITE = np.random.default_rng(3).normal(size=N)


@pytest.mark.parametrize("driver", [HELD, BINARY, WHITE], ids=["held levels", "binary", "white noise"])
def test_two_channels_tell_by_how_they_move(driver: NDArray[np.float64]) -> None:
    for given in (record(a=lag(driver), b=driver), record(b=driver, a=lag(driver))):
        found = guessed(given)
        assert found is not None
        assert found.mapping == Mapping.of("b -> a")


def test_an_output_that_is_measured_seldom_or_coarsely_is_no_input() -> None:
    slowly = np.repeat(lag(WHITE)[::6], 6)
    coarse = np.round(4.0 * lag(WHITE) / np.ptp(lag(WHITE))) / 4.0
    for output in (slowly, coarse):
        found = guessed(record(a=WHITE, b=output))
        assert found is not None
        assert (str(found.mapping), found.reason) == ("a -> b", "")


def test_what_was_guessed_is_told_with_both_ways_to_write_it() -> None:
    with pytest.warns(GuessedWarning, match=r'b -> a: b is held .*mapping="b -> a" says so, mapping="a -> b" not'):
        advice = sysid.advise(record(a=lag(HELD), b=HELD))
    assert str(advice.mapping) == "b -> a"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sysid.advise(record(a=lag(HELD), b=HELD), "a -> b")
        sysid.advise(record(u=HELD, y=lag(HELD)))
