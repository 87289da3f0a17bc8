"""TorchScript: for hosts that embed libtorch. Deprecated by its makers; ONNX is the format to prefer."""

from __future__ import annotations

import io
import warnings
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Run, Runner, given, step_by_step
from sysid.export.surrogate import Surrogate


@contextmanager
def _deprecation_known() -> Iterator[None]:
    """Keep quiet about what the module's docstring says: torch.jit is deprecated in favour of torch.export."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=r"`torch\.jit\.", category=DeprecationWarning)
        yield


def _forget_scripted_classes() -> None:
    """Have torch number classes from the beginning.

    It numbers those that it has scripted before in the process (``___torch_mangle_5``), and the numbers are in the
    file: a second export would have other bytes than the first. Torch's own tests do this before each test; modules
    that are scripted already keep their classes.
    """
    import torch

    torch._C._jit_clear_class_registry()
    torch.jit._recursive.concrete_type_store = torch.jit._recursive.ConcreteTypeStore()
    torch.jit._state._clear_class_state()


@dataclass(frozen=True, kw_only=True)
class TorchScriptExporter(AbstractExporter):
    """Writes ``step.torchscript.pt`` and ``sequence.torchscript.pt``, zip files of code and tensors."""

    packages: ClassVar[tuple[str, ...]] = ("torch",)

    name: str = "torchscript"

    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Script both modules and save them."""
        import torch

        from sysid.export.torch.equations import EquationStep
        from sysid.export.torch.module import SurrogateSequence, SurrogateStep

        _forget_scripted_classes()
        files = []
        for kind, module in ((Kind.STEP, SurrogateStep(surrogate)), (Kind.SEQUENCE, SurrogateSequence(surrogate))):
            name = f"{kind.value}.torchscript.pt"
            buffer = io.BytesIO()
            with _deprecation_known():
                for stage in (part for part in module.modules() if isinstance(part, EquationStep)):
                    stage.traced()
                torch.jit.save(torch.jit.script(module.eval()), buffer)
            (folder / name).write_bytes(reproducible_archive(buffer.getvalue()))
            details = {"torch": torch.__version__.partition("+")[0]}
            files.append(ExportedFile(name=name, format=self.name, kind=kind, details=details))
        return tuple(files)

    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Load the file on the CPU. TorchScript code can compute, but not reach the file system or network."""
        self.check()
        import torch

        with _deprecation_known():
            module = torch.jit.load(folder / file.name, map_location="cpu")  # type: ignore[no-untyped-call]  # torch.jit has no types

        run = run_of(module)
        return run if file.kind is Kind.SEQUENCE else step_by_step(run)


def run_of(module: Callable[[Any, Any], Any]) -> Runner:
    """A loaded module as what a bundle's files are run by.

    Args:
        module: From inputs and state to output, next state and flags.

    Returns:
        The same of arrays.
    """
    import torch

    def run(inputs: NDArray[Any], state: NDArray[Any] | None) -> Run:
        with torch.inference_mode():
            output, state_out, flags = module(
                torch.from_numpy(np.ascontiguousarray(inputs)), torch.from_numpy(np.ascontiguousarray(given(state)))
            )
        return Run(output=output.numpy(), state=state_out.numpy(), flags=flags.numpy()[..., 0])

    return run


def reproducible_archive(archive: bytes) -> bytes:
    """The same archive without what belongs to the machine that wrote it.

    Beside the code torch stores its source lines with the path of this checkout (``.debug_pkl``), and a hash over
    them (``serialization_id``); neither is read when the file is loaded.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(archive)) as source, zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as target:
        for entry in source.infolist():
            if entry.filename.endswith((".debug_pkl", "/serialization_id")):
                continue
            plain = zipfile.ZipInfo(entry.filename)
            plain.create_system = 0  # otherwise it tells the operating system
            target.writestr(plain, source.read(entry))
    return buffer.getvalue()
