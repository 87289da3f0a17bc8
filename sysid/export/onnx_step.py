"""One step of a surrogate as an ONNX graph: sample and state in, output, next state and flags out."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from sysid.export.flags import MEANING, Flag
from sysid.export.onnx_nodes import Nodes
from sysid.export.surrogate import Port, Stage, Surrogate
from sysid.models import AbstractForm, StateSpace

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
    _flags(nodes, surrogate, run_stages(nodes, surrogate, _stage))
    return nodes.graph("step", *ends(nodes, surrogate, ["batch"]))


def run_stages(nodes: Nodes, surrogate: Surrogate, stage_nodes: Any) -> list[str]:
    """Lay the stages one behind the other, up to the graph's outputs ``y`` and ``state_out``.

    Args:
        nodes: The graph.
        surrogate: What to write.
        stage_nodes: Adds one stage, from the names of its inputs and its state to those of its scaled output, its
            output ``y`` and its ``state_out``.

    Returns:
        The names of the scaled outputs.
    """
    alone = len(surrogate.stages) == 1
    known, outputs, states, scaled = "u", [], [], []
    for k, stage in enumerate(surrogate.stages):
        part = nodes.within("" if alone else f"stage{k}_")
        inputs, state = known, "state"
        if stage.sources != tuple(range(len(surrogate.inputs) + k)):
            inputs = part.add("Gather", [known, nodes.integers(list(stage.sources))], "u", axis=-1)
        if not alone:
            bounds = [nodes.integers([at]) for at in (stage.first, stage.first + stage.state.size, 1)]
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
    return scaled


def _stage(nodes: Nodes, stage: Stage, inputs: str, state: str) -> tuple[str, str, str]:
    if isinstance(stage.form, StateSpace):
        return _linear_stage(nodes, stage, stage.form, inputs, state)
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


def _linear_stage(nodes: Nodes, stage: Stage, form: StateSpace, inputs: str, state: str) -> tuple[str, str, str]:
    scaled = scaled_inputs(nodes, inputs, form)
    known = nodes.add("Concat", [state, scaled], "state_and_inputs", axis=1)
    output, state_out = linear_step(nodes, form, known)
    output = clipped(nodes, output, stage)
    return output, unscaled_output(nodes, output, form), state_out


def linear_step(nodes: Nodes, form: StateSpace, known: str) -> tuple[str, str]:
    """One step of a state space.

    Args:
        nodes: The graph.
        form: The state space.
        known: State and scaled inputs side by side, ``(batch, n_state + n_inputs)``.

    Returns:
        The scaled output ``(batch, 1)`` and the next state.
    """
    readout = np.concatenate([form.C, form.D])[:, np.newaxis]
    constant = nodes.numbers("c", [form.constant])
    output = nodes.add("Gemm", [known, nodes.numbers("C_and_D", readout), constant], "output")
    matrix = nodes.numbers("A_and_B", np.concatenate([form.A, form.B], axis=1).T)
    return output, nodes.add("MatMul", [known, matrix], "state_out")


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


def scaled_inputs(nodes: Nodes, inputs: str, recursion: AbstractForm) -> str:
    """Inputs in the model's numbers, scaled on the last axis."""
    offset = nodes.numbers("input_offset", recursion.scaling.input_offset)
    scale = nodes.numbers("input_scale", recursion.scaling.input_scale)
    return nodes.add("Div", [nodes.add("Sub", [inputs, offset], "u_centred"), scale], "u_scaled")


def unscaled_output(nodes: Nodes, output: str, recursion: AbstractForm, name: str = "y") -> str:
    """The stage's output in its unit."""
    scale = nodes.numbers("output_scale", recursion.scaling.output_scale)
    offset = nodes.numbers("output_offset", recursion.scaling.output_offset)
    return nodes.add("Add", [nodes.add("Mul", [output, scale], "y_centred"), offset], name)


def clipped(nodes: Nodes, output: str, stage: Stage) -> str:
    """The output within its bounds; no node where there are none. NaN stays NaN, as in the model."""
    if not stage.bounded:
        return output
    low, high = nodes.numbers("low", stage.form.low), nodes.numbers("high", stage.form.high)
    return nodes.add("Clip", [output, low, high], "bounded")


def _flags(nodes: Nodes, surrogate: Surrogate, scaled: list[str]) -> None:
    """The flags of a sample, with few nodes: in one step a node costs more than its arithmetic."""
    low, high = ([getattr(port, side) for port in surrogate.inputs] for side in ("low", "high"))
    below = nodes.add("Less", ["u", nodes.numbers("declared_low", low)], "u_below")
    above = nodes.add("Greater", ["u", nodes.numbers("declared_high", high)], "u_above")
    known = nodes.add("Concat", ["u", "y"], "u_and_y", axis=-1)
    raised = {
        Flag.OUTSIDE_RANGE: [nodes.add("Or", [below, above], "u_outside")],
        Flag.AT_BOUND: held_outputs(nodes, surrogate, scaled),
        Flag.NOT_A_NUMBER: [nodes.add("IsNaN", [known], "u_and_y_lost")],
    }
    bits = []
    for flag, causes in raised.items():
        part = nodes.within(f"{str(flag.name).lower()}_")
        if causes:
            whole = causes[0] if len(causes) == 1 else part.add("Concat", causes, "causes", axis=-1)
            whole = part.add("ReduceMax", [part.add("Cast", [whole], "by_channel", to=INT32)], "any", axes=[-1])
            bits.append(part.add("Mul", [whole, part.whole(int(flag))], "bit"))
    last = bits[0]
    for i, bit in enumerate(bits[1:], start=2):
        last = nodes.add("Add", [last, bit], "flags" if i == len(bits) else "flags_but_last")


def held_outputs(nodes: Nodes, surrogate: Surrogate, scaled: list[str]) -> list[str]:
    """Where the output of each bounded stage is at a bound."""
    held = []
    for k, (stage, output) in enumerate(zip(surrogate.stages, scaled, strict=True)):
        if stage.bounded:
            part, recursion = nodes.within(f"held{k}_"), stage.recursion
            low = part.add("LessOrEqual", [output, part.numbers("low", recursion.low)], "at_low")
            high = part.add("GreaterOrEqual", [output, part.numbers("high", recursion.high)], "at_high")
            held.append(part.add("Or", [low, high], "at_bound"))
    return held


INT32 = 6
"""``TensorProto.INT32``."""
