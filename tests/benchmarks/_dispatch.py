"""What a runtime takes to call the nodes of a loop, whatever they compute: the least that the loop can take."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from onnx import helper, numpy_helper

from sysid.export.onnx.nodes import IR_VERSION, OPSET

SAMPLES = 2000
REAL, WHOLE = onnx.TensorProto.DOUBLE, onnx.TensorProto.INT64
BY_NUMBER = ("Tanh", "Mul", "Add", "Max", "Min", "Clip")
"""Operators that compute number by number."""


def loop_of(path: Path) -> Any:
    """The body of the loop over samples: the first ``Scan`` of a sequence.

    Args:
        path: A sequence as ONNX.

    Returns:
        The body as a graph.
    """

    def bodies(graph: Any) -> Iterator[Any]:
        for node in graph.node:
            for inner in (attribute.g for attribute in node.attribute if attribute.type == onnx.AttributeProto.GRAPH):
                if node.op_type == "Scan":
                    yield inner
                yield from bodies(inner)

    return next(bodies(onnx.load(path).graph))


def on_one_row(body: Any) -> tuple[bytes, dict[str, np.ndarray]]:
    """The same nodes, wired alike, with one row in place of every value's, in a loop of its own.

    Args:
        body: A body that reads and writes a memory in a ring, and is given the terms of inputs and its places.

    Returns:
        A model, and what it is fed.
    """
    memory, x, reads, writes = (one.name for one in body.input)
    nodes, constants, rows = _narrowed(body)
    n_reads = next(len(node.output) for node in nodes if node.op_type == "Split")  # what is read is cut for the groups
    given = [_value(memory, [1, 1]), _value(x, [1, 1]), _value(reads, [n_reads], WHOLE), _value(writes, [1, 1], WHOLE)]
    made = [_value(one.name, [rows[one.name], 1]) for one in body.output]
    inner = helper.make_graph(nodes, "one_row", given, made, constants)
    loop = helper.make_node("Scan", ["m", "x", "r", "w"], ["last", "raw"], body=inner, num_scan_inputs=3)
    fed = {
        "m": np.zeros((1, 1)),
        "x": np.zeros((SAMPLES, 1, 1)),
        "r": np.zeros((SAMPLES, n_reads), np.int64),
        "w": np.zeros((SAMPLES, 1, 1), np.int64),
    }
    kinds = {name: WHOLE if array.dtype == np.int64 else REAL for name, array in fed.items()}
    ends = [_value("last", [1, 1]), _value("raw", [SAMPLES, rows[body.output[1].name], 1])]
    graph = helper.make_graph([loop], "dispatch", [_value(k, list(fed[k].shape), kinds[k]) for k in fed], ends)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
    return model.SerializeToString(), fed


def _value(name: str, shape: list[int], kind: int = REAL) -> Any:
    return helper.make_tensor_value_info(name, kind, shape)


def _narrowed(body: Any) -> tuple[list[Any], list[Any], dict[str, int]]:
    """Nodes, constants of one row, and rows of every value: several where pieces are laid one behind the other."""
    cut = {node.input[0]: len(node.output) for node in body.node if node.op_type == "Split"}
    fixed = {one.name: len(one.dims) for one in body.initializer}
    fed = {one.name for one in body.input} | {name for node in body.node for name in node.output}
    rows = {one.name: 1 for one in body.input}
    nodes, constants = [], []
    for number, node in enumerate(body.node):
        names, parts = list(node.input), cut.get(node.output[0], 1)
        tables: dict[int, Any] = {}
        if node.op_type == "Gemm":
            tables = {0: np.zeros((parts, rows[names[1]])), 2: np.zeros((parts, 1))}
        elif node.op_type == "Gather":
            tables = {1: np.zeros(parts, dtype=np.int64)}
        elif node.op_type == "Split":
            tables = {1: np.ones(len(node.output), dtype=np.int64)}
        elif node.op_type in BY_NUMBER:
            tables = {at: np.zeros([1] * fixed.get(name, 2)) for at, name in enumerate(names)}
        for at, table in tables.items():
            if names[at] not in fed:
                names[at] = f"one_row_{number}_{at}"
                constants.append(numpy_helper.from_array(table, names[at]))
        laid = sum(rows[name] for name in names) if node.op_type == "Concat" else 1
        rows |= dict.fromkeys(node.output, parts if node.op_type in ("Gemm", "Gather") else laid)
        kept = {one.name: helper.get_attribute_value(one) for one in node.attribute}
        nodes.append(helper.make_node(node.op_type, names, node.output, **kept))
    return nodes, constants, rows
