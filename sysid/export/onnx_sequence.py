"""A whole free run as an ONNX graph: one ``Scan`` of any length, for any number of cars at once.

The past inputs of all samples are laid side by side before the loop, and the body is left with few nodes:
in a network of this size a node costs more than its arithmetic. Two other forms were measured on 20,000 samples
of a 4/4/20 network. With the inputs' share of the matrix product before the loop one car is a tenth faster, but
a hundred cars are slower by a fifth and more, because the products of all samples do not fit into the cache. With
the delay lines of the inputs inside the loop a hundred cars are a tenth faster, but one car is slower by a third.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray
from onnx import numpy_helper

from sysid.export.flags import Flag
from sysid.export.layout import StateLayout
from sysid.export.onnx_nodes import TO_END, Nodes
from sysid.export.onnx_step import INT32, clipped, ends, held_outputs, linear_step, run_stages, unscaled_output
from sysid.export.surrogate import Stage, Surrogate
from sysid.models import AbstractForm, Lags, StateSpace


def sequence_graph(surrogate: Surrogate, dtype: DTypeLike) -> Any:
    """The graph of a free run.

    Inputs ``u (time, batch, n_inputs)`` in units and ``state (batch, n_state)``; outputs ``y (time, batch,
    n_outputs)`` in their units, ``state_out (batch, n_state)``, so that a run in pieces equals one long run, and
    ``flags (time, batch, 1)``. Each stage of a cascade runs over all samples before the next one does.

    Args:
        surrogate: What to write.
        dtype: Of the numbers.

    Returns:
        The ``GraphProto``.
    """
    nodes = Nodes(dtype)
    _flags(nodes, surrogate, run_stages(nodes, surrogate, _stage))
    return nodes.graph("sequence", *ends(nodes, surrogate, ["time", "batch"]))


def _stage(nodes: Nodes, stage: Stage, inputs: str, state: str) -> tuple[str, str, str]:
    if isinstance(stage.form, StateSpace):
        return _linear_stage(nodes, stage, stage.form, inputs, state)
    layout, recursion = stage.layout, stage.recursion
    n_inputs, longest = recursion.lags.n_inputs, max(line.length for line in layout.inputs)
    scaled = _scaled_inputs(nodes, inputs, recursion, n_inputs)
    history = _with_past(nodes, layout, scaled, state, longest)
    columns = _input_columns(recursion.lags)
    regressors = _input_regressors(nodes, columns, history, n_inputs, longest)
    line = layout.output
    span = [nodes.integers([line.first]), nodes.integers([TO_END]), nodes.integers([1])]
    past = nodes.add("Slice", [state, *span], "output_line")
    body = _scan_body(stage, columns, line.length, nodes)
    output = nodes.add_scan([past], [regressors], ["output_line_end"], "y_scaled", body)
    flat = nodes.add("Squeeze", [output, nodes.integers([-1])], "y_scaled_flat")
    y = _columns(nodes, [unscaled_output(nodes, flat, recursion, "y_flat")], "y")
    return flat, y, _state_out(nodes, layout, history, longest)


def _linear_stage(nodes: Nodes, stage: Stage, form: StateSpace, inputs: str, state: str) -> tuple[str, str, str]:
    """A state space: the loop carries its state, and each step is two products."""
    scaled = _scaled_inputs(nodes, inputs, form, form.n_inputs)
    body = Nodes(nodes.dtype, prefix=f"{nodes.prefix}body_")
    x, u = f"{body.prefix}x", f"{body.prefix}u"
    output, state_out = linear_step(body, form, body.add("Concat", [x, u], "state_and_inputs", axis=1))
    output = clipped(body, output, stage)
    graph = body.graph(
        "one_step",
        [body.value("x", ["batch", form.n_state]), body.value("u", ["batch", form.n_inputs])],
        [
            body.value(state_out.removeprefix(body.prefix), ["batch", form.n_state]),
            body.value(output.removeprefix(body.prefix), ["batch", 1]),
        ],
    )
    result = nodes.add_scan([state], [scaled], ["state_out"], "y_scaled", graph)
    flat = nodes.add("Squeeze", [result, nodes.integers([-1])], "y_scaled_flat")
    y = _columns(nodes, [unscaled_output(nodes, flat, form, "y_flat")], "y")
    return flat, y, f"{nodes.prefix}state_out"


def _channels(nodes: Nodes, value: str, names: list[str]) -> list[str]:
    """The channels of ``(time, batch, n)`` as arrays ``(time, batch)``.

    Arithmetic along a last axis of one, two or three numbers cannot be vectorised: on 20,000 samples of a hundred cars
    it was measured ten times as slow as without that axis.
    """
    parts = nodes.split(value, [f"{name}_column" for name in names])
    last = nodes.integers([-1])
    return [nodes.add("Squeeze", [part, last], name) for part, name in zip(parts, names, strict=True)]


def _columns(nodes: Nodes, channels: list[str], output: str) -> str:
    """Arrays ``(time, batch)`` side by side as ``(time, batch, n)``."""
    last = nodes.integers([-1])
    if len(channels) == 1:
        return nodes.add("Unsqueeze", [channels[0], last], output)
    columns = [nodes.add("Unsqueeze", [channel, last], f"{output}_{i}") for i, channel in enumerate(channels)]
    return nodes.add("Concat", columns, output, axis=2)


def _scaled_inputs(nodes: Nodes, inputs: str, recursion: AbstractForm, n_inputs: int) -> str:
    """Inputs in the model's numbers."""
    scaling, scaled = recursion.scaling, []
    channels = _channels(nodes, inputs, [f"u{i}" for i in range(n_inputs)])
    for i, (offset, scale) in enumerate(zip(scaling.input_offset, scaling.input_scale, strict=True)):
        centred = nodes.add("Sub", [channels[i], nodes.numbers(f"input_offset{i}", offset)], f"u{i}_centred")
        scaled.append(nodes.add("Div", [centred, nodes.numbers(f"input_scale{i}", scale)], f"u{i}_scaled"))
    return _columns(nodes, scaled, "u_scaled")


