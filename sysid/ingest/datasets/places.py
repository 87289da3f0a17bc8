"""Where the files of a data set lie, and whether they are the ones that its description means."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from sysid.errors import ConfigError
from sysid.ingest.datasets.description import DatasetDescription, SourceDescription


def files_folder(description: DatasetDescription, path: Path) -> Path:
    """The folder that a data set's files are relative to.

    Args:
        description: The data set.
        path: Its ``dataset.yaml``.

    Returns:
        The folder of the description, or the one that an environment variable names.

    Raises:
        ConfigError: If there is no such variable, or it names no folder.
    """
    name = description.source.folder_from
    if name is None:
        return path.parent
    folder = os.environ.get(name, "")
    if not folder or not Path(folder).is_dir():
        files = sorted({file for case in description.cases.values() for file in case.files})
        raise ConfigError(
            f"the records of {description.name} are not part of this package",
            where=f"environment variable {name}",
            expected=f"the folder that holds {', '.join(files)}",
            got=f"{folder}, which is no folder" if folder else "nothing",
            remedy=f"fetch them from their owner ({description.provenance.strip() or 'see its description'}) and write "
            f"{name}=FOLDER before the command",
        )
    return Path(folder)


def checked_file(source: SourceDescription, name: str, folder: Path) -> Path:
    """A file of a data set, if its content is the one that is meant.

    Args:
        source: Where the samples come from.
        name: The file as the case names it.
        folder: What it is relative to.

    Returns:
        The file.

    Raises:
        ConfigError: If its SHA-256 is another.
    """
    path, wanted = folder / name, source.sha256.get(name)
    if wanted is None or not path.is_file():  # that it is not there, its reader says
        return path
    with path.open("rb") as file:
        found = hashlib.file_digest(file, "sha256").hexdigest()
    if found != wanted:
        raise ConfigError(
            "the file is not the one that the data set was described for",
            where=path,
            expected=f"SHA-256 {wanted}",
            got=found,
            remedy="fetch it again; for another version of the record, write a data set of your own",
        )
    return path
