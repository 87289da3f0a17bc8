"""MATLAB and GNU Octave: functions of plain code, without a toolbox."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sysid
from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Run, Runner
from sysid.export.flags import MEANING, Flag
from sysid.export.forms.programs import ProgramForm
from sysid.export.languages.octave import octave, session
from sysid.export.languages.plain_source import plain_stage, program_lines, rest_values
from sysid.export.surrogate import Surrogate
from sysid.export.templating import render
from sysid.names import c_comment, shortened

LONGEST_PREFIX = 58
"""Characters; names of MATLAB's functions have 63 at most, and ours end with ``_step``."""
WIDTH = 110
FUNCTIONS = ("least", "greatest", "root", "logarithm", "power_of", "choice", "table_at")


class MatlabExporter(AbstractExporter):
    """Writes ``<name>_run.m``, and beside it ``<name>_step.m`` and ``<name>_rest.m``."""

    name = "matlab"
    begins = True

    def check(self) -> None:
        """Look for Octave: what is written is run before it is published."""
        octave()

    def write(self, surrogate: Surrogate, folder: Path) -> tuple[ExportedFile, ...]:
        """Write the three functions."""
        prefix = prefix_of(surrogate)
        names = [f"{prefix}_{what}.m" for what in ("run", "step", "rest")]
        for name, text in zip(names, _texts(surrogate, prefix), strict=True):
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
        details = {"prefix": prefix, "n_outputs": len(surrogate.outputs)}
        run, *companions = names
        file = ExportedFile(
            name=run, format=self.name, kind=Kind.SEQUENCE, details=details, companions=tuple(companions)
        )
        return (file,)

    def load(self, file: ExportedFile, folder: Path) -> Runner:
        """Give the functions to Octave, which runs one car after the other."""
        process = session()
        place = process.add([folder / name for name in (file.name, *file.companions)])
        function, n_outputs = f"{file.details['prefix']}_run", file.details["n_outputs"]

        def run(inputs: NDArray[Any], state: NDArray[Any] | None) -> Run:
            begun = [None] * inputs.shape[1] if state is None else list(state)
            cars = [process.run(place, function, inputs[:, car], one, n_outputs) for car, one in enumerate(begun)]
            y, after, flags = (np.stack(parts) for parts in zip(*cars, strict=True))
            return Run(output=y.transpose(1, 0, 2), state=after, flags=flags.T.astype(np.int32))

        return run


def prefix_of(surrogate: Surrogate) -> str:
    """What the functions' names begin with: a letter first, and short enough for MATLAB."""
    return shortened(surrogate.identifier, LONGEST_PREFIX, "_")


def _texts(surrogate: Surrogate, prefix: str) -> list[str]:
    stages = [plain_stage(stage) for stage in surrogate.stages]
    for stage in stages:
        listings = stage["form"].run if isinstance(stage["form"], ProgramForm) else {}
        stage["programs"] = {name: _program(one) for name, one in listings.items() if one.results}
    values = {
        "s": surrogate,
        "p": prefix,
        "version": sysid.__version__,
        "stages": stages,
        "Flag": Flag,
        "meaning": MEANING,
        "row": _row,
        "matrix": _matrix,
        "number": _number,
        "places": _places,
        "tables": _tables,
        "words": c_comment,
        **rest_values(surrogate),
    }
    step = render("step.m.j2", **values)
    used = [name for name in FUNCTIONS if re.search(rf"\b{name}\(", step)]
    return [render("run.m.j2", **values), step + render("functions.m.j2", used=used), render("rest.m.j2", **values)]


def _tables(stage: dict[str, Any]) -> list[tuple[str, NDArray[np.float64]]]:
    """The constants of a stage, by name."""
    form = stage["form"]
    if stage["kind"] == "lagged":
        found = {"constant": form.constant}
        if form.linear.any():
            found["linear"] = form.linear
        if form.neurons:
            found |= {"bias": form.hidden_bias, "weights": form.hidden_weights, "readout": form.readout}
        return [*found.items(), *([("gates", form.gates)] if form.gated else [])]
    found = {"constant": form.constant, "readout": form.readout}
    if form.n_state:
        found |= {"drift": form.drift, "change": form.change}
    for side, layer in (("output", form.output_neurons), ("state", form.state_neurons)):
        if len(layer):
            found |= {f"{side}_bias": layer.bias, f"{side}_weights": layer.weights, f"{side}_readout": layer.readout}
    return list(found.items())


def _program(listing: Any) -> dict[str, Any]:
    lines, results = program_lines(listing, lambda one: one.matlab, number=_number, first=1, points=_points)
    return {"lines": lines, "results": results}


def _points(points: Sequence[Sequence[float]]) -> str:
    return f"[{'; '.join(_row(point) for point in points)}]"


def _number(value: float) -> str:
    """A number that reads back as the same; one below zero in brackets, for what is raised to a power."""
    text = repr(float(value))
    return f"({text})" if text.startswith("-") else text


def _row(values: Iterable[float]) -> str:
    """Numbers side by side."""
    return _wrapped(repr(float(value)) for value in values)


def _places(columns: Iterable[int]) -> str:
    """Places that count from 0, side by side as places that count from 1."""
    return _wrapped(str(int(column) + 1) for column in columns)


def _wrapped(texts: Iterable[str]) -> str:
    """Texts side by side, in as many lines as they need."""
    lines, line = [], ""
    for text in texts:
        if line and len(line) + len(text) > WIDTH:
            lines.append(line)
            line = ""
        line += f"{text}, "
    return ", ...\n        ".join(one.rstrip(", ") for one in [*lines, line])


def _matrix(table: NDArray[np.float64]) -> str:
    """A matrix row by row; an empty one keeps its shape, and a vector is a column."""
    table = np.asarray(table, dtype=np.float64)
    table = table.reshape(len(table), -1) if table.ndim == 1 else table
    if not table.size:
        return f"zeros({table.shape[0]}, {table.shape[1]})"
    if table.shape[1] == 1:
        return f"[{_row(table[:, 0])}].'"
    return "[" + "; ...\n        ".join(_row(row) for row in table) + "]"
