"""Command tables: the inputs of a surrogate as a few rows, each held until the next one's time.

What is written by hand or printed in a paper: ``[[0, 90], [100, 84.2], [600, 90], [2050, 90]]``, times in tenths of a
second. The last row's time is the end. Units are declared, in the file or beside it: a command in kPa that is taken for
psi runs without an error, and nothing that comes out of it is right.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, UnitError
from sysid.ingest.cells.headers import parse_header, split_reference
from sysid.traces import Channel, Trace
from sysid.units import Reference, convert
from sysid.yaml_files import parse_yaml

LONGEST = 10_000_000
"""Samples: a table that would make more is taken for one in another unit of time."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CommandTable:
    """Inputs that change at a few times and are held between them.

    Args:
        channels: The inputs, in the order of the columns.
        times: Seconds, increasing from 0; the last is the end. Shape ``(n_rows,)``.
        values: In the channels' units, shape ``(n_rows, n_channels)``.
        source: Where it comes from.

    Raises:
        ConfigError: If the numbers cannot be a command.

    Example:
        >>> table = CommandTable(channels=(Channel(name="u", unit="V"),), times=[0.0, 0.2, 0.5],
        ...     values=[[1.0], [2.0], [2.0]], source="example")
        >>> table.trace(0.1)["u"].tolist()
        [1.0, 1.0, 2.0, 2.0, 2.0]
    """

    channels: tuple[Channel, ...]
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    source: str

    def __post_init__(self) -> None:
        for name in ("times", "values"):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=np.float64))
        if len(self.times) < 2:
            raise self._refusal("a command needs a row for its end", "two rows or more", f"{len(self.times)} rows")
        if not np.isfinite(self.times).all() or not np.isfinite(self.values).all():
            raise self._refusal("the command has a value that is not a number", "finite numbers", "nan or inf")
        if self.times[0] != 0.0 or not (np.diff(self.times) > 0.0).all():
            at = int(np.argmin(np.diff(self.times))) + 1
            got = (
                f"{self.times[0]:g} s first"
                if self.times[0]
                else f"{self.times[at]:g} s after {self.times[at - 1]:g} s"
            )
            raise self._refusal("the command's times do not increase from 0", "times that increase from 0", got)

    def _refusal(self, what: str, expected: str, got: str) -> ConfigError:
        return ConfigError(
            what, where=self.source, expected=expected, got=got, remedy="correct the rows of the command"
        )

    def trace(self, sample_time: float) -> Trace:
        """The inputs at every sample: a row counts from the first sample at or after its time.

        Args:
            sample_time: Seconds.

        Returns:
            A trace from 0 to the last sample before the end.

        Raises:
            ConfigError: If that is no sample, or more than anybody means.
        """
        count = round(float(self.times[-1]) / sample_time)
        if not 1 <= count <= LONGEST:
            raise ConfigError(
                "the command's length cannot be meant",
                where=self.source,
                expected=f"1 to {LONGEST} samples of {sample_time:g} s",
                got=f"an end at {self.times[-1]:g} s",
                remedy="correct the unit of its times",
            )
        # A time that is a whole number of samples is that sample, whatever its last digit.
        first = np.ceil(self.times[:-1] / sample_time - 1e-6).astype(np.int64)
        rows = np.searchsorted(first, np.arange(count), side="right") - 1
        return Trace(
            name=Path(self.source).stem or "command",
            sample_time=sample_time,
            channels=self.channels,
            values=self.values[rows],
            provenance=(f"command of {len(self.times)} rows from {self.source}",),
        )


def read_command(
    path: str | Path, channels: Sequence[Channel], *, time_unit: str | None = None, unit: str | None = None
) -> CommandTable:
    """Read a command table: CSV, JSON or YAML.

    A CSV file has the time in its first column and the inputs beside it, in their order or under their names; its
    header may name units, as in ``time [ds],STP [kPa]``. JSON and YAML hold either the rows alone or an object with
    ``command`` (the rows), ``time_unit``, ``unit`` (for all inputs, or one for each by name) and ``inputs`` (the order
    of the columns).

    Args:
        path: The file.
        channels: The inputs that the surrogate has, in its units.
        time_unit: Unit of the times, such as ``"s"`` or ``"ds"``; what the file says must agree.
        unit: Unit of the values, likewise; a pressure may say ``"kPa abs"``.

    Returns:
        The table, in seconds and in the channels' units.

    Raises:
        ConfigError: If the file cannot be read as a command, a unit is not declared, or inputs are missing.
        UnitError: If a unit is unknown or of another quantity.
    """
    path = Path(path)
    kinds = {".csv": _from_csv, ".txt": _from_csv, ".json": _from_yaml, ".yaml": _from_yaml, ".yml": _from_yaml}
    if path.suffix.lower() not in kinds:
        raise ConfigError(
            "not a kind of command file", where=path, expected=f"a name that ends in {', '.join(kinds)}",
            got=path.suffix or "a name without an ending", remedy="change the ending",
        )  # fmt: skip
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError("the command file cannot be read", where=path, got=str(error)) from error
    read = kinds[path.suffix.lower()](text, path)
    return read.table(channels, time_unit, unit)


