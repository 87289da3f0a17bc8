"""C++: the C source in one header, with a class around it."""

from __future__ import annotations

import ctypes
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from sysid.export.c.compiler import build_library, compiler
from sysid.export.c.exporter import caller
from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Runner
from sysid.export.surrogate import Surrogate
from sysid.export.templating import render

SHIM = """#define {P}_IMPLEMENTATION
#include "{p}.hpp"
static unsigned int
run_by_class(bool fresh, {p}_real *state, size_t n, const {p}_real *u, {p}_real *y, unsigned int *flags)
{{
    {p}::Surrogate model(u);
    if (!fresh)
        std::memcpy(static_cast<void *>(&model.state()), state, sizeof model.state());
    const unsigned int raised = model.run(n, u, y, flags);
    std::memcpy(state, &model.state(), sizeof model.state());
    return raised;
}}
extern "C" unsigned int go_on({p}_real *state, size_t n, const {p}_real *u, {p}_real *y, unsigned int *flags)
{{
    return run_by_class(false, state, n, u, y, flags);
}}
extern "C" unsigned int from_rest({p}_real *state, size_t n, const {p}_real *u, {p}_real *y, unsigned int *flags)
{{
    return run_by_class(true, state, n, u, y, flags);
}}
"""


@dataclass(frozen=True, kw_only=True)
class CppExporter(AbstractExporter):
    """Writes ``<name>.hpp``: implementation, plain functions and a class.

    Args:
        name: Name in the table.
    """

    begins: ClassVar[bool] = True
    searches: ClassVar[bool] = True

    name: str = "cpp"

    def check(self) -> None:
        """Look for a compiler: what is written is built and run before it is published."""
        compiler("c++")

    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Write the header."""
        from sysid.export.c.source import c_files

        prefix = surrogate.identifier
        files = c_files(surrogate)
        header, source = (files[f"{prefix}.{end}"] for end in ("h", "c"))
        source = source.replace(f'#include "{prefix}.h"\n', "", 1)
        text = render(
            "surrogate.hpp.j2",
            s=surrogate,
            p=prefix,
            P=prefix.upper(),
            header=header,
            source=source + _undefined(source),
        )
        (folder / f"{prefix}.hpp").write_text(text, encoding="utf-8", newline="\n")
        details = {"standard": "C++98", "prefix": prefix, "n_outputs": len(surrogate.outputs)}
        details["n_state"] = surrogate.state_size
        return (ExportedFile(name=f"{prefix}.hpp", format=self.name, kind=Kind.SEQUENCE, details=details),)

    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Build a program around the class, and call it."""
        prefix = file.details["prefix"]
        with tempfile.TemporaryDirectory() as workplace:
            (Path(workplace) / file.name).write_bytes((folder / file.name).read_bytes())
            (Path(workplace) / "shim.cpp").write_text(
                "#include <cstring>\n" + SHIM.format(p=prefix, P=prefix.upper()), encoding="utf-8"
            )
            build_library(["shim.cpp"], Path(workplace), "surrogate.so", language="c++")
            # The loader keeps what it has mapped, so that the file may go.
            library = ctypes.CDLL(str(Path(workplace) / "surrogate.so"))
        return caller(library.go_on, library.from_rest, file)


def _undefined(source: str) -> str:
    """The end of an implementation: macros are forgotten, whose names who includes it may use."""
    words = [line.split()[1].partition("(")[0] for line in source.splitlines() if line.startswith("#define ")]
    return "".join(f"#undef {word}\n" for word in dict.fromkeys(words))
