"""One step of a surrogate as an ONNX graph: sample and state in, outputs, next state and flags out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from sysid.export.flags import MEANING, Flag
from sysid.export.incremental_form import IncrementalForm
from sysid.export.lagged_form import LaggedForm
from sysid.export.layout import StateLayout
from sysid.export.onnx_nodes import Nodes
from sysid.export.onnx_state_space import state_space_step, within_bound
from sysid.export.stage import Port, Side, Stage
from sysid.export.state_space_form import StateSpaceForm
from sysid.export.surrogate import Surrogate

STATE_TEXT = "past samples, scaled; the layout stands in model.json under state"
FLAGS_TEXT = "the sum of: " + "; ".join(f"{int(flag)}: {text}" for flag, text in MEANING.items())
INT32 = 6
"""``TensorProto.INT32``."""


@dataclass(frozen=True, kw_only=True)
class Made:
    """The names of what a stage gives.

    Args:
        scaled: Its outputs in scaled numbers, all in one value or each in one.
        state: Its state afterwards.
        remainder: What rounding took from the newest numbers of its state; ``None`` where that is not kept.
        limited: Where an output is at a declared limit.
        outputs: Its outputs in their units, all in one value.
    """

    scaled: tuple[str, ...]
    state: str
    remainder: str | None = None
    limited: tuple[str, ...] = ()
    outputs: str = ""


def step_graph(surrogate: Surrogate, dtype: DTypeLike) -> Any:
    """The graph of one step; see :func:`step_nodes`.

    Args:
        surrogate: What to write.
        dtype: Of the numbers.

    Returns:
        The ``GraphProto``.
    """
    nodes = step_nodes(surrogate, dtype)
    return nodes.graph("step", *ends(nodes, surrogate, ["batch"]))


def step_nodes(surrogate: Surrogate, dtype: DTypeLike) -> Nodes:
    """The nodes of one step.

    Inputs ``u (batch, n_inputs)`` in units and ``state (batch, n_state)``; outputs ``y (batch, n_outputs)`` in their
    units, ``state_out (batch, n_state)`` and ``flags (batch, 1)``.

    Args:
        surrogate: What to write.
        dtype: Of the numbers.

    Returns:
        The nodes, from ``u`` and ``state`` to the outputs.
    """
    nodes = Nodes(dtype)
    known, made = "u", []
    for k, stage in enumerate(surrogate.stages):
        part = stage_part(nodes, surrogate, k)
        inputs = known
        n_known = stage.targets[0]
        if stage.known_sources != tuple(range(n_known)):
            read = "u" if len(surrogate.stages) > 1 else "read"  # alone, "u" is what goes in
            inputs = part.add("Gather", [known, nodes.integers(list(stage.known_sources))], read, axis=-1)
        add_stage = _state_space_stage if isinstance(stage.form, StateSpaceForm) else _stage
        one = add_stage(part, stage, inputs, *stage_state(part, surrogate, stage))
        made.append(_within_limits(part, stage, one, known))
        if k + 1 < len(surrogate.stages):
            known = part.add("Concat", [known, made[-1].outputs], "known", axis=-1)
    computed = nodes.add("Concat", [one.outputs for one in made], "computed" if surrogate.selects else "y", axis=-1)
    if surrogate.selects:
        columns = [column - len(surrogate.inputs) for column in surrogate.columns]
        nodes.add("Gather", [computed, nodes.integers(columns)], "y", axis=-1)
    _late(
        nodes, surrogate, computed, join_states(nodes, made, "state_out" if not surrogate.late else "state_before_late")
    )
    _flags(nodes, surrogate, computed, made)
    return nodes


def _late(nodes: Nodes, surrogate: Surrogate, computed: str, state: str) -> None:
    """Put what was computed after it was read into the next state."""
    late = surrogate.late
    if not late:
        return
    channels = nodes.add("Concat", ["u", computed], "channels", axis=-1)
    values = nodes.add("Gather", [channels, nodes.integers([one.column for one in late])], "late", axis=-1)
    offset, scale = (
        nodes.numbers(f"late_{side}", [getattr(one, side) for one in late]) for side in ("offset", "scale")
    )
    scaled = nodes.add("Div", [nodes.add("Sub", [values, offset], "late_centred"), scale], "late_scaled")
    size = surrogate.state_length(nodes.dtype)
    columns = list(range(size))
    for i, one in enumerate(late):
        columns[one.place] = size + i
    both = nodes.add("Concat", [state, scaled], "state_and_late", axis=-1)
    nodes.add("Gather", [both, nodes.integers(columns)], "state_out", axis=-1)


def stage_part(nodes: Nodes, surrogate: Surrogate, k: int) -> Nodes:
    """The same graph with the names of a stage."""
    return nodes.within("" if len(surrogate.stages) == 1 else f"stage{k}_")


def stage_state(nodes: Nodes, surrogate: Surrogate, stage: Stage) -> tuple[str, str | None]:
    """A stage's own state and its remainder; ``None`` where it keeps none.

    Args:
        nodes: The graph.
        surrogate: The whole.
        stage: The stage.

    Returns:
        Their names, both with the cars as first axis.
    """
    state = _cut(nodes, surrogate, stage.first, stage.state.size, "own_state")
    if nodes.dtype != np.float32 or not stage.remainders:
        return state, None
    return state, _cut(nodes, surrogate, surrogate.state_size + stage.first_remainder, stage.remainders, "remainder")


def _cut(nodes: Nodes, surrogate: Surrogate, first: int, size: int, name: str) -> str:
    """Some columns of the state; no node where they are all."""
    if size == surrogate.state_length(nodes.dtype):
        return "state"
    bounds = [nodes.integers([at]) for at in (first, first + size, 1)]
    return nodes.add("Slice", ["state", *bounds], name)


def join_states(nodes: Nodes, made: Sequence[Made], name: str = "state_out") -> str:
    """Lay the stages' states end to end, the remainders after them; gives back the name."""
    states = [one.state for one in made] + [one.remainder for one in made if one.remainder]
    return nodes.add("Concat", states, name, axis=1)


