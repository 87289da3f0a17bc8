"""A list of ONNX nodes under construction: each call adds one and gives back the name of its value."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import onnx
from numpy.typing import ArrayLike, DTypeLike
from onnx import helper, numpy_helper

from sysid.export.surrogate import Surrogate

OPSET = 17
"""Old enough for runtimes from 2022 on (onnxruntime 1.12), and it has every operator used, Clip and Scan in float64."""
IR_VERSION = 8
"""The file format that came with that opset."""
TO_END = int(np.iinfo(np.int64).max)
"""As the end of a Slice: to the end, whatever the length."""


LONGEST = 40
"""Letters of the values in an index constant's name, beyond which a digest stands for the rest."""


ROWS_OF_A_SLICE = 30
"""Rows from which on copying a slice is quicker than gathering them."""


class Nodes:
    """Nodes and constants of one graph.

    Args:
        dtype: Of the numbers.
        prefix: Put before every name. ONNX wants names unique across a graph and the bodies inside it.
        trailing: Axes behind the channels where these lie along the first one.
    """

    def __init__(self, dtype: DTypeLike, prefix: str = "", trailing: int = 1) -> None:
        self.dtype = np.dtype(dtype)
        self.prefix, self.trailing = prefix, trailing
        self.nodes: list[Any] = []
        self.constants: dict[str, Any] = {}

    def within(self, prefix: str) -> Nodes:
        """The same graph, with other names: for one of several stages."""
        part = Nodes(self.dtype, prefix, self.trailing)
        part.nodes, part.constants = self.nodes, self.constants
        return part

    def counting(self) -> Nodes:
        """The same graph, with numbers in float32: for sums of truths."""
        part = self.within(self.prefix)
        part.dtype = np.dtype(np.float32)
        return part

    def numbers(self, name: str, values: ArrayLike) -> str:
        """Add a constant of the graph's number type."""
        return self._constant(name, np.asarray(values, dtype=self.dtype))

    def column(self, name: str, values: ArrayLike) -> str:
        """Add a constant of every channel, to be laid against values with channels along the first axis."""
        return self.numbers(name, np.asarray(values).reshape(-1, *([1] * self.trailing)))

    def kind(self) -> int:
        """The graph's number type, as ONNX counts them."""
        return int(helper.np_dtype_to_tensor_dtype(self.dtype))

    def truths(self, name: str, values: Sequence[bool]) -> str:
        """Add a constant of truth values, of every channel."""
        array = np.asarray(values, dtype=bool).reshape(-1, *([1] * self.trailing))
        return self._constant(name, array)

    def integers(self, values: ArrayLike) -> str:
        """Add an index constant, named by its values and kept once."""
        array = np.asarray(values, dtype=np.int64)
        text = "_".join("end" if value == TO_END else str(value) for value in array.ravel())
        if len(text) > LONGEST:
            text = f"{text[:LONGEST]}_{hashlib.sha256(text.encode()).hexdigest()[:12]}"
        return self._constant(f"index{array.ndim}_{text}", array)

    def whole(self, value: int) -> str:
        """Add an int32 constant."""
        return self._constant(f"whole_{value}", np.asarray(value, dtype=np.int32))

    def _constant(self, name: str, array: Any) -> str:
        name = self.prefix + name
        self.constants[name] = numpy_helper.from_array(np.ascontiguousarray(array).reshape(array.shape), name)
        return name

    def add(self, operator: str, inputs: Sequence[str], output: str, **attributes: Any) -> str:
        """Add a node with one output, whose name it gives back."""
        output = self.prefix + output
        self.nodes.append(helper.make_node(operator, list(inputs), [output], name=f"make_{output}", **attributes))
        return output

    def rows(self, value: str, rows: Sequence[int], count: int, name: str) -> str:
        """Some rows along the first axis of a value that has ``count``; no node where they are all."""
        return self.rows_of([(value, count)], [(0, row) for row in rows], name)

    def rows_of(self, values: Sequence[tuple[str, int]], rows: Sequence[tuple[int, int]], name: str) -> str:
        """Rows of several values, one behind the other, each by value and row.

        A slice is copied as one piece, where a gather takes as long for every row as a node does for thirty.

        Args:
            values: Their names, and how many rows they have.
            rows: Which are taken.
            name: Of what it gives.

        Returns:
            The name.
        """
        runs: list[list[int]] = []
        for value, row in rows:
            if runs and runs[-1][0] == value and runs[-1][2] == row:
                runs[-1][2] = row + 1
            else:
                runs.append([value, row, row + 1])
        if len(runs) > max(1, len(rows) // ROWS_OF_A_SLICE):
            starts = np.cumsum([0, *(count for _, count in values)])
            whole = values[0][0]
            if len(values) > 1:
                whole = self.add("Concat", [one for one, _ in values], f"{name}_from", axis=0)
            return self.add("Gather", [whole, self.integers([int(starts[v]) + row for v, row in rows])], name, axis=0)
        pieces: list[str] = []
        for value, first, end in runs:
            source, count = values[value]
            if (first, end) != (0, count):
                span = [self.integers([at]) for at in (first, end, 0)]
                source = self.add("Slice", [source, *span], name if len(runs) == 1 else f"{name}_{len(pieces)}")
            pieces.append(source)
        return pieces[0] if len(pieces) == 1 else self.add("Concat", pieces, name, axis=0)

    def cut(self, value: str, sizes: dict[str, int]) -> list[str]:
        """Cut a value along its first axis into named parts; no node where there is one."""
        if len(sizes) == 1:
            return [value]
        names = [self.prefix + output for output in sizes]
        inputs = [value, self.integers(list(sizes.values()))]
        self.nodes.append(helper.make_node("Split", inputs, names, name=f"make_{names[0]}", axis=0))
        return names

    def value(self, name: str, shape: Sequence[int | str] | None, doc: str = "", dtype: DTypeLike | None = None) -> Any:
        """Describe an input or output of the graph."""
        kind = helper.np_dtype_to_tensor_dtype(np.dtype(dtype or self.dtype))
        return helper.make_tensor_value_info(
            self.prefix + name, kind, None if shape is None else list(shape), doc_string=doc
        )

    def graph(self, name: str, inputs: Sequence[Any], outputs: Sequence[Any]) -> Any:
        """Close the graph, without what nobody reads."""
        needed, nodes = {one.name for one in outputs}, []
        for node in reversed(self.nodes):
            if needed.intersection(node.output):
                nodes.append(node)
                needed |= _read(node)
        constants = [one for key, one in self.constants.items() if key in needed]
        return helper.make_graph(nodes[::-1], name, list(inputs), list(outputs), constants)


def _read(node: Any) -> set[str]:
    """What a node reads, and what bodies inside it do."""
    found = set(node.input)
    for attribute in node.attribute:
        for inner in attribute.g.node:
            found |= _read(inner)
        found |= {one.name for one in attribute.g.output}
    return found


def checked_model(graph: Any, surrogate: Surrogate, version: str) -> Any:
    """A complete ONNX model that has passed the full checker.

    Args:
        graph: Its graph.
        surrogate: What it came from; channels, units and ranges are written into the metadata.
        version: Of the workbench.

    Returns:
        The ``ModelProto``.
    """
    proto = helper.make_model(
        graph,
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="sysid-workbench",
        producer_version=version,
    )
    helper.set_model_props(
        proto,
        {
            "mapping": surrogate.mapping,
            "structure": surrogate.label,
            "sample_time_s": repr(surrogate.sample_time),
            "input_units": ", ".join(port.unit for port in surrogate.inputs),
            "input_ranges": ", ".join(f"{port.low!r} to {port.high!r}" for port in surrogate.inputs),
            "output_unit": ", ".join(port.unit for port in surrogate.outputs),
        },
    )
    onnx.checker.check_model(proto, full_check=True)
    return proto
