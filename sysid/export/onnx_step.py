"""One step of a recursion as an ONNX graph: sample and state in, output and next state out."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from sysid.export.layout import StateLayout
from sysid.export.onnx_nodes import Nodes
from sysid.models import AbstractModel, Recursion


def step_graph(model: AbstractModel, dtype: DTypeLike) -> Any:
    """The graph of one step.

    Inputs ``u (batch, n_inputs)`` in units and ``state (batch, n_state)``; outputs ``y (batch, 1)`` in its unit
    and ``state_out (batch, n_state)``.

    Args:
        model: The model.
        dtype: Of the numbers.

    Returns:
        The ``GraphProto``.
    """
    layout, recursion, nodes = StateLayout.of(model), model.recursion, Nodes(dtype)
    scaled = scaled_inputs(nodes, "u", recursion)
    known = nodes.add("Concat", [scaled, "state"], "inputs_and_state", axis=1)
    columns = nodes.integers(layout.regressor_columns(recursion.lags))
    regressors = nodes.add("Gather", [known, columns], "regressors", axis=1)
    linear = nodes.numbers("w", recursion.linear[:, np.newaxis])
    constant = nodes.numbers("c", [recursion.constant])
    total = nodes.add("Gemm", [regressors, linear, constant], "linear_part")
    if recursion.neurons:
        weights, bias = nodes.numbers("W", recursion.hidden_weights.T), nodes.numbers("b", recursion.hidden_bias)
        hidden = nodes.add("Tanh", [nodes.add("Gemm", [regressors, weights, bias], "hidden_sum")], "hidden")
        readout = nodes.numbers("v", recursion.readout[:, np.newaxis])
        total = nodes.add("Gemm", [hidden, readout, total], "network")
    output = clipped(nodes, total, recursion)
    everything = nodes.add("Concat", [scaled, output, "state"], "inputs_output_and_state", axis=1)
    nodes.add("Gather", [everything, nodes.integers(layout.next_columns())], "state_out", axis=1)
    unscaled_output(nodes, output, recursion)
    n_inputs, size = recursion.lags.n_inputs, layout.size
    return nodes.graph(
        "step",
        [nodes.value("u", ["batch", n_inputs], input_text(model)), nodes.value("state", ["batch", size], STATE_TEXT)],
        [nodes.value("y", ["batch", 1], output_text(model)), nodes.value("state_out", ["batch", size], STATE_TEXT)],
    )


STATE_TEXT = "past samples, scaled; the layout stands in model.json under state"


def input_text(model: AbstractModel) -> str:
    """What the last axis of ``u`` holds."""
    return ", ".join(f"{name} [{unit}]" for name, unit in zip(model.mapping.inputs, model.input_units, strict=True))


def output_text(model: AbstractModel) -> str:
    """What the last axis of ``y`` holds."""
    return f"{model.mapping.output} [{model.output_unit}]"


def scaled_inputs(nodes: Nodes, inputs: str, recursion: Recursion) -> str:
    """Inputs in the model's numbers, scaled on the last axis."""
    offset = nodes.numbers("input_offset", recursion.scaling.input_offset)
    scale = nodes.numbers("input_scale", recursion.scaling.input_scale)
    return nodes.add("Div", [nodes.add("Sub", [inputs, offset], "u_centred"), scale], "u_scaled")


def unscaled_output(nodes: Nodes, output: str, recursion: Recursion) -> str:
    """The graph's output ``y`` in its unit."""
    scale = nodes.numbers("output_scale", recursion.scaling.output_scale)
    offset = nodes.numbers("output_offset", recursion.scaling.output_offset)
    return nodes.add("Add", [nodes.add("Mul", [output, scale], "y_centred"), offset], "y")


def clipped(nodes: Nodes, output: str, recursion: Recursion) -> str:
    """The output within its bounds; no node where there are none. NaN stays NaN, as in the model."""
    if np.isneginf(recursion.low) and np.isposinf(recursion.high):
        return output
    low, high = nodes.numbers("low", recursion.low), nodes.numbers("high", recursion.high)
    return nodes.add("Clip", [output, low, high], "bounded")
