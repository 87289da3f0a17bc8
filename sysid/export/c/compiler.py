"""The machine's C compiler: it builds what an exporter writes, so that it can be run and packed."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from sysid.errors import ConfigError, SysidError
from sysid.extras import has

WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-pedantic")
"""What the exported source is clean under."""
FLAGS = ("-O2", "-fPIC", "-shared")
LANGUAGES = {"c": ("CC", ("cc", "gcc", "clang"), "-std=c99"), "c++": ("CXX", ("c++", "g++", "clang++"), "-std=c++11")}
"""Of each the variable that chooses a compiler, those that are looked for, and the standard."""
ZIG = (sys.executable, "-m", "ziglang", "cc")
"""Clang with the headers and libraries of every machine, from PyPI."""


class CompilerError(SysidError):
    """C that we wrote and that the compiler refuses."""


NEEDS = {"c": "the formats c, arduino, fmi2 and fmi3 need a C compiler", "c++": "the format cpp needs a C++ compiler"}


def compiler(language: str = "c") -> list[str]:
    """The command of the compiler: ``CC`` (for C++ ``CXX``) if it is set, otherwise the first that is there.

    Args:
        language: ``"c"`` or ``"c++"``.

    Returns:
        The command, as words.

    Raises:
        ConfigError: If there is none.
    """
    variable, names, _ = LANGUAGES[language]
    chosen = shlex.split(os.environ.get(variable, ""))
    found = [chosen] if chosen else [[name] for name in names]
    for command in found:
        if shutil.which(command[0]):
            return command
    if not chosen and has("ziglang"):
        return [*ZIG[:-1], "cc" if language == "c" else "c++", *CROSS]
    raise ConfigError(
        f"{NEEDS[language]}, which is not there",
        expected=" or ".join(command[0] for command in found),
        got="no such program",
        remedy=f"install gcc or clang, set {variable}, or leave these formats out",
    )


CROSS = ("-s", "-fno-sanitize=undefined")
"""For other machines: without what only a debugger reads, and without the checks that this compiler builds in."""


def build_library(
    sources: Sequence[str],
    folder: Path,
    output: str,
    flags: Sequence[str] = (),
    *,
    target: str | None = None,
    language: str = "c",
) -> None:
    """Build a shared library; the same bytes wherever the folder lies.

    Args:
        sources: File names in the folder.
        folder: Where they lie, and where the library goes.
        output: Its file name.
        flags: More flags of the compiler.
        target: A machine that it is built for, by the compiler of the extra ``fmu-cross``; this one by default.
        language: ``"c"`` or ``"c++"``.

    Raises:
        ConfigError: If there is no compiler.
        CompilerError: If it reports an error.
    """
    chosen = compiler(language) if target is None else [*ZIG, "-target", target, *CROSS]
    command = [*chosen, LANGUAGES[language][2], *FLAGS, *flags, "-o", output, *sources, "-lm"]
    _compile(command, folder, ", ".join(sources))


def build_module(source: str, folder: Path) -> bytes:
    """Build a module of WebAssembly that imports nothing.

    Args:
        source: File name in the folder; what it marks as exported is.
        folder: Where it lies.

    Returns:
        The module.

    Raises:
        CompilerError: If the compiler, that of the extra ``wasm``, reports an error.
    """
    flags = ("-target", "wasm32-wasi", "-mexec-model=reactor", *CROSS, "-std=c99", "-O2")
    _compile([*ZIG, *flags, "-o", "module.wasm", source, "-lm"], folder, source)
    return (folder / "module.wasm").read_bytes()


def _compile(command: Sequence[str], folder: Path, what: str) -> None:
    done = subprocess.run(  # noqa: S603 - a compiler on files that we wrote
        command, cwd=folder, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise CompilerError(
            "the compiler refuses the exported C source",
            where=what,
            got=done.stderr.strip()[-2000:],
            remedy="please report this with the compiler's name and version",
        )