@dataclass(frozen=True, kw_only=True)
class _Draft:
    """What a stage gives before its declared limits.

    Args:
        scaled: Its outputs in scaled numbers.
        following: Adds its state afterwards, from its outputs as they are held in the end.
        remainder: As in :class:`Made`.
    """

    scaled: str
    following: Callable[[str], str]
    remainder: str | None


def _stage(nodes: Nodes, stage: Stage, inputs: str, state: str, remainder: str | None) -> _Draft:
    form, layout = stage.lagged
    incremental = IncrementalForm.of(form)
    scaled = scaled_inputs(nodes, inputs, form)
    known = nodes.add("Concat", [scaled, state], "inputs_and_state", axis=1)
    terms, order = _terms(nodes, layout, incremental, known)
    linear = [nodes.numbers("w", incremental.linear[:, order].T), nodes.numbers("c", form.constant)]
    output = nodes.add("Gemm", [terms, *linear], "linear_part")
    if form.neurons:
        hidden = [nodes.numbers("W", incremental.hidden_weights[:, order].T), nodes.numbers("b", form.hidden_bias)]
        neurons = form.neuron.onnx(nodes, nodes.add("Gemm", [terms, *hidden], "hidden_sum"), "hidden")
        readout = form.readout
        if form.gated:
            slopes = [nodes.numbers("G", incremental.gates[:, order].T), nodes.numbers("v", form.readout[0])]
            neurons = nodes.add("Mul", [neurons, nodes.add("Gemm", [terms, *slopes], "gates")], "behind_gates")
            readout = np.ones_like(readout)
        output = nodes.add("Gemm", [neurons, nodes.numbers("V", readout.T), output], "network")
    lost = None
    if form.adds:
        columns = nodes.integers([layout.column(form.n_inputs + j, 1) for j in range(form.n_outputs)])
        output, lost = added(nodes, nodes.add("Gather", [known, columns], "last", axis=1), output, remainder)

    def following(held: str) -> str:
        together = nodes.add("Concat", [scaled, held, state], "inputs_outputs_and_state", axis=1)
        return nodes.add("Gather", [together, nodes.integers(layout.next_columns())], "next_state", axis=1)

    return _Draft(scaled=clipped(nodes, output, stage), following=following, remainder=lost)


