"""IEC 61131-3 Structured Text: a function block for programmable controllers."""

from __future__ import annotations

import ctypes
import re
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import sysid
from sysid.export.c.exporter import caller
from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Runner
from sysid.export.flags import MEANING, Flag
from sysid.export.forms.operations import pieces
from sysid.export.forms.programs import Listing, ProgramForm
from sysid.export.languages.matiec import build, matiec
from sysid.export.languages.plain_source import plain_stage, program_lines, rest_values, tables
from sysid.export.surrogate import Surrogate
from sysid.export.templating import render
from sysid.names import c_comment

WIDTH = 100
FUNCTIONS = ("tanh", "least", "greatest", "root", "sign", "above", "not_below", "choice")


class StructuredTextExporter(AbstractExporter):
    """Writes ``<name>.st``: a function block of LREAL numbers and the functions that it calls."""

    name = "st"
    begins = True

    def check(self) -> None:
        """Look for MATIEC: what is written is compiled and run before it is published."""
        matiec()

    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Write the function block."""
        name = f"{surrogate.identifier}.st"
        (folder / name).write_text(_text(surrogate), encoding="ascii", newline="\n")
        details = {
            "function_block": block_of(surrogate),
            "inputs": [f"in_{port.identifier}" for port in surrogate.inputs],
            "outputs": [f"out_{port.identifier}" for port in surrogate.outputs],
            "n_outputs": len(surrogate.outputs),
            "n_state": surrogate.state_size,
        }
        return (ExportedFile(name=name, format=self.name, kind=Kind.STEP, details=details),)

    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Compile the block by MATIEC and this machine's compiler, and call it."""
        with tempfile.TemporaryDirectory() as workplace:
            (Path(workplace) / "harness.c").write_text(
                render("st_harness.c.j2", **{"block": file.details["function_block"].upper(), **file.details}),
                encoding="utf-8",
            )
            library = ctypes.CDLL(str(build(folder / file.name, Path(workplace))))
        return caller(library.go_on, library.from_rest, file)


def block_of(surrogate: Surrogate) -> str:
    """The name of the function block."""
    return f"fb_{surrogate.identifier}"


def _text(surrogate: Surrogate) -> str:
    stages = [plain_stage(stage) for stage in surrogate.stages]
    own, prefix = tables(surrogate), surrogate.identifier
    functions = {name: f"{prefix}_{name}" for name in FUNCTIONS}
    for stage in stages:
        form = stage["form"]
        listings = form.run if isinstance(form, ProgramForm) else {}
        stage["programs"] = {
            name: _program(one, functions, {points: f"{prefix}_table{at}" for points, at in own.items()})
            for name, one in listings.items()
        }
        stage["active"] = stage["neuron"].st.format(x="a", **functions)
    lengths = [len(program["lines"]) for stage in stages for program in stage["programs"].values()]
    starts = np.array([port.start for port in surrogate.inputs])
    values = {
        "s": surrogate,
        "p": prefix,
        "block": block_of(surrogate),
        "version": sysid.__version__,
        "stages": stages,
        "longest": max(lengths, default=0),
        "sizes": _sizes(stages),
        "starting": surrogate.at_rest(starts),
        "Flag": Flag,
        "meaning": MEANING,
        "number": _number,
        "array": _array,
        "columns": lambda rows: np.array(rows).T,
        "words": _words,
        **rest_values(surrogate),
    }
    body = _unrolled(render("block.st.j2", **values))
    used = [name for name in FUNCTIONS if re.search(rf"\b{functions[name]}\(", body)]
    pieced = [(at, points, list(zip(*pieces(points), strict=True))) for points, at in own.items()]
    return render("functions.st.j2", p=prefix, used=used, tables=pieced, number=_number) + body


def _unrolled(text: str) -> str:
    """The block with every loop of a single pass written out: MATIEC of October 2024 does not run those."""
    lines, single = [], []
    for line in text.splitlines():
        loop = re.match(r"( *)FOR (\w+) := (\d+) TO (\d+)(?: BY -1)? DO", line)
        if loop:
            single.append(loop[3] == loop[4])
            lines.append(f"{loop[1]}{loop[2]} := {loop[3]};" if single[-1] else line)
        elif line.strip() != "END_FOR;" or not single.pop():
            lines.append(line)
    return "\n".join(lines) + "\n"


def _program(listing: Listing, functions: dict[str, str], named: dict[Any, str]) -> dict[str, Any]:
    lines, results = program_lines(
        listing,
        lambda one: one.st,
        number=_number,
        first=0,
        points=lambda points: named.get(points, ""),
        functions=functions,
    )
    return {"lines": lines, "results": results}


def _sizes(stages: Sequence[dict[str, Any]]) -> dict[str, int]:
    """The longest that each array of the block has to be."""
    found = {"x": 1, "u": 1, "y": 1, "scaled": 1, "after": 1}
    for stage in stages:
        form = stage["form"]
        hidden = 0 if stage["kind"] == "lagged" else form.n_state
        lengths = {
            "x": len(stage["columns"]) if stage["kind"] == "lagged" else hidden + stage["n"],
            "u": len(stage.get("given", ())) + getattr(form, "ahead", False),
            "y": len(stage["outputs"]),
            "scaled": len(stage["scaled"]),
            "after": hidden,
        }
        found = {name: max(length, lengths[name]) for name, length in found.items()}
    return found


def _number(value: float) -> str:
    """A number as IEC 61131-3 writes it, which reads back as the same: always with a point."""
    mantissa, mark, exponent = repr(float(value)).partition("e")
    mantissa = mantissa if "." in mantissa else f"{mantissa}.0"
    text = f"{mantissa}E{int(exponent)}" if mark else mantissa
    return f"({text})" if text.startswith("-") else text


def _array(values: Iterable[float]) -> str:
    """Numbers of an array, row by row, in as many lines as they need."""
    lines, line = [], ""
    for text in (_number(value).strip("()") for value in np.asarray(values, dtype=np.float64).ravel()):
        if line and len(line) + len(text) > WIDTH:
            lines.append(line)
            line = ""
        line += f"{text}, "
    return ",\n      ".join(one.rstrip(", ") for one in [*lines, line])


def _words(text: object) -> str:
    """Text that can neither end a comment nor begin one, in letters that every editor of controllers has."""
    plain = c_comment(text).encode("ascii", "replace").decode()
    return plain.replace("(*", "( *").replace("*)", "* )")
