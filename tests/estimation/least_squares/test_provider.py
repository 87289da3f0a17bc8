"""What every provider owes the engine: the same step with the evidence's question and without it."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import sysid
from sysid.estimation import Training
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.least_squares.termination import Termination
from tests.estimation.least_squares.test_levenberg_marquardt import flat_prior

TANK = sysid.GreyBox(
    equations="dh/dt = k*u - c*sqrt(max(h, 0.01))\ny = h",
    parameters={"k": {"start": 0.5}, "c": {"start": 0.5}},
    initial={"h": 1.0},
)


def record():
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(0.5, 1.5, 15), 20)
    y = np.convolve(u, 0.1 * 0.9 ** np.arange(300))[:300] ** 1.2 + 0.01 * rng.standard_normal(300)
    return sysid.data((u, y), sample_time=0.1)


@pytest.mark.parametrize(
    "structure",
    [sysid.NARX(input_delays="0:1", output_delays=2, neurons=2), sysid.NeuralStateSpace(states=2, neurons=2), TANK],
    ids=lambda one: one.kind,
)
def test_a_step_is_the_same_where_nobody_asks_for_news(structure, monkeypatch):
    found: list[tuple[AbstractProvider, np.ndarray]] = []
    minimise = LevenbergMarquardt.minimise

    def watched(self, provider, theta, prior):
        found.append((provider, theta))
        return minimise(self, provider, theta, prior)

    monkeypatch.setattr(LevenbergMarquardt, "minimise", watched)
    sysid.fit(record(), "u -> y", structure, Training(starts=1, max_iterations=3), stability=None)
    assert found
    for provider, theta in found:
        whole, bare = provider.linearise(theta), provider.linearise(theta, correlation=False)
        assert whole.loss == bare.loss
        np.testing.assert_array_equal(whole.gradient, bare.gradient)
        np.testing.assert_array_equal(whole.gauss_newton, bare.gauss_newton)
        assert whole.correlation_time >= 1.0
    assert any(np.isnan(provider.linearise(theta, correlation=False).correlation_time) for provider, theta in found)


@dataclass(eq=False)
class Line(AbstractProvider):
    """A straight line through noise, that counts who asks for what."""

    n_samples: int = 40
    asked: int = 0
    bare: int = 0

    def _at(self, theta):
        t = np.linspace(0.0, 1.0, self.n_samples)
        J = np.column_stack([np.ones_like(t), np.exp(theta[1] * t) * t])
        e = theta[0] + np.exp(theta[1] * t) - 2.0 - 3.0 * t - 0.1 * np.cos(40.0 * t)
        return Linearisation(loss=0.5 * float(e @ e), gradient=J.T @ e, gauss_newton=J.T @ J, correlation_time=2.0)

    def loss(self, theta):
        return self._at(theta).loss

    def linearise(self, theta, *, correlation=True):
        self.asked += correlation
        self.bare += not correlation
        return self._at(theta) if correlation else replace(self._at(theta), correlation_time=np.nan)


@pytest.mark.parametrize("after", [None, 3])
def test_news_are_asked_for_with_the_evidence_alone(after):
    line = Line()
    engine = LevenbergMarquardt(termination=Termination(max_iterations=6, patience=20), evidence_after=after)
    solution = engine.minimise(line, np.zeros(2), flat_prior(2, alpha=1e-3))
    assert line.bare > 1
    assert (line.asked > 1) == (after is not None)
    assert (solution.evidence is None) == (after is None)
    assert solution.at.correlation_time == 2.0  # who makes something of the solution may ask the evidence