def _flags(nodes: Nodes, surrogate: Surrogate, scaled: list[str]) -> None:
    """The flags of all samples, after the loops."""
    channels = _channels(nodes, "u", [f"u{i}_seen" for i in range(len(surrogate.inputs))])
    outside, lost = [], []
    for i, (port, channel) in enumerate(zip(surrogate.inputs, channels, strict=True)):
        if port.range is not None:
            low, high = nodes.numbers(f"declared_low{i}", port.low), nodes.numbers(f"declared_high{i}", port.high)
            outside.append(nodes.add("Less", [channel, low], f"u{i}_below"))
            outside.append(nodes.add("Greater", [channel, high], f"u{i}_above"))
        lost.append(nodes.add("IsNaN", [channel], f"u{i}_lost"))
    lost += [nodes.add("IsNaN", [output], f"y{k}_lost") for k, output in enumerate(scaled)]
    causes = {
        Flag.OUTSIDE_RANGE: outside,
        Flag.AT_BOUND: held_outputs(nodes, surrogate, scaled),
        Flag.NOT_A_NUMBER: lost,
    }
    bits = []
    for flag, raised in causes.items():
        part = nodes.within(f"{str(flag.name).lower()}_")
        if raised:
            any_of = raised[0]
            for i, cause in enumerate(raised[1:]):
                any_of = part.add("Or", [any_of, cause], f"any{i}")
            bits.append(part.add("Mul", [part.add("Cast", [any_of], "number", to=INT32), part.whole(int(flag))], "bit"))
    total = bits[0]
    for i, bit in enumerate(bits[1:]):
        total = nodes.add("Add", [total, bit], f"flags_{i}")
    nodes.add("Unsqueeze", [total, nodes.integers([-1])], "flags")


def _input_columns(lags: Lags) -> list[tuple[int, int, int]]:
    """Every input regressor as (lag, input, its place in the model), by lag, the order in which they are cut out."""
    pairs = [(lag, i) for i, lags_i in enumerate(lags.inputs) for lag in lags_i]
    return sorted((lag, i, place) for place, (lag, i) in enumerate(pairs))


def _with_past(nodes: Nodes, layout: StateLayout, scaled: str, state: str, longest: int) -> str:
    """The inputs with ``longest`` samples before them, oldest first: ``(longest + time, batch, n_inputs)``."""
    if longest == 0:
        return scaled
    # An input with a shorter line is filled up with its oldest sample, which no regressor reads.
    lags = range(longest, 0, -1)
    columns = [line.column(min(lag, line.length)) if line.length else 0 for lag in lags for line in layout.inputs]
    past = nodes.add("Gather", [state, nodes.integers(columns)], "past_inputs_by_car", axis=1)
    shape = nodes.integers([0, longest, len(layout.inputs)])
    past = nodes.add("Reshape", [past, shape], "past_inputs_table")
    past = nodes.add("Transpose", [past], "past_inputs", perm=[1, 0, 2])
    return nodes.add("Concat", [past, scaled], "u_with_past", axis=0)


