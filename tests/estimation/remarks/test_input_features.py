"""What an output may do with its inputs, as columns: each is causal, settled at the beginning, and of its kind."""

from __future__ import annotations

import numpy as np

from sysid.estimation.remarks.input_features import CURVES, LINEAR, PLAYS, features


def test_columns_are_settled_and_depend_on_nothing_that_comes_later() -> None:
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1.0, 1.0, (40, 2)), 5, axis=0)
    u -= u.mean(axis=0)
    simulated = np.cumsum(u[:, 0])
    found = features(u, simulated)
    assert set(found) == {LINEAR, CURVES, PLAYS}
    assert all(column.shape == (200,) and np.isfinite(column).all() for column in found[PLAYS])
    still = features(np.full((200, 1), 3.0), np.zeros(200))
    assert all(np.allclose(column, column[0]) for column in still[PLAYS][len(still[LINEAR]) :])
    # Each kind has all simpler ones before it, and none is copied.
    assert all(one is other for one, other in zip(found[LINEAR], found[PLAYS], strict=False))
    assert len(found[LINEAR]) < len(found[CURVES]) < len(found[PLAYS])


def test_a_play_follows_only_what_pushes_it() -> None:
    u = np.r_[np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.0, 50)]
    found = features(u[:, np.newaxis], u)
    held = found[PLAYS][len(found[CURVES])]
    turn = held[49:56]
    assert np.allclose(turn, turn[0])  # nothing moves while it crosses the gap
    assert held[-1] < turn[0]


def test_of_many_inputs_the_first_are_looked_at() -> None:
    u = np.random.default_rng(1).standard_normal((200, 9))
    every, first = features(u, u[:, 0]), features(u[:, :4], u[:, 0])
    assert {kind: len(columns) for kind, columns in every.items()} == {kind: len(one) for kind, one in first.items()}