def _terms(nodes: Nodes, layout: StateLayout, incremental: IncrementalForm, known: str) -> tuple[str, list[int]]:
    """Levels, then rates, of ``[scaled inputs | state]``, and the place of each in the form."""
    terms = (*incremental.inputs, *incremental.outputs)
    levels = [i for i, term in enumerate(terms) if term.older is None]
    rates = [i for i, term in enumerate(terms) if term.older is not None]
    picked = nodes.integers([layout.column(terms[i].channel, terms[i].lag) for i in levels])
    parts = [nodes.add("Gather", [known, picked], "levels", axis=1)]
    if not rates:
        return parts[0], levels
    newer, older = (
        nodes.add("Gather", [known, nodes.integers(columns)], name, axis=1)
        for name, columns in (
            ("newer", [layout.column(terms[i].channel, terms[i].lag) for i in rates]),
            ("older", [layout.column(terms[i].channel, terms[i].older or 0) for i in rates]),
        )
    )
    return nodes.add("Concat", [*parts, nodes.add("Sub", [newer, older], "rates")], "terms", axis=1), levels + rates


def added(nodes: Nodes, last: str, change: str, remainder: str | None) -> tuple[str, str | None]:
    """The sum of last numbers and their change.

    Args:
        nodes: The graph.
        last: The last numbers.
        change: What is added to them.
        remainder: What rounding took from the last numbers; ``None`` where it is not kept.

    Returns:
        The numbers, and what rounding takes from them.
    """
    if remainder is None:
        return nodes.add("Add", [last, change], "sum"), None
    whole = nodes.add("Add", [change, remainder], "whole_change")
    total = nodes.add("Add", [last, whole], "sum")
    return total, nodes.add("Sub", [whole, nodes.add("Sub", [total, last], "moved")], "lost")


def _state_space_stage(nodes: Nodes, stage: Stage, inputs: str, state: str, remainder: str | None) -> _Draft:
    form = stage.state_space
    scaled = scaled_inputs(nodes, inputs, form)
    z = nodes.add("Concat", [state, scaled], "state_and_inputs", axis=1)
    output, change = state_space_step(nodes, form, z, rows=False)
    following, lost = added(nodes, state, change, remainder)
    following = within_bound(nodes, form, following)
    return _Draft(scaled=clipped(nodes, output, stage), following=lambda _: following, remainder=lost)


def _within_limits(nodes: Nodes, stage: Stage, draft: _Draft, known: str) -> Made:
    """The outputs within their declared limits, in scaled numbers and in units, and the state that follows."""
    form, scaled, limited = stage.form, draft.scaled, []
    outputs = unscaled_outputs(nodes, scaled, form)
    if stage.limited:
        numbers = nodes.split(scaled, [f"scaled_{j}" for j in range(form.n_outputs)])
        values = nodes.split(outputs, [f"output_{j}" for j in range(form.n_outputs)])
        for j, sides in enumerate(stage.limits):
            for side in sides:
                part = nodes.within(f"{nodes.prefix}limit{j}_{'high' if side.upper else 'low'}_")
                limit = _limit(part, stage, side, values, known)
                offset, scale = form.offset[form.n_inputs + j], form.scale[form.n_inputs + j]
                centred = part.add("Sub", [limit, part.numbers("offset", offset)], "centred")
                number = part.add("Div", [centred, part.numbers("scale", scale)], "scaled")
                beyond = part.add("Greater" if side.upper else "Less", [values[j], limit], "beyond")
                numbers[j] = part.add("Where", [beyond, number, numbers[j]], "number")
                values[j] = part.add("Where", [beyond, limit, values[j]], "value")
                if stage.told[j]:
                    limited.append(part.add("Equal", [values[j], limit], "reached"))
        scaled = nodes.add("Concat", numbers, "scaled_within_limits", axis=1)
        outputs = nodes.add("Concat", values, "outputs_within_limits", axis=1)
    state = draft.following(scaled)
    return Made(scaled=(scaled,), outputs=outputs, state=state, remainder=draft.remainder, limited=tuple(limited))


def _limit(nodes: Nodes, stage: Stage, side: Side, values: Sequence[str], known: str) -> str:
    if side.column is None:
        return nodes.numbers("limit", [[side.value]])
    if side.column in stage.targets:
        return values[stage.targets.index(side.column)]
    return nodes.add("Gather", [known, nodes.integers([side.column])], "channel", axis=1)


