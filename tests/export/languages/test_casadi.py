"""Derivatives through a free run: CasADi's and torch's are one another's, and those of the model's own free run."""

from __future__ import annotations

import re
from pathlib import Path

import casadi
import numpy as np
import pytest
import torch

from sysid.export import Surrogate
from sysid.export.languages.casadi import CasadiExporter, step_function
from sysid.export.torch.module import SurrogateSequence
from sysid.models import NARX

SAMPLES = 2000
PAGE = Path(__file__).resolve().parents[3] / "docs" / "bundles.md"


@pytest.fixture(scope="module")
def surrogate(narx) -> Surrogate:
    """A network with gates, away from its bounds."""
    return Surrogate.of(narx(NARX(input_delays="0:1", output_delays=[1, 3], neurons=4, gated=True)))


def cost_by_casadi(surrogate, u, state):
    """The mean square of the outputs, and its derivatives with respect to inputs and first state."""
    inputs, begun = casadi.MX.sym("u", *u.T.shape), casadi.MX.sym("state", len(state))
    run = step_function(surrogate).mapaccum("run", len(u), [1], [1])
    y = run(inputs, begun)[0]
    cost = casadi.sumsqr(y) / len(u)
    found = casadi.Function(
        "cost", [inputs, begun], [cost, casadi.gradient(cost, inputs), casadi.gradient(cost, begun)]
    )
    value, by_input, by_state = (one.full() for one in found(u.T, state))
    return value[0, 0], by_input.T, by_state[:, 0]


def cost_by_torch(surrogate, u, state):
    inputs, begun = (torch.tensor(one, requires_grad=True) for one in (u[:, np.newaxis], state[np.newaxis]))
    cost = (SurrogateSequence(surrogate)(inputs, begun)[0] ** 2).sum() / len(u)
    cost.backward()
    return cost.item(), inputs.grad.numpy()[:, 0], begun.grad.numpy()[0]


def slope(function, step):
    """The derivative at 0 by central differences, with the errors of the second and fourth order taken out."""
    at = [(function(k * step) - function(-k * step)) / (2 * k * step) for k in (1, 2, 4)]
    once = [(4 * at[i] - at[i + 1]) / 3 for i in range(2)]
    return (16 * once[0] - once[1]) / 15


def test_derivatives_of_a_long_free_run_are_the_models(surrogate, inputs):
    u = 0.5 * inputs(SAMPLES, 2) + 20.0
    state = surrogate.at_rest(u[0])
    value, by_input, by_state = cost_by_casadi(surrogate, u, state)
    other = cost_by_torch(surrogate, u, state)
    assert value == pytest.approx(other[0], rel=1e-12)
    np.testing.assert_allclose(by_input, other[1], rtol=1e-9, atol=1e-9 * np.abs(by_input).max())
    np.testing.assert_allclose(by_state, other[2], rtol=1e-9, atol=1e-9 * np.abs(by_state).max())
    direction = np.random.default_rng(0).normal(size=u.shape)
    direction[0] = 0.0  # the first sample is where the run begins, too

    def cost(moved):
        return np.mean(surrogate.simulate(u + moved * direction) ** 2)

    assert slope(cost, 1e-2) == pytest.approx(float(np.sum(by_input * direction)), rel=1e-9)


def test_where_a_limit_holds_derivatives_are_those_of_the_limit(limited, inputs):
    surrogate = Surrogate.of(limited, outputs=["BP", "BC"])
    u, state = casadi.SX.sym("u", 2), casadi.SX.sym("state", surrogate.state_size)
    y = step_function(surrogate)(u, state)[0]
    slopes = casadi.Function("slopes", [u, state], [casadi.jacobian(y, u), y])
    at = np.array([0.5, 10.0])  # BP may not be above STP, and BC not below 37.6
    jacobian, value = (one.full() for one in slopes(at, surrogate.at_rest(np.array([80.0, 10.0]))))
    assert value[0, 0] == at[0]
    np.testing.assert_allclose(jacobian[0], [1.0, 0.0], atol=1e-12)
    held = value[1, 0] in {37.6, 37.9}
    assert held
    np.testing.assert_allclose(jacobian[1], 0.0, atol=1e-12)


def test_the_page_s_optimal_control_reaches_its_set_point(surrogate, tmp_path, monkeypatch):
    CasadiExporter().write(surrogate, tmp_path)
    monkeypatch.chdir(tmp_path)
    first = np.array([40.0, 60.0])
    begun = surrogate.simulate(np.tile(first, (300, 1)))[-1, 0]
    names = {"first": first, "low": 0.0, "high": 95.0, "set_point": begun + 2.0}
    names["state"] = surrogate.at_rest(first, np.array([begun]))
    (code,) = re.findall(r"^```python casadi\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    exec(compile(code, "bundles.md", "exec"), names)  # noqa: S102 - our own page
    best = names["best"]
    assert ((best >= -1e-6) & (best <= 95.0 + 1e-6)).all()
    y = surrogate.simulate(np.concatenate([np.tile(first, (300, 1)), best]))[300:, 0]
    assert np.abs(y[25:] - names["set_point"]).max() < 0.2