@dataclass(frozen=True, kw_only=True)
class _Read:
    """What a file says, before it is checked against the surrogate."""

    path: Path
    rows: list[list[float]]
    names: tuple[str, ...] | None
    time_unit: str | None
    units: Dict[str, str]
    """By channel; under the empty name for all of them."""

    def table(self, channels: Sequence[Channel], time_unit: str | None, unit: str | None) -> CommandTable:
        known = [channel.name for channel in channels]
        names = known if self.names is None else list(self.names)
        if sorted(names) != sorted(known):
            raise ConfigError(
                "the command is not one of this surrogate", where=self.path,
                expected=f"a column for each of {', '.join(known)}", got=", ".join(names) or "no column",
                remedy="name the columns as the surrogate's inputs, or leave the names out and keep their order",
            )  # fmt: skip
        width = 1 + len(known)
        short = next((i for i, row in enumerate(self.rows) if len(row) != width), None)
        if short is not None:
            raise ConfigError(
                "a row of the command has another length", where=f"{self.path}, row {short + 1}",
                expected=f"time, {', '.join(names)}", got=f"{len(self.rows[short])} numbers",
            )  # fmt: skip
        seconds = self._declared("time", self.time_unit, time_unit, "--time-unit")
        table = np.array(self.rows, dtype=np.float64).reshape(-1, width)
        values = np.empty((len(table), len(channels)))
        for i, channel in enumerate(channels):
            found = self.units.get(channel.name, self.units.get(""))
            said = self._declared(channel.name, found, unit, "--unit")
            values[:, i] = self._converted(table[:, 1 + names.index(channel.name)], said, channel)
        times = self._converted(table[:, 0], seconds, Channel(name="time", unit="s"))
        # 0.1 of 3 tenths of a second is 0.30000000000000004 s; a time is told to a nanosecond.
        return CommandTable(channels=tuple(channels), times=np.round(times, 9), values=values, source=str(self.path))

    def _declared(self, name: str, found: str | None, given: str | None, option: str) -> str:
        if found and given and found != given:
            raise ConfigError(
                f"the unit of {name} is declared twice", where=self.path, expected=found, got=f"{option} {given}",
                remedy=f"leave {option} out, or correct the file",
            )  # fmt: skip
        if not (found or given):
            example, first = ("s or ds", "s") if name == "time" else ("psi or kPa", "psi")
            raise ConfigError(
                f"the unit of {name} is not declared", where=self.path, expected=f"a unit, such as {example}",
                got="a number", remedy=f"say {option}, or name it in the file, as in {name} [{first}]",
            )  # fmt: skip
        return found or given or ""

    def _converted(self, values: NDArray[np.float64], said: str, channel: Channel) -> NDArray[np.float64]:
        unit, reference = split_reference(said)
        try:
            return convert(values, unit, channel.unit, reference=reference or channel.reference,
                           to_reference=channel.reference)  # fmt: skip
        except UnitError as error:
            error.add_note(f"reading {channel.name} of the command {self.path}")
            raise


def _from_csv(text: str, path: Path) -> _Read:
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    delimiter = next((mark for mark in (";", "\t", ",") if lines and mark in lines[0]), ",")
    rows = [[form.strip() for form in row] for row in csv.reader(io.StringIO("\n".join(lines)), delimiter=delimiter)]
    decimal = "," if delimiter == ";" else "."
    names, units, time_unit = None, {}, None
    if rows and not _is_number(rows[0][0], decimal):
        headers = [parse_header(form) for form in rows.pop(0)]
        names = tuple(header.name for header in headers[1:])
        time_unit = headers[0].unit
        units = {h.name: _with_reference(h.unit, h.reference) for h in headers[1:] if h.unit is not None}
    numbers = [[_number(form, decimal, f"{path}, row {i + 1}") for form in row] for i, row in enumerate(rows)]
    return _Read(path=path, rows=numbers, names=names, time_unit=time_unit, units=units)


def _with_reference(unit: str, reference: Reference | None) -> str:
    return unit if reference is None or reference is Reference.NONE else f"{unit} {reference.value}"


def _from_yaml(text: str, path: Path) -> _Read:
    # Every JSON text is a YAML text. A list has no key, which this project's YAML files all begin with.
    content = parse_yaml(text if not text.lstrip().startswith("[") else f"command: {text.strip()}", where=path)
    strangers = sorted(set(content) - {"command", "time_unit", "unit", "inputs"})
    if strangers or "command" not in content:
        raise ConfigError(
            "not a command file", where=path, expected="command, and perhaps time_unit, unit and inputs",
            got=", ".join(map(str, content)) or "nothing", remedy="put the rows under command",
        )  # fmt: skip
    rows, unit, names = content["command"], content.get("unit"), content.get("inputs")
    if not isinstance(rows, list) or not all(isinstance(row, list) for row in rows):
        raise ConfigError("the command is not a list of rows", where=path, expected="[[time, value], ...]", got=rows)
    units = {str(k): str(v) for k, v in unit.items()} if isinstance(unit, dict) else {"": str(unit)} if unit else {}
    numbers = [[_number(form, ".", f"{path}, row {i + 1}") for form in row] for i, row in enumerate(rows)]
    time_unit = content.get("time_unit")
    return _Read(
        path=path,
        rows=numbers,
        names=None if names is None else tuple(map(str, names)),
        time_unit=None if time_unit is None else str(time_unit),
        units=units,
    )


def _is_number(text: str, decimal: str) -> bool:
    try:
        float(text.replace(decimal, "."))
    except ValueError:
        return False
    return True


def _number(form: Any, decimal: str, where: str) -> float:
    text = form.replace(decimal, ".") if isinstance(form, str) else form
    try:
        if isinstance(text, bool):
            raise ValueError
        return float(text)
    except (TypeError, ValueError):
        raise ConfigError(
            "the command has a form that is no number", where=where, expected="a number", got=repr(form)
        ) from None