def ends(nodes: Nodes, surrogate: Surrogate, leading: list[str]) -> tuple[list[Any], list[Any]]:
    """Descriptions of the graph's inputs and outputs.

    Args:
        nodes: The graph.
        surrogate: What is written.
        leading: Axes before the channels.

    Returns:
        Those of the inputs, and those of the outputs.
    """
    size = surrogate.state_length(nodes.dtype)
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


def within_a_body(nodes: Nodes, prefix: str) -> Nodes:
    """The same nodes as part of another graph's loop, with other names for what goes in and comes out.

    Args:
        nodes: From ``u`` and ``state`` to ``y``, ``state_out`` and ``flags``.
        prefix: Put before these names.

    Returns:
        The nodes; new names get the prefix too.
    """
    own = {name: f"{prefix}{name}" for name in ("u", "state", "y", "state_out", "flags")}
    for node in nodes.nodes:
        for names in (node.input, node.output):
            names[:] = [own.get(name, name) for name in names]
    return nodes.within(prefix)


def _channels(ports: tuple[Port, ...]) -> str:
    return ", ".join(f"{port.name} [{port.unit}]" for port in ports)


def scaled_inputs(nodes: Nodes, inputs: str, form: LaggedForm | StateSpaceForm) -> str:
    """Inputs in the model's numbers, scaled on the last axis."""
    offset = nodes.numbers("input_offset", form.offset[: form.n_inputs])
    scale = nodes.numbers("input_scale", form.scale[: form.n_inputs])
    return nodes.add("Div", [nodes.add("Sub", [inputs, offset], "u_centred"), scale], "u_scaled")


def unscaled_outputs(nodes: Nodes, scaled: str, form: LaggedForm | StateSpaceForm) -> str:
    """The stage's outputs in their units, on the last axis."""
    scale = nodes.numbers("output_scale", form.scale[form.n_inputs :])
    offset = nodes.numbers("output_offset", form.offset[form.n_inputs :])
    return nodes.add("Add", [nodes.add("Mul", [scaled, scale], "y_centred"), offset], "in_units")


def clipped(nodes: Nodes, output: str, stage: Stage) -> str:
    """Outputs within the model's own bounds; no node where there are none. NaN stays NaN, as in the model."""
    if not stage.bounded:
        return output
    low, high = nodes.numbers("low", stage.form.low), nodes.numbers("high", stage.form.high)
    return nodes.add("Clip", [output, low, high], "bounded")


def _flags(nodes: Nodes, surrogate: Surrogate, computed: str, made: Sequence[Made]) -> None:
    """The flags of a sample, with few nodes: in one step a node costs more than its arithmetic."""
    low, high = ([getattr(port, side) for port in surrogate.inputs] for side in ("low", "high"))
    below = nodes.add("Less", ["u", nodes.numbers("declared_low", low)], "u_below")
    above = nodes.add("Greater", ["u", nodes.numbers("declared_high", high)], "u_above")
    known = nodes.add("Concat", ["u", computed], "u_and_y", axis=-1)
    raised = {
        Flag.OUTSIDE_RANGE: [nodes.add("Or", [below, above], "u_outside")],
        Flag.AT_BOUND: held_outputs(nodes, surrogate, made),
        Flag.NOT_A_NUMBER: [nodes.add("IsNaN", [known], "u_and_y_lost")],
        Flag.AT_LIMIT: [name for one in made for name in one.limited],
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
        last = nodes.add("Add", [last, bit], "flags" if i == len(bits) else f"flags_{i}")


def held_outputs(nodes: Nodes, surrogate: Surrogate, made: Sequence[Made]) -> list[str]:
    """Where the outputs of each bounded stage are at a bound of the model itself."""
    held = []
    for k, (stage, one) in enumerate(zip(surrogate.stages, made, strict=True)):
        for j, output in enumerate(one.scaled if stage.bounded else ()):
            part, form = nodes.within(f"held{k}_{j}_"), stage.form
            low = part.add("LessOrEqual", [output, part.numbers("low", form.low)], "at_low")
            high = part.add("GreaterOrEqual", [output, part.numbers("high", form.high)], "at_high")
            held.append(part.add("Or", [low, high], "at_bound"))
    return held