def _input_regressors(
    nodes: Nodes, columns: list[tuple[int, int, int]], history: str, n_inputs: int, longest: int
) -> str:
    """The input regressors of all samples, ``(time, batch, n_columns)``."""
    lags = sorted({lag for lag, _, _ in columns} or {0})
    cuts = []
    for lag in lags:
        bounds = [nodes.integers([longest - lag]), nodes.integers([-lag if lag else TO_END]), nodes.integers([0])]
        cuts.append(nodes.add("Slice", [history, *bounds], f"u_lag_{lag}"))
    table = nodes.add("Concat", cuts, "u_lagged", axis=2)
    if not columns:
        # The loop needs something to run over; zeros, because an input that the model does not read may be NaN.
        shape = nodes.add("Shape", [table], "u_lagged_shape")
        zero = numpy_helper.from_array(np.zeros(1, dtype=nodes.dtype))
        return nodes.add("ConstantOfShape", [shape], "nothing_used", value=zero)
    if len(columns) == len(lags) * n_inputs:
        return table
    used = nodes.integers([lags.index(lag) * n_inputs + i for lag, i, _ in columns])
    return nodes.add("Gather", [table, used], "u_used", axis=2)


def _state_out(nodes: Nodes, layout: StateLayout, history: str, longest: int) -> str:
    """The state after the last sample, from the ends of the inputs and of the output."""
    ends, n_inputs = [f"{nodes.prefix}output_line_end"], len(layout.inputs)
    columns = [lag - 1 for lag in range(1, layout.output.length + 1)]
    if longest:
        back = [nodes.integers([-1]), nodes.integers([-longest - 1]), nodes.integers([0]), nodes.integers([-1])]
        newest = nodes.add("Slice", [history, *back], "inputs_end")
        newest = nodes.add("Transpose", [newest], "inputs_end_by_car", perm=[1, 0, 2])
        flat = nodes.integers([0, longest * n_inputs])
        ends.insert(0, nodes.add("Reshape", [newest, flat], "inputs_end_row"))
        inputs = [(lag * n_inputs) + i for i, line in enumerate(layout.inputs) for lag in range(line.length)]
        columns = [*inputs, *(longest * n_inputs + column for column in columns)]
    row = nodes.add("Concat", ends, "ends", axis=1)
    return nodes.add("Gather", [row, nodes.integers(columns)], "state_out", axis=1)


def _scan_body(stage: Stage, columns: list[tuple[int, int, int]], length: int, outer: Nodes) -> Any:
    """One step: the output's past and the input regressors in, the shifted past and the output out."""
    recursion, nodes = stage.recursion, Nodes(outer.dtype, prefix=f"{outer.prefix}body_")
    lags, past, x = recursion.lags, f"{nodes.prefix}past", f"{nodes.prefix}x"
    if lags.output:
        lagged = past
        if lags.output != tuple(range(1, length + 1)):
            lagged = nodes.add("Gather", [past, nodes.integers([lag - 1 for lag in lags.output])], "lagged", axis=1)
        x = nodes.add("Concat", [x, lagged], "regressors", axis=1)
    W, w = (_by_column(table, columns, lags) for table in (recursion.hidden_weights, recursion.linear[np.newaxis]))
    if recursion.neurons:
        hidden = nodes.add(
            "Gemm", [x, nodes.numbers("W", W.T), nodes.numbers("b", recursion.hidden_bias)], "hidden_sum"
        )
        hidden = nodes.add("Tanh", [hidden], "hidden")
        # Side by side, neurons and regressors reach the output in one product.
        x = nodes.add("Concat", [hidden, x], "neurons_and_regressors", axis=1)
        w = np.concatenate([recursion.readout[np.newaxis], w], axis=1)
    constant = nodes.numbers("c", [recursion.constant])
    output = clipped(nodes, nodes.add("Gemm", [x, nodes.numbers("v_and_w", w.T), constant], "output"), stage)
    span = [nodes.integers([0]), nodes.integers([length - 1]), nodes.integers([1])]
    nodes.add("Concat", [output, nodes.add("Slice", [past, *span], "kept")], "past_out", axis=1)
    n_columns = len(columns) or lags.n_inputs
    return nodes.graph(
        "one_step",
        [nodes.value("past", ["batch", length]), nodes.value("x", ["batch", n_columns])],
        [
            nodes.value("past_out", ["batch", length]),
            nodes.value(output.removeprefix(nodes.prefix), ["batch", 1]),
        ],
    )


def _by_column(table: NDArray[np.float64], columns: list[tuple[int, int, int]], lags: Lags) -> NDArray[np.float64]:
    """Weights ``(n, n_regressors)`` in the order of the columns; zeros for inputs that the model does not read."""
    places = [place for _, _, place in columns]
    inputs = table[:, places] if columns else np.zeros((len(table), lags.n_inputs))
    return np.concatenate([inputs, table[:, lags.n_regressors - len(lags.output) :]], axis=1)
