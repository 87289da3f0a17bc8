"""A list of ONNX nodes under construction: each call adds one and gives back the name of its value."""

from __future__ import annotations

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


class Nodes:
    """Nodes and constants of one graph.

    Args:
        dtype: Of the numbers.
        prefix: Put before every name. ONNX wants names unique across a graph and the bodies inside it.
    """

    def __init__(self, dtype: DTypeLike, prefix: str = "") -> None:
        self.dtype = np.dtype(dtype)
        self.prefix = prefix
        self.nodes: list[Any] = []
        self.constants: dict[str, Any] = {}

    def within(self, prefix: str) -> Nodes:
        """The same graph, with other names: for one of several stages."""
        part = Nodes(self.dtype, prefix)
        part.nodes, part.constants = self.nodes, self.constants
        return part

    def numbers(self, name: str, values: ArrayLike) -> str:
        """Add a constant of the graph's number type."""
        return self._constant(name, np.asarray(values, dtype=self.dtype))

    def integers(self, values: ArrayLike) -> str:
        """Add an index constant, named by its values and kept once."""
        array = np.asarray(values, dtype=np.int64)
        text = "_".join("end" if value == TO_END else str(value) for value in array.ravel())
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

    def split(self, value: str, outputs: Sequence[str], axis: int = -1) -> list[str]:
        """Cut a value into equal parts along an axis, the last by default, one for each name."""
        if len(outputs) == 1:
            return [value]
        names = [self.prefix + output for output in outputs]
        self.nodes.append(helper.make_node("Split", [value], names, name=f"make_{names[0]}", axis=axis))
        return names

    def add_scan(
        self, states: Sequence[str], scanned: Sequence[str], ends: Sequence[str], output: str, body: Any
    ) -> str:
        """Add a loop over the first axis of ``scanned``; gives back the name of its one output by sample."""
        outputs = [self.prefix + name for name in (*ends, output)]
        inputs = [*states, *scanned]
        self.nodes.append(
            helper.make_node(
                "Scan", inputs, outputs, name=f"{self.prefix}loop", body=body, num_scan_inputs=len(scanned)
            )
        )
        return outputs[-1]

    def value(self, name: str, shape: Sequence[int | str], doc: str = "", dtype: DTypeLike | None = None) -> Any:
        """Describe an input or output of the graph."""
        kind = helper.np_dtype_to_tensor_dtype(np.dtype(dtype or self.dtype))
        return helper.make_tensor_value_info(self.prefix + name, kind, list(shape), doc_string=doc)

    def graph(self, name: str, inputs: Sequence[Any], outputs: Sequence[Any]) -> Any:
        """Close the graph."""
        return helper.make_graph(self.nodes, name, list(inputs), list(outputs), list(self.constants.values()))


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
