"""Plants that searches are tried on: integrated as their equations say."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from tests.benchmarks.auto_plants import levels, ramps
from tests.references.strange_plants import PLANTS


def test_the_linear_plant_is_what_scipy_makes_of_its_matrices() -> None:
    plant = PLANTS["linear, third order, dead time"]
    u = levels(plant, np.random.default_rng(0), 300)
    A, B = np.array([[0.0, 1.0, 0.0], [-4.0, -1.2, 0.0], [1.0, 0.0, -1.0]]), np.array([[0.0], [4.0], [0.0]])
    exact = signal.cont2discrete((A, B, np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 1))), plant.sample_time)
    x, expected = np.zeros(3), []
    for k in range(len(u)):
        expected.append(x[2])
        x = exact[0] @ x + exact[1] @ u[max(k - plant.dead, 0)]
    np.testing.assert_allclose(plant.run(u), expected, atol=1e-6)


@pytest.mark.parametrize("name", PLANTS)
def test_half_the_step_of_integration_gives_the_same(name: str) -> None:
    plant = PLANTS[name]
    u = levels(plant, np.random.default_rng(1), 200)
    finer = type(plant)(**{**vars(plant), "steps": 2 * plant.steps})
    y = plant.run(u)
    assert np.isfinite(y).all() and y.std() > 0.0
    assert np.sqrt(np.mean((finer.run(u) - y) ** 2)) < 0.02 * y.std()


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize("of", [levels, ramps])
def test_inputs_stay_in_their_ranges(name: str, of: type) -> None:
    plant = PLANTS[name]
    u = of(plant, np.random.default_rng(2), 500)
    low, high = np.array(plant.ranges).T
    assert u.shape == (500, len(plant.ranges)) and (u >= low).all() and (u <= high).all()
