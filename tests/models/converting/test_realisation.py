"""Continuous systems seen at the samples, inputs held or moving, and late by a part of a sample."""

import numpy as np
import pytest

from sysid.models.converting.realisation import Realisation

PLANT = Realisation(
    A=np.array([[-0.7, 0.4], [-0.2, -1.1]]), B=np.array([1.0, 0.5]), C=np.array([[1.0, 2.0], [0.3, 0.0]]),
    D=np.array([0.0, 0.8]),
)  # fmt: skip
FINE, T = 200, 0.5


def run(system: Realisation, u: np.ndarray) -> np.ndarray:
    x, found = np.zeros(len(system.A)), []
    for one in u:
        found.append(system.C @ x + system.D * one)
        x = system.A @ x + system.B * one
    return np.array(found)


@pytest.mark.parametrize("late", [0.0, 0.31, 0.9])
@pytest.mark.parametrize("moving", [False, True], ids=["held", "moving"])
def test_the_samples_are_those_of_the_plant_on_a_fine_grid(moving: bool, late: float) -> None:
    u = np.r_[0.0, 0.0, np.random.default_rng(0).normal(size=30)]
    fine = np.repeat(u, FINE)
    if moving:
        fine = np.interp(np.arange(len(u) * FINE) / FINE, np.arange(len(u)), u)
    dead = round(late * FINE)
    fine = np.concatenate([np.zeros(dead), fine])[: len(fine)]
    truth = run(PLANT.sampled(T / FINE, moving=moving), fine)[::FINE]
    found = run(PLANT.sampled(T, moving=moving, late=late), u)
    np.testing.assert_allclose(found[:-1], truth[:-1], atol=1e-10)


@pytest.mark.parametrize("moving", [False, True], ids=["held", "moving"])
def test_an_input_that_stands_leaves_a_late_system_at_rest(moving: bool) -> None:
    system = PLANT.sampled(T, moving=moving, late=0.4)
    state = system.equilibrium(3.0)
    np.testing.assert_allclose(system.A @ state + system.B * 3.0, state, atol=1e-12)
    gain = PLANT.D - PLANT.C @ np.linalg.solve(PLANT.A, PLANT.B)
    np.testing.assert_allclose(system.C @ state + system.D * 3.0, 3.0 * gain, atol=1e-12)
