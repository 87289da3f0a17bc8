"""One step of a surrogate as an ONNX graph: sample and state in, output, next state and flags out."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from sysid.export.flags import MEANING, Flag
from sysid.export.onnx_nodes import Nodes
from sysid.export.surrogate import Port, Stage, Surrogate
from sysid.models import Recursion

STATE_TEXT = "past samples, scaled; the layout stands in model.json under state"
FLAGS_TEXT = "the sum of: " + "; ".join(f"{int(flag)}: {text}" for flag, text in MEANING.items())


def step_graph(surrogate: Surrogate, dtype: DTypeLike) -> Any:
    """The graph of one step.

    Inputs ``u (batch, n_inputs)`` in units and ``state (batch, n_state)``; outputs ``y (batch, n_outputs)`` in their
    units, ``state_out (batch, n_state)`` and ``flags (batch, 1)``.

    Args:
        surrogate: What to write.
        dtype: Of the numbers.

    Returns:
        The ``GraphProto``.
    """
    nodes = Nodes(dtype)
    run_stages(nodes, surrogate, _stage)
    shapes: list[str] = ["batch"]
    return nodes.graph("step", *ends(nodes, surrogate, shapes))


def run_stages(nodes: Nodes, surrogate: Surrogate, stage_nodes: Any) -> None:
    """Lay the stages one behind the other, up to the graph's outputs.

    Args:
        nodes: The graph.
        surrogate: What to write.
        stage_nodes: Adds one stage, from the names of its inputs and its state to those of its scaled output, its
            output ``y`` and its ``state_out``.
    """
    alone = len(surrogate.stages) == 1
    known, outputs, states, scaled = "u", [], [], []
    for k, stage in enumerate(surrogate.stages):
        part = nodes.within("" if alone else f"stage{k}_")
        inputs, state = known, "state"
        if stage.sources != tuple(range(len(surrogate.inputs) + k)):
            inputs = part.add("Gather", [known, nodes.integers(list(stage.sources))], "u", axis=-1)
        if not alone:
            bounds = [nodes.integers([at]) for at in (stage.first, stage.first + stage.layout.size, 1)]
            state = part.add("Slice", ["state", *bounds], "state")
        y_scaled, y, state_out = stage_nodes(part, stage, inputs, state)
        scaled.append(y_scaled)
        outputs.append(y)
        states.append(state_out)
        if k + 1 < len(surrogate.stages):
            known = part.add("Concat", [known, y], "known", axis=-1)
    if not alone:
        nodes.add("Concat", outputs, "y", axis=-1)
        nodes.add("Concat", states, "state_out", axis=1)
    _flags(nodes, surrogate, scaled)


def _stage(nodes: Nodes, stage: Stage, inputs: str, state: str) -> tuple[str, str, str]:
    layout, recursion = stage.layout, stage.recursion
    scaled = scaled_inputs(nodes, inputs, recursion)
    known = nodes.add("Concat", [scaled, state], "inputs_and_state", axis=1)
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
    output = clipped(nodes, total, stage)
    everything = nodes.add("Concat", [scaled, output, state], "inputs_output_and_state", axis=1)
    state_out = nodes.add("Gather", [everything, nodes.integers(layout.next_columns())], "state_out", axis=1)
    return output, unscaled_output(nodes, output, recursion), state_out


def ends(nodes: Nodes, surrogate: Surrogate, leading: list[str]) -> tuple[list[Any], list[Any]]:
    """Descriptions of the graph's inputs and outputs.

    Args:
        nodes: The graph.
        surrogate: What is written.
        leading: Axes before the channels.

    Returns:
        Those of the inputs, and those of the outputs.
    """
    size = surrogate.state_size
    inputs, outputs = surrogate.inputs, surrogate.outputs
    return (
        [
            nodes.value("u", [*leading, len(inputs)], _channels(inputs)),
            nodes.value("state", ["batch", size], STATE_TEXT),
        ],
        [
            nodes.value("y", [*leading, len(outputs)], _channels(outputs)),
            nodes.value("state_out", ["batch", size], STATE_TEXT),
            nodes.value("flags", [*leading, 1], FLAGS_TEXT, dtype=np.int32),
        ],
    )


def _channels(ports: tuple[Port, ...]) -> str:
    return ", ".join(f"{port.name} [{port.unit}]" for port in ports)


def scaled_inputs(nodes: Nodes, inputs: str, recursion: Recursion) -> str:
    """Inputs in the model's numbers, scaled on the last axis."""
    offset = nodes.numbers("input_offset", recursion.scaling.input_offset)
    scale = nodes.numbers("input_scale", recursion.scaling.input_scale)
    return nodes.add("Div", [nodes.add("Sub", [inputs, offset], "u_centred"), scale], "u_scaled")


