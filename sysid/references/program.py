"""An external program as a reference: a file of inputs in, a file of outputs out."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, SysidError
from sysid.ingest import FileOptions, RawTable, RepairOptions, read_table, write_trace
from sysid.references.config import PLACEHOLDER, ReferenceConfig
from sysid.references.kinds import RunError, checked, with_files
from sysid.traces import Channel, Trace
from sysid.units import convert

FILES = ("inputs", "outputs")


class ProgramReference:
    """A command line that reads ``{inputs}`` and writes ``{outputs}``.

    The file of inputs has a column ``time [s]`` and one for each input and parameter, with units in the header. The
    file of outputs needs a column for each output, by name, and as many rows; a unit in its header is heeded.

    Args:
        config: What it is.

    Raises:
        ConfigError: If the command passes no file, or names what is none of the parameters.
    """

    def __init__(self, config: ReferenceConfig) -> None:
        self.config = config
        self.command = config.program or ()
        asked = [name for word in self.command for name in PLACEHOLDER.findall(word)]
        known = (*FILES, *config.parameters, *config.constants)
        strangers = [name for name in asked if name not in known]
        missing = [name for name in FILES if name not in asked]
        if strangers or missing:
            raise ConfigError(
                "the command of the program cannot be filled in", where="program",
                expected="{inputs} and {outputs}, and no other braces than of " + ", ".join(known),
                got=" ".join(self.command), remedy="pass the two files, as in [solver, '{inputs}', '{outputs}']",
            )  # fmt: skip

    @property
    def digest(self) -> str:
        """Of the command, the files that stand in it, and those that are named beside it."""
        return with_files(repr(self.command), self.config, (*self.command, *self.config.files))

    def run(
        self, inputs: NDArray[np.float64], parameters: Mapping[str, float]
    ) -> tuple[NDArray[np.float64] | None, NDArray[np.float64]]:
        """Run it once; see :class:`sysid.references.kinds.Loaded`."""
        with tempfile.TemporaryDirectory(prefix="sysid-run-") as place:
            given, made = (Path(place) / f"{name}.{self.config.format}" for name in FILES)
            write_trace(self._trace(inputs, parameters), given)
            words = {"inputs": str(given), "outputs": str(made)} | {k: repr(float(v)) for k, v in parameters.items()}
            command = [PLACEHOLDER.sub(lambda found: words[found.group(1)], word) for word in self.command]
            try:
                # The command is a list that the user's YAML names; the time limit is the worker's, which ends us all.
                done = subprocess.run(command, cwd=self.config.folder, capture_output=True, check=False)  # noqa: S603
            except OSError as error:
                raise RunError(f"the program cannot be started: {error}") from None
            if done.returncode:
                said = (done.stderr or done.stdout).decode(errors="replace").strip().splitlines()[-1:]
                raise RunError(f"the program ended with exit code {done.returncode}{': ' + said[0] if said else ''}")
            if not made.is_file():
                raise RunError("the program wrote no file of outputs")
            return None, checked(self._read(made), self.config, len(inputs))

    def _trace(self, inputs: NDArray[np.float64], parameters: Mapping[str, float]) -> Trace:
        config = self.config
        columns = [*inputs.T, *(np.full(len(inputs), parameters[name]) for name in config.parameters)]
        units = [(name, port.unit) for name, port in config.inputs.items()]
        units += [(name, port.unit) for name, port in config.parameters.items()]
        channels = tuple(Channel(name=name, unit=unit) for name, unit in units)
        return Trace(name="run", sample_time=config.sample_time, channels=channels, values=np.column_stack(columns))

    def _read(self, file: Path) -> NDArray[np.float64]:
        try:
            table: RawTable = read_table(file, files=FileOptions(), repairs=RepairOptions())
        except SysidError as error:
            raise RunError(f"what the program wrote cannot be read: {error.what}") from None
        missing = [name for name in self.config.outputs if name not in table.names]
        if missing:
            raise RunError(f"the program wrote no column {missing[0]}, only {', '.join(table.names)}")
        return np.column_stack([self._column(table, name) for name in self.config.outputs])

    def _column(self, table: RawTable, name: str) -> NDArray[np.float64]:
        column, unit = table.find(name), self.config.outputs[name].unit
        if not column.unit or column.unit == unit:
            return column.values
        try:
            return convert(column.values, column.unit, unit)
        except SysidError:
            raise RunError(f"the program wrote {name} in {column.unit}, where {unit} was expected") from None
