"""A whole free run as an ONNX graph: one ``Scan`` a stage, of any length, for any number of cars at once.

The regressors of all inputs are laid side by side before the loop, and the body is left with few nodes: in a network
of this size a node costs more than its arithmetic. Inside the loop cars lie along the last axis: to put rows of one
number each behind one another costs as much as the products do, and a hundred cars take a quarter less time without.
Measured on 20,000 samples of a 4/4/20 network and given up: the inputs' share of the product before the loop (no gain,
a hundred cars slower by a third), the inputs' delay lines inside it (one car slower by a third), several samples in one
pass through the body (no gain), and each past rate carried by itself (a twentieth faster, but onnxruntime's Scan mixes
up numbers that go from step to step without a node).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike
from onnx import helper, numpy_helper

from sysid.export.flags import Flag
from sysid.export.incremental_form import IncrementalForm, Term
from sysid.export.lagged_form import LaggedForm
from sysid.export.layout import DelayLine
from sysid.export.onnx_blocks import in_blocks
from sysid.export.onnx_body import Body, clip_range, lagged_body, limit_name, scanned_limits, state_space_body
from sysid.export.onnx_nodes import TO_END, Nodes
from sysid.export.onnx_step import (
    INT32,
    Made,
    ends,
    held_outputs,
    join_states,
    stage_part,
    stage_state,
    step_nodes,
    within_a_body,
)
from sysid.export.stage import Stage
from sysid.export.state_space_form import StateSpaceForm
from sysid.export.surrogate import Surrogate


def sequence_graph(surrogate: Surrogate, dtype: DTypeLike) -> Any:
    """The graph of a free run.

    Inputs ``u (time, batch, n_inputs)`` in units and ``state (batch, n_state)``; outputs ``y (time, batch,
    n_outputs)`` in their units, ``state_out (batch, n_state)``, so that a run in pieces equals one long run, and
    ``flags (time, batch, 1)``. Each stage of a cascade runs over all samples before the next one does; where models
    read each other in a circle, the whole step is the body of one loop.

    Args:
        surrogate: What to write.
        dtype: Of the numbers.

    Returns:
        The ``GraphProto``.
    """
    if surrogate.late:
        return _step_after_step(surrogate, dtype)
    nodes = Nodes(dtype)
    inputs = _channels(nodes, "u", [f"u{i}" for i in range(len(surrogate.inputs))])
    known, made = list(inputs), []
    for k, stage in enumerate(surrogate.stages):
        part = stage_part(nodes, surrogate, k)
        state, remainder = stage_state(part, surrogate, stage)
        sequence = _Sequence(part, stage, known, state, remainder)
        made.append(sequence.made())
        known += sequence.outputs
    _columns(nodes, [known[column] for column in surrogate.columns], "y")
    join_states(nodes, made)
    _flags(nodes, surrogate, inputs, made)
    return in_blocks(surrogate, nodes)


def _step_after_step(surrogate: Surrogate, dtype: DTypeLike) -> Any:
    """A loop over the samples around the graph of a step."""
    step = within_a_body(step_nodes(surrogate, dtype), "step_")
    (u, state), (y, state_out, flags) = ends(step, surrogate, ["batch"])
    body = step.graph("one_step", [state, u], [state_out, y, flags])
    nodes, outputs = Nodes(dtype), ["state_out", "y", "flags"]
    nodes.nodes.append(helper.make_node("Scan", ["state", "u"], outputs, name="loop", body=body, num_scan_inputs=1))
    return nodes.graph("sequence", *ends(nodes, surrogate, ["time", "batch"]))


class _Sequence:
    """The nodes of one stage; channels are arrays ``(time, batch)``.

    Args:
        nodes: The graph, with the stage's names.
        stage: The stage.
        known: All inputs of the whole and outputs of earlier stages, in units.
        state: The stage's state.
        remainder: What rounding took from it; ``None`` where that is not kept.
    """

    def __init__(self, nodes: Nodes, stage: Stage, known: Sequence[str], state: str, remainder: str | None) -> None:
        self.nodes, self.stage, self.known, self.keeps = nodes, stage, list(known), remainder is not None
        self.state = nodes.add("Transpose", [state], "state_by_row", perm=[1, 0])
        self.remainder = (
            [] if remainder is None else [nodes.add("Transpose", [remainder], "remainder_rows", perm=[1, 0])]
        )
        self.outputs: list[str] = []

    def made(self) -> Made:
        """Add the nodes; ``outputs`` has the names of the outputs in units afterwards."""
        nodes = self.nodes
        numbers, state = self._state_space() if isinstance(self.stage.form, StateSpaceForm) else self._lagged()
        limited = self._in_units(numbers)
        lost = nodes.add("Transpose", [f"{nodes.prefix}remainder_end"], "lost", perm=[1, 0]) if self.keeps else None
        return Made(scaled=tuple(numbers), state=state, remainder=lost, limited=tuple(limited))

    def _lagged(self) -> tuple[list[str], str]:
        nodes, (form, layout) = self.nodes, self.stage.lagged
        incremental = IncrementalForm.of(form, blocks=True)
        scaled = [self._scaled(self.known[source], i, f"u{i}") for i, source in enumerate(self.stage.sources)]
        histories = [self._with_past(name, line) for name, line in zip(scaled, layout.inputs, strict=True)]
        scanned = {"x": self._terms(incremental.inputs, histories, layout.inputs)}
        for j, side in scanned_limits(self.stage):
            row = self._scaled(self.known[side.column or 0], form.n_inputs + j, limit_name(j, side))
            scanned[limit_name(j, side)] = nodes.add(
                "Unsqueeze", [row, nodes.integers([1])], f"{limit_name(j, side)}_row"
            )
        begin = self._begin(form, layout.outputs)
        body = lagged_body(nodes, self.stage, incremental, list(begin), list(scanned))
        numbers = self._loop(begin, list(scanned.values()), body)
        pieces = [self._newest(history, line) for history, line in zip(histories, layout.inputs, strict=True)]
        for number, line in zip(numbers, layout.outputs, strict=True):
            span = [nodes.integers([-line.length]), nodes.integers([TO_END]), nodes.integers([0])]
            tail = nodes.add("Slice", [number, *span], f"{line.channel}_tail")
            pieces.append(self._newest(self._with_past(tail, line), line))
        return numbers, nodes.add("Concat", [piece for piece in pieces if piece], "next_state", axis=1)

    def _state_space(self) -> tuple[list[str], str]:
        """A state space: the loop carries its state."""
        nodes = self.nodes
        rows = [self._scaled(self.known[source], i, f"u{i}") for i, source in enumerate(self.stage.sources)]
        begin = {"state": self.state} | dict(zip(["remainder"], self.remainder, strict=False))
        body = state_space_body(nodes, self.stage, keeps=self.keeps)
        numbers = self._loop(begin, [_rows(nodes, rows, "x") if rows else self._nothing()], body)
        return numbers, nodes.add("Transpose", [f"{nodes.prefix}state_end"], "next_state", perm=[1, 0])

    def _zeros(self, like: str) -> str:
        """As many samples as a channel has, whatever they are there."""
        zero = numpy_helper.from_array(np.zeros(1, dtype=self.nodes.dtype))
        shape = self.nodes.add("Shape", [like], "shape")
        return self.nodes.add("ConstantOfShape", [shape], "nothing_used", value=zero)

    def _nothing(self) -> str:
        """The inputs of a model without any, ``(time, 0, batch)``."""
        nodes, none = self.nodes, self.nodes.integers([0])
        rows = _rows(nodes, [self._zeros(self.known[0])], "x_unused")
        return nodes.add("Slice", [rows, none, none, nodes.integers([1])], "x")

    def _loop(self, begin: dict[str, str], scanned: list[str], body: Body) -> list[str]:
        """The loop; gives back the scaled outputs, each ``(time, batch)``."""
        nodes, n, one = self.nodes, self.stage.form.n_outputs, self.nodes.integers([1])
        ends_of = [f"{name}_end" for name in begin]
        numbers = nodes.add_scan(list(begin.values()), scanned, ends_of, "y_loop", body.graph)
        span = clip_range(self.stage)
        if span is not None and not body.held:
            low, high = nodes.numbers("low", span[0]), nodes.numbers("high", span[1])
            numbers = nodes.add("Clip", [numbers, low, high], "y_bounded")
        rows = nodes.split(numbers, [f"y_row{j}" for j in range(n)], axis=1)
        return [nodes.add("Squeeze", [row, one], f"y_scaled{j}") for j, row in enumerate(rows)]

    def _begin(self, form: LaggedForm, lines: Sequence[DelayLine]) -> dict[str, str]:
        """What the loop carries, before the first sample."""
        nodes = self.nodes
        if not form.adds:
            count = sum(line.length for line in lines)
            return {"line": self._gathered(range(lines[0].first, lines[0].first + count), "line")}
        begin = {"level": self._gathered([line.column(1) for line in lines], "level")}
        longest = max(line.length for line in lines)
        if longest > 1:
            # Beyond a shorter line the weights are zero.
            back = [(lag, line) for lag in range(1, longest) for line in lines]
            newer = self._gathered([line.column(min(lag, line.length)) for lag, line in back], "newer")
            older = self._gathered([line.column(min(lag + 1, line.length)) for lag, line in back], "older")
            begin["rates"] = nodes.add("Sub", [newer, older], "rates")
        return begin | dict(zip(["remainder"], self.remainder, strict=False))

    def _gathered(self, rows: Sequence[int], name: str) -> str:
        """Some rows of the state."""
        return self.nodes.add("Gather", [self.state, self.nodes.integers(list(rows))], name, axis=0)

    def _scaled(self, channel: str, column: int, name: str) -> str:
        """A channel in the numbers of one of the stage's columns."""
        nodes, form = self.nodes, self.stage.form
        centred = nodes.add("Sub", [channel, nodes.numbers(f"{name}_offset", form.offset[column])], f"{name}_centred")
        return nodes.add("Div", [centred, nodes.numbers(f"{name}_scale", form.scale[column])], f"{name}_scaled")

    def _with_past(self, channel: str, line: DelayLine) -> str:
        """A channel with the samples before it, oldest first; as it is where none are held."""
        if not line.length:
            return channel
        past = self._gathered([line.column(lag) for lag in range(line.length, 0, -1)], f"{line.channel}_past")
        return self.nodes.add("Concat", [past, channel], f"{line.channel}_with_past", axis=0)

    def _newest(self, history: str, line: DelayLine) -> str:
        """The line after the last sample, ``(batch, length)``; nothing for an empty one."""
        if not line.length:
            return ""
        nodes, back = self.nodes, self.nodes.integers([-1])
        span = [back, nodes.integers([-line.length - 1]), nodes.integers([0]), back]
        rows = nodes.add("Slice", [history, *span], f"{line.channel}_newest")
        return nodes.add("Transpose", [rows], f"{line.channel}_line", perm=[1, 0])

    def _terms(self, terms: Sequence[Term], histories: Sequence[str], lines: Sequence[DelayLine]) -> str:
        """The inputs' terms of all samples, ``(time, n_terms, batch)``."""
        nodes = self.nodes
        if not terms:
            # The loop needs something to run over; zeros, because an input that the model does not read may be NaN.
            return _rows(nodes, [self._zeros([*histories, *self.known][0])], "x")

        def sample(channel: int, lag: int) -> str:
            length = lines[channel].length
            if not length:
                return histories[channel]
            span = [nodes.integers([length - lag]), nodes.integers([-lag if lag else TO_END]), nodes.integers([0])]
            return nodes.add("Slice", [histories[channel], *span], f"u{channel}_lag{lag}")

        samples = {(t.channel, lag): "" for t in terms for lag in (t.lag, t.older) if lag is not None}
        samples = {key: sample(*key) for key in samples}
        rows = []
        for term in terms:
            newer = samples[term.channel, term.lag]
            if term.older is not None:
                names = [newer, samples[term.channel, term.older]]
                newer = nodes.add("Sub", names, f"u{term.channel}_rate{term.lag}")
            rows.append(newer)
        return _rows(nodes, rows, "x")

    def _in_units(self, numbers: Sequence[str]) -> list[str]:
        """Outputs in units, held within their declared limits to the last digit; gives back where they are."""
        nodes, form, limited = self.nodes, self.stage.form, []
        for j, (number, sides) in enumerate(zip(numbers, self.stage.limits, strict=True)):
            scale = nodes.numbers(f"y{j}_scale", form.scale[form.n_inputs + j])
            offset = nodes.numbers(f"y{j}_offset", form.offset[form.n_inputs + j])
            value = nodes.add("Add", [nodes.add("Mul", [number, scale], f"y{j}_centred"), offset], f"y{j}_in_units")
            for side in sides:
                part = nodes.within(f"{nodes.prefix}{limit_name(j, side)}_")
                limit = part.numbers("value", side.value) if side.column is None else self._channel(side.column)
                beyond = part.add("Greater" if side.upper else "Less", [value, limit], "beyond_in_units")
                value = part.add("Where", [beyond, limit, value], "in_units")
                if self.stage.told[j]:
                    limited.append(part.add("Equal", [value, limit], "reached"))
            self.outputs.append(value)
        return limited

    def _channel(self, column: int) -> str:
        return [*self.known, *self.outputs][column]


