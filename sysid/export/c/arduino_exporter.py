"""An Arduino library, which PlatformIO takes too: the C source in float32, with what their tools read, in a zip."""

from __future__ import annotations

import json
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from sysid.export.archive import write_archive
from sysid.export.c.compiler import compiler
from sysid.export.c.exporter import CExporter
from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Runner
from sysid.export.surrogate import Surrogate
from sysid.export.templating import render

VERSION = "1.0.0"
"""Of every library: the tools want one, and a bundle has none."""


@dataclass(frozen=True, kw_only=True)
class ArduinoExporter(AbstractExporter):
    """Writes ``<name>_arduino.zip``, for *Add .ZIP Library* and for ``lib_deps``.

    Args:
        name: Name in the table.
    """

    begins: ClassVar[bool] = True
    searches: ClassVar[bool] = True

    name: str = "arduino"

    def check(self) -> None:
        """Look for a compiler: what is written is built and run before it is published."""
        compiler()

    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Write the zip."""
        from sysid.export.c.source import c_files

        prefix = surrogate.identifier
        macro = f"{prefix.upper()}_FLOAT"
        files = c_files(surrogate)
        # Whoever compiles a library there sets no macros, and the processors compute in float32.
        files[f"{prefix}.h"] = files[f"{prefix}.h"].replace(
            "#include <stddef.h>\n", f"#define {macro}\n#include <stddef.h>\n", 1
        )
        sketch = render("sketch.ino.j2", s=surrogate, p=prefix, P=prefix.upper())
        content = {f"{prefix}/src/{name}": text for name, text in files.items()}
        content |= {f"{prefix}/examples/{prefix}_serial/{prefix}_serial.ino": sketch, **_descriptions(surrogate)}
        name = f"{prefix}_arduino.zip"
        write_archive(folder / name, {path: text.encode() for path, text in content.items()})
        details = {"prefix": prefix, "n_outputs": len(surrogate.outputs), "float32_macro": macro}
        details["n_state"] = surrogate.state_length(np.float32)
        file = ExportedFile(name=name, format=self.name, kind=Kind.SEQUENCE, dtype="float32", details=details)
        return (file,)

    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Build the library's source with this machine's compiler, and call it."""
        prefix = file.details["prefix"]
        source, header = (f"{prefix}.{end}" for end in ("c", "h"))
        with tempfile.TemporaryDirectory() as workplace, zipfile.ZipFile(folder / file.name) as library:
            for name in (source, header):
                (Path(workplace) / name).write_bytes(library.read(f"{prefix}/src/{name}"))
            plain = ExportedFile(
                name=source,
                format=self.name,
                kind=file.kind,
                dtype=file.dtype,
                # The header says so by itself.
                details={**file.details, "float32_macro": "SYSID_NOTHING"},
                companions=(header,),
            )
            return CExporter().load(plain, Path(workplace))


def _descriptions(surrogate: Surrogate) -> dict[str, str]:
    """What the tools read: of Arduino, then of PlatformIO."""
    prefix = surrogate.identifier
    sentence = f"A frozen surrogate: {surrogate.mapping}, a sample every {surrogate.sample_time:g} s."
    properties = {
        "name": prefix,
        "version": VERSION,
        "author": "sysid-workbench",
        "maintainer": "sysid-workbench",
        "sentence": " ".join(sentence.split()),
        "paragraph": "It allocates nothing and keeps nothing but its state. Written by sysid-workbench.",
        "category": "Data Processing",
        "url": "https://pypi.org/project/sysid-workbench",
        "architectures": "*",
        "includes": f"{prefix}.h",
    }
    library = {
        "name": prefix,
        "version": VERSION,
        "description": properties["sentence"],
        "frameworks": "*",
        "platforms": "*",
        "headers": properties["includes"],
    }
    return {
        f"{prefix}/library.properties": "".join(f"{key}={value}\n" for key, value in properties.items()),
        f"{prefix}/library.json": json.dumps(library, indent=2) + "\n",
    }
