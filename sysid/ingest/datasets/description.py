"""The description of a data set: ``dataset.yaml``, checked field by field."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from sysid.errors import ConfigError, UnitError
from sysid.field_checks import FieldError, check
from sysid.ingest.tables.option_group import Options
from sysid.ingest.tables.options import (
    ColumnOption,
    FileOptions,
    GridOptions,
    RepairOptions,
    Rows,
    TimeOption,
)
from sysid.traces import Channel, Role
from sysid.units import Reference, check_unit, is_pressure
from sysid.yaml_files import read_yaml


def _unit_text(value: Any) -> Any:
    return "1" if value == 1 and not isinstance(value, bool) else value


class ChannelDescription(Options):
    """A channel of the data set.

    Args:
        name: Short name, unique (``BP``).
        unit: Unit that the traces shall have (``psi``; ``1`` for a pure number).
        reference: ``gauge`` or ``absolute``; a pressure must say one, or ``none`` if it is a difference.
        description: What it is.
        decimals: Decimals to round to, as the instrument had; ``None`` does not round.
    """

    name: Annotated[str, Field(min_length=1)]
    unit: Annotated[str, BeforeValidator(_unit_text, json_schema_input_type=str | Literal[1])]
    reference: Reference | None = None
    description: str = ""
    decimals: Annotated[int, Field(ge=-12, le=15)] | None = None

    @model_validator(mode="after")
    def _unit_and_reference(self) -> ChannelDescription:
        try:
            check_unit(self.unit)
        except UnitError as error:
            raise FieldError(
                error.what, expected=error.expected, got=error.got, remedy=error.remedy or "correct the unit"
            ) from None
        pressure = is_pressure(self.unit)
        if pressure and self.reference is None:
            raise FieldError(
                f"channel {self.name} does not say what its pressure is measured from",
                expected="reference: gauge, absolute, or none for a difference of pressures",
                got=f"unit: {self.unit} alone",
                remedy="add reference: gauge or reference: absolute",
            )
        if not pressure and self.reference not in {None, Reference.NONE}:
            raise FieldError(
                f"channel {self.name} has a reference and is not a pressure",
                expected="a unit of pressure",
                got=f"unit: {self.unit}",
                remedy="correct the unit, or remove reference",
            )
        return self

    @property
    def channel(self) -> Channel:
        """The channel that traces carry."""
        return Channel(
            name=self.name,
            unit=self.unit,
            reference=self.reference or Reference.NONE,
            description=self.description,
        )


FOR_FILES = {"grid", "repairs", "folder_from", "sha256"}
"""Fields of a source that only files have."""


class SourceDescription(Options):
    """Where the samples come from: a generator, files on disk, or some from the one and some from the others.

    Args:
        generator: Name of the generator.
        options: Its options; it checks them itself.
        files: How the files are read.
        grid: How their samples come onto the grid.
        repairs: Which repairs are asked for.
        folder_from: Environment variable that names the folder in which the files lie, where they are not to lie beside
            the description: records that everybody fetches from their owner.
        sha256: By file, what its content has to be.
    """

    generator: str | None = None
    options: dict[str, Any] = Field(default_factory=dict)
    files: FileOptions | None = None
    grid: GridOptions = GridOptions()
    repairs: RepairOptions = RepairOptions()
    folder_from: Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")] | None = None
    sha256: dict[str, Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _one_kind(self) -> SourceDescription:
        if self.generator is None and self.files is None:
            raise FieldError(
                "source is neither a generator nor files",
                expected="generator: <name>, files: {...}, or both",
                got=", ".join(sorted(self.model_fields_set)) or "nothing",
                remedy="give one of them; files: {} reads files that say everything themselves",
            )
        foreign = set() if self.files is not None else FOR_FILES
        if self.repairs.model_fields_set <= {"mask"}:  # what is made is masked, too
            foreign = foreign - {"repairs"}
        strangers = sorted(self.model_fields_set & (foreign if self.generator else {"options"}))
        if strangers:
            raise FieldError(
                f"source.{strangers[0]} means nothing here",
                expected="options with a generator, repairs of no other kind than mask; "
                f"{', '.join(sorted(FOR_FILES))} with files",
                got=f"{strangers[0]} with {'a generator' if self.generator else 'files'}",
                remedy=f"remove {strangers[0]}",
            )
        return self


class CaseDescription(Options):
    """One experiment.

    Args:
        role: What it may be used for: ``estimation``, ``selection``, ``validation`` or ``test``.
        recipe: What the generator makes it from.
        file: The file that holds it, relative to the ``dataset.yaml``; several where each holds some of its columns.
        start: Seconds, in the file's time: what is before is cut off.
        stop: Seconds, in the file's time: what is after is cut off.
        columns: Its columns, by channel, where they differ from those of ``source.files``.
        time: Its time column, where it differs.
        group: Its group, structure or segment in the file.
        sheet: Its sheet.
        rows: Its first and last row, counted from 1.
    """

    role: Role
    recipe: dict[str, Any] | None = None
    file: str | Annotated[tuple[str, ...], Field(min_length=1)] | None = None
    start: float | None = None
    stop: float | None = None
    columns: dict[str, ColumnOption] = Field(default_factory=dict)
    time: TimeOption | None = None
    group: str | None = None
    sheet: str | None = None
    rows: Rows | None = None

    def read_as(self, files: FileOptions) -> FileOptions:
        """How its file is read.

        Args:
            files: How the files of the data set are read.

        Returns:
            The same with what this case says of its own.
        """
        own: dict[str, object] = {
            name: getattr(self, name) for name in ("time", "group", "sheet", "rows") if name in self.model_fields_set
        }
        if self.columns:
            own["columns"] = {**files.columns, **self.columns}
        return files.model_copy(update=own)

    @property
    def files(self) -> tuple[str, ...]:
        """The files that hold it."""
        return (self.file,) if isinstance(self.file, str) else self.file or ()

    @model_validator(mode="after")
    def _interval(self) -> CaseDescription:
        if self.start is not None and self.stop is not None and self.stop <= self.start:
            raise FieldError(
                "stop is not after start",
                expected=f"a stop above {self.start:g} s",
                got=f"{self.stop:g} s",
                remedy="correct start or stop",
            )
        return self


class DatasetDescription(Options):
    """A data set as described by its ``dataset.yaml``.

    Args:
        name: Its name.
        description: What it is.
        sample_time: Seconds between samples.
        channels: Its channels, in order.
        source: Where the samples come from.
        cases: The experiments, by name.
        provenance: How the data came to be.
        inferred: What was not known and had to be inferred, one sentence each.
        licence: Under what terms it may be used.
    """

    name: Annotated[str, Field(min_length=1)]
    description: str = ""
    sample_time: Annotated[float, Field(gt=0)]
    channels: Annotated[tuple[ChannelDescription, ...], Field(min_length=1)]
    source: SourceDescription
    cases: Annotated[dict[str, CaseDescription], Field(min_length=1)]
    provenance: str = ""
    inferred: tuple[str, ...] = ()
    licence: str = ""

    @field_validator("channels")
    @classmethod
    def _names_differ(cls, channels: tuple[ChannelDescription, ...]) -> tuple[ChannelDescription, ...]:
        names = [channel.name for channel in channels]
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise FieldError(
                f"two channels are named {repeated[0]}",
                expected="a different name for each channel",
                got=", ".join(names),
                remedy="rename one of them",
            )
        return channels

    @model_validator(mode="after")
    def _cases_fit_source(self) -> DatasetDescription:
        for name, case in self.cases.items():
            fields, source = case.model_fields_set, self.source
            if source.generator is not None and (source.files is None or "file" not in fields):
                needed, foreign = "recipe", fields - {"role", "recipe"}
            else:
                needed, foreign = "file", fields & {"recipe"}
            if needed not in fields or foreign:
                both = "a generator and files" if source.files is not None else "a generator"
                raise FieldError(
                    f"case {name} does not fit the source",
                    expected=f"{needed}, as the source is {both if source.generator else 'files'}",
                    got=", ".join(sorted(fields)),
                    remedy=f"write {needed}: ..." + (f" and remove {', '.join(sorted(foreign))}" if foreign else ""),
                )
        return self

    @property
    def trace_channels(self) -> tuple[Channel, ...]:
        """The channels that its traces carry."""
        return tuple(channel.channel for channel in self.channels)

    @property
    def decimals(self) -> dict[str, int]:
        """Decimals to round to, by the name of the channel."""
        return {channel.name: channel.decimals for channel in self.channels if channel.decimals is not None}


def read_description(path: Path) -> DatasetDescription:
    """Read and check a ``dataset.yaml``.

    Args:
        path: The file.

    Returns:
        The description.

    Raises:
        ConfigError: Naming the file, the field, what was expected, what came, and the remedy.
    """
    if not path.is_file():
        raise ConfigError(
            "there is no description of the data set",
            where=path,
            expected="a dataset.yaml",
            got="nothing at this path",
            remedy="correct the path, or let `sysid ingest FILE` propose one",
        )
    return check(DatasetDescription, read_yaml(path), where=path)
