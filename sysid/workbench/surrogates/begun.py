"""A workspace that begins with a reference: its experiments as a pipeline that runs."""

from __future__ import annotations

import os
from pathlib import Path

from sysid.atomic import write_bytes
from sysid.errors import ConfigError
from sysid.names import slug
from sysid.references.described import Wish
from sysid.references.sources import Source
from sysid.workbench.schemas import write_schemas
from sysid.workbench.surrogates.plan import text_of
from sysid.workbench.workspace import refuse_taken

README = """# A surrogate of {source}

    sysid run {name} --dry-run             what the experiments on it will cost
    sysid surrogate {name} --minutes 60    experiments, a model, an FMU in its place, and the proof

It is code, and runs with your rights. `pipelines/{name}.yaml` says within what its inputs may move and how much is
run; read it before you run it, and change what is not so. Results lie in `runs/`, and can be made again.
"""


def make_reference_workspace(folder: Path, source: Source, wish: Wish) -> tuple[list[Path], str, list[str]]:
    """Fill a folder with a pipeline of experiments on a reference. Nothing is run.

    An FMU is copied; what a function or a program needs beside itself nobody knows, and it stays where it is.

    Args:
        folder: Made if it is not there; nothing that is there is overwritten.
        source: The reference.
        wish: What is said beside it.

    Returns:
        The files made, the pipeline's name, and what was taken from where.

    Raises:
        ConfigError: If a file is there already, the folder cannot be written to, or something is not said.
    """
    name, fmu = slug(source.name), source.fmu
    pipeline = folder / "pipelines" / f"{name}.yaml"
    places = {"folder": _seen_from(pipeline.parent, Path(source.reference.get("folder", ".")))}
    if fmu is not None:
        places = {"folder": ".", "fmu": f"../references/{fmu.name}"}
    text, notes = text_of(source, wish, name=name, places=places)
    files = {} if fmu is None else {folder / "references" / fmu.name: fmu.read_bytes()}
    files |= {pipeline: text.encode(), folder / "README.md": README.format(source=source.text, name=name).encode()}
    refuse_taken(folder, files)
    try:
        for file, content in files.items():
            write_bytes(file, content)
        schemas = write_schemas(folder)
    except OSError as error:
        raise ConfigError(
            "the workspace cannot be written", where=folder, got=error, remedy="name another folder"
        ) from error
    return [*files, *schemas], name, notes


def _seen_from(place: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(folder.resolve(), place.resolve())).as_posix()
    except ValueError:  # another drive
        return str(folder.resolve())
