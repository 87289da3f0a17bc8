"""ONNX: the format to prefer. Runs wherever onnxruntime does, from C, C++, C#, Java, JavaScript or Python."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

import sysid
from sysid.export.exporter import (
    AbstractExporter,
    ExportedFile,
    Kind,
    Run,
    Runner,
    given,
    step_by_step,
    with_remainders,
)
from sysid.export.surrogate import Surrogate


@dataclass(frozen=True, kw_only=True)
class OnnxExporter(AbstractExporter):
    """Writes ``step.onnx`` and ``sequence.onnx``.

    Args:
        name: Name in the table; both number types are in it.
        dtype: ``"float64"`` or ``"float32"``, of inputs, outputs and arithmetic; it stands in the file name if
            it is not the first.
    """

    packages: ClassVar[tuple[str, ...]] = ("onnx", "onnxruntime")

    name: str = "onnx"
    dtype: str = "float64"

    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Write both graphs; both have passed the full checker."""
        from sysid.export.onnx.nodes import IR_VERSION, OPSET, checked_model
        from sysid.export.onnx.sequence import sequence_graph
        from sysid.export.onnx.step import step_graph

        files = []
        suffix = "" if self.dtype == "float64" else f".{self.dtype}"
        for kind, build in ((Kind.STEP, step_graph), (Kind.SEQUENCE, sequence_graph)):
            proto = checked_model(build(surrogate, self.dtype), surrogate, sysid.__version__)
            name = f"{kind.value}{suffix}.onnx"
            (folder / name).write_bytes(proto.SerializeToString(deterministic=True))
            details = {"opset": OPSET, "domain": "ai.onnx", "ir_version": IR_VERSION}
            files.append(ExportedFile(name=name, format=self.name, kind=kind, dtype=self.dtype, details=details))
        return tuple(files)

    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Open the file in onnxruntime on one thread: the graph is a chain of small steps."""
        self.check()
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        session = onnxruntime.InferenceSession(folder / file.name, options, providers=["CPUExecutionProvider"])
        dtype = np.dtype(file.dtype)
        length = session.get_inputs()[1].shape[1]

        def run(inputs: NDArray[Any], state: NDArray[Any] | None) -> Run:
            before = np.asarray(with_remainders(given(state), length), dtype=dtype)
            feed = {"u": np.asarray(inputs, dtype=dtype), "state": before}
            output, state_out, flags = session.run(["y", "state_out", "flags"], feed)
            return Run(output=output, state=state_out, flags=flags[..., 0])

        return run if file.kind is Kind.SEQUENCE else step_by_step(run)
