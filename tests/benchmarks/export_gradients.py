"""Gradients of a free run of 2,000 samples by PyTorch, JAX and CasADi, against the kernels, and their times.

    python -m tests.benchmarks export_gradients

One network with gates, away from its bounds, random weights, seed 2. The cost is the mean square of the output; its
gradient is taken with respect to every input and the first state. The kernels have no derivative by inputs: along a
random direction theirs is a central difference whose errors of the second and fourth order are taken out. Times are
medians of processor time on one thread, after a first call that compiles.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")

from collections.abc import Callable

import casadi
import jax
import numpy as np
import torch

from sysid.export import Surrogate, jax_run
from sysid.export.languages.casadi import step_function
from sysid.export.torch.module import SurrogateSequence
from sysid.models import NARX
from tests.benchmarks._findings import found
from tests.benchmarks.export import RANGES, build, excitation, median

SAMPLES = 2_000
Gradient = Callable[[], tuple[np.ndarray, np.ndarray]]
"""Gives the derivatives by inputs and by the first state."""


def by_torch(surrogate: Surrogate, u: np.ndarray, state: np.ndarray) -> Gradient:
    """Back through the module that TorchScript and ``torch.export`` are made from."""
    module = SurrogateSequence(surrogate)

    def gradient() -> tuple[np.ndarray, np.ndarray]:
        inputs, begun = (torch.tensor(one, requires_grad=True) for one in (u[:, np.newaxis], state[np.newaxis]))
        (module(inputs, begun)[0] ** 2).mean().backward()
        return inputs.grad.numpy()[:, 0], begun.grad.numpy()[0]

    return gradient


def by_jax(surrogate: Surrogate, u: np.ndarray, state: np.ndarray) -> Gradient:
    """Back through ``jax.lax.scan``, compiled."""
    run = jax_run(surrogate)
    compiled = jax.jit(jax.grad(lambda u, state: (run(u, state)[0] ** 2).mean(), argnums=(0, 1)))

    def gradient() -> tuple[np.ndarray, np.ndarray]:
        inputs, begun = (np.asarray(one) for one in compiled(u, state))
        return inputs, begun

    return gradient


def by_casadi(surrogate: Surrogate, u: np.ndarray, state: np.ndarray) -> Gradient:
    """Back through ``mapaccum``, in CasADi's own virtual machine."""
    inputs, begun = casadi.MX.sym("u", *u.T.shape), casadi.MX.sym("state", len(state))
    y = step_function(surrogate).mapaccum("run", len(u), [1], [1])(inputs, begun)[0]
    cost = casadi.sumsqr(y) / len(u)
    compiled = casadi.Function("cost", [inputs, begun], [casadi.gradient(cost, inputs), casadi.gradient(cost, begun)])

    def gradient() -> tuple[np.ndarray, np.ndarray]:
        inputs, begun = (one.full() for one in compiled(u.T, state))
        return inputs.T, begun[:, 0]

    return gradient


def slope(surrogate: Surrogate, u: np.ndarray, direction: np.ndarray, step: float = 1e-2) -> float:
    """The derivative of the cost along a direction, by the kernels' free run."""

    def cost(share: float) -> float:
        return float(np.mean(surrogate.simulate(u + share * direction) ** 2))

    at = [(cost(k * step) - cost(-k * step)) / (2 * k * step) for k in (1, 2, 4)]
    once = [(4 * at[i] - at[i + 1]) / 3 for i in range(2)]
    return (16 * once[0] - once[1]) / 15


def main() -> None:
    """Each beside the kernels, and beside PyTorch."""
    torch.set_num_threads(1)
    jax.config.update("jax_enable_x64", True)
    surrogate = Surrogate.of(
        build("BP+AR -> BC", NARX(input_delays="0:1", output_delays=[1, 3], neurons=8, gated=True), 2), RANGES
    )
    u = 0.5 * excitation(surrogate, 1)[:SAMPLES, 0] + 20.0
    state = surrogate.at_rest(u[0])
    direction = np.random.default_rng(0).normal(size=u.shape)
    direction[0] = 0.0  # the first sample is where the run begins, too
    expected = slope(surrogate, u, direction)
    found("the kernels' own free run", median(lambda: surrogate.simulate(u)), "ms")
    gradients = {
        "PyTorch": by_torch(surrogate, u, state),
        "JAX": by_jax(surrogate, u, state),
        "CasADi": by_casadi(surrogate, u, state),
    }
    first, times = gradients["PyTorch"](), {}
    for name, gradient in gradients.items():
        own = gradient()
        off = abs(float(np.sum(own[0] * direction)) / expected - 1.0)
        found(f"{name}: gradient against the kernels, relative", off, target=1e-9)
        apart = max(float(np.abs(a - b).max() / np.abs(b).max()) for a, b in zip(own, first, strict=True))
        times[name] = median(gradient, repeats=3)
        note = f"largest difference from PyTorch's {apart:.1e} of the largest"
        goal = times["PyTorch"] if name == "JAX" else None
        found(f"{name}: gradient by every input and the first state", times[name], "ms", target=goal, note=note)


if __name__ == "__main__":
    main()
