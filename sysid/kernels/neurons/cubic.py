"""The cube, which goes on growing."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sysid.kernels.arrays import FAST
from sysid.kernels.neurons.neuron import Graph, Neuron


@njit(cache=True, nogil=True, fastmath=FAST)
def values(a, first, n):
    """Replace ``n`` sums from ``first`` on by their function."""
    for j in range(first, first + n):
        a[j] = a[j] * a[j] * a[j]


@njit(cache=True, nogil=True, fastmath=FAST)
def with_slopes(a, slope):
    """Replace all sums by their function, and write its derivatives."""
    for j in range(len(a)):
        slope[j] = 3.0 * a[j] * a[j]
    for j in range(len(a)):
        a[j] = a[j] * slope[j] / 3.0


def _value(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return x**3


def _slope(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return 3.0 * x * x


def _onnx(graph: Graph, sums: str, name: str) -> str:
    return graph.add("Mul", [graph.add("Mul", [sums, sums], f"{name}_square"), sums], name)


def _torch() -> Any:
    import torch

    class Cube(torch.nn.Module):
        def forward(self, x: torch.Tensor) -> torch.Tensor:
            return x * x * x

    return Cube()


CUBIC = Neuron(
    name="cubic",
    description="goes on growing beyond the training range, as springs do that stiffen",
    value=_value,
    slope=_slope,
    c="x * x * x",
    onnx=_onnx,
    torch=_torch,
    jax=lambda: lambda x: x * x * x,  # what a power's derivative is at 0 depends on the library
    matlab="x .* x .* x",
    st="{x} * {x} * {x}",
)
