"""A graph over all samples as a loop over blocks of samples, so that what lies between its nodes stays in the cache.

Regressors of 20,000 samples of a hundred cars are 64 MB in float32: written to memory and read back, that takes as long
as half of the arithmetic. In blocks of 25,600 numbers a channel the whole was measured a fifth faster; one car is one
block. The numbers are the same to the last bit: a block is what a call with a piece of a record is.
"""

from __future__ import annotations

from typing import Any

from onnx import TensorProto, helper

from sysid.export.onnx.nodes import Nodes
from sysid.export.onnx.outputs import ends
from sysid.export.surrogate import Surrogate

CELLS = 25_600
"""Samples times cars of a block."""
LEAST = 64
"""Samples of a block at least, however many cars there are."""


def in_blocks(surrogate: Surrogate, nodes: Nodes) -> Any:
    """A graph over any number of samples, from the nodes of one.

    Args:
        surrogate: What is written.
        nodes: From ``u`` and ``state`` to ``y``, ``state_out`` and ``flags``, samples along the first axis.

    Returns:
        The ``GraphProto``, with the same inputs and outputs.
    """
    outer = Nodes(nodes.dtype)
    kinds = {"y": helper.np_dtype_to_tensor_dtype(nodes.dtype), "flags": TensorProto.INT32}
    size, count = _blocks(outer)
    empty = [_sequence(outer, name, kind) for name, kind in kinds.items()]
    ended = ["state_out", *(f"{name}_of_blocks" for name in kinds)]
    body = _body(surrogate, nodes, size, kinds)
    outer.nodes.append(helper.make_node("Loop", [count, "", "state", *empty], ended, name="blocks", body=body))
    for name in kinds:
        outer.add("ConcatFromSequence", [f"{name}_of_blocks"], name, axis=0)
    return outer.graph("sequence", *ends(outer, surrogate, ["time", "batch"]))


def _blocks(nodes: Nodes) -> tuple[str, str]:
    """Samples of a block, and how many blocks there are: one at least."""
    one = nodes.integers([1])
    samples, cars = nodes.add("Shape", ["u"], "samples", start=0, end=1), nodes.add("Shape", ["u"], "n", start=1, end=2)
    fits = nodes.add("Div", [nodes.integers([CELLS]), nodes.add("Max", [cars, one], "cars")], "fits")
    size = nodes.add("Max", [fits, nodes.integers([LEAST])], "block_size")
    beyond = nodes.add("Sub", [nodes.add("Add", [samples, size], "samples_and_a_block"), one], "beyond")
    count = nodes.add("Max", [nodes.add("Div", [beyond, size], "whole_blocks"), one], "n_blocks")
    return size, nodes.add("Squeeze", [count], "count")


def _sequence(nodes: Nodes, name: str, kind: int) -> str:
    return nodes.add("SequenceEmpty", [], f"no_{name}", dtype=kind)


def _body(surrogate: Surrogate, nodes: Nodes, size: str, kinds: dict[str, int]) -> Any:
    """One block: its samples in, its outputs at the end of what the blocks before it gave."""
    inner = _within_a_body(nodes, "block_")
    first = inner.add("Mul", ["block", size], "first")
    span = [first, inner.add("Add", [first, size], "stop"), inner.integers([0])]
    inner.add("Slice", ["u", *span], "u")
    order = len(inner.nodes) - 3  # what cuts out the samples comes before what reads them
    inner.nodes[:] = inner.nodes[order:] + inner.nodes[:order]
    after = [inner.add("SequenceInsert", [f"{name}_before", f"block_{name}"], f"{name}_so_far") for name in kinds]
    on = inner.add("Identity", ["block_on"], "goes_on")
    state: list[int | str] = ["batch", surrogate.state_length(nodes.dtype)]
    sequences = [
        [
            helper.make_tensor_sequence_value_info(name, kind, None)
            for name, kind in zip(names, kinds.values(), strict=True)
        ]
        for names in ([f"{name}_before" for name in kinds], after)
    ]
    begin = [
        helper.make_tensor_value_info("block", TensorProto.INT64, []),
        helper.make_tensor_value_info("block_on", TensorProto.BOOL, []),
        inner.value("state", state),
    ]
    end = [helper.make_tensor_value_info(on, TensorProto.BOOL, []), inner.value("state_out", state)]
    return inner.graph("block_of_samples", begin + sequences[0], end + sequences[1])


def _within_a_body(nodes: Nodes, prefix: str) -> Nodes:
    """The same nodes as part of another graph's loop: what goes in and comes out, and is new, has a prefix."""
    own = {name: f"{prefix}{name}" for name in ("u", "state", "y", "state_out", "flags")}
    for node in nodes.nodes:
        for names in (node.input, node.output):
            names[:] = [own.get(name, name) for name in names]
    return nodes.within(prefix)