def _channels(nodes: Nodes, value: str, names: list[str]) -> list[str]:
    """The channels of ``(time, batch, n)`` as arrays ``(time, batch)``.

    Arithmetic along a last axis of one, two or three numbers cannot be vectorised: on 20,000 samples of a hundred cars
    it was measured ten times as slow as without that axis.
    """
    parts = nodes.split(value, [f"{name}_column" for name in names])
    last = nodes.integers([-1])
    return [nodes.add("Squeeze", [part, last], name) for part, name in zip(parts, names, strict=True)]


def _columns(nodes: Nodes, channels: Sequence[str], output: str) -> str:
    """Arrays ``(time, batch)`` side by side as ``(time, batch, n)``."""
    last = nodes.integers([-1])
    if len(channels) == 1:
        return nodes.add("Unsqueeze", [channels[0], last], output)
    columns = [nodes.add("Unsqueeze", [channel, last], f"{output}_{i}") for i, channel in enumerate(channels)]
    return nodes.add("Concat", columns, output, axis=2)


def _rows(nodes: Nodes, channels: Sequence[str], output: str) -> str:
    """Arrays ``(time, batch)`` as ``(time, n, batch)``."""
    middle = nodes.integers([1])
    rows = [nodes.add("Unsqueeze", [channel, middle], f"{output}_{i}") for i, channel in enumerate(channels)]
    return rows[0] if len(rows) == 1 else nodes.add("Concat", rows, output, axis=1)


def _flags(nodes: Nodes, surrogate: Surrogate, inputs: Sequence[str], made: Sequence[Made]) -> None:
    """The flags of all samples, after the loops."""
    outside, lost = [], []
    for i, (port, channel) in enumerate(zip(surrogate.inputs, inputs, strict=True)):
        if port.range is not None:
            low, high = nodes.numbers(f"declared_low{i}", port.low), nodes.numbers(f"declared_high{i}", port.high)
            outside.append(nodes.add("Less", [channel, low], f"u{i}_below"))
            outside.append(nodes.add("Greater", [channel, high], f"u{i}_above"))
        lost.append(nodes.add("IsNaN", [channel], f"u{i}_lost"))
    scaled = [number for one in made for number in one.scaled]
    lost += [nodes.add("IsNaN", [output], f"y{k}_lost") for k, output in enumerate(scaled)]
    causes = {
        Flag.OUTSIDE_RANGE: outside,
        Flag.AT_BOUND: held_outputs(nodes, surrogate, made),
        Flag.NOT_A_NUMBER: lost,
        Flag.AT_LIMIT: [name for one in made for name in one.limited],
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
