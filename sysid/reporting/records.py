"""What all files of stored results have in common: numbers, versions, reading, writing, and saying what is damaged."""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from pathlib import Path
from typing import Annotated, Any, Final, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, WithJsonSchema

from sysid.atomic import replacing
from sysid.bounded_text import read_json
from sysid.errors import ConfigError, shortened

SCHEMA_VERSION: Final = 2
"""Of ``results.json``; version 1 is read too."""

RESULTS_FILE: Final = "results.json"

AGAIN: Final = "run the pipeline again; it resumes from what is finished"
"""What helps where a stored file is damaged."""


def _nan_for_null(value: object) -> object:
    return math.nan if value is None else value


# JSON has no word for infinity and NaN: a figure that is not finite is written as null, and read as NaN.
Number = Annotated[
    float,
    BeforeValidator(_nan_for_null),
    WithJsonSchema({"type": ["number", "null"]}),
]


class Record(BaseModel):
    """Frozen; keys from a later release are kept, so that a copy loses nothing."""

    model_config = ConfigDict(frozen=True, extra="allow", protected_namespaces=())


R = TypeVar("R", bound=BaseModel)


class DataSetRecord(Record):
    """The data set of a run."""

    name: str = Field(description="The data set, or the judge, which brings its own scenes.")
    digest: str = Field(default="", description="SHA-256 of the data set.")
    others: dict[str, str] = Field(default={}, description="SHA-256 of the other data sets that were read, by name.")


class RunResults(Record):
    """What results.json says of a run of any kind."""

    schema_version: int = Field(default=SCHEMA_VERSION, description="2; absent in a file, it is read as 1.")
    kind: str = Field(default="fits", description="Kind of the pipeline: fits, sweep, assembly, or a judge's name.")
    pipeline: str = Field(description="Name of the pipeline.")
    description: str = Field(default="", description="What it is for.")
    command: str = Field(description="The command that makes the run again.")
    created: str = Field(description="Date and time of the run, ISO 8601.")
    environment: dict[str, Any] = Field(
        description="sysid, python, packages (name -> version), cpu, cores, platform, commit."
    )
    seed: int | None = Field(default=None, description="Seed of everything random.")
    start: dict[str, Any] | None = Field(
        default=None,
        description="How each free run begins: kind (estimated, rest, first-sample, measured) and n_measured.",
    )
    data: DataSetRecord


def read_document(path: Path, *, remedy: str = AGAIN) -> dict[str, Any]:
    """The JSON object of a file.

    Args:
        path: The file.
        remedy: What to do where it is damaged.

    Returns:
        Plain data.

    Raises:
        ConfigError: If there is no such file, or it is damaged.
    """
    try:
        document = read_json(path)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise ConfigError(
            "the folder holds no results",
            where=path.parent,
            expected=f"a run folder with {path.name}",
            got="no such file",
            remedy="name the folder of a finished run, such as runs/<pipeline>, or run the pipeline first",
        ) from error
    except (OSError, ValueError, RecursionError) as error:
        raise damaged(path, "JSON in UTF-8", error, remedy=remedy) from error
    if not isinstance(document, dict):
        raise damaged(path, "a JSON object at the top level", type(document).__name__, remedy=remedy)
    return document


def parse_record(
    kind: type[R],
    document: Dict[str, Any],
    *,
    where: object,
    newest: int = SCHEMA_VERSION,
    what: str = "the results",
    remedy: str = AGAIN,
) -> R:
    """Check plain data.

    Args:
        kind: What they are to be.
        document: Plain data.
        where: Named in errors: the file they came from.
        newest: The greatest ``schema_version`` that is known here.
        what: What they are, in errors.
        remedy: What to do where they are damaged.

    Returns:
        The record.

    Raises:
        ConfigError: If they were written by a newer release, or a field is missing or wrong.
    """
    _refuse_newer(document, where=where, newest=newest, what=what)
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"]) or "the whole file"
        raise damaged(where, f"{field}: {first['msg']}", shortened(first["input"]), what=what, remedy=remedy) from error


def _refuse_newer(
    document: Dict[str, Any], *, where: object, newest: int = SCHEMA_VERSION, what: str = "the results"
) -> None:
    """Say so where a file has a ``schema_version`` above the newest that is known: it is of a later release."""
    version = document.get("schema_version", 1)
    if isinstance(version, int) and version > newest:
        raise ConfigError(
            f"{what} were written by a newer release",
            where=where,
            expected=f"schema_version up to {newest}",
            got=version,
            remedy="upgrade the workbench, or make the report with the release that made the run",
        )


def write_record(path: Path, record: BaseModel) -> Path:
    """Write a record as strict JSON, under a temporary name that is then renamed.

    Args:
        path: The file; its folder is made if missing.
        record: The record.

    Returns:
        The file.
    """
    with replacing(path) as draft:
        draft.write_text(record.model_dump_json(indent=1) + "\n", encoding="utf-8")
    return path


def damaged(
    where: object, expected: object, got: object, *, what: str = "the results", remedy: str = AGAIN
) -> ConfigError:
    """The error of a stored file that cannot be used.

    Args:
        where: The file.
        expected: What it should hold.
        got: What it holds.
        what: What it is.
        remedy: What to do.

    Returns:
        The error.
    """
    return ConfigError(f"{what} are damaged", where=where, expected=expected, got=got, remedy=remedy)
