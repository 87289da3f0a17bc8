"""C99: for everything that has a compiler and nothing else, from micro-controllers to real-time targets."""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sysid.export.c.compiler import build_library, compiler
from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Run, Runner, with_remainders
from sysid.export.surrogate import Surrogate


@dataclass(frozen=True, kw_only=True)
class CExporter(AbstractExporter):
    """Writes a source and its header, which compute in float64, or in float32 when a macro is set.

    Args:
        name: Name in the table.
        dtype: The number type in which the source is run against the model; the files are the same for both.
    """

    begins: ClassVar[bool] = True
    searches: ClassVar[bool] = True

    name: str = "c"
    dtype: str = "float64"

    def check(self) -> None:
        """Look for a compiler: what is written is built and run before it is published."""
        compiler()

    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Write both files."""
        from sysid.export.c.source import c_files

        for name, text in c_files(surrogate).items():
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
        prefix = surrogate.identifier
        details = {
            "standard": "C99",
            "prefix": prefix,
            "n_outputs": len(surrogate.outputs),
            "n_state": surrogate.state_length(self.dtype),
            "float32_macro": f"{prefix.upper()}_FLOAT",
        }
        file = ExportedFile(
            name=f"{prefix}.c",
            format=self.name,
            kind=Kind.SEQUENCE,
            dtype=self.dtype,
            details=details,
            companions=(f"{prefix}.h",),
        )
        return (file,)

    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Build the source with this machine's compiler, and call it."""
        prefix = file.details["prefix"]
        library = _library(file, folder)
        function, begin = library[f"{prefix}_run"], library[f"{prefix}_init"]

        def from_rest(state: Any, n_samples: Any, inputs: Any, *others: Any) -> None:
            begin(state, inputs, None)
            function(state, n_samples, inputs, *others)

        return caller(function, from_rest, file)


def _library(file: ExportedFile, folder: Path) -> ctypes.CDLL:
    flags = [f"-D{file.details['float32_macro']}"] if file.dtype == "float32" else []
    with tempfile.TemporaryDirectory() as workplace:
        for name in (file.name, *file.companions):
            (Path(workplace) / name).write_bytes((folder / name).read_bytes())
        build_library([file.name], Path(workplace), "surrogate.so", flags)
        # The loader keeps what it has mapped, so that the file may go.
        return ctypes.CDLL(str(Path(workplace) / "surrogate.so"))


def caller(function: Callable[..., Any], from_rest: Callable[..., Any], file: ExportedFile) -> Runner:
    """A compiled run, as the contract of exporters has it.

    Args:
        function: ``(state, n_samples, inputs, outputs, flags)``, of one car.
        from_rest: The same, which sets the state itself.
        file: What it was built from; its details tell how many outputs and numbers of the state there are.

    Returns:
        The runner.
    """
    dtype, n_outputs = np.dtype(file.dtype), file.details["n_outputs"]

    def run(inputs: NDArray[Any], state: NDArray[Any] | None) -> Run:
        n_samples, n_cars, _ = inputs.shape
        before = np.zeros((n_cars, 0)) if state is None else state
        after = np.array(with_remainders(before, file.details["n_state"]), dtype=dtype, order="C")
        walked = from_rest if state is None else function
        u = np.ascontiguousarray(inputs.transpose(1, 0, 2), dtype=dtype)
        y = np.empty((n_cars, n_samples, n_outputs), dtype=dtype)
        flags = np.empty((n_cars, n_samples), dtype=np.uint32)
        for car in range(n_cars):
            places = [ctypes.c_void_p(array[car].ctypes.data) for array in (after, u, y, flags)]
            walked(places[0], ctypes.c_size_t(n_samples), *places[1:])
        return Run(output=y.transpose(1, 0, 2), state=after, flags=flags.T.astype(np.int32))

    return run