def unscaled_output(nodes: Nodes, output: str, recursion: Recursion) -> str:
    """The stage's output ``y`` in its unit."""
    scale = nodes.numbers("output_scale", recursion.scaling.output_scale)
    offset = nodes.numbers("output_offset", recursion.scaling.output_offset)
    return nodes.add("Add", [nodes.add("Mul", [output, scale], "y_centred"), offset], "y")


def clipped(nodes: Nodes, output: str, stage: Stage) -> str:
    """The output within its bounds; no node where there are none. NaN stays NaN, as in the model."""
    if not stage.bounded:
        return output
    low, high = nodes.numbers("low", stage.recursion.low), nodes.numbers("high", stage.recursion.high)
    return nodes.add("Clip", [output, low, high], "bounded")


def _flags(nodes: Nodes, surrogate: Surrogate, scaled: list[str]) -> None:
    """The flags of every sample at once, outside of any loop."""
    low, high = ([getattr(port, side) for port in surrogate.inputs] for side in ("low", "high"))
    below = nodes.add("Less", ["u", nodes.numbers("declared_low", low)], "u_below")
    above = nodes.add("Greater", ["u", nodes.numbers("declared_high", high)], "u_above")
    bits = [_any(nodes, nodes.add("Or", [below, above], "u_outside"), Flag.OUTSIDE_RANGE)]
    both = nodes.add("Concat", ["u", "y"], "u_and_y", axis=-1)
    bits.append(_any(nodes, nodes.add("IsNaN", [both], "u_and_y_lost"), Flag.NOT_A_NUMBER))
    for k, (stage, output) in enumerate(zip(surrogate.stages, scaled, strict=True)):
        if stage.bounded:
            low_k, high_k = (
                nodes.numbers(f"low{k}", stage.recursion.low),
                nodes.numbers(f"high{k}", stage.recursion.high),
            )
            at_low = nodes.add("LessOrEqual", [output, low_k], f"y{k}_at_low")
            at_high = nodes.add("GreaterOrEqual", [output, high_k], f"y{k}_at_high")
            held = nodes.add("Or", [at_low, at_high], f"y{k}_held")
            bits.append(_any(nodes, held, Flag.AT_BOUND, number=k))
    held_bits = bits[2:]
    if len(held_bits) > 1:
        bits = [*bits[:2], nodes.add("Max", held_bits, "any_held")]
    total = bits[0]
    for i, bit in enumerate(bits[1:-1]):
        total = nodes.add("Add", [total, bit], f"flags_{i}")
    nodes.add("Add", [total, bits[-1]], "flags")


def _any(nodes: Nodes, raised: str, flag: Flag, number: int = 0) -> str:
    """The flag's bit where any channel raises it, ``(..., 1)``, as int32."""
    bit = nodes.within(f"{flag.name.lower()}{number}_" if flag.name else "")
    whole = bit.add("Cast", [raised], "by_channel", to=_INT32)
    most = bit.add("ReduceMax", [whole], "any", axes=[-1], keepdims=1)
    return bit.add("Mul", [most, bit.whole(int(flag))], "bit")


_INT32 = 6
"""``TensorProto.INT32``."""
