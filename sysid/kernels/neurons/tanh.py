"""The hyperbolic tangent, which saturates."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sysid.kernels import registers
from sysid.kernels.arrays import FAST
from sysid.kernels.neurons.neuron import Graph, Neuron


@njit(cache=True, nogil=True, fastmath=FAST)
def values(a, first, n):
    """Replace ``n`` sums from ``first`` on by their function."""
    registers.tanh(a, first, n)


@njit(cache=True, nogil=True, fastmath=FAST)
def with_slopes(a, slope):
    """Replace all sums by their function, and write its derivatives."""
    registers.tanh(a, 0, len(a))
    for j in range(len(a)):
        slope[j] = 1.0 - a[j] * a[j]


def _slope(x: NDArray[np.float64]) -> NDArray[np.float64]:
    h = np.tanh(x)
    return 1.0 - h * h


def _onnx(graph: Graph, sums: str, name: str) -> str:
    return graph.add("Tanh", [sums], name)


def _torch() -> Any:
    from torch import nn

    return nn.Tanh()


def _jax() -> Any:
    import jax.numpy as jnp

    return jnp.tanh


TANH = Neuron(
    name="tanh",
    description="saturates, as what is measured within a range mostly does",
    value=np.tanh,
    slope=_slope,
    # Beyond 20 the tanh of a double is 1; not a number stays as it is.
    c="TANH(x > R(20.0) ? R(20.0) : x < R(-20.0) ? R(-20.0) : x)",
    onnx=_onnx,
    torch=_torch,
    jax=_jax,
    matlab="tanh(x)",
    st="{tanh}({x})",
)
