"""torch.export's own format (``.pt2``): what PyTorch puts in TorchScript's place, for hosts that run PyTorch.

One step only: the format has no loop that runs at a bearable speed (a scanned sequence of 20,000 samples took 2.4 s,
thirty times as long as ONNX).
"""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any, ClassVar

from sysid.export.archive import write_archive
from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Runner, step_by_step
from sysid.export.surrogate import Surrogate
from sysid.export.torch.torchscript import run_of

LARGEST_BATCH = 1 << 20
"""Cars in one call: the format wants to know."""


class TorchExportExporter(AbstractExporter):
    """Writes ``step.pt2``."""

    name = "torch-export"
    packages: ClassVar[tuple[str, ...]] = ("torch",)

    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Export the step for any number of cars."""
        import torch

        from sysid.export.torch.module import SurrogateStep

        batch = torch.export.Dim("batch", min=1, max=LARGEST_BATCH)
        # Two cars: for the tracer a batch of one is not an example of many.
        example = (
            torch.zeros(2, len(surrogate.inputs), dtype=torch.float64),
            torch.zeros(2, surrogate.state_size, dtype=torch.float64),
        )
        buffer = io.BytesIO()
        program = torch.export.export(SurrogateStep(surrogate).eval(), example, dynamic_shapes=({0: batch}, {0: batch}))
        torch.export.save(program, buffer)
        write_archive(folder / "step.pt2", _reproducible(buffer.getvalue()), compress=False)
        details = {"torch": torch.__version__.partition("+")[0], "largest_batch": LARGEST_BATCH}
        return (ExportedFile(name="step.pt2", format=self.name, kind=Kind.STEP, details=details),)

    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Load the program on the CPU. Its graph can compute, but not reach the file system or network."""
        self.check()
        import torch

        module = torch.export.load(folder / file.name).module()

        return step_by_step(run_of(module))


def _reproducible(archive: bytes) -> dict[str, bytes]:
    """The archive's files without what belongs to the machine that wrote them.

    torch stores with every node the source lines that it came from, with the path of this checkout, and a hash over
    all of it (``serialization_id``); neither is read to run the program. It insists on the example that was traced
    (``sample_inputs``, two tensors of zeros), which is the only pickle in a bundle; torch reads it as weights only.
    """
    content = {}
    with zipfile.ZipFile(io.BytesIO(archive)) as source:
        for name in source.namelist():
            if name.endswith("/serialization_id"):
                continue
            data = source.read(name)
            if "/models/" in name and name.endswith(".json"):
                data = json.dumps(_without_traces(json.loads(data))).encode()
            content[name] = data
    return content


def _without_traces(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_traces(entry) for key, entry in value.items() if key != "stack_trace"}
    if isinstance(value, list):
        return [_without_traces(entry) for entry in value]
    return value
