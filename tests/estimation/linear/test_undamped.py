"""Pairs of poles on the circle: those that records do not tell from there are held there, and others are not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

import sysid
from sysid.estimation import Status
from sysid.traces import TraceSet

W = {0: 0.56, 2: 0.32}
"""Natural frequency in rad a sample, by the seed of the noise."""
HELD = [
    sysid.TransferFunction(poles=2, zeros=1, delays=1),
    sysid.TransferFunction(poles=2, zeros=0, delays=0, domain="continuous"),
    sysid.OE(nb=2, nf=2, nk=1),
]
INSIDE = sysid.LinearStateSpace(states=2)


def record(seed: int, *, noise: float, radius: float = 1.0, n: int = 600) -> tuple[TraceSet, np.ndarray]:
    """A sampled ``w^2 / (s^2 + w^2)``, and its output without noise."""
    rng, w = np.random.default_rng(seed), W[seed]
    u = rng.choice([-1.0, 1.0], n // 9 + 1).repeat(9)[:n]
    a = [1.0, -2.0 * radius * np.cos(w), radius**2]
    y = signal.lfilter([0.0, 1.0 - np.cos(w), 1.0 - np.cos(w)], a, u)
    return sysid.data((u, y + noise * np.std(y) * rng.standard_normal(n)), sample_time=1.0), y


@pytest.mark.parametrize("structure", [*HELD, INSIDE], ids=lambda one: one.label)
@pytest.mark.parametrize("seed", W)
def test_an_undamped_pair_is_not_called_unstable_and_runs_as_the_plant_does(structure: object, seed: int) -> None:
    data, _ = record(seed, noise=0.05)
    fit = sysid.fit(data, "u -> y", structure)
    assert fit.status is Status.CONVERGED
    assert abs(fit.model.pole_radius - 1.0) <= (1.1e-6 if structure is INSIDE else 1e-12)
    assert fit.posterior is not None
    w = np.linalg.eigvals(fit.model.continuous().A)
    assert np.abs(w.imag) == pytest.approx(W[seed], abs=1e-4)


def test_a_pair_on_the_circle_is_no_double_integrator() -> None:
    data, _ = record(0, noise=0.0)
    fit = sysid.fit(data, "u -> y", HELD[0])
    assert any("swings undamped at 0.56 rad/s" in note for note in fit.notes)
    assert not any("integrator" in note for note in fit.notes)


@pytest.mark.parametrize("structure", HELD, ids=lambda one: one.label)
def test_a_pair_that_the_record_shows_to_be_damped_is_not_held(structure: object) -> None:
    data, _ = record(0, noise=0.02, radius=0.999)
    fit = sysid.fit(data, "u -> y", structure)
    assert fit.model.pole_radius == pytest.approx(0.999, abs=2e-4)
    assert fit.status is Status.CONVERGED


@pytest.mark.parametrize("structure", [*HELD[:2], INSIDE], ids=lambda one: one.label)
def test_a_pair_that_the_record_shows_to_grow_is_not_held(structure: object) -> None:
    data, _ = record(0, noise=0.02, radius=1.002)
    fit = sysid.fit(data, "u -> y", structure)
    assert fit.model.pole_radius == pytest.approx(1.002, abs=2e-4)
    assert fit.status is Status.UNSTABLE
