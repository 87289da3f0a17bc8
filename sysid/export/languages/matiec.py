"""MATIEC, an open compiler of IEC 61131-3, which runs what is written for programmable controllers."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

from sysid.errors import ConfigError
from sysid.export.c.compiler import CompilerError, build_library, compiler

PROGRAM = "iec2c"


def matiec() -> tuple[Path, Path]:
    """The compiler, and the folder of its library.

    Returns:
        Both.

    Raises:
        ConfigError: If one of them is not there.
    """
    folder = os.environ.get("MATIEC", "")
    named = shutil.which(PROGRAM, path=folder) if folder else shutil.which(PROGRAM)
    if named:
        program = Path(named).resolve()
        for beside in ("lib", "../lib/matiec", "../share/matiec/lib", "../lib"):
            library = program.parent / beside
            if (library / "C" / "iec_std_lib.h").is_file():
                return program, library
    raise ConfigError(
        "the format st is compiled by MATIEC and run before it is published, and MATIEC is not there",
        expected="the program iec2c with its folder lib beside it",
        got=f"no such program in {folder}" if folder else "no such program",
        remedy="build https://github.com/beremiz/matiec, set MATIEC to its folder, or leave the format st out",
    )


def build(source: Path, folder: Path) -> Path:
    """Compile a function block to a shared library with a function ``run``.

    Args:
        source: The Structured Text.
        folder: Where to; ``harness.c``, which includes what MATIEC writes and calls it, is there.

    Returns:
        The library.

    Raises:
        ConfigError: If there is no compiler.
        CompilerError: If MATIEC or the C compiler refuses it.
    """
    program, library = matiec()
    compiler()
    (folder / "block.st").write_bytes(source.read_bytes())
    done = subprocess.run(  # noqa: S603 - the compiler on a file that we wrote
        [program, "-f", "-I", library, "-T", folder, folder / "block.st"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode or not (folder / "POUS.c").is_file():
        raise CompilerError(
            "MATIEC refuses the exported Structured Text",
            where=source.name,
            got=(done.stderr or done.stdout).strip()[-2000:],
            remedy="please report this",
        )
    build_library(["harness.c"], folder, "block.so", ["-O1", "-std=gnu99", "-w", f"-I{library / 'C'}"])
    return folder / "block.so"
