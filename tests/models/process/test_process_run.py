"""The run of a process model beside a plant on a fine grid, and its derivatives beside differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from sysid.models.process.process_run import run
from sysid.models.process.process_type import ProcessType

PLANTS = {
    "P1D": [2.0, 3.0, 0.73],
    "P1DZ": [2.0, 1.5, 0.4, 0.73],
    "P2DZU": [2.0, 0.8, 0.3, -0.5, 0.73],
    "P3D": [1.0, 2.0, 0.9, 0.4, 1.0],
    "P3DU": [1.0, 1.0, 0.2, 0.5, 0.1],
    "P1DI": [0.5, 2.0, 0.31],
    "P0DI": [1.0, 0.3],
}
T, FINE = 0.25, 100


def moves(n: int = 120) -> np.ndarray:
    return np.repeat(np.random.default_rng(0).normal(size=n // 8), 8)


@pytest.mark.parametrize(("kind", "values"), PLANTS.items(), ids=PLANTS)
def test_a_run_is_that_of_the_plant_in_continuous_time(kind: str, values: list[float]) -> None:
    of, own, u = ProcessType.parse(kind), np.array(values), moves()
    B, F = of.polynomials(own)
    fine = np.repeat(u, FINE)
    late = round(of.at(own, "Td") / T * FINE)
    fine = np.concatenate([np.zeros(late), fine])[: len(fine)]
    with np.errstate(all="ignore"):
        y = signal.lsim((B[::-1], F[::-1]), fine, np.arange(len(fine)) * T / FINE, interp=False)[1][::FINE]
    found = run(of, own, u, 0.0, T)
    # A zero beside one pole hands the input through: on a fine grid it arrives up to one of its steps later.
    assert np.abs(found.output - y).max() < 1e-8 * np.abs(y).max()


@pytest.mark.parametrize(("kind", "values"), PLANTS.items(), ids=PLANTS)
@pytest.mark.parametrize("begun", [False, True], ids=["at rest", "in motion"])
def test_derivatives_are_those_of_differences(kind: str, values: list[float], begun: bool) -> None:
    of, own, u = ProcessType.parse(kind), np.array(values), moves()
    own = own + 0.01 * (of.names[-1] == "Td") * np.eye(len(own))[-1]  # away from whole samples, where slopes jump
    state = np.random.default_rng(1).normal(size=of.order) if begun else None

    def output(x: np.ndarray, at: np.ndarray | None = state) -> np.ndarray:
        return run(of, x, u, u[0], T, first=4, state=at).output

    found = run(of, own, u, u[0], T, first=4, state=state)
    for i, column in enumerate(found.slopes.T):
        h = 1e-6 * np.eye(len(own))[i]
        assert np.abs((output(own + h) - output(own - h)) / 2e-6 - column).max() < 1e-6 * max(1.0, abs(column).max())
    if state is not None:
        for i, column in enumerate(found.beginnings.T):
            assert np.allclose(output(own, state + np.eye(of.order)[i]) - found.output, column, atol=1e-12)


def test_at_rest_nothing_moves() -> None:
    of, own = ProcessType.parse("P2DZU"), np.array(PLANTS["P2DZU"])
    assert np.allclose(run(of, own, np.full(50, 3.0), 3.0, T).output, 6.0)


def test_slopes_of_polynomials_are_those_of_differences() -> None:
    of, own = ProcessType.parse("P3ZU"), np.array([2.0, 1.1, 0.3, 0.6, -0.4])

    def flat(x: np.ndarray) -> np.ndarray:
        B, F = of.polynomials(x)
        return np.concatenate([B, F[:-1]])

    found = of.polynomial_slopes(own)
    for i in range(len(own)):
        h = 1e-6 * np.eye(len(own))[i]
        assert np.allclose((flat(own + h) - flat(own - h)) / 2e-6, found[:, i], rtol=1e-6, atol=1e-8)
