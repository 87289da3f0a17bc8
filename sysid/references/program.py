"""An external program as a reference: a file of inputs in, a file of outputs out."""

from __future__ import annotations

import signal
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import SysidError
from sysid.ingest import FileOptions, RawTable, RepairOptions, read_table
from sysid.ingest.writers import write_csv, write_parquet
from sysid.references.config import FILES, PLACEHOLDER, ReferenceConfig
from sysid.references.kinds import RunError, checked, with_files
from sysid.traces import Channel, Trace
from sysid.units import convert

UNEVEN = 0.01
"""Share of a sample by which a program's own times may be off, as rounded ones are."""
TAIL = 2000
"""Bytes of what a program says of which the last line is told."""


class ProgramReference:
    """A command line that reads ``{inputs}`` and writes ``{outputs}``.

    The file of inputs has a column ``time [s]`` and one for each input and parameter, with units in the header. The
    file of outputs needs a column for each output, by name, and as many rows; a unit in its header is heeded.

    Args:
        config: What it is.
    """

    def __init__(self, config: ReferenceConfig) -> None:
        self.config = config
        self.command = config.program or ()

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
            trace = self._trace(inputs, parameters)
            # Somebody's program reads it: the first line is the header, as everywhere.
            write_csv(trace, given, plain=True) if self.config.format == "csv" else write_parquet(trace, given)
            words = {"inputs": str(given), "outputs": str(made)} | {k: repr(float(v)) for k, v in parameters.items()}
            command = [PLACEHOLDER.sub(lambda found: words[found.group(1)], word) for word in self.command]
            self._do(command, Path(place))
            if not made.is_file():
                raise RunError("the program wrote no file of outputs, to the path that stands for {outputs}")
            return None, checked(self._read(made), self.config, len(inputs))

    def _do(self, command: Sequence[str], place: Path) -> None:
        """Run the command until it ends, whatever it leaves running: what it says goes to files, not to who waits."""
        said = [place / name for name in ("stderr", "stdout")]
        with said[0].open("wb") as errors, said[1].open("wb") as told:
            try:
                # The command is a list that the user's YAML names; the time limit is the worker's, which ends us all.
                done = subprocess.run(  # noqa: S603
                    command, cwd=self.config.folder, stdin=subprocess.DEVNULL, stdout=told, stderr=errors, check=False
                )
            except OSError as error:
                raise RunError(f"the program cannot be started: {error}") from None
        if done.returncode in self.config.exit_codes:
            return
        last = next((lines[-1:] for file in said if (lines := _tail(file))), [])
        words = f": {last[0]}" if last else ""
        if done.returncode < 0:
            raise RunError(f"the program was ended by signal {signal.Signals(-done.returncode).name}{words}")
        raise RunError(
            f"the program ended with exit code {done.returncode}{words} (if that is how it ends well, name it under "
            "exit_codes)"
        )

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
        self._check_times(table)
        missing = [name for name in self.config.outputs if name not in table.names]
        if missing:
            raise RunError(f"the program wrote no column {missing[0]}, only {', '.join(table.names)}")
        return np.column_stack([self._column(table, name) for name in self.config.outputs])

    def _check_times(self, table: RawTable) -> None:
        """Refuse rows that say themselves that they are of other times: from one to the next is a sample."""
        if table.time is None or table.time in self.config.outputs:
            return
        try:
            column = table.find(table.time)
            times = convert(column.values, column.unit or "s", "s")
        except SysidError:  # stamps of a calendar: the number of rows has to do
            return
        h, steps = self.config.sample_time, np.diff(times)
        bad = np.flatnonzero(~(np.abs(steps - h) <= UNEVEN * h))
        if len(bad):
            raise RunError(
                f"the program wrote rows {steps[bad[0]]:.6g} s apart ({table.time}, row {bad[0] + 2}), where {h:g} s "
                "was expected: a row for each of {inputs}, in their order; say the unit of its time if that is not s"
            )

    def _column(self, table: RawTable, name: str) -> NDArray[np.float64]:
        try:
            column, unit = table.find(name), self.config.outputs[name].unit
        except SysidError as error:
            raise RunError(f"the program wrote {name} so that it cannot be read: {error.what}") from None
        if not column.unit or column.unit == unit:
            return column.values
        try:
            return convert(column.values, column.unit, unit)
        except SysidError:
            raise RunError(f"the program wrote {name} in {column.unit}, where {unit} was expected") from None


def _tail(file: Path) -> list[str]:
    """The last lines of what a program said."""
    with file.open("rb") as said:
        said.seek(max(0, file.stat().st_size - TAIL))
        return said.read().decode(errors="replace").strip().splitlines()
