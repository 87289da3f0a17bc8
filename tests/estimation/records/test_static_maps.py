"""Maps without memory, told from what remembers."""

import numpy as np
import pytest
import scipy

from sysid.estimation.records.static_maps import is_static


def held(seed: int, inputs: int) -> np.ndarray:
    """Levels that stay for some samples each."""
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (60, inputs)).repeat(5, axis=0)


def curve(u: np.ndarray) -> np.ndarray:
    return np.column_stack([np.exp(-(u[:, 0] ** 2)) + np.abs(u[:, -1]), np.tanh(u.sum(axis=1))])


def lag(u: np.ndarray) -> np.ndarray:
    return scipy.signal.lfilter([0.5], [1.0, -0.5], curve(u), axis=0)


def late(u: np.ndarray) -> np.ndarray:
    return curve(np.vstack([u[:1], u[:-1]]))


def play(u: np.ndarray) -> np.ndarray:
    y, at = np.empty((len(u), 1)), 0.0
    for k, one in enumerate(u[:, 0]):
        at = min(max(at, one - 0.4), one + 0.4)
        y[k] = at
    return y


@pytest.mark.parametrize(
    ("plant", "inputs", "noise", "static"),
    [
        (curve, 1, 0.0, True),
        (curve, 2, 0.02, True),
        (lambda u: u[:, :1] * u[:, 1:2] + u[:, 2:3] * u[:, 3:], 4, 0.0, True),
        (lag, 2, 0.0, False),
        (late, 2, 0.0, False),
        (play, 1, 0.0, False),
        (curve, 1, 1.0, False),
    ],
    ids=["curve", "noise", "four inputs", "lag", "late", "play", "nothing but noise"],
)
def test_a_map_has_one_output_at_one_place_whenever_it_is_there(plant, inputs, noise, static):
    records = [(u, plant(u)) for u in (held(seed, inputs) for seed in range(8))]
    drawn = np.random.default_rng(9)
    assert is_static([(u, y + noise * drawn.standard_normal(y.shape)) for u, y in records]) is static


def test_of_one_record_parts_explain_each_other():
    u = np.concatenate([held(seed, 2) for seed in range(8)])
    assert is_static([(u, curve(u))])
    assert not is_static([(u, lag(u))])


def test_of_few_places_more_is_left_where_outputs_stand_but_for_noise():
    """A map of two inputs in 2,000 samples was fitted by states, at half of what it is."""
    u = np.concatenate([held(seed, 2) for seed in range(3)])
    y = np.exp(-4.0 * u[:, :1] ** 2) * np.sin(3.0 * u[:, 1:]) + np.abs(u[:, :1] - u[:, 1:])
    assert is_static([(u, y + 0.02 * np.random.default_rng(9).standard_normal(y.shape))])


def test_too_few_places_tell_nothing():
    few = held(0, 1)[:100]
    assert not is_static([(few, few)])
    assert not is_static([(np.zeros((0, 1)), np.zeros((0, 1)))])
    assert not is_static([(np.zeros((9, 0)), np.zeros((9, 1)))])
