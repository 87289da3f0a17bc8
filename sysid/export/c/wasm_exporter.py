"""WebAssembly: the C source as a module for browsers and servers, and a page that runs it by sliders."""

from __future__ import annotations

import base64
import json
import tempfile
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sysid.export.c.compiler import build_module
from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Run, Runner
from sysid.export.flags import MEANING
from sysid.export.forms.stage import Port
from sysid.export.surrogate import Surrogate
from sysid.export.templating import render


class WasmExporter(AbstractExporter):
    """Writes ``<name>.wasm``, which imports nothing, and ``<name>.html``, which holds it."""

    name = "wasm"
    begins = searches = True
    packages: ClassVar[tuple[str, ...]] = ("wasmtime", "ziglang")

    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Compile the C source, and write the page around it."""
        from sysid.export.c.source import c_files

        prefix = surrogate.identifier
        names = {"p": prefix, "P": prefix.upper()}
        with tempfile.TemporaryDirectory() as workplace:
            for name, text in (c_files(surrogate) | {"module.c": render("wasm.c.j2", **names)}).items():
                (Path(workplace) / name).write_text(text, encoding="utf-8", newline="\n")
            module = build_module("module.c", Path(workplace))
        (folder / f"{prefix}.wasm").write_bytes(module)
        page = render("wasm.html.j2", data=_text(_about(surrogate, module)))
        (folder / f"{prefix}.html").write_text(page, encoding="utf-8", newline="\n")
        details = {"imports": [], "exports": ["memory", "init", "step", "inputs", "outputs", "state"]}
        file = ExportedFile(
            name=f"{prefix}.wasm", format=self.name, kind=Kind.STEP, details=details, companions=(f"{prefix}.html",)
        )
        return (file,)

    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Load the module into Wasmtime; it has no way out of its own memory."""
        self.check()
        import wasmtime

        store = wasmtime.Store()
        module = wasmtime.Module(store.engine, (folder / file.name).read_bytes())
        exports: Any = wasmtime.Instance(store, module, []).exports(store)
        memory, begin, step = exports["memory"], exports["init"], exports["step"]
        places = {name: exports[name](store) for name in ("inputs", "outputs", "state")}
        n_outputs, n_state = exports["n_outputs"](store), exports["n_state"](store)

        def write(values: NDArray[np.float64], place: str) -> None:
            memory.write(store, np.ascontiguousarray(values, dtype=np.float64).tobytes(), places[place])

        def read(place: str, length: int) -> NDArray[np.float64]:
            at = places[place]
            return np.frombuffer(bytes(memory.read(store, at, at + 8 * length)), dtype=np.float64)

        def run(inputs: NDArray[Any], state: NDArray[Any] | None) -> Run:
            n_samples, n_cars, _ = inputs.shape
            y, after = np.empty((n_samples, n_cars, n_outputs)), np.empty((n_cars, n_state))
            flags = np.empty((n_samples, n_cars), dtype=np.int32)
            for car in range(n_cars):
                if state is None:
                    write(inputs[0, car], "inputs")
                    begin(store)
                else:
                    write(state[car], "state")
                for i in range(n_samples):
                    write(inputs[i, car], "inputs")
                    flags[i, car] = step(store)
                    y[i, car] = read("outputs", n_outputs)
                after[car] = read("state", n_state)
            return Run(output=y, state=after, flags=flags)

        return run


def _about(surrogate: Surrogate, module: bytes) -> dict[str, Any]:
    """What the page shows."""
    return {
        "title": surrogate.mapping,
        "text": f"{surrogate.label}. One sample every {surrogate.sample_time:g} s, in real time, in this browser.",
        "sample_time": surrogate.sample_time,
        "inputs": [_slider(port) for port in surrogate.inputs],
        "outputs": [{"name": port.name, "unit": port.unit} for port in surrogate.outputs],
        "flags": [{"bit": int(flag), "text": text} for flag, text in MEANING.items()],
        "wasm": base64.b64encode(module).decode(),
    }


def _slider(port: Port) -> dict[str, Any]:
    """An input with the ends of its slider: its declared range, or a unit to both sides of its start."""
    low, high = port.range or (port.start - 1.0, port.start + 1.0)
    return {"name": port.name, "unit": port.unit, "low": low, "high": high, "start": port.start}


def _text(about: dict[str, Any]) -> str:
    """JSON that no name can end: within a script, markup is plain text but for ``<``."""
    return json.dumps(about).replace("<", "\\u003c")
