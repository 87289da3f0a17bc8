"""Derivatives through a free run by JAX: those of torch, and of the model's own free run."""

from __future__ import annotations

import re
from pathlib import Path

import jax
import numpy as np
import pytest
import torch

from sysid.errors import ConfigError
from sysid.export import Surrogate, jax_run, jax_step
from sysid.export.languages.jax import JaxExporter
from sysid.export.torch.module import SurrogateSequence
from sysid.models import NARX

SAMPLES = 2000
PAGE = Path(__file__).resolve().parents[3] / "docs" / "bundles.md"


@pytest.fixture(scope="module")
def surrogate(narx) -> Surrogate:
    """A network with gates, away from its bounds."""
    return Surrogate.of(narx(NARX(input_delays="0:1", output_delays=[1, 3], neurons=4, gated=True)))


def test_a_long_free_run_and_its_derivatives_are_torch_s_and_the_model_s(surrogate, inputs):
    u = 0.5 * inputs(SAMPLES, 2) + 20.0
    state = surrogate.at_rest(u[0])
    run = jax_run(surrogate)

    def cost(u, state):
        y, _, flags = run(u, state)
        return (y**2).mean(), (y, flags)

    with jax.enable_x64(True):
        found = jax.jit(jax.value_and_grad(cost, argnums=(0, 1), has_aux=True))(u, state)
        (_, (y, flags)), by_jax = jax.tree.map(np.asarray, found)
    np.testing.assert_allclose(y, surrogate.simulate(u), rtol=1e-9)
    assert (y.shape, flags.shape, flags.dtype) == ((SAMPLES, 1), (SAMPLES,), np.int32)
    torch_u, torch_state = (torch.tensor(one, requires_grad=True) for one in (u[:, np.newaxis], state[np.newaxis]))
    (SurrogateSequence(surrogate)(torch_u, torch_state)[0] ** 2).mean().backward()
    for ours, theirs in zip(by_jax, (torch_u.grad.numpy()[:, 0], torch_state.grad.numpy()[0]), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())


def test_where_a_limit_holds_derivatives_are_those_of_the_limit(limited):
    surrogate = Surrogate.of(limited, outputs=["BP", "BC"])
    step, state = jax_step(surrogate), surrogate.at_rest(np.array([80.0, 10.0]))
    at = np.array([0.5, 10.0])  # BP may not be above STP, and BC not below 37.6
    with jax.enable_x64(True):
        jacobian, value = jax.jit(jax.jacrev(lambda u: (step(u, state)[0],) * 2, has_aux=True))(at)
    jacobian, value = np.asarray(jacobian), np.asarray(value)
    assert value[0] == at[0]
    np.testing.assert_allclose(jacobian[0], [1.0, 0.0], atol=1e-12)
    assert value[1] in {37.6, 37.9}
    np.testing.assert_allclose(jacobian[1], 0.0, atol=1e-12)


def test_float32_is_refused_with_the_line_that_changes_it(surrogate):
    with pytest.raises(ConfigError, match="float32") as told:
        jax_step(surrogate)(np.zeros(2), np.zeros(surrogate.state_size))
    assert 'jax.config.update("jax_enable_x64", True)' in told.value.remedy


def test_the_page_s_gradient_of_the_file_is_the_model_s(surrogate, inputs, tmp_path, monkeypatch):
    JaxExporter().write(surrogate, tmp_path)
    monkeypatch.chdir(tmp_path)
    u = inputs(50, 2)
    names = {"u": u, "state": surrogate.at_rest(u[0]), "target": surrogate.simulate(u) + 1.0}
    (code,) = re.findall(r"^```python jax\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    before = jax.config.jax_enable_x64
    try:
        exec(compile(code, "bundles.md", "exec"), names)  # noqa: S102 - our own page
    finally:
        jax.config.update("jax_enable_x64", before)
    assert names["cost"] == pytest.approx(1.0)
    change = np.zeros_like(u)
    change[25, 1] = 1e-3
    costs = [((surrogate.simulate(u + sign * change) - names["target"]) ** 2).mean() for sign in (1, -1)]
    assert names["slopes"][25, 1] == pytest.approx((costs[0] - costs[1]) / 2e-3, rel=1e-5)
