"""One step of a state space as ONNX nodes, for a batch of samples or for a sequence."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sysid.export.onnx_nodes import Nodes
from sysid.export.state_space_form import Neurons, StateSpaceForm


def state_space_step(nodes: Nodes, form: StateSpaceForm, z: str, *, rows: bool) -> tuple[str, str]:
    """One step of a state space.

    Args:
        nodes: The graph.
        form: The state space.
        z: State and scaled inputs.
        rows: Whether ``z`` is ``(n_state + n_inputs, batch)``; ``(batch, n_state + n_inputs)`` otherwise.

    Returns:
        The scaled output, not yet within its bounds, and what is added to the state, both laid as ``z`` is.
    """

    def product(name: str, matrix: NDArray[np.float64], value: str, plus: str, output: str) -> str:
        table = nodes.numbers(name, matrix if rows else matrix.T)
        return nodes.add("Gemm", [table, value, plus] if rows else [value, table, plus], output)

    def column(name: str, values: ArrayLike) -> str:
        numbers = np.atleast_1d(np.asarray(values))
        return nodes.numbers(name, numbers[:, np.newaxis] if rows else numbers)

    def summed(name: str, matrix: NDArray[np.float64], constant: ArrayLike, neurons: Neurons) -> str:
        total = product(f"{name}_matrix", matrix, z, column(f"{name}_constant", constant), f"{name}_linear")
        if not len(neurons):
            return total
        hidden = product(f"{name}_W", neurons.weights, z, column(f"{name}_b", neurons.bias), f"{name}_hidden_sum")
        hidden = form.neuron.onnx(nodes, hidden, f"{name}_hidden")
        return product(f"{name}_V", neurons.readout, hidden, total, f"{name}_network")

    output = summed("output", form.readout, form.constant, form.output_neurons)
    if form.rectified:
        output = nodes.add("Abs", [output], "output_rectified")
    return output, summed("change", form.change, form.drift, form.state_neurons)


def within_bound(nodes: Nodes, form: StateSpaceForm, state: str) -> str:
    """A state within its bound; no node where there is none."""
    if not np.isfinite(form.bound):
        return state
    bounds = [nodes.numbers(f"state_{name}", value) for name, value in (("low", -form.bound), ("high", form.bound))]
    return nodes.add("Clip", [state, *bounds], "state_bounded")
